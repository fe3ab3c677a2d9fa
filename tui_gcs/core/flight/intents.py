"""Intents: what a planner wants of its vehicles becomes their courses, or is refused with a reason."""

import math

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.guard.guard import SPEED_TOLERANCE
from tui_gcs.core.motion.course import STILL, Course, PositionTarget, Trajectory, course_of
from tui_gcs.core.motion.cruise import ACCEL_SHARE, MAX_CRUISE_S, Cruise
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol.common import EventClass, Intent, Phase, TeamPlan, Vec3
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.scenario.model import Limits

MAX_SLOT_CELLS, MAX_REASON_CELLS = 12, 100
"""Longest name of a slot, and longest reason, that a planner may give; the rest is cut."""
CATCH_UP_TIME_S = 1.0
"""Time constant with which the reference of a velocity course drifts back to its vehicle, which lags behind it."""
FOLLOWS_M = 5.0
"""A vehicle this near to its reference begins a new course at the reference; one farther away, where it is itself."""


class IntentController:
    """Carries out the intents of one team's planner, only for vehicles that fly for it."""

    def __init__(self, team: str, services: FlightServices, steering: Steering) -> None:
        self._team = team
        self._fleet, self._flights, self._guard = services.fleet, services.flights, services.guard
        self._events, self._clock = services.events, services.clock
        self._steering = steering

    def carry_out(self, plan: TeamPlan) -> list[tuple[int, str]]:
        """Give every vehicle its course.

        Returns:
            (vehicle, reason) of those that the planner wants to send home.
        """
        going_home: list[tuple[int, str]] = []
        for intent in plan.intents:
            flight = self._flights.get(intent.vehicle)
            if flight is None or flight.team != self._team:
                text = f"planner names vehicle {intent.vehicle}, not of its team"
                self._refuse(intent.vehicle, "unknown vehicle", text)
            elif flight.phase is not Phase.FLYING:
                # The frame that the plan was made from may be older than a hold or a return.
                continue
            elif intent.kind == "hold":
                self._hold(flight, intent)
            elif intent.kind == "return":
                going_home.append((intent.vehicle, clean(intent.reason, MAX_REASON_CELLS)))
            elif (vehicle := self._fleet.vehicles.get(intent.vehicle)) is not None:
                limits = self._guard.limits_of(intent.vehicle)
                self._steer(flight, vehicle, intent, plan.t_s, limits)
        return going_home

    def _hold(self, flight: Flight, intent: Intent) -> None:
        flight.slot, flight.joined, flight.waits = clean(intent.slot, MAX_SLOT_CELLS), intent.joined, intent.joined
        vehicle = self._fleet.vehicles.get(flight.vehicle)
        if vehicle is not None and flight.course is not None:
            flight.course = None
            self._steering.hold(vehicle, by=f"planner {self._team}")

    def _steer(self, flight: Flight, vehicle: Vehicle, intent: Intent, plan_s: float, limits: Limits) -> None:
        course = self._course(flight, vehicle, intent, plan_s, limits)
        if isinstance(course, str):
            self._refuse(vehicle.id, "kind", course)
            return
        flight.course, flight.slot, flight.joined = course, clean(intent.slot, MAX_SLOT_CELLS), intent.joined
        flight.waits = False

    def _course(
        self, flight: Flight, vehicle: Vehicle, intent: Intent, plan_s: float, limits: Limits
    ) -> PositionTarget | Trajectory | Cruise | Orbit | str:
        if intent.kind == "velocity":
            return self._cruise(flight, vehicle, intent, plan_s, limits)
        if intent.kind == "orbit":
            return self._orbit(flight, vehicle, intent, limits)
        return course_of(intent, limits.speed_m_s)

    def _cruise(self, flight: Flight, vehicle: Vehicle, intent: Intent, plan_s: float, limits: Limits) -> Cruise | str:
        velocity = intent.velocity_m_s
        if velocity is None or not all(map(math.isfinite, velocity)):
            return "velocity without finite numbers"
        if not 0.0 < intent.valid_s <= MAX_CRUISE_S:
            return f"velocity valid for {intent.valid_s:g} s: more than 0, at most {MAX_CRUISE_S:g} s"
        if (speed := math.hypot(*velocity)) > limits.speed_m_s * SPEED_TOLERANCE:
            return f"velocity of {speed:.1f} m/s asked, {limits.speed_m_s:g} allowed"
        now = self._clock.now()
        place, moving = self._start_of(flight, vehicle, now)
        return Cruise(now, place, moving, velocity, plan_s + intent.valid_s, ACCEL_SHARE * limits.accel_m_s2)

    def _orbit(self, flight: Flight, vehicle: Vehicle, intent: Intent, limits: Limits) -> Orbit | str:
        """The orbit that an intent asks for, or why not.

        The same orbit again goes on where it is; a vehicle that was stopped on it begins anew.
        """
        if intent.position_m is None:
            return "orbit without a centre"
        speed = limits.speed_m_s if intent.speed_m_s is None else min(intent.speed_m_s, limits.speed_m_s)
        now = self._clock.now()
        place, moving = self._stop_of(vehicle, limits)
        begin_s = now + moving
        try:
            orbit = Orbit.about(
                begin_s,
                place,
                intent.position_m,
                intent.radius_m,
                speed,
                limits.accel_m_s2,
                clockwise=intent.clockwise,
            )
        except ValueError as error:
            return str(error)
        before = flight.course
        if isinstance(before, Orbit) and before.same_circle(orbit) and self._follows(flight, before, vehicle, now):
            return before
        return orbit

    def _stop_of(self, vehicle: Vehicle, limits: Limits) -> tuple[Vec3, float]:
        """Where the vehicle comes to rest when it brakes now, and after how many seconds."""
        speed = math.hypot(*vehicle.telemetry.velocity_m_s)
        return self._steering.stop_place(vehicle), speed / limits.accel_m_s2 if math.isfinite(speed) else 0.0

    def _start_of(self, flight: Flight, vehicle: Vehicle, now: float) -> tuple[Vec3, Vec3]:
        """Place and velocity to go on from: those of the reference that it follows, or its own."""
        measured = vehicle.telemetry.velocity_m_s if all(map(math.isfinite, vehicle.telemetry.velocity_m_s)) else STILL
        course = flight.course
        if course is None or isinstance(course, PositionTarget) or not self._follows(flight, course, vehicle, now):
            return vehicle.telemetry.position_m, measured
        place, velocity = course.at(now)
        # A velocity was asked for, not a place: the reference drifts back to a vehicle that lags, which would else
        # catch up at more than that velocity.
        age_s = min(now - vehicle.telemetry.position_s, 1.0)
        share = min(max(now - course.begin_s, 0.0) / CATCH_UP_TIME_S, 1.0) if isinstance(course, Cruise) else 0.0
        x, y, z = (
            r + share * (p + age_s * v - r)
            for r, p, v in zip(place, vehicle.telemetry.position_m, measured, strict=True)
        )
        return (x, y, z), velocity

    @staticmethod
    def _follows(flight: Flight, course: Course, vehicle: Vehicle, now: float) -> bool:
        return not flight.vetoed and math.dist(course.at(now)[0], vehicle.telemetry.position_m) <= FOLLOWS_M

    def _refuse(self, vehicle: int, code: str, why: str) -> None:
        self._guard.veto(code, why)
        source = f"planner {self._team}"
        self._events.report(EventClass.PLANNER, source, f"vehicle {vehicle}: {why}", WARNING, every_s=5)
