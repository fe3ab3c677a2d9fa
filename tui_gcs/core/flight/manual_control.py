"""Vehicles that an operator flies by hand: out of the planner's hands, on courses that the guard judges as any other.

`Resume` gives them back. A vehicle in no team is not ours to steer: modes can be set, but it has no course.
"""

import math

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import ArmingStep, Flight, TakenOut
from tui_gcs.core.flight.steering import MIN_HOVER_M, Steering
from tui_gcs.core.guard.motion_prediction import CLIMB_M_S, DESCENT_M_S
from tui_gcs.core.motion.course import MIN_SPEED_M_S, STILL, Course, PositionTarget
from tui_gcs.core.motion.cruise import ACCEL_SHARE, Cruise
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol.common import Freshness, Phase, Vec3
from tui_gcs.core.protocol.flight import Circle, GoTo, Nudge
from tui_gcs.core.scenario.model import Limits

NUDGE_S = 1.0
"""So long after the last key a vehicle that is nudged begins to brake: terminals tell of no key that is let go."""
FOLLOWS_M = 5.0
"""A vehicle this near to the course of the nudge before goes on from that."""
NO_TEAM = "is in no team: no course is flown with it"
FLIES = frozenset({Phase.FLYING, Phase.HOLDING, Phase.BY_HAND, Phase.RETURNING, Phase.LANDING, Phase.TAKEN_OUT})
"""Phases out of which an operator may take a vehicle."""


class ManualController:
    """Gives vehicles the courses that an operator asks for."""

    def __init__(self, services: FlightServices, steering: Steering) -> None:
        self._flights, self._guard, self._firmware = services.flights, services.guard, services.firmware
        self._commands, self._clock = services.commands, services.clock
        self._steering = steering

    @property
    def limits(self) -> Limits:
        """The scenario's."""
        return self._guard.limits

    def why_not(self, vehicle: Vehicle) -> str:
        """Why no course can be flown with it now, or ""."""
        flight = self._flights.get(vehicle.id)
        if flight is None:
            return NO_TEAM
        if why := self._firmware.of(vehicle).why_not(vehicle) or vehicle.why_not_commanded:
            return why
        if vehicle.freshness(self._clock.now()) is not Freshness.OK:
            return "its position is not known"
        if not vehicle.telemetry.airborne:
            return "is not in the air: take off first"
        return "" if flight.phase in FLIES else f"not now: {flight.phase}"

    def go_to(self, vehicle: Vehicle, point_m: Vec3, request: GoTo) -> str:
        """Fly there; "" or why not."""
        limit = self._guard.limits.speed_m_s
        speed = limit if math.isnan(request.speed_m_s) else request.speed_m_s
        if not MIN_SPEED_M_S <= speed <= limit:
            return f"{speed:g} m/s: {MIN_SPEED_M_S:g} to {limit:g} are allowed"
        here = self._steering.stop_place(vehicle)
        if request.from_home:
            home = self._flights.home_m(vehicle)
            if home is None:
                return "its home is not known"
            point_m = (home[0] + point_m[0], home[1] + point_m[1], point_m[2])
        x, y, z = (own if math.isnan(asked) else asked for asked, own in zip(point_m, here, strict=True))
        if not all(map(math.isfinite, (x, y, z))):
            return "the place is not finite"
        if z < MIN_HOVER_M:
            return f"{z:.1f} m is too low to hover: at least {MIN_HOVER_M:g} m"
        return self._take(vehicle, PositionTarget((x, y, z), speed))

    def circle(self, vehicle: Vehicle, request: Circle) -> str:
        """Fly round a place; "" or why not."""
        limits, now = self._guard.limits, self._clock.now()
        speed = limits.speed_m_s if math.isnan(request.speed_m_s) else min(request.speed_m_s, limits.speed_m_s)
        here = self._steering.stop_place(vehicle)
        x, y, z = request.centre_m
        moving_m_s = math.hypot(*vehicle.telemetry.velocity_m_s)
        begin_s = now + (moving_m_s / limits.accel_m_s2 if math.isfinite(moving_m_s) else 0.0)
        try:
            orbit = Orbit.about(
                begin_s,
                here,
                (x, y, here[2] if math.isnan(z) else z),
                request.radius_m,
                speed,
                limits.accel_m_s2,
                clockwise=request.clockwise,
            )
        except ValueError as error:
            return str(error)
        return self._take(vehicle, orbit)

    def nudge(self, vehicle: Vehicle, request: Nudge) -> str:
        """Move a little; "" or why not. Faster than the limits is cut to them, in the direction that is asked for."""
        limits, now = self._guard.limits, self._clock.now()
        if not all(map(math.isfinite, request.velocity_m_s)):
            return "the velocity is not finite"
        east, north, up = request.velocity_m_s
        speed = math.hypot(east, north, up)
        share = min(1.0, limits.speed_m_s / speed) if speed > 0 else 0.0
        velocity = (east * share, north * share, max(-DESCENT_M_S, min(up * share, CLIMB_M_S)))
        flight = self._flights.get(vehicle.id)
        place, moving = self._begin_of(flight, vehicle, now)
        course = Cruise(now, place, moving, velocity, now + NUDGE_S, ACCEL_SHARE * limits.accel_m_s2)
        return self._take(vehicle, course)

    def is_nudged(self, vehicle: Vehicle) -> bool:
        """Whether it still does what a nudge told it, and nobody has taken it away from that."""
        return _nudge_of(self._flights.get(vehicle.id)) is not None

    def _begin_of(self, flight: Flight | None, vehicle: Vehicle, now: float) -> tuple[Vec3, Vec3]:
        """Place and velocity to go on from: of the nudge before, as long as it is followed, or its own."""
        before = _nudge_of(flight)
        if before is not None and flight is not None and not flight.vetoed:
            place, velocity = before.at(now)
            if math.dist(place, vehicle.telemetry.position_m) <= FOLLOWS_M:
                return place, velocity
        known = all(map(math.isfinite, vehicle.telemetry.velocity_m_s))
        return vehicle.telemetry.position_m, vehicle.telemetry.velocity_m_s if known else STILL

    def limit_speed(self, vehicle: Vehicle, speed_m_s: float) -> str:
        """Another speed on the way to its place; "" or why not."""
        flight = self._flights.get(vehicle.id)
        if flight is None or flight.phase is not Phase.BY_HAND or not isinstance(flight.course, PositionTarget):
            return "is not on its way to a place"
        limit = self._guard.limits.speed_m_s
        if not MIN_SPEED_M_S <= speed_m_s <= limit:
            return f"{speed_m_s:g} m/s: {MIN_SPEED_M_S:g} to {limit:g} are allowed"
        return self._take(vehicle, PositionTarget(flight.course.point_m, speed_m_s))

    def let_go(self, vehicle: Vehicle, step: TakenOut) -> None:
        """It flies what is on board from now on, or its motors are stopped: nobody here steers it.

        Its firmware is not released: a PX4 that is still in OFFBOARD is told to stop there until its mode has changed.
        Left without set-points it would fly home by its failsafe, across the layers of others.
        """
        flight = self._flights.get(vehicle.id)
        if flight is not None:
            flight.enter(Phase.TAKEN_OUT, self._clock.now(), step)

    def lifting(self, vehicle: Vehicle, alt_m: float) -> str:
        """It is about to take off to `alt_m` by hand; "" or why not."""
        flight = self._flights.get(vehicle.id)
        if flight is None:
            return NO_TEAM
        flight.home_m, flight.touchdown_m = vehicle.telemetry.position_m, None
        flight.enter(Phase.ARMING, self._clock.now(), ArmingStep.MANUAL)
        flight.by_hand_m = alt_m
        return ""

    def lifted(self, vehicle: Vehicle) -> None:
        """It has left the ground: it climbs."""
        flight = self._flights.get(vehicle.id)
        if flight is not None and flight.phase is Phase.ARMING:
            flight.enter(Phase.TAKEOFF, self._clock.now())

    def steers(self, vehicle: Vehicle) -> bool:
        """Whether somebody here steers it now: an operator or a planner."""
        flight = self._flights.get(vehicle.id)
        return flight is not None and flight.phase not in (Phase.GROUND, Phase.TAKEN_OUT)

    def _take(self, vehicle: Vehicle, course: Course) -> str:
        if why := self.why_not(vehicle):
            return why
        flight = self._flights.by_id[vehicle.id]
        if flight.phase is not Phase.BY_HAND:
            self._commands.cancel(vehicle.id)
            if (order := self._firmware.of(vehicle).engage(vehicle)) is not None:
                self._commands.submit(order)
            flight.enter(Phase.BY_HAND, self._clock.now())
        limit = self._guard.limits.speed_m_s
        slow = isinstance(flight.course, PositionTarget) and flight.course.speed_m_s < limit
        if slow and not isinstance(
            course, PositionTarget
        ):  # it was told to keep below a speed that this course does not
            self._commands.submit(self._firmware.of(vehicle).change_speed(vehicle, limit))
        flight.course, flight.passed, flight.vetoed = course, None, ""
        return ""


def _nudge_of(flight: Flight | None) -> Cruise | None:
    """What a nudge told it, as long as nobody has taken it away from that."""
    if flight is None or flight.phase is not Phase.BY_HAND or not isinstance(flight.course, Cruise):
        return None
    return flight.course
