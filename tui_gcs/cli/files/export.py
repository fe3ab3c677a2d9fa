"""`tui-gcs export`: the flown tracks of recorded flights as CSV, KML or GPX."""

import argparse
import heapq
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.files.file_access import MAX_CELLS, may_write, put
from tui_gcs.cli.vehicle_numbers import vehicle_ids
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.track_files import SourcePoint, csv_text, gpx_text, kml_text
from tui_gcs.core.records.flight_points import LeftOut, TlogPoints
from tui_gcs.core.records.onboard_logs import DataFlashPoints, OnboardLogError, ULogPoints, has_gps_time
from tui_gcs.core.records.tlog_reader import TlogError

Reader = TlogPoints | DataFlashPoints | ULogPoints
ENDINGS: dict[str, type[Reader]] = {".tlog": TlogPoints, ".bin": DataFlashPoints, ".ulg": ULogPoints}


def run(arguments: argparse.Namespace) -> int:
    """Write the tracks; the exit code is 1 if part of a log was damaged or has no absolute times."""
    paths = [Path(name) for name in arguments.flight]
    target = Path(arguments.file) if arguments.file is not None else None
    if arguments.json and target is None:
        raise CommandError("--json: the tracks themselves go to standard output; write them with --file FILE")
    kind = _format(arguments.to, target)
    if target is not None:
        may_write(target, force=arguments.force)
    wanted = frozenset(vehicle_ids(arguments.vehicles)) if arguments.vehicles is not None else None
    flights = [_Flight(path, wanted) for path in paths]
    points = heapq.merge(*flights, key=lambda each: each[1].wall_s)
    title = ", ".join(path.name for path in paths)
    lines = {"csv": csv_text(points), "kml": _later(kml_text, points, title), "gpx": _later(gpx_text, points, title)}
    if target is None:
        for line in lines[kind]:
            sys.stdout.write(line)
    else:
        put(target, "".join(lines[kind]).encode(), force=arguments.force)
    text = f"{clean(str(target), MAX_CELLS)} written: {sum(flight.count for flight in flights)} points"
    if target is not None and not arguments.json:
        sys.stdout.write(f"{text}\n")
    reports = [flight.report() for flight in flights]  # of all of them
    worse = any(reports)
    code = ReportCode.FAILED if worse else ReportCode.NONE
    data = {"file": arguments.file, "flights": [flight.data() for flight in flights]}
    return finish(arguments, CommandReport(not worse, code, text if target is not None else "", data))


class _Flight:
    """The points of one log that were asked for, and what was remarkable about it."""

    def __init__(self, path: Path, wanted: frozenset[int] | None) -> None:
        reader = ENDINGS.get(path.suffix.lower())
        if reader is None:
            raise CommandError(f"{clean(str(path), MAX_CELLS)}: no flight: {', '.join(ENDINGS)}")
        self._path, self._wanted = path, wanted
        self._points: Reader = reader(path)
        self.count = 0
        self._since_boot = 0

    def __iter__(self) -> Iterator[SourcePoint]:
        """Yield (name of the log, point). Raises `CommandError`."""
        name = clean(self._path.name, MAX_CELLS)
        try:
            for point in self._points:
                if self._wanted is None or point.vehicle in self._wanted:
                    self.count += 1
                    self._since_boot += not has_gps_time(point)
                    yield name, point
        except TlogError as error:
            raise CommandError(str(error)) from None
        except OnboardLogError as error:
            raise CommandError(f"{clean(str(self._path), MAX_CELLS)}: {error}") from None

    def data(self) -> dict[str, object]:
        """Return what is reported of it in JSON."""
        left_out: LeftOut = self._points.left_out
        return {
            "flight": str(self._path),
            "points": self.count,
            "without_place": left_out.without_place,
            "damaged_bytes": left_out.damaged_bytes,
            "since_boot": self._since_boot,
        }

    def report(self) -> bool:
        """Report on standard error what was left out or is not as it seems; return whether data are worse for it."""
        left_out: LeftOut = self._points.left_out
        name = clean(str(self._path), MAX_CELLS)
        if not self.count:
            sys.stderr.write(f"tui-gcs: {name}: no positions in it\n")
        if left_out.without_place:
            sys.stderr.write(f"tui-gcs: {name}: {left_out.without_place} positions without a fix left out\n")
        if left_out.damaged_bytes:
            sys.stderr.write(f"tui-gcs: {name}: {left_out.damaged_bytes} damaged bytes skipped\n")
        if self._since_boot:
            sys.stderr.write(f"tui-gcs: {name}: no GPS time in it: its times count from the vehicle's boot\n")
        return bool(left_out.damaged_bytes or self._since_boot or not self.count)


def _format(to: str | None, target: Path | None) -> str:
    """Return csv, kml or gpx: as asked for, else by the file's ending, else csv."""
    if to is not None:
        return to
    ending = target.suffix.lower().lstrip(".") if target is not None else "csv"
    if ending not in ("csv", "kml", "gpx"):
        raise CommandError(f"{clean(str(target), MAX_CELLS)}: csv, kml or gpx? --to FORMAT")
    return ending


def _later(
    write: Callable[[Iterable[SourcePoint], str], str], points: Iterable[SourcePoint], title: str
) -> Iterator[str]:
    """Make the whole document when it is asked for."""
    yield write(points, title)
