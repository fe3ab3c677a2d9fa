"""Flight archive: the recordings below the state directories, found without reading them whole.

live/NAME.tlog, sim/NAME.tlog                 flights, each with its journal NAME.jsonl
sim/rehearsal-DAY-TIME/run.tlog               rehearsals and other runs in lock-step, with run.jsonl
live/logs/vehicle-7/log-00012-DAY.bin, .ulg   logs that were downloaded from vehicles
"""

import calendar
import math
import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.base.text import clean
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.frames import MAGIC, check_frame, frame_end
from tui_gcs.core.protocol.journal import EventClass, JournalEvent
from tui_gcs.core.records.event_log import INFO
from tui_gcs.core.records.journal_reader import journal_event
from tui_gcs.core.records.onboard_logs import EARLIEST_WALL_S
from tui_gcs.core.records.planner_log import log_files
from tui_gcs.core.records.rehearsal_files import FILE_NAMES
from tui_gcs.core.records.rehearsal_store import FILE, RehearsalRecord, read_rehearsals

ENDINGS = {".tlog": "telemetry log", ".bin": "ArduPilot log", ".ulg": "PX4 log"}
"""Files that are flights, and what they are called."""
GROWS_S = 60.0
"""A file that was written this recently may still be written."""
TAIL_BYTES = 16_384
MAX_JOURNAL_BYTES = 64 << 20
"""Of a longer journal only the beginning is looked at."""
MAX_FLIGHTS = 2_000
_TIME_BYTES = 8
_MAX_WALL_S = 4_102_444_800.0  # the year 2100
_VEHICLE = re.compile(rb'"source":"vehicle ([0-9]{1,6})"')
_ALARM = b'"cls":"alarm"'
_LOG_TIME = re.compile(r"-(\d{8}T\d{6}Z)$")
LOG_OF = "log of "
"""How the source of a log begins that was downloaded from a vehicle."""


@dataclass(frozen=True)
class RecordedFlight:
    """One recording, as far as it is known without reading it. Unknown numbers are NaN, words empty."""

    path: Path
    source: str
    """LIVE, SIM, rehearsal, `log of 7`, or `file` for one that the operator named."""
    size_bytes: int
    changed_wall_s: float
    """When it was written last, Unix seconds."""
    began_wall_s: float = math.nan
    length_s: float = math.nan
    vehicles: tuple[int, ...] = ()
    scenario: str = ""
    result: str = ""
    """Of a rehearsal: how many of its checks held, or why it ended early."""
    worst_alarm: str = ""
    worst_severity: int = INFO
    """MAV_SEVERITY of that alarm."""
    journal: Path | None = None
    report: str = ""
    """Path of the report of a rehearsal."""

    @property
    def what(self) -> str:
        """What kind of file it is, in words."""
        return ENDINGS.get(self.path.suffix.lower(), "file")

    @property
    def is_telemetry(self) -> bool:
        """Whether it can be replayed."""
        return self.path.suffix.lower() == ".tlog"

    @property
    def is_vehicle_log(self) -> bool:
        """Whether it was downloaded from a vehicle."""
        return self.source.startswith(LOG_OF)

    def may_grow(self, now_wall_s: float) -> bool:
        """Return whether it may be written at this moment."""
        return now_wall_s - self.changed_wall_s < GROWS_S


class FlightArchive:
    """Lists the recordings; a file that did not change is not opened again."""

    def __init__(self, folders: Mapping[str, Path]) -> None:
        """Look into these folders, named LIVE and SIM; they need not exist."""
        self._folders = folders
        self._opened: dict[Path, str] = {}
        self._known: dict[Path, tuple[tuple[int, int, int], RecordedFlight]] = {}

    def open_file(self, path: Path) -> str:
        """Add a file that the operator named; return why it is no flight, or ""."""
        if path.suffix.lower() not in ENDINGS:
            return f"{clean(path.name, 60)}: no flight: {', '.join(ENDINGS)}"
        try:
            open_plain(path).close()
        except (OSError, ValueError) as error:
            return f"{clean(str(path), 200)}: cannot be read: {getattr(error, 'strerror', None) or error}"
        self._opened[path.absolute()] = "file"
        return ""

    def scan(self) -> tuple[RecordedFlight, ...]:
        """Return the recordings, the newest first. Files that vanish meanwhile are left out."""
        found: dict[Path, str] = dict(self._opened)
        for name, folder in self._folders.items():
            found |= dict(_files_in(folder, name))
        flights = [flight for path, source in found.items() if (flight := self._flight(path, source)) is not None]
        rehearsals = [r for folder in self._folders.values() for r in read_rehearsals(folder / FILE)]
        flights = [_with_result(flight, rehearsals) for flight in flights]
        flights.sort(key=lambda flight: (flight.changed_wall_s, str(flight.path)), reverse=True)
        return tuple(flights[:MAX_FLIGHTS])

    def _flight(self, path: Path, source: str) -> RecordedFlight | None:
        try:
            info = path.stat()
            journal = path.with_suffix(".jsonl")
            stamp = (info.st_mtime_ns, info.st_size, journal.stat().st_size if journal.is_file() else -1)
            known = self._known.get(path)
            if known is None or known[0] != stamp:
                known = self._known[path] = stamp, _read(path, source, info.st_size, info.st_mtime)
        except (OSError, ValueError):
            return None
        return known[1]


def delete_flight(flight: RecordedFlight, now_wall_s: float) -> str:
    """Remove a recording with what belongs to it; return why not, or ""."""
    if flight.source == "file":
        return "it was opened by its path: this screen only removes what the station recorded"
    if flight.may_grow(now_wall_s):
        return f"it was written less than {GROWS_S:.0f} s ago and may still be recorded"
    path = flight.path
    try:
        path.unlink()
        for beside in (path.with_suffix(".jsonl"), *log_files(path)):
            if flight.is_telemetry:
                beside.unlink(missing_ok=True)
        if flight.source == "rehearsal":
            for name in FILE_NAMES:
                path.with_name(name).unlink(missing_ok=True)
            if not any(path.parent.iterdir()):
                path.parent.rmdir()
    except OSError as error:
        return f"{clean(path.name, 60)}: {error.strerror or error}"
    return ""


def _files_in(folder: Path, name: str) -> Iterator[tuple[Path, str]]:
    """Yield each recording below a state directory, and what it is of."""
    for path in folder.glob("*.tlog"):
        yield path.absolute(), name
    for path in folder.glob("*/run.tlog"):
        yield path.absolute(), "rehearsal" if path.parent.name.startswith("rehearsal-") else path.parent.name
    for path in folder.glob("logs/vehicle-*/*"):
        if path.suffix.lower() in (".bin", ".ulg"):
            yield path.absolute(), f"{LOG_OF}{path.parent.name.removeprefix('vehicle-')}"


def _read(path: Path, source: str, size_bytes: int, changed_wall_s: float) -> RecordedFlight:
    """Read the first and last time of a telemetry log, and what stands in its journal. Raises `OSError`."""
    flight = RecordedFlight(path, source, size_bytes, changed_wall_s)
    if flight.is_vehicle_log:
        number = source.removeprefix(LOG_OF)
        return replace(
            flight, vehicles=(int(number),) if number.isdecimal() else (), began_wall_s=_time_in_name(path.stem)
        )
    if not flight.is_telemetry:
        return flight
    first_s, last_s = telemetry_times(path)
    flight = replace(flight, began_wall_s=first_s, length_s=last_s - first_s)
    journal = path.with_suffix(".jsonl")
    return _with_journal(flight, journal) if journal.is_file() else flight


def _time_in_name(name: str) -> float:
    """Return the time at which a vehicle began its log, as `core/services` names the file; NaN without one."""
    match = _LOG_TIME.search(name)
    try:
        return float(calendar.timegm(time.strptime(match[1], "%Y%m%dT%H%M%SZ"))) if match else math.nan
    except ValueError:
        return math.nan


def telemetry_times(path: Path) -> tuple[float, float]:
    """Return the times of the first and the last record of a telemetry log, Unix seconds; NaN where there is none.

    Only both ends of the file are read. Raises `OSError`.
    """
    with open_plain(path) as file:
        head = file.read(TAIL_BYTES)
        size = file.seek(0, 2)
        file.seek(max(0, size - TAIL_BYTES))
        tail = file.read(TAIL_BYTES)
    return next(_record_times(head), math.nan), max(_record_times(tail), default=math.nan)


def _record_times(data: bytes) -> Iterator[float]:
    """Yield the time of each good frame in a piece of a telemetry log."""
    for match in MAGIC.finditer(data, _TIME_BYTES):
        start = match.start()
        end = frame_end(data, start, len(data))
        wall_s = int.from_bytes(data[start - _TIME_BYTES : start], "big") / 1e6
        plausible = start < end <= len(data) and EARLIEST_WALL_S <= wall_s <= _MAX_WALL_S
        frame = check_frame(data[start:end]) if plausible else None
        # Of an unknown message the checksum cannot be checked: other bytes may look like one.
        if frame is not None and dialect.is_known(frame.msgid):
            yield wall_s


def _with_journal(flight: RecordedFlight, journal: Path) -> RecordedFlight:
    """Add the vehicles, the scenario and the worst alarm of a journal. Raises `OSError`."""
    with open_plain(journal) as file:
        data = file.read(MAX_JOURNAL_BYTES)
    vehicles = sorted({int(match[1]) for match in _VEHICLE.finditer(data)})
    first, _, _ = data.partition(b"\n")
    worst: JournalEvent | None = None
    for line in data.splitlines() if _ALARM in data else ():
        event = _alarm(line) if _ALARM in line else None
        if event is not None and event.severity < (worst.severity if worst is not None else INFO):
            worst = event
    return replace(
        flight,
        vehicles=tuple(vehicles),
        scenario=_scenario(first),
        worst_alarm=worst.text if worst is not None else "",
        worst_severity=worst.severity if worst is not None else INFO,
        journal=journal,
    )


def _alarm(line: bytes) -> JournalEvent | None:
    event = journal_event(line)
    return event if event is not None and event.cls is EventClass.ALARM else None


def _scenario(line: bytes) -> str:
    """Return the scenario's name from the first line of a journal; journals of earlier versions have none."""
    try:
        found = msgspec.json.decode(line)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        return ""
    name = found.get("scenario", "") if isinstance(found, dict) else ""
    return clean(name, 80) if isinstance(name, str) else ""


def _with_result(flight: RecordedFlight, rehearsals: list[RehearsalRecord]) -> RecordedFlight:
    """Add the result of the rehearsal that was recorded in the flight's folder."""
    if flight.source != "rehearsal":
        return flight
    found = next((one for one in reversed(rehearsals) if one.folder == flight.path.parent.name), None)
    if found is None:
        return flight
    good = f"{'passed' if found.passed else 'FAILED'} {found.checks_good}/{found.checks}"
    result = f"{good}  {found.problem}" if found.problem else good
    return replace(flight, result=result, scenario=found.scenario, report=found.report)


def utc_time(wall_s: float) -> str:
    """Return a time as `2026-11-27 08:15`, UTC; `--` if it is not known."""
    return time.strftime("%Y-%m-%d %H:%M", time.gmtime(wall_s)) if EARLIEST_WALL_S <= wall_s <= _MAX_WALL_S else "--"
