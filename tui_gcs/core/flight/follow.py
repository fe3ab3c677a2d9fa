"""Follow: vehicles that fly beside another one, each at its distance and height, on courses that the guard judges.

Five times a second each is nudged to move as its leader does, and towards its place beside it. A nudge lasts a second:
when this ends, or the station does, the follower brakes and stands.
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
"""How often each follower gets its next nudge."""
CLOSING_GAIN_HZ = 0.4
"""Speed towards its place, m/s for each metre away from it."""
CLOSING_ACCEL_SHARE = 0.5
"""Share of the allowed acceleration with which it could stop at its place, so that it does not overshoot into its
leader."""


@dataclass
class _Follower:
    """Where one vehicle flies beside its leader."""

    leader: int
    offset_m: Vec3
    """East and north from the leader; z: the height above its own home that it keeps."""
    course: Course | None = None
    """The course of its newest nudge: another one ends following."""


class FollowController:
    """Keeps which vehicle follows which, and nudges the followers."""

    def __init__(self, services: FlightServices, manual: ManualController) -> None:
        self._fleet, self._flights = services.fleet, services.flights
        self._manual = manual
        self._events, self._clock = services.events, services.clock
        self._followers: dict[int, _Follower] = {}
        self._next_s = -math.inf

    def begin(self, vehicle: Vehicle, leader_id: int, offset_m: Vec3) -> str:
        """Follow from now on; "" or why not. NaN in `offset_m` keeps the present offset."""
        if why := self._manual.why_not(vehicle):
            return why
        # Two that follow each other would have no leader.
        if vehicle.id == leader_id or vehicle.id in self._leaders_of(leader_id):
            return "it would follow itself"
        leader = self._fleet.vehicles.get(leader_id)
        if leader is None or (why := self._why_not_followed(leader)):
            return f"vehicle {leader_id} {why if leader is not None else 'was never heard'}"
        limits = self._manual.limits
        (x, y, z), (to_x, to_y, _) = vehicle.telemetry.position_m, leader.telemetry.position_m
        now = (x - to_x, y - to_y, z)
        east, north, up = (own if math.isnan(given) else given for given, own in zip(offset_m, now, strict=True))
        if not all(map(math.isfinite, (east, north, up))):
            return "the place is not finite"
        if math.hypot(east, north) < limits.separation_horizontal_m:
            return f"{math.hypot(east, north):.0f} m from it is too near: at least {limits.separation_horizontal_m:g} m"
        self._followers[vehicle.id] = _Follower(leader_id, (east, north, up))
        why = self._steer(vehicle, self._followers[vehicle.id], leader)
        if why:
            del self._followers[vehicle.id]
        return why

    def tick(self) -> None:
        """Nudge every follower when it is due; end those that another course replaced or that cannot go on."""
        now = self._clock.now()
        if not self._followers or now < self._next_s - 1e-9:
            return
        self._next_s = now + STEP_S
        for number, follower in list(self._followers.items()):
            flight, vehicle = self._flights.get(number), self._fleet.vehicles.get(number)
            if flight is None or vehicle is None or not _is_unchanged(flight, follower):
                self._end(number, flight)
                continue
            leader = self._fleet.vehicles.get(follower.leader)
            why = f"vehicle {follower.leader} " + (self._why_not_followed(leader) if leader is not None else "is gone")
            if leader is not None and not self._why_not_followed(leader):
                why = self._steer(vehicle, follower, leader)
            if why:
                self._end(number, flight)
                text = f"follows vehicle {follower.leader} no longer and stands: {why}"
                self._events.report(EventClass.MISSION, f"vehicle {number}", text, WARNING)

    def _steer(self, vehicle: Vehicle, follower: _Follower, leader: Vehicle) -> str:
        """Nudge a follower as its leader moves, and towards its place; "" or why not."""
        now, limits = self._clock.now(), self._manual.limits
        flight = self._flights.get(vehicle.id)
        # Measured from the reference, not from the vehicle: its lag would be added up nudge by nudge.
        here = follower.course.at(now)[0] if follower.course is not None and flight and not flight.vetoed else None
        age_s = now - leader.telemetry.position_s
        east, north, _ = leader.telemetry.velocity_m_s
        x, y, _ = leader.telemetry.position_m
        place = (
            x + east * age_s + follower.offset_m[0],
            y + north * age_s + follower.offset_m[1],
            follower.offset_m[2],
        )
        apart = [there - own for there, own in zip(place, here or vehicle.telemetry.position_m, strict=True)]
        far_m = math.hypot(*apart)
        closes = 0.0
        if far_m > 0:
            closes = min(CLOSING_GAIN_HZ, math.sqrt(2 * CLOSING_ACCEL_SHARE * limits.accel_m_s2 / far_m))
        velocity = (east + closes * apart[0], north + closes * apart[1], closes * apart[2])
        why = self._manual.nudge(vehicle, Nudge((vehicle.id,), velocity))
        if not why and flight is not None:
            follower.course, flight.slot = flight.course, f">{follower.leader}"
        return why

    def _why_not_followed(self, leader: Vehicle) -> str:
        if leader.freshness(self._clock.now()) is not Freshness.OK or not leader.telemetry.has_position():
            return "is not heard, or its position is not known"
        return "" if leader.telemetry.airborne else "is not in the air"

    def _leaders_of(self, vehicle: int) -> set[int]:
        """The leader of this vehicle, the leader's leader, and so on."""
        found: set[int] = set()
        while (follower := self._followers.get(vehicle)) is not None and follower.leader not in found:
            vehicle = follower.leader
            found.add(vehicle)
        return found

    def _end(self, vehicle: int, flight: Flight | None) -> None:
        del self._followers[vehicle]
        if flight is not None and flight.phase is Phase.BY_HAND:
            flight.slot = ""


def _is_unchanged(flight: Flight, follower: _Follower) -> bool:
    """Whether the vehicle still follows the newest nudge that was given here."""
    return flight.phase is Phase.BY_HAND and flight.course is follower.course
