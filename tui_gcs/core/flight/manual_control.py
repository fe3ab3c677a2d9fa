"""Manual control: an operator flies a vehicle to places, round circles, or nudges it; the guard judges every course.

The vehicle leaves its planner's control until it is resumed. A vehicle in no team has no course, and is not steered:
only its modes can be set.
"""

import math

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import ArmingStep, Flight, TakenOut
from tui_gcs.core.flight.steering import MIN_HOVER_M, Steering
from tui_gcs.core.guard.motion_prediction import CLIMB_M_S, DESCENT_M_S
from tui_gcs.core.guard.permission import STATION
from tui_gcs.core.motion.course import MIN_SPEED_M_S, STILL, Course, PositionTarget
from tui_gcs.core.motion.cruise import ACCEL_SHARE, Cruise
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol.common import Freshness, Phase, Vec3
from tui_gcs.core.protocol.flight import CircleFlight, GoTo, Nudge
from tui_gcs.core.scenario.model import Limits

NUDGE_S = 1.0
"""A nudged vehicle begins to brake this long after the last key: a terminal does not report that a key is released."""
FOLLOWS_M = 5.0
"""A vehicle this near to the course of the nudge before goes on from that course."""
NO_TEAM = "is in no team: no course is flown with it"
MAY_BE_TAKEN = frozenset({Phase.FLYING, Phase.HOLDING, Phase.BY_HAND, Phase.RETURNING, Phase.LANDING, Phase.TAKEN_OUT})
"""Phases out of which an operator may take a vehicle."""


class ManualController:
    """Gives vehicles the courses that an operator asks for."""

    def __init__(self, services: FlightServices, steering: Steering) -> None:
        self._flights, self._guard, self._firmware = services.flights, services.guard, services.firmware
        self._commands, self._clock = services.commands, services.clock
        self._steering = steering

    @property
    def limits(self) -> Limits:
        """The limits of the present scenario."""
        return self._guard.limits

    def why_not(self, vehicle: Vehicle) -> str:
        """Why no course can be flown with the vehicle now, or ""."""
        flight = self._flights.get(vehicle.id)
        if flight is None:
            return NO_TEAM
        if why := self._firmware.of(vehicle).why_not(vehicle) or vehicle.why_not_commanded:
            return why
        if vehicle.freshness(self._clock.now()) is not Freshness.OK:
            return "its position is not known"
        if not vehicle.telemetry.airborne:
            return "is not in the air: take off first"
        return "" if flight.phase in MAY_BE_TAKEN else f"not now: {flight.phase}"

    def go_to(self, vehicle: Vehicle, point_m: Vec3, request: GoTo) -> str:
        """Fly to a place; "" or why not. NaN in `point_m` keeps the vehicle's own coordinate."""
        limit = self._guard.limits_of(vehicle.id).speed_m_s
        speed = limit if math.isnan(request.speed_m_s) else request.speed_m_s
        if not MIN_SPEED_M_S <= speed <= limit:
            return f"{speed:g} m/s: {MIN_SPEED_M_S:g} to {limit:g} are allowed"
        here = self._steering.stop_place(vehicle)
        if request.from_home:
            home = self._flights.home_m(vehicle)
            if home is None:
                return "its home is not known"
            point_m = (home[0] + point_m[0], home[1] + point_m[1], point_m[2])
        x, y, z = (own if math.isnan(given) else given for given, own in zip(point_m, here, strict=True))
        if not all(map(math.isfinite, (x, y, z))):
            return "the place is not finite"
        if z < MIN_HOVER_M:
            return f"{z:.1f} m is too low to hover: at least {MIN_HOVER_M:g} m"
        return self._fly(vehicle, PositionTarget((x, y, z), speed))

    def circle(self, vehicle: Vehicle, request: CircleFlight) -> str:
        """Fly round a place; "" or why not."""
        limits, now = self._guard.limits_of(vehicle.id), self._clock.now()
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
        return self._fly(vehicle, orbit)

    def nudge(self, vehicle: Vehicle, request: Nudge, by: str = STATION) -> str:
        """Move for a moment, as `by` orders; "" or why not.

        A velocity above the limits is cut to them, its direction kept.
        """
        limits, now = self._guard.limits_of(vehicle.id), self._clock.now()
        if not all(map(math.isfinite, request.velocity_m_s)):
            return "the velocity is not finite"
        east, north, up = request.velocity_m_s
        speed = math.hypot(east, north, up)
        share = min(1.0, limits.speed_m_s / speed) if speed > 0 else 0.0
        velocity = (east * share, north * share, max(-DESCENT_M_S, min(up * share, CLIMB_M_S)))
        flight = self._flights.get(vehicle.id)
        place, moving = self._begin_of(flight, vehicle, now)
        course = Cruise(now, place, moving, velocity, now + NUDGE_S, ACCEL_SHARE * limits.accel_m_s2)
        why = self._fly(vehicle, course)
        if not why:
            self._flights.by_id[vehicle.id].ordered_by = by
        return why

    def is_nudged(self, vehicle: Vehicle) -> bool:
        """Whether it still follows a nudge, and nothing else has given it a course since."""
        return _nudge_of(self._flights.get(vehicle.id)) is not None

    def _begin_of(self, flight: Flight | None, vehicle: Vehicle, now: float) -> tuple[Vec3, Vec3]:
        """Place and velocity from which a nudge begins.

        Of the nudge before while it is followed, else the vehicle's.
        """
        before = _nudge_of(flight)
        if before is not None and flight is not None and not flight.vetoed:
            place, velocity = before.at(now)
            if math.dist(place, vehicle.telemetry.position_m) <= FOLLOWS_M:
                return place, velocity
        known = all(map(math.isfinite, vehicle.telemetry.velocity_m_s))
        return vehicle.telemetry.position_m, vehicle.telemetry.velocity_m_s if known else STILL

    def limit_speed(self, vehicle: Vehicle, speed_m_s: float) -> str:
        """Change the speed on the way to its place; "" or why not."""
        flight = self._flights.get(vehicle.id)
        if flight is None or flight.phase is not Phase.BY_HAND or not isinstance(flight.course, PositionTarget):
            return "is not on its way to a place"
        limit = self._guard.limits_of(vehicle.id).speed_m_s
        if not MIN_SPEED_M_S <= speed_m_s <= limit:
            return f"{speed_m_s:g} m/s: {MIN_SPEED_M_S:g} to {limit:g} are allowed"
        return self._fly(vehicle, PositionTarget(flight.course.point_m, speed_m_s))

    def release(self, vehicle: Vehicle, step: TakenOut) -> None:
        """The vehicle flies what is on board from now on, or its motors were stopped.

        This station does not steer it.
        """
        flight = self._flights.get(vehicle.id)
        if flight is not None:
            # Its firmware is not released: a PX4 that is still in OFFBOARD gets a stop target there until its mode
            # has changed. Without set-points it would fly home by its failsafe, across the layers of others.
            flight.enter(Phase.TAKEN_OUT, self._clock.now(), step)

    def begin_take_off(self, vehicle: Vehicle, alt_m: float) -> str:
        """A take-off to `alt_m` for manual control begins; "" or why not."""
        flight = self._flights.get(vehicle.id)
        if flight is None:
            return NO_TEAM
        flight.home_m = vehicle.telemetry.position_m
        flight.enter(Phase.ARMING, self._clock.now(), ArmingStep.MANUAL)
        flight.manual_alt_m = alt_m
        return ""

    def on_lifted(self, vehicle: Vehicle) -> None:
        """The vehicle has left the ground: it climbs."""
        flight = self._flights.get(vehicle.id)
        if flight is not None and flight.phase is Phase.ARMING:
            flight.enter(Phase.TAKEOFF, self._clock.now())

    def steers(self, vehicle: Vehicle) -> bool:
        """Whether an operator or a planner steers it through this station now."""
        flight = self._flights.get(vehicle.id)
        return flight is not None and flight.phase not in (Phase.GROUND, Phase.TAKEN_OUT)

    def _fly(self, vehicle: Vehicle, course: Course) -> str:
        if why := self.why_not(vehicle):
            return why
        flight = self._flights.by_id[vehicle.id]
        if flight.phase is not Phase.BY_HAND:
            self._commands.cancel(vehicle.id)
            if (order := self._firmware.of(vehicle).engage(vehicle)) is not None:
                self._commands.submit(order)
            flight.enter(Phase.BY_HAND, self._clock.now())
        limit = self._guard.limits_of(vehicle.id).speed_m_s
        slow = isinstance(flight.course, PositionTarget) and flight.course.speed_m_s < limit
        if slow and not isinstance(course, PositionTarget):
            # The speed limit of the way before would hold for this course as well.
            self._commands.submit(self._firmware.of(vehicle).change_speed(vehicle, limit))
        flight.course, flight.passed, flight.vetoed = course, None, ""
        return ""


def _nudge_of(flight: Flight | None) -> Cruise | None:
    """The course of a nudge that the vehicle still follows, or None."""
    if flight is None or flight.phase is not Phase.BY_HAND or not isinstance(flight.course, Cruise):
        return None
    return flight.course
