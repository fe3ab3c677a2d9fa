"""`tui-gcs task`: points of interest for planners, added, listed and cancelled while vehicles fly."""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from tui_gcs.cli.command_report import CommandReport, finish, finish_reply
from tui_gcs.cli.common import PRINCIPAL, ask, join
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.station_control import which
from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.point_files import PointFileError, read_points
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import (
    PROTOCOL,
    AddPoints,
    CancelPoints,
    GetScenario,
    Hello,
    PointOfInterest,
    Reply,
    StationStatus,
)
from tui_gcs.core.protocol.points import NewPoint

ADVICE = ": the station may still do it; `tui-gcs task list` shows"
MAX_FILE_BYTES = 1_000_000


def run(arguments: argparse.Namespace) -> int:
    """Ask the running station; the exit code is 0 only if it did all that was asked."""
    if arguments.what == "cancel" and bool(arguments.names) == arguments.all:
        raise CommandError("task cancel: name the tasks, or give --all")
    bus = join(which(arguments.kind))
    try:
        if arguments.what == "list":
            return show(_status(bus), arguments)
        if arguments.what == "cancel":
            reply = ask(bus, CancelPoints(tuple(arguments.names)), Reply, ADVICE)
        else:
            reply = ask(bus, AddPoints(tuple(asked_points(arguments, frame_of(bus)))), Reply, ADVICE)
    finally:
        bus.close()
    return finish_reply(arguments, ok=reply.ok, text=reply.text)


def frame_of(bus: Bus) -> LocalFrame:
    """Return the local frame of the scenario that is flown. Raises `CommandError`."""
    reply = ask(bus, GetScenario(), Reply, ADVICE)
    if reply.scenario is None:
        raise CommandError(clean(reply.text) or "the station has no scenario")
    return LocalFrame(reply.scenario.scenario.origin)


def asked_points(arguments: argparse.Namespace, frame: LocalFrame) -> list[NewPoint]:
    """Return the points that the arguments name. Raises `CommandError`."""
    if arguments.file is not None:
        path = Path(arguments.file)
        try:
            with open_plain(path) as file:
                data = file.read(MAX_FILE_BYTES + 1)
            if len(data) > MAX_FILE_BYTES:
                raise PointFileError(f"is larger than {MAX_FILE_BYTES // 1000} kB")
            return read_points(data.decode("utf-8"), path.name, frame)
        except OSError as error:
            raise CommandError(f"{clean(arguments.file, 200)}: cannot be read ({error.strerror})") from None
        except UnicodeDecodeError:
            raise CommandError(f"{clean(arguments.file, 200)}: is not UTF-8 text") from None
        except PointFileError as error:
            raise CommandError(f"{clean(arguments.file, 200)}: {error}") from None
    degrees = arguments.at is not None
    a, b = _pair("--at" if degrees else "--xy", arguments.at if degrees else arguments.xy)
    if degrees and not (abs(a) <= 90.0 and abs(b) <= 180.0):
        raise CommandError(f"--at {clean(arguments.at, 40)}: must be LAT,LON in degrees")
    place_m = frame.to_enu(a, b) if degrees else (a, b)
    within_s = math.inf if arguments.deadline is None else arguments.deadline
    return [NewPoint(arguments.name, place_m, arguments.priority, within_s, arguments.team)]


def _pair(option: str, text: str) -> tuple[float, float]:
    try:
        a, b = (float(part) for part in text.split(","))
    except ValueError:
        a = b = math.nan
    if not (math.isfinite(a) and math.isfinite(b)):
        raise CommandError(f"{option} {clean(text, 40)}: must be two numbers with a comma between them")
    return a, b


def _status(bus: Bus) -> StationStatus:
    reply = ask(bus, Hello(PROTOCOL, PRINCIPAL), Reply, ADVICE)
    if reply.status is None:
        raise CommandError(clean(reply.text) or "the station says nothing of its state")
    return reply.status


def show(status: StationStatus, arguments: argparse.Namespace) -> int:
    """Print all points, the open ones first."""
    points = sorted(status.points, key=lambda point: point.state != "open")
    if not arguments.json:
        _print(points, status.t_s)
    return finish(arguments, CommandReport(True, data={"tasks": [_row(point, status.t_s) for point in points]}))


def _print(points: Sequence[PointOfInterest], now_s: float) -> None:
    for point in points:
        row = _row(point, now_s)
        left = "" if row["left_s"] is None else f"  {row['left_s']:.0f} s left"
        by = f" by vehicle {point.vehicle}" if point.vehicle else ""
        x, y = point.place_m
        place = f"[{x:.0f} {y:.0f}]"
        sys.stdout.write(f"{clean(point.name):<20} {point.state}{by}{left}  {place}  priority {point.priority:g}\n")
    if not points:
        sys.stdout.write("no tasks\n")


def _row(point: PointOfInterest, now_s: float) -> dict[str, object]:
    left_s = point.due_s - now_s if point.state == "open" and math.isfinite(point.due_s) else None
    return {
        "name": point.name,
        "state": point.state,
        "east_m": round(point.place_m[0], 1),
        "north_m": round(point.place_m[1], 1),
        "priority": point.priority,
        "team": point.team,
        "left_s": left_s if left_s is None else round(left_s, 1),
        "vehicle": point.vehicle or None,
    }
