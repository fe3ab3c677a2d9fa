"""Replay: a recorded flight on the same screens. Nothing is sent anywhere, and nothing can be commanded.

The recorded frames go through the same fleet as live ones, on a clock of their own that shows the time of the
recording, so freshness, losses and jumps are judged as they were in flight whatever the speed.
"""

import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import msgspec

from tui_gcs.core.alarms.alarm_table import AlarmTable
from tui_gcs.core.alarms.vehicle_findings import VehicleAlarmMonitor
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink.frames import Frame, decode
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import (
    EventClass,
    Freshness,
    Reply,
    ReplyCode,
    RunKind,
    RunPhase,
    ScenarioChanged,
    StationStatus,
)
from tui_gcs.core.records.event_log import NOTICE, WARNING, EventLog
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.scenario.model import Limits, LinkLoss, ResultLimits, Scenario
from tui_gcs.core.station.fleet_frame import fleet_frame

FRAME_GAP_S = 0.1
STATUS_GAP_S = 0.5
ALARM_GAP_S = 0.2
LONGEST_GAP_S = 10.0
"""Longer gaps (logs joined together, a clock that was set) are played as this one: long enough to show LOST."""
MAX_RECORDS_PER_TICK = 20_000
"""A speed that needs more records per tick than this is played as fast as possible."""
_HEARTBEAT, _GLOBAL_POSITION_INT = 0, 33
_NOBODY = 0  # no system sends as 0: none of the recorded ids is ours
_OBSERVE = (m.Hello, m.GetScenario, m.GetEvents, m.GetTask, m.GetPlan)


class _DueRecord(NamedTuple):
    """A record that waits for its time on the played clock."""

    at_s: float
    """The time on the played clock when it is due."""
    wall_s: float
    frame: Frame


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


class Player:
    """Plays one telemetry log onto a bus: fleet frames, events and status of kind REPLAY; it answers consoles."""

    def __init__(self, path: Path | str, speed: float, bus: Bus, clock: Clock) -> None:
        """Play `path` at `speed` times real time, beginning with the first `tick`.

        Raises:
            TlogError: unreadable, empty or no telemetry log.
            ValueError: `speed` is not a number above 0.
        """
        if not (math.isfinite(speed) and speed > 0):
            raise ValueError(f"replay speed must be a number above 0, not {speed:g}")
        self.name = clean(Path(path).name, 80)
        self.finished = False
        self._speed = speed
        self._bus = bus
        self._clock = clock
        self._lock = threading.Lock()  # a console asks from a thread of its own
        self._reader = read_tlog(path)
        self._played = PlayedClock()
        self._events = EventLog(self._played)
        self._events.listen(lambda event: bus.publish(keys.EVENT, m.encode(event)))
        self._scenario = _bare_scenario(self.name, _first_place(path))
        # Without keys and with no id of our own: a recording can neither be verified nor commanded.
        self._fleet = VehicleRegistry(self._played, self._events, LocalFrame(self._scenario.origin), _NOBODY)
        self._flights = FlightTable()
        self._alarms = AlarmTable(self._played, self._events)
        self._monitor = VehicleAlarmMonitor(self._alarms)
        self._next_look_s = 0.0
        wall_s, frame = next(self._reader)
        self._due: _DueRecord | None = _DueRecord(0.0, wall_s, frame)
        self._last_wall_s = self._played.ahead_s = wall_s
        self._last_tick_s: float | None = None
        self._next_frame_s = self._next_status_s = -math.inf
        self._frame_seq = self._status_seq = 0
        self._subscription = bus.answer(keys.REQUEST.format(principal="*"), self._on_question)

    def tick(self) -> None:
        """Play what is due on the injected clock and publish."""
        with self._lock:
            now = self._clock.now()
            if self._last_tick_s is None:
                self._last_tick_s = now
                self._bus.publish(keys.SCENARIO, m.encode(self._scenario_changed()))
            self._play_until(self._played.now_s + (now - self._last_tick_s) * self._speed)
            self._last_tick_s = now
            self._fleet.tick()
            self._look_for_alarms()
            self._publish_due(now)

    def close(self) -> None:
        """Stop answering requests."""
        self._subscription.close()

    def _play_until(self, until_s: float) -> None:
        """Take all records up to `until_s` on the played clock, which ends there, or earlier where it must."""
        for _ in range(MAX_RECORDS_PER_TICK):
            due = self._next_due()
            if due is None:
                return
            if due.at_s > until_s:
                self._played.now_s = until_s
                return
            self._due = None
            self._played.now_s, self._played.ahead_s = due.at_s, due.wall_s - due.at_s
            # what stations say is no vehicle's word; who is a vehicle, heartbeats tell
            # Frames of ground stations stay out: only a heartbeat makes a system a vehicle, and only vehicles are
            # shown.
            if due.frame.msgid == _HEARTBEAT or due.frame.system in self._fleet.vehicles:
                self._fleet.intakes[""].datagrams(self.name, [(due.frame.raw, self.name)], due.at_s)

    def _next_due(self) -> "_DueRecord | None":
        """The next record; None at the end of the log."""
        if self._due is None and not self.finished:
            record = next(self._reader, None)
            if record is None:
                self._finish()
                return None
            wall_s, frame = record
            # Logs may be joined, or the clock was set: time never runs back, and long gaps are cut short.
            gap_s = min(max(0.0, wall_s - self._last_wall_s), LONGEST_GAP_S)
            self._last_wall_s = wall_s
            self._due = _DueRecord(self._played.now_s + gap_s, wall_s, frame)
        return self._due

    def _finish(self) -> None:
        self.finished = True
        self._events.report(EventClass.PROCESSING, "replay", "end of the recording", NOTICE)
        if self._reader.skipped_bytes:
            text = f"{self._reader.skipped_bytes} byte(s) of the recording were damaged and skipped"
            self._events.report(EventClass.PROCESSING, "replay", text, WARNING)

    def _look_for_alarms(self) -> None:
        """Find the alarms that the recorded telemetry of the vehicles itself gives reason for."""
        played_s = self._played.now()
        if played_s >= self._next_look_s:
            self._next_look_s = played_s + ALARM_GAP_S
            vehicles = self._fleet.in_order()
            self._alarms.look(
                f for v in vehicles for f in self._monitor.findings(v, played_s, in_flight=v.telemetry.armed)
            )

    def _publish_due(self, now: float) -> None:
        if now >= self._next_frame_s - 1e-9:
            self._next_frame_s = now + FRAME_GAP_S
            self._frame_seq += 1
            frame = fleet_frame(self._frame_seq, RunKind.REPLAY, self._fleet, self._flights, None, self._played)
            self._bus.publish(keys.FLEET, m.encode(frame))
        if now >= self._next_status_s - 1e-9:
            self._next_status_s = now + STATUS_GAP_S
            self._status_seq += 1
            self._bus.publish(keys.STATUS, m.encode(self._status()))

    def _status(self) -> StationStatus:
        played_s = self._played.now()
        vehicles = self._fleet.vehicles.values()
        return StationStatus(
            seq=self._status_seq,
            t_s=played_s,
            wall_s=self._played.wall(),
            kind=RunKind.REPLAY,
            scenario=self._scenario.name,
            revision=1,
            run=RunPhase.IDLE,
            round_index=0,
            rounds=(),
            mission_time_s=played_s,
            heard=sum(1 for v in vehicles if v.freshness(played_s) is not Freshness.LOST),
            vehicles=len(vehicles),
            armed=sum(1 for v in vehicles if v.telemetry.armed),
            in_control="",
            dropped=dict(self._fleet.dropped),
            recording=self.name,
            alarms=tuple(_seen(alarm) for alarm in self._alarms.alarms() if alarm.state != "over"),
        )

    def _scenario_changed(self) -> ScenarioChanged:
        return ScenarioChanged(revision=1, path="", toml="", scenario=self._scenario)

    def _on_question(self, key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        with self._lock:
            answer = self._answer(payload)
        reply(m.encode(answer))

    def _answer(self, payload: bytes) -> Reply:
        try:
            request = m.decode_request(payload)
        except msgspec.MsgspecError as error:
            return Reply(ok=False, text=f"request not understood: {error}", code=ReplyCode.NOT_UNDERSTOOD)
        if not isinstance(request, _OBSERVE):
            return Reply(ok=False, text="this is a recording: nothing can be commanded")
        if isinstance(request, m.GetScenario):
            return Reply(ok=True, scenario=self._scenario_changed())
        if isinstance(request, m.GetEvents):
            return Reply(ok=True, events=self._events.since(request.after))
        if isinstance(request, m.GetTask):
            return Reply(ok=False, text="a recording has no teams")
        return Reply(ok=True)


def _seen(alarm: m.Alarm) -> m.Alarm:
    """The alarm as a recording shows it: it neither flashes nor rings, and asks for no act."""
    return msgspec.structs.replace(alarm, state="acknowledged", fresh=(), action="")


def _first_place(path: Path | str) -> Origin:
    """The first valid position of the log; 0, 0 if there is none. Raises `TlogError`."""
    for _, frame in read_tlog(path):
        message = decode(frame) if frame.msgid == _GLOBAL_POSITION_INT else None
        if message is None:
            continue
        lat_deg, lon_deg = message.fields["lat"] / 1e7, message.fields["lon"] / 1e7
        if (lat_deg, lon_deg) != (0.0, 0.0) and abs(lat_deg) < 89 and abs(lon_deg) <= 180:
            ground_mm = message.fields["alt"] - message.fields["relative_alt"]
            return Origin(lat_deg=lat_deg, lon_deg=lon_deg, ground_amsl_m=ground_mm / 1e3)
    return Origin(lat_deg=0.0, lon_deg=0.0, ground_amsl_m=0.0)


def _bare_scenario(name: str, origin: Origin) -> Scenario:
    """A scenario without zones and teams, which only has the map's origin."""
    return Scenario(
        name=name,
        seed=0,
        origin=origin,
        footprint_radius_m=0.0,
        limits=Limits(),
        results=ResultLimits(),
        link_loss=LinkLoss(),
        rounds=(),
        teams=(),
        places=(),
    )
