"""Time on the link: TIMESYNC and PING are answered, and each vehicle's clock is compared with ours (docs/autopilots.md C6)."""

import math
from collections import Counter, deque
from dataclasses import dataclass, field

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import Fields, VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.uplink.ack_matching import Trips
from tui_gcs.core.uplink.uplink import Uplink

MAX_PER_S = 50
"""Per vehicle: ArduPilot asks every 10 s, PX4 at 10 Hz at most. More is a flood, and is not answered."""
ASK_GAP_S = 10.0
"""How often each vehicle is asked for its time."""
FIRST_GAP_S = 2.5
"""How soon again while it never answered: twice as long each time. Whose an ACK is depends on it (`AckMatcher`)."""
LOOK_GAP_S, MAX_AT_ONCE = 0.25, 10
"""How often it is looked who is due, and how many are asked then: a fleet's questions are spread."""
KEPT = 6
"""Measurements of one vehicle: a minute."""
SILENT_S = 2.0
"""A vehicle that said nothing for this long is not asked."""
MAX_RTT_S = 5.0
"""An answer that took longer tells nothing."""


class TimeResponder:
    """Answers at once, from within `VehicleRegistry`'s dispatch."""

    def __init__(self, fleet: VehicleRegistry, uplink: Uplink, clock: Clock, own_system: int) -> None:
        """Listen to `fleet`, answer through `uplink` what nobody else than `own_system` is asked."""
        self._for_us = (0, own_system)
        self._uplink = uplink
        self._clock = clock
        self._answered: Counter[int] = Counter()
        self._second = 0
        self.ignored = 0
        """Questions that came too fast."""
        fleet.on_message("TIMESYNC", self._timesync)
        fleet.on_message("PING", self._ping)

    def _timesync(self, vehicle: Vehicle, fields: Fields) -> None:
        """A request has tc1 = 0 and the sender's time in ts1; the answer gives ts1 back, with our time in tc1."""
        if fields["tc1"] == 0 and fields.get("target_system", 0) in self._for_us and self._may(vehicle):
            self._uplink.ask(vehicle.id, "TIMESYNC", tc1=round(self._clock.now() * 1e9), ts1=fields["ts1"])

    def _ping(self, vehicle: Vehicle, fields: Fields) -> None:
        """A request has no target; the answer is the same with the target set."""
        if fields["target_system"] == 0 and self._may(vehicle):
            self._uplink.ask(vehicle.id, "PING", time_usec=fields["time_usec"], seq=fields["seq"])

    def _may(self, vehicle: Vehicle) -> bool:
        second = int(self._clock.now())
        if second != self._second:
            self._second = second
            self._answered.clear()
        self._answered[vehicle.id] += 1
        if self._answered[vehicle.id] > MAX_PER_S:
            self.ignored += 1
            return False
        return True


@dataclass(frozen=True)
class LinkTiming:
    """How long a question and its answer take, and how far a vehicle's clock is from ours."""

    rtt_s: float
    """The newest."""
    best_rtt_s: float
    """Of the last minute."""
    offset_s: float
    """Vehicle's time (since its boot, or the epoch) minus station's, from the quickest answer of the last minute.

    To be shown, not to be used: freshness is the time of arrival (docs/architecture.md, Time).
    """
    age_s: float


@dataclass
class _ClockRecord:
    asked: dict[int, float] = field(default_factory=dict)
    """Station time of questions under way, by what they say in ts1."""
    next_s: float = -math.inf
    gap_s: float = FIRST_GAP_S
    heard: deque[tuple[float, float, float]] = field(default_factory=lambda: deque(maxlen=KEPT))
    """(when, round trip, offset)."""


class LinkTimingService:
    """Asks every vehicle for its time, seldom."""

    def __init__(self, context: ServiceContext) -> None:
        """Nothing is asked before the first `tick`."""
        self._context = context
        self._books: dict[int, _ClockRecord] = {}
        self._next_look_s = -math.inf
        self.ignored: Counter[str] = Counter()
        fleet = context.fleet
        fleet.on_message("TIMESYNC", self._heard)
        fleet.on_gone(self._forget)
        fleet.paths.on_reboot.append(self._forget)
        fleet.paths.on_replace.append(self._forget)
        fleet.paths.on_move.append(self._forget)

    def of(self, vehicle: Vehicle) -> LinkTiming | None:
        """What was measured to a vehicle; None if it never answered."""
        book = self._books.get(vehicle.id)
        if book is None or not book.heard:
            return None
        when, rtt_s, _ = book.heard[-1]
        _, best_rtt_s, offset_s = min(book.heard, key=lambda entry: entry[1])
        return LinkTiming(rtt_s, best_rtt_s, offset_s, self._context.clock.now() - when)

    def trips(self, vehicle: int) -> Trips | None:
        """The shortest and the longest time there and back of the last minute; None if nothing was measured.

        Of three and more the very longest is left out: one answer that was held up makes nobody wait for a minute.
        """
        book = self._books.get(vehicle)
        if book is None or not book.heard:
            return None
        times_s = sorted(rtt_s for _, rtt_s, _ in book.heard)
        return times_s[0], times_s[-2] if len(times_s) > 2 else times_s[-1]

    def tick(self) -> None:
        """Ask who is due."""
        now = self._context.clock.now()
        if now < self._next_look_s:
            return
        self._next_look_s = now + LOOK_GAP_S
        asked = 0
        for vehicle in self._context.fleet.vehicles.values():
            book = self._books.setdefault(vehicle.id, _ClockRecord())
            if now < book.next_s or not self._may_ask(vehicle, now):
                continue
            book.next_s = now + (ASK_GAP_S if book.heard else book.gap_s)
            book.gap_s = min(2 * book.gap_s, ASK_GAP_S)
            book.asked = {ts1: asked_s for ts1, asked_s in book.asked.items() if now - asked_s < MAX_RTT_S}
            ts1 = round(now * 1e9)
            book.asked[ts1] = now
            self._context.uplink.ask(vehicle.id, "TIMESYNC", tc1=0, ts1=ts1)
            asked += 1
            if asked >= MAX_AT_ONCE:
                return

    def _may_ask(self, vehicle: Vehicle, now: float) -> bool:
        heard = vehicle.identity.confirmed and now - vehicle.heard_s <= SILENT_S
        return (
            heard
            and not vehicle.path.high_latency
            and vehicle.telemetry.high_latency_s <= vehicle.telemetry.heartbeat_s
        )

    def _heard(self, vehicle: Vehicle, fields: Fields) -> None:
        """Its time is taken for that of the middle of the way there and back.

        Whom it names as target is not looked at: PX4 sends what happens to be in its memory (measured on 1.16.1).
        """
        if fields["tc1"] == 0:
            return
        book = self._books.get(vehicle.id)
        asked_s = book.asked.pop(fields["ts1"], None) if book is not None else None
        if book is None or asked_s is None:
            self.ignored["answer to nothing asked"] += 1
            return
        now = self._context.clock.now()
        rtt_s = now - asked_s
        if rtt_s <= MAX_RTT_S:
            book.heard.append((now, rtt_s, fields["tc1"] / 1e9 - (asked_s + now) / 2))

    def _forget(self, vehicle: Vehicle) -> None:
        self._books.pop(vehicle.id, None)
