"""TIMESYNC and PING are answered, and each vehicle's clock and round trip are measured (docs/autopilots.md C6).

The same requests show over which paths a vehicle is heard and not reached (`up_ways`).
"""

import math
from collections import Counter, deque
from dataclasses import dataclass, field

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import Fields, VehicleRegistry
from tui_gcs.core.fleet.identity.path import Path
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.up_ways import HEARD_S, UpWay
from tui_gcs.core.uplink.ack_matching import RoundTrips
from tui_gcs.core.uplink.uplink import Uplink

MAX_PER_S = 50
"""The most answers a second to one vehicle: ArduPilot asks every 10 s, PX4 at 10 Hz at most. More is a flood."""
ASK_GAP_S = 5.0
"""How often each vehicle is asked for its time, over one of its paths: 28 bytes, 41 with a signature."""
FIRST_GAP_S, MAX_GAP_S = 2.5, 10.0
"""How soon a vehicle that never answered is asked again, twice as long each time: the matching of ACKs needs the round
trip. At most `MAX_GAP_S`, or `ASK_GAP_S` if it must answer."""
ALWAYS_ANSWER = frozenset({3, 12})
"""MAV_AUTOPILOT of ArduPilot and PX4: both answer TIMESYNC at any time (docs/autopilots.md C6)."""
LOOK_PERIOD_S, MAX_AT_ONCE = 0.25, 10
"""How often due vehicles are looked for, and how many are asked then: the requests of a fleet are spread."""
MAX_MEASUREMENTS = 12
"""How many measurements of one vehicle are kept: a minute."""
SILENT_S = 2.0
"""A vehicle that was not received for this long is not asked."""
MAX_RTT_S = 5.0
"""An answer that took longer is not used."""


class TimeResponder:
    """Answers TIMESYNC and PING at once, while the frame is dispatched, so that vehicles measure only the link."""

    def __init__(self, fleet: VehicleRegistry, uplink: Uplink, clock: Clock, own_system: int) -> None:
        """Answer requests that are not addressed to another station than `own_system`."""
        self._for_us = (0, own_system)
        self._uplink = uplink
        self._clock = clock
        self._answered: Counter[int] = Counter()
        self._second = 0
        self.ignored = 0
        """How many requests came too fast."""
        fleet.on_message("TIMESYNC", self._timesync)
        fleet.on_message("PING", self._ping)

    def _timesync(self, vehicle: Vehicle, fields: Fields) -> None:
        """Answer a request: it has tc1 = 0 and the sender's time in ts1.

        The answer returns ts1, with our time in tc1.
        """
        if fields["tc1"] == 0 and fields.get("target_system", 0) in self._for_us and self._may(vehicle):
            self._uplink.ask(vehicle.id, "TIMESYNC", tc1=round(self._clock.now() * 1e9), ts1=fields["ts1"])

    def _ping(self, vehicle: Vehicle, fields: Fields) -> None:
        """Answer a request: it has no target. The answer is the same message with the target set."""
        if fields["target_system"] == 0 and self._may(vehicle):
            self._uplink.ask(vehicle.id, "PING", time_usec=fields["time_usec"], seq=fields["seq"])

    def _may(self, vehicle: Vehicle) -> bool:
        second = int(self._clock.now())
        if second != self._second:
            self._second = second
            self._answered.clear()
        self._answered[vehicle.id] += 1
        # Answering a flood would use up the link.
        if self._answered[vehicle.id] > MAX_PER_S:
            self.ignored += 1
            return False
        return True


@dataclass(frozen=True)
class LinkTiming:
    """The round trip to a vehicle.

    The offset of its clock is not kept: freshness is the time of arrival (docs/architecture.md, "Time").
    """

    rtt_s: float
    """The newest round trip."""
    best_rtt_s: float
    """The shortest round trip of the last minute."""
    age_s: float


@dataclass
class _ClockRecord:
    ways: dict[Path, UpWay] = field(default_factory=dict)
    """The paths that were asked."""
    next_s: float = -math.inf
    gap_s: float = FIRST_GAP_S
    answered: bool = False
    heard: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=MAX_MEASUREMENTS))
    """(station time, round trip) of the newest answers over the path in use."""

    def next_way(self, paths: list[Path]) -> UpWay:
        """The path of `paths` that is asked next: one that is in doubt, or else the one asked longest ago."""
        ways = [self.ways.setdefault(path, UpWay(path)) for path in paths]
        return min(ways, key=lambda way: (way.path.up_way_dead or not way.missed, way.asked_s))


class LinkTimingService:
    """Requests the time of every vehicle at long intervals, and keeps the round trips."""

    def __init__(self, context: ServiceContext) -> None:
        """Create the service; `tick` sends the requests."""
        self._context = context
        self._records: dict[int, _ClockRecord] = {}
        self._next_look_s = -math.inf
        self.ignored: Counter[str] = Counter()
        context.fleet.on_message("TIMESYNC", self._on_timesync)
        context.forget_with(self._forget)
        context.fleet.paths.on_move.append(self._forget)

    def of(self, vehicle: Vehicle) -> LinkTiming | None:
        """The measurement of a vehicle; None if it never answered."""
        record = self._records.get(vehicle.id)
        if record is None or not record.heard:
            return None
        when, rtt_s = record.heard[-1]
        best_rtt_s = min(one_s for _, one_s in record.heard)
        return LinkTiming(rtt_s, best_rtt_s, self._context.clock.now() - when)

    def round_trips(self, vehicle: int) -> RoundTrips | None:
        """The shortest and the longest round trip of the last minute in seconds; None if nothing was measured.

        Of three and more the longest is left out, so that one delayed answer does not prolong every wait for a minute.
        """
        record = self._records.get(vehicle)
        if record is None or not record.heard:
            return None
        times_s = sorted(rtt_s for _, rtt_s in record.heard)
        return times_s[0], times_s[-2] if len(times_s) > 2 else times_s[-1]

    def dead_up_ways(self, vehicle: Vehicle) -> list[Path]:
        """The paths over which the vehicle is heard now and nothing that is sent arrives."""
        record, now = self._records.get(vehicle.id), self._context.clock.now()
        if record is None or vehicle.why_not_commanded or not _answers(vehicle, record):
            return []
        return [path for path in vehicle.used_paths() if path.up_way_dead and now - path.last_heard_s <= HEARD_S]

    def tick(self) -> None:
        """Request the time of the vehicles that are due."""
        now = self._context.clock.now()
        if now < self._next_look_s:
            return
        self._next_look_s = now + LOOK_PERIOD_S
        count = 0
        for vehicle in self._context.fleet.vehicles.values():
            record = self._records.setdefault(vehicle.id, _ClockRecord())
            for way in record.ways.values():
                way.settle(now)
            if now < record.next_s or count >= MAX_AT_ONCE or not (paths := self._may_ask(vehicle, now)):
                continue
            record.next_s = now + (ASK_GAP_S if record.answered else record.gap_s)
            record.gap_s = min(2 * record.gap_s, ASK_GAP_S if _answers(vehicle, record) else MAX_GAP_S)
            record.ways = {path: way for path, way in record.ways.items() if path in vehicle.paths}
            way, ts1 = record.next_way(paths), round(now * 1e9)
            way.ask(ts1, now)
            self._context.uplink.ask_time(vehicle, way.path, ts1)
            count += 1

    def _may_ask(self, vehicle: Vehicle, now: float) -> list[Path]:
        """The paths over which the vehicle may be asked now."""
        if not vehicle.identity.confirmed or vehicle.telemetry.high_latency_s > vehicle.telemetry.heartbeat_s:
            return []
        return [path for path in vehicle.used_paths() if self._is_open(path, now)]

    def _is_open(self, path: Path, now: float) -> bool:
        spec = self._context.specs.get(path.source.link)
        quiet = path.high_latency or (spec is not None and spec.high_latency)
        return not quiet and now - path.last_heard_s <= SILENT_S

    def _on_timesync(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take an answer to a request of ours."""
        # The target of the answer is not looked at: PX4 sends what happens to be in its memory (measured on 1.16.1).
        if fields["tc1"] == 0:
            return
        record = self._records.get(vehicle.id)
        for way in record.ways.values() if record is not None else ():
            if (asked_s := way.answer(fields["ts1"])) is not None and record is not None:
                record.answered = True
                self._take(vehicle, record, way, asked_s)
                return
        self.ignored["answer to nothing asked"] += 1

    def _take(self, vehicle: Vehicle, record: _ClockRecord, way: UpWay, asked_s: float) -> None:
        """Keep the round trip of an answer, if it went the way of commands."""
        now = self._context.clock.now()
        if way.path is vehicle.path and now - asked_s <= MAX_RTT_S:
            record.heard.append((now, now - asked_s))

    def _forget(self, vehicle: Vehicle) -> None:
        self._records.pop(vehicle.id, None)
        for path in vehicle.paths:
            path.up_way_dead = False


def _answers(vehicle: Vehicle, record: _ClockRecord) -> bool:
    """Whether the vehicle answers TIMESYNC if it hears it."""
    return record.answered or vehicle.autopilot in ALWAYS_ANSWER
