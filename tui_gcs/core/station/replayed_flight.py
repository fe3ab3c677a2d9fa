"""Replayed flight: fleet, events and alarms of a recording at one moment of it.

The state at a time depends on the recording and on that time alone, not on how it was reached: checks that look at the
fleet now and then run at fixed steps of played time, whatever the speed. So a copy that was kept earlier and plays to
a moment shows the same as one that played there from the beginning.
"""

import copy
from pathlib import Path
from typing import NamedTuple

from tui_gcs.core.alarms.alarm_table import AlarmTable
from tui_gcs.core.alarms.vehicle_findings import VehicleAlarmMonitor
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink.frames import Frame
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING, EventLog
from tui_gcs.core.records.tlog_reader import BEGINNING, TlogError, TlogReader, read_tlog
from tui_gcs.core.station.recorded_events import RecordedEvents, cleaned

STEP_S = 0.1
"""The fleet is checked for losses once in this played time."""
STEPS_PER_ALARM_LOOK = 2
LONGEST_GAP_S = 10.0
"""Longer gaps (logs joined together, a clock that was set) are played as this one: long enough to show LOST."""
_HEARTBEAT = 0
_NOBODY = 0  # no system sends as 0: none of the recorded ids is ours


class PlayedClock:
    """The clock of the recording: `now` counts played seconds, `wall` is the time written in the log."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.ahead_s = 0.0
        """Seconds that `wall` is ahead of `now`."""

    def now(self) -> float:
        """Seconds played since the first frame."""
        return self.now_s

    def wall(self) -> float:
        """Unix time at which this was recorded."""
        return self.now_s + self.ahead_s

    def steady_wall(self) -> float:
        """The same as `wall`, because nothing is recorded by it."""
        return self.wall()


class _DueRecord(NamedTuple):
    """A record that waits for its time on the played clock."""

    at_s: float
    """The time on the played clock when it is due."""
    wall_s: float
    frame: Frame


def played_gap_s(before_wall_s: float, wall_s: float) -> float:
    """Return for how long the time between two records is played."""
    # Logs may be joined, or the clock was set: time never runs back, and long gaps are cut short.
    return min(max(0.0, wall_s - before_wall_s), LONGEST_GAP_S)


class ReplayedFlight:
    """Fleet, events and alarms at `clock`; `advance` plays on, `twin` keeps a copy of this moment."""

    def __init__(self, path: Path, name: str, origin: Origin) -> None:
        """Begin at the first frame of `path`; `name` is the link that its frames seem to come from.

        Raises:
            TlogError: unreadable, empty or no telemetry log.
        """
        self.clock = PlayedClock()
        self.events = EventLog(self.clock)
        # Without keys and with no id of our own: a recording can neither be verified nor commanded.
        self.fleet = VehicleRegistry(self.clock, self.events, LocalFrame(origin), _NOBODY)
        self.flights = FlightTable()
        self._recorded = RecordedEvents(path)
        self._reported = 0
        """How many of the recorded events were reported."""
        # The journal has the alarms as the operator saw them: those found again would be the same events twice.
        self.alarms = AlarmTable(self.clock, EventLog(self.clock) if self._recorded else self.events)
        self.finished = False
        self._path = path
        self._name = name
        self._monitor = VehicleAlarmMonitor(self.alarms)
        self._steps = 0
        self._position = BEGINNING
        self._reader: TlogReader | None = None
        wall_s, frame = next(self._open())
        self._due: _DueRecord | None = _DueRecord(0.0, wall_s, frame)
        self._last_wall_s = self.clock.ahead_s = wall_s

    def advance(self, until_s: float, max_records: int) -> bool:
        """Play to `until_s` or to the end of the recording; return whether it came there with so many records."""
        for _ in range(max_records):
            due = self._next_due()
            if due is None:
                return True
            if due.at_s > until_s:
                self._check_until(until_s, with_end=True)
                self.clock.now_s = max(self.clock.now_s, until_s)
                return True
            self._check_until(due.at_s, with_end=False)
            self._due = None
            self.clock.now_s, self.clock.ahead_s = due.at_s, due.wall_s - due.at_s
            self._report_recorded(due.wall_s)
            # Frames of ground stations stay out: only a heartbeat makes a system a vehicle, and only vehicles are
            # shown.
            if due.frame.msgid == _HEARTBEAT or due.frame.system in self.fleet.vehicles:
                self.fleet.intakes[""].datagrams(self._name, [(due.frame.raw, self._name)], due.at_s)
        return False

    def twin(self) -> "ReplayedFlight":
        """Return a copy that shares nothing which changes."""
        reader, self._reader = self._reader, None
        self._position = reader.position if reader is not None else self._position
        twin = copy.deepcopy(self)
        self._reader = reader
        return twin

    def _open(self) -> TlogReader:
        if self._reader is None:
            self._reader = read_tlog(self._path, self._position)
        return self._reader

    def _check_until(self, until_s: float, *, with_end: bool) -> None:
        """Run the checks that are due before `until_s`, with `with_end` also those at it."""
        while (step_s := (self._steps + 1) * STEP_S) < until_s or (with_end and step_s == until_s):
            self._steps += 1
            self.clock.now_s = step_s
            self.fleet.tick()
            if self._steps % STEPS_PER_ALARM_LOOK == 0:
                self._look_for_alarms(step_s)

    def _report_recorded(self, wall_s: float) -> None:
        """Report what the station's journal has up to this Unix time."""
        events = self._recorded.until(wall_s, self._reported)
        self._reported += len(events)
        for event in events:
            self.events.report(*cleaned(event))

    def _look_for_alarms(self, played_s: float) -> None:
        """Find the alarms that the recorded telemetry of the vehicles itself gives reason for."""
        vehicles = self.fleet.in_order()
        self.alarms.look(f for v in vehicles for f in self._monitor.findings(v, played_s, in_flight=v.telemetry.armed))

    def _next_due(self) -> _DueRecord | None:
        """The next record; None at the end of the log."""
        if self._due is None and not self.finished:
            reader = self._open()
            try:
                record = next(reader, None)
            except TlogError as error:  # the file was moved or the disk is gone
                self.events.report(EventClass.PROCESSING, "replay", str(error), WARNING)
                record = None
            if record is None:
                self._finish(reader)
                return None
            wall_s, frame = record
            gap_s = played_gap_s(self._last_wall_s, wall_s)
            self._last_wall_s = wall_s
            self._due = _DueRecord(self.clock.now_s + gap_s, wall_s, frame)
        return self._due

    def _finish(self, reader: TlogReader) -> None:
        self.finished = True
        self.events.report(EventClass.PROCESSING, "replay", "end of the recording", NOTICE)
        if reader.skipped_bytes:
            text = f"{reader.skipped_bytes} byte(s) of the recording were damaged and skipped"
            self.events.report(EventClass.PROCESSING, "replay", text, WARNING)
