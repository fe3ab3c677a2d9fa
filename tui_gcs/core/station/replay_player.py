"""Replay: a recorded flight on the same screens. Nothing is sent anywhere, and nothing can be commanded.

The recorded frames go through the same fleet as live ones, on a clock of their own that shows the time of the
recording, so freshness, losses and jumps are judged as they were in flight whatever the speed. Copies of the flight
that are kept on the way make going back cheap.
"""

import bisect
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.mavlink.frames import decode
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import (
    EventClass,
    Freshness,
    JournalEvent,
    Reply,
    ReplyCode,
    RunKind,
    RunPhase,
    ScenarioChanged,
    StationStatus,
)
from tui_gcs.core.protocol.inspection import GetMessages, GetValues
from tui_gcs.core.protocol.planner_log import GetPlannerLog
from tui_gcs.core.protocol.replay import ControlReplay, ReplayAct, ReplayStatus
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.records.event_log import CRITICAL, INFO, MAX_EVENTS, WARNING
from tui_gcs.core.records.flight_archive import telemetry_times
from tui_gcs.core.records.planner_log import RecordedPlannerLog
from tui_gcs.core.records.tlog_reader import TlogError, read_tlog
from tui_gcs.core.scenario.model import Limits, LinkLoss, ResultLimits, Scenario
from tui_gcs.core.station.fleet_frame import fleet_frame
from tui_gcs.core.station.received_messages import ReceivedMessages
from tui_gcs.core.station.replayed_flight import STEP_S, ReplayedFlight, played_gap_s

FRAME_GAP_S = 0.1
STATUS_GAP_S = 0.5
MAX_RECORDS_PER_TICK = 20_000
"""A speed that needs more records per tick than this is played as fast as possible."""
MEASURED_PER_TICK = 1_000
"""Records that are read ahead for their times in each tick, until the length of the recording is known: 5 ms."""
MIN_SPEED, MAX_SPEED = 1 / 8, 1024.0
TWIN_GAP_S = 10.0
"""Played time between two copies that are kept, until there are `MAX_TWINS`: then every second one is dropped."""
MAX_TWINS = 64
SAME_EVENT_S = 0.5
"""Events that are this close together are one, where an operator goes from event to event."""
SAID_S, MAX_SAID_CELLS = 5.0, 40
"""For how many played seconds, and in how many cells, the alarm stands beside the time that was searched for."""
_GLOBAL_POSITION_INT = 33
_OBSERVE = (m.Hello, m.GetScenario, m.GetEvents, m.GetTask, m.GetPlan)
_decoder: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(
    m.AnyRequest | ControlReplay | GetMessages | GetValues | GetPlannerLog
)
_WORDS = {ReplayAct.NEXT_EVENT: "the next event", ReplayAct.NEXT_ALARM: "the next alarm"}


@dataclass
class _ReplayGoal:
    """What the player is on its way to: a time, or the first event that fits."""

    words: str
    until_s: float
    """The time; for an event the one from which it was searched."""
    is_found: Callable[[JournalEvent], bool] | None = None


class Player:
    """Plays one telemetry log onto a bus: fleet frames, events and status of kind REPLAY; it answers consoles."""

    def __init__(self, path: Path | str, speed: float, bus: Bus, clock: Clock, begin_s: float = 0.0) -> None:
        """Play `path` at `speed` times real time from `begin_s` seconds after its beginning, with the first `tick`.

        Raises:
            TlogError: unreadable, empty or no telemetry log.
            ValueError: `speed` is not a number above 0.
        """
        if not (math.isfinite(speed) and speed > 0):
            raise ValueError(f"replay speed must be a number above 0, not {speed:g}")
        self.name = clean(Path(path).name, 80)
        self._speed = speed
        self._paused = False
        self._bus = bus
        self._clock = clock
        self._lock = threading.Lock()  # a console asks from a thread of its own
        origin = _first_place(path)
        self._scenario = _bare_scenario(self.name, origin)
        self._flight = ReplayedFlight(Path(path), self.name, origin)
        self._planner_log = RecordedPlannerLog(Path(path))
        self._twins = [self._flight.twin()]
        """Copies of the flight in the order of their times; the first one is its beginning."""
        self._twin_gap_s = TWIN_GAP_S
        self._goal = _ReplayGoal(f"{begin_s:.0f} s", begin_s) if begin_s > 0 else None
        self._rewinds = 0
        self._said = ""
        """What became of the last search: the alarm that was found, or that there is none."""
        self._said_until_s = math.inf
        self._length = _LengthMeter(path)
        self._last_tick_s: float | None = None
        self._next_frame_s = self._next_status_s = -math.inf
        self._frame_seq = self._status_seq = self._event_seq = 0
        self._subscription = bus.answer(keys.REQUEST.format(principal="*"), self._on_question)

    @property
    def finished(self) -> bool:
        """Whether the end of the recording is shown."""
        return self._flight.finished

    @property
    def at_s(self) -> float:
        """Played seconds since the beginning."""
        return self._flight.clock.now()

    @property
    def searching(self) -> str:
        """What the player is on its way to; "" if it plays or stands still."""
        return self._goal.words if self._goal is not None else ""

    def tick(self) -> None:
        """Play what is due on the injected clock and publish."""
        with self._lock:
            now = self._clock.now()
            if self._last_tick_s is None:
                self._last_tick_s = now
                self._bus.publish(keys.SCENARIO, m.encode(self._scenario_changed()))
            if self._goal is not None:
                self._go_on(self._goal)
            elif not self._paused:
                self._play_until(self.at_s + (now - self._last_tick_s) * self._speed, MAX_RECORDS_PER_TICK)
            self._last_tick_s = now
            self._length.measure(MEASURED_PER_TICK)
            self._publish_due(now)

    def close(self) -> None:
        """Stop answering requests."""
        self._subscription.close()

    # ---------------------------------------------------------------- playing

    def _play_until(self, until_s: float, max_records: int) -> bool:
        """Play to a time, and keep copies on the way; return whether it came there."""
        while (stop_s := min(until_s, self._twins[-1].clock.now() + self._twin_gap_s)) < until_s:
            # Never more than one gap ahead of the last copy, so that copies lie at times that depend on nothing else.
            if not self._flight.advance(stop_s, max_records):
                return False
            if self.finished:
                return True
            self._keep_twin()
        return self._flight.advance(until_s, max_records)

    def _keep_twin(self) -> None:
        self._twins.append(self._flight.twin())
        if len(self._twins) > MAX_TWINS:
            del self._twins[1::2]
            self._twin_gap_s *= 2

    def _go_on(self, goal: _ReplayGoal) -> None:
        """Play towards the goal as fast as this computer can, for one tick."""
        if goal.is_found is None:
            if self._play_until(goal.until_s, MAX_RECORDS_PER_TICK):
                self._arrive()
            return
        for _ in range(MAX_RECORDS_PER_TICK // 100):
            step_s = (math.floor(self.at_s / STEP_S + 1e-6) + 1) * STEP_S
            newest = self._flight.events.newest_seq
            self._play_until(step_s, MAX_RECORDS_PER_TICK)
            found = next((event for event in self._flight.events.since(newest) if goal.is_found(event)), None)
            if found is not None:
                self._arrive()
                self._name(found)
                return
            if self.finished:
                self._go_to(goal.until_s)
                self._said, self._said_until_s = f"{goal.words}: there is none", math.inf
                return

    def _name(self, event: JournalEvent) -> None:
        """Report which alarm is shown: the list of events has none, and the second line only those of telemetry."""
        if _is_alarm(event):
            self._said = clean(event.text, MAX_SAID_CELLS)
            self._said_until_s = event.t_s + SAID_S

    def _arrive(self) -> None:
        self._goal = None
        self._next_frame_s = self._next_status_s = -math.inf

    def _rewind(self, to_s: float) -> None:
        """Take the newest copy from before a time; consoles forget what they were shown after it."""
        at = bisect.bisect_right([twin.clock.now() for twin in self._twins], to_s) - 1
        # Newer copies stay true: the recording does not change.
        self._flight = self._twins[max(0, at)].twin()
        self._rewinds += 1
        self._event_seq = self._flight.events.newest_seq

    # ---------------------------------------------------------------- what an operator asks

    def _control(self, request: ControlReplay) -> Reply:
        act, here_s = request.act, self.at_s
        self._said = ""
        if act is ReplayAct.PAUSE:
            self._paused = not self._paused
        elif act in (ReplayAct.FASTER, ReplayAct.SLOWER):
            speed = self._speed * (2.0 if act is ReplayAct.FASTER else 0.5)
            self._speed = min(MAX_SPEED, max(MIN_SPEED, speed))
        elif act in (ReplayAct.MOVE, ReplayAct.GO_TO):
            if not math.isfinite(request.seconds):
                return Reply(ok=False, text="the time to go to must be a number")
            self._go_to(max(0.0, request.seconds + (here_s if act is ReplayAct.MOVE else 0.0)))
        elif act in _WORDS:
            if self.finished:
                return Reply(ok=False, text="the end of the recording: nothing comes after it")
            self._search(act)
        elif not self._go_back_to(_is_alarm if act is ReplayAct.PREVIOUS_ALARM else _is_event):
            what = "alarm" if act is ReplayAct.PREVIOUS_ALARM else "event"
            return Reply(ok=False, text=f"no {what} before this moment")
        self._next_frame_s = self._next_status_s = -math.inf
        return Reply(ok=True, text=self._words())

    def _words(self) -> str:
        if self._goal is not None:
            return f"going to {self._goal.words}"
        return "paused" if self._paused else f"plays at {self._speed:g} x"

    def _go_to(self, to_s: float) -> None:
        if to_s < self.at_s:
            self._rewind(to_s)
        self._goal = _ReplayGoal(f"{to_s:.0f} s", to_s)

    def _search(self, act: ReplayAct) -> None:
        fits = _is_alarm if act is ReplayAct.NEXT_ALARM else _is_event
        after_s = self.at_s + SAME_EVENT_S
        self._goal = _ReplayGoal(_WORDS[act], self.at_s, lambda event: event.t_s > after_s and fits(event))

    def _go_back_to(self, fits: Callable[[JournalEvent], bool]) -> bool:
        """Go to the newest event before this moment; return whether there is one."""
        before_s = self.at_s - SAME_EVENT_S
        events = self._flight.events.since(0, MAX_EVENTS)
        found = next((e for e in reversed(events) if e.t_s < before_s and fits(e)), None)
        if found is not None:
            self._name(found)
            # The next step of the checks: the event is shown, and all that came with it.
            self._go_to(math.ceil(found.t_s / STEP_S - 1e-6) * STEP_S)
        return found is not None

    # ---------------------------------------------------------------- the bus

    def _publish_due(self, now: float) -> None:
        # The status first: it says that the player went back, and consoles drop events from before then.
        if now >= self._next_status_s - 1e-9:
            self._next_status_s = now + STATUS_GAP_S
            self._status_seq += 1
            self._bus.publish(keys.STATUS, m.encode(self._status()))
        for event in self._flight.events.since(self._event_seq):
            self._event_seq = event.seq
            self._bus.publish(keys.EVENT, m.encode(event))
        if now >= self._next_frame_s - 1e-9:
            self._next_frame_s = now + FRAME_GAP_S
            self._frame_seq += 1
            flight = self._flight
            frame = fleet_frame(self._frame_seq, RunKind.REPLAY, flight.fleet, flight.flights, None, flight.clock)
            self._bus.publish(keys.FLEET, m.encode(frame))

    def _status(self) -> StationStatus:
        flight, played_s = self._flight, self.at_s
        vehicles = flight.fleet.vehicles.values()
        return StationStatus(
            seq=self._status_seq,
            t_s=played_s,
            wall_s=flight.clock.wall(),
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
            dropped=dict(flight.fleet.dropped),
            recording=self.name,
            alarms=tuple(_seen(alarm) for alarm in flight.alarms.alarms() if alarm.state != "over"),
            replay=ReplayStatus(
                at_s=played_s,
                length_s=self._length.length_s,
                speed=self._speed,
                paused=self._paused,
                searching=self.searching,
                rewinds=self._rewinds,
                said=self._said if self.at_s <= self._said_until_s else "",
            ),
        )

    def _scenario_changed(self) -> ScenarioChanged:
        return ScenarioChanged(revision=1, path="", toml="", scenario=self._scenario)

    def _on_question(self, key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        with self._lock:
            answer = self._answer(payload)
        reply(m.encode(answer))

    def _answer(self, payload: bytes) -> Reply:
        try:
            request = _decoder.decode(payload)
        except msgspec.MsgspecError as error:
            return Reply(ok=False, text=f"request not understood: {error}", code=ReplyCode.NOT_UNDERSTOOD)
        if isinstance(request, ControlReplay):
            return self._control(request)
        if isinstance(request, GetMessages | GetValues):
            received = ReceivedMessages(self._flight.fleet, self._flight.clock, _no_parameter)
            return received.messages(request) if isinstance(request, GetMessages) else received.values(request)
        if isinstance(request, GetPlannerLog):
            return self._planner_log_piece(request)
        if not isinstance(request, _OBSERVE):
            return Reply(ok=False, text="this is a recording: nothing can be commanded")
        if isinstance(request, m.GetScenario):
            return Reply(ok=True, scenario=self._scenario_changed())
        if isinstance(request, m.GetEvents):
            return Reply(ok=True, events=self._flight.events.since(request.after))
        if isinstance(request, m.GetTask):
            return Reply(ok=False, text="a recording has no teams")
        return Reply(ok=True)

    def _planner_log_piece(self, request: GetPlannerLog) -> ServiceReply:
        piece = self._planner_log.piece(request, self._flight.clock.wall())
        if piece is None:
            return ServiceReply(ok=False, text="no planner log lies beside this recording")
        return ServiceReply(ok=True, planner_log=piece)


def _no_parameter(_vehicle: Vehicle, _name: str) -> None:
    """A recording has no table of parameters: their messages are among the others."""


class _LengthMeter:
    """Adds up how long a recording plays, a piece at a time.

    An hour of eight vehicles takes minutes to add up. Until then the length is the time from the first record to the
    last one, with gaps whole.
    """

    def __init__(self, path: Path | str) -> None:
        first_s, last_s = telemetry_times(Path(path))
        self.length_s = last_s - first_s if last_s >= first_s else math.nan
        self._is_measured = False
        self._reader = read_tlog(path)
        self._so_far_s = 0.0
        self._last_wall_s = math.nan

    def measure(self, records: int) -> None:
        """Read so many records more; `length_s` is exact at the end."""
        if self._is_measured:
            return
        for _ in range(records):
            wall_s = self._next_wall_s()
            if wall_s is None:
                self.length_s, self._is_measured = self._so_far_s, True
                return
            if not math.isnan(self._last_wall_s):
                self._so_far_s += played_gap_s(self._last_wall_s, wall_s)
            self._last_wall_s = wall_s

    def _next_wall_s(self) -> float | None:
        """The time of the next record; None at the end, also where the file cannot be read any further."""
        try:
            record = next(self._reader, None)
        except TlogError:
            return None
        return record[0] if record is not None else None


def _is_event(event: JournalEvent) -> bool:
    """Whether an operator goes to it: sensors report all the time what they do."""
    return event.cls is not EventClass.SENSOR or event.severity <= WARNING


def _is_alarm(event: JournalEvent) -> bool:
    """Whether it is an alarm that began, or as grave as one. What is over is reported as information."""
    return event.severity <= CRITICAL or (event.cls is EventClass.ALARM and event.severity < INFO)


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
