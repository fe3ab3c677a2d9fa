"""Vehicles that follow another one: flown by hand, each at its distance and height, on courses that the guard judges.

Five times a second each is asked to move as the one it follows does, and towards its place beside it. Nothing lasts
longer than a second: when this ends, or the station, it brakes and stands.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight
from tui_gcs.core.flight.manual_control import ManualController
from tui_gcs.core.motion.course import Course
from tui_gcs.core.protocol.common import EventClass, Freshness, Phase, Vec3
from tui_gcs.core.protocol.flight import Nudge
from tui_gcs.core.records.event_log import WARNING

STEP_S = 0.2
CLOSES_HZ = 0.4
"""How fast it closes on its place: so many metres a second for each metre."""
CLOSES_SHARE = 0.5
"""Of the allowed acceleration, with which it could stop there: nobody overshoots into whom he follows."""


@dataclass
class _Escort:
    leader: int
    offset_m: Vec3
    """East and north from the leader; z: the height above its own home that it keeps."""
    course: Course | None = None
    """What it was told last: another one ends this."""


class FollowController:
    """Who follows whom."""

    def __init__(self, services: FlightServices, manual: ManualController) -> None:
        """Nobody follows anybody."""
        self._fleet, self._flights = services.fleet, services.flights
        self._manual = manual
        self._events, self._clock = services.events, services.clock
        self._escorts: dict[int, _Escort] = {}
        self._next_s = -math.inf

    def begin(self, vehicle: Vehicle, leader_id: int, offset_m: Vec3) -> str:
        """Follow from now on; "" or why not. NaN in `offset_m`: as it is now."""
        if why := self._manual.why_not(vehicle):
            return why
        if vehicle.id == leader_id or vehicle.id in self._before(leader_id):
            return "it would follow itself"
        leader = self._fleet.vehicles.get(leader_id)
        if leader is None or (why := self._why_not_led_by(leader)):
            return f"vehicle {leader_id} {why if leader is not None else 'was never heard'}"
        limits = self._manual.limits
        (x, y, z), (to_x, to_y, _) = vehicle.telemetry.position_m, leader.telemetry.position_m
        now = (x - to_x, y - to_y, z)
        east, north, up = (own if math.isnan(asked) else asked for asked, own in zip(offset_m, now, strict=True))
        if not all(map(math.isfinite, (east, north, up))):
            return "the place is not finite"
        if math.hypot(east, north) < limits.separation_horizontal_m:
            return f"{math.hypot(east, north):.0f} m from it is too near: at least {limits.separation_horizontal_m:g} m"
        self._escorts[vehicle.id] = _Escort(leader_id, (east, north, up))
        why = self._steer(vehicle, self._escorts[vehicle.id], leader)
        if why:
            del self._escorts[vehicle.id]
        return why

    def tick(self) -> None:
        """Say anew what is due; end what somebody else decided, or what cannot go on."""
        now = self._clock.now()
        if not self._escorts or now < self._next_s - 1e-9:
            return
        self._next_s = now + STEP_S
        for number, escort in list(self._escorts.items()):
            flight, vehicle = self._flights.get(number), self._fleet.vehicles.get(number)
            if flight is None or vehicle is None or not _is_ours(flight, escort):
                self._end(number, flight)
                continue
            leader = self._fleet.vehicles.get(escort.leader)
            why = f"vehicle {escort.leader} " + (self._why_not_led_by(leader) if leader is not None else "is gone")
            if leader is not None and not self._why_not_led_by(leader):
                why = self._steer(vehicle, escort, leader)
            if why:
                self._end(number, flight)
                text = f"follows vehicle {escort.leader} no longer and stands: {why}"
                self._events.report(EventClass.MISSION, f"vehicle {number}", text, WARNING)

    def _steer(self, vehicle: Vehicle, escort: _Escort, leader: Vehicle) -> str:
        """As the leader moves, and towards its place; "" or why not."""
        now, limits = self._clock.now(), self._manual.limits
        flight = self._flights.get(vehicle.id)
        here = escort.course.at(now)[0] if escort.course is not None and flight and not flight.vetoed else None
        age_s = now - leader.telemetry.position_s
        east, north, _ = leader.telemetry.velocity_m_s
        x, y, _ = leader.telemetry.position_m
        place = (x + east * age_s + escort.offset_m[0], y + north * age_s + escort.offset_m[1], escort.offset_m[2])
        apart = [there - own for there, own in zip(place, here or vehicle.telemetry.position_m, strict=True)]
        far_m = math.hypot(*apart)
        closes = min(CLOSES_HZ, math.sqrt(2 * CLOSES_SHARE * limits.accel_m_s2 / far_m)) if far_m > 0 else 0.0
        velocity = (east + closes * apart[0], north + closes * apart[1], closes * apart[2])
        why = self._manual.nudge(vehicle, Nudge((vehicle.id,), velocity))
        if not why and flight is not None:
            escort.course, flight.slot = flight.course, f">{escort.leader}"
        return why

    def _why_not_led_by(self, leader: Vehicle) -> str:
        if leader.freshness(self._clock.now()) is not Freshness.OK or not leader.telemetry.has_position():
            return "is not heard, or its position is not known"
        return "" if leader.telemetry.airborne else "is not in the air"

    def _before(self, vehicle: int) -> set[int]:
        """Whom this one follows, and whom that one follows, and so on."""
        found: set[int] = set()
        while (escort := self._escorts.get(vehicle)) is not None and escort.leader not in found:
            vehicle = escort.leader
            found.add(vehicle)
        return found

    def _end(self, vehicle: int, flight: Flight | None) -> None:
        del self._escorts[vehicle]
        if flight is not None and flight.phase is Phase.BY_HAND:
            flight.slot = ""


def _is_ours(flight: Flight, escort: _Escort) -> bool:
    """Whether it still does what was said here last."""
    return flight.phase is Phase.BY_HAND and flight.course is escort.course
