"""Flight timeline: what happened in a recording, from every source that knows of it, joined by time.

A telemetry log gives modes, arming and status texts; its journal gives all that the station recorded, which includes
those texts. A log of a vehicle gives its own texts, modes and errors; what the station's journals have about that
vehicle in the same time stands between them, where the log has GPS time.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import msgspec

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.judging.summary_text import summary_text
from tui_gcs.core.judging.tlog_summary import SystemSummary, summarize
from tui_gcs.core.protocol.event_scope import concerns
from tui_gcs.core.protocol.journal import JournalEvent
from tui_gcs.core.records.event_log import NOTICE
from tui_gcs.core.records.flight_archive import RecordedFlight
from tui_gcs.core.records.onboard_events import OnboardEvent, onboard_events
from tui_gcs.core.records.onboard_logs import EARLIEST_WALL_S, OnboardLogError
from tui_gcs.core.records.tlog_reader import TlogError

MAX_ENTRIES = 50_000
MAX_LINE_BYTES = 1 << 20
SUMMARY_CELLS = 100
MARGIN_S = 5.0
"""Clocks of vehicles and of the station differ by less than this where both have GPS time or NTP."""
_event_decoder = msgspec.json.Decoder(JournalEvent)


class TimelineEntry(NamedTuple):
    """One thing that happened."""

    wall_s: float
    """Unix seconds; seconds since boot where the log of a vehicle has no GPS time."""
    severity: int
    """MAV_SEVERITY."""
    source: str
    """The source of the report: vehicle 3, alarm, log of 3, …"""
    text: str


@dataclass(frozen=True)
class FlightTimeline:
    """What happened in a recording, by time."""

    entries: tuple[TimelineEntry, ...]
    summary: tuple[str, ...]
    """Lines about the whole recording."""
    first_wall_s: float
    """The time from which entries are counted."""
    has_wall_time: bool = True
    """False: times count from the vehicle's boot, and nothing of the station can be joined."""


class FlightReadError(Exception):
    """The recording cannot be read: one line for the operator."""


def timeline(flight: RecordedFlight, archive: Iterable[RecordedFlight] = ()) -> FlightTimeline:
    """Read a recording whole and return what happened in it; `archive` holds the station's own journals.

    Raises:
        FlightReadError: the file cannot be read, or is none of its kind.
    """
    try:
        return _of_telemetry(flight) if flight.is_telemetry else _of_onboard_log(flight, archive)
    except (TlogError, OnboardLogError) as error:
        raise FlightReadError(str(error)) from None


def _of_telemetry(flight: RecordedFlight) -> FlightTimeline:
    summary = summarize(flight.path)
    entries = list(_journal(flight.journal)) if flight.journal is not None else []
    for system in summary.systems:
        entries += _modes(system)
        # The journal has the texts already.
        entries += _texts(system) if flight.journal is None else []
    lines = [line for line in summary_text(summary, SUMMARY_CELLS).splitlines() if line]
    # The head and the table of the systems; what follows are the entries again.
    head = len(summary.systems) + len(summary.warnings) + 2
    return FlightTimeline(_sorted(entries), tuple(lines[:head]), summary.first_wall_s)


def _modes(system: SystemSummary) -> Iterator[TimelineEntry]:
    source = f"vehicle {system.system}"
    for span in system.modes:
        yield TimelineEntry(span.wall_s, NOTICE, source, f"mode {span.mode}")
    for armed in system.armed:
        yield TimelineEntry(armed.from_wall_s, NOTICE, source, "armed")
        if armed.ended:
            yield TimelineEntry(armed.to_wall_s, NOTICE, source, "disarmed")


def _texts(system: SystemSummary) -> Iterator[TimelineEntry]:
    for text in system.texts:
        yield TimelineEntry(text.wall_s, text.severity, f"vehicle {system.system}", text.text)


def _of_onboard_log(flight: RecordedFlight, archive: Iterable[RecordedFlight]) -> FlightTimeline:
    events = onboard_events(flight.path)
    if not events:
        return FlightTimeline((), (f"{flight.what}: no texts, modes or errors in it",), 0.0, has_wall_time=False)
    first_s, last_s = events[0].wall_s, events[-1].wall_s
    # Some logs get GPS time only in the air: what is before counts from boot.
    absolute = [event.wall_s for event in events if event.wall_s >= EARLIEST_WALL_S]
    entries = [TimelineEntry(e.wall_s, e.severity, f"log of {e.vehicle}", e.text) for e in events]
    lines = [f"{flight.what} of vehicle {events[0].vehicle}, {len(events)} entries over {last_s - first_s:.0f} s"]
    lines += _worst(events)
    joined = []
    if absolute:
        numbers = flight.vehicles or (events[0].vehicle,)
        joined = list(_of_station(archive, numbers, min(absolute) - MARGIN_S, max(absolute) + MARGIN_S))
        lines.append(f"the station's own journals add {len(joined)} entries of that time")
    else:
        lines.append("no GPS time in it: times count from boot, and the station's journals cannot be joined")
    begin_s = min([first_s, *(entry.wall_s for entry in joined)])
    return FlightTimeline(_sorted(entries + joined), tuple(lines), begin_s, has_wall_time=bool(absolute))


def _worst(events: tuple[OnboardEvent, ...]) -> Iterator[str]:
    grave = [event for event in events if event.severity < NOTICE]
    if grave:
        worst = min(grave, key=lambda event: event.severity)
        yield f"{len(grave)} errors and warnings, the gravest at +{worst.wall_s - events[0].wall_s:.0f} s: {worst.text}"


def _of_station(
    archive: Iterable[RecordedFlight], vehicles: tuple[int, ...], from_s: float, to_s: float
) -> Iterator[TimelineEntry]:
    """Yield what journals of flights in that time have about these vehicles, or about all."""
    for flight in archive:
        overlaps = flight.began_wall_s <= to_s and flight.began_wall_s + flight.length_s >= from_s
        if flight.journal is None or not overlaps:
            continue
        for entry in _journal(flight.journal, vehicles):
            if from_s <= entry.wall_s <= to_s:
                yield entry


def _journal(path: Path, vehicles: tuple[int, ...] = ()) -> Iterator[TimelineEntry]:
    """Yield the events of a journal, of these vehicles or of all; other records and damaged lines are left out."""
    try:
        with open_plain(path) as file:
            while line := file.readline(MAX_LINE_BYTES):
                event = _event(line) if line.startswith(b'{"seq"') else None
                if event is not None and (not vehicles or concerns(event, vehicles)):
                    yield TimelineEntry(event.wall_s, event.severity, event.source, event.text)
    except OSError as error:
        raise FlightReadError(f"{path.name}: cannot be read: {error.strerror or error}") from None


def _event(line: bytes) -> JournalEvent | None:
    try:
        return _event_decoder.decode(line)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        return None


def _sorted(entries: list[TimelineEntry]) -> tuple[TimelineEntry, ...]:
    return tuple(sorted(entries, key=lambda entry: entry.wall_s)[:MAX_ENTRIES])
