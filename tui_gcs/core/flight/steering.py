"""Steering streams the set-points of flying vehicles; the guard judges each course before its set-points are sent.

A vetoed vehicle brakes and holds; the next set-point that passes lets it go on. Each set-point carries its permission:
the verdict on its course, or the reason of a stop. Holds are sent from here too, and are never judged.
"""

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from shapely import LineString, Point

from tui_gcs.core.firmware.own_limits import OwnLimits
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.fleet_monitor import error_m
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import COLUMN_M, Flight
from tui_gcs.core.geometry.shortest_route import route
from tui_gcs.core.guard.bypass import bypass_columns
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.keep_out import keep_out
from tui_gcs.core.guard.motion_prediction import LOST_AGE_S, LostLinkBehaviour, MotionModel, VehicleState
from tui_gcs.core.guard.permission import STATION, SetpointPermission, StopReason, Verdict
from tui_gcs.core.motion.course import STILL, Course, PositionTarget, stopping_point
from tui_gcs.core.motion.cruise import Cruise
from tui_gcs.core.motion.lead_compensation import LeadCompensatedCourse
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.motion.tracking_error import TrackingMonitor, reference_when
from tui_gcs.core.protocol.common import EventClass, Freshness, KeepOut, Phase, Vec3
from tui_gcs.core.records.event_log import ALERT, WARNING
from tui_gcs.core.uplink.actions import VehicleAction

AT_REST_M_S = 1.0
"""A braking vehicle slower than this is treated as standing."""
MIN_HOVER_M = 2.5
"""No vehicle is held lower: a copter that is sent to 0 m sits on the ground with its motors running."""
MIN_GAP_SHARE = 0.9
"""Smallest gap after a late set-point, as a share of the normal one. The guard refuses less than 80 of 100 ms."""
JUDGE_GAP_S = 0.2
"""A new course is judged at once, and the same one again after this time: the guard predicts 5 s ahead."""
STAND_GAP_S = 0.2
"""Period at which a position target is repeated. A firmware for which one message is enough sends it once."""

VETO_REPEAT_S = 60.0
"""Longest interval between the reports of a veto that goes on: they must not push other events off the screen."""
BRAKING_S = 4.0
"""After a nudge ended its brake goes over every path for this long: from 8 m/s at 2.5 m/s² it takes 3.2 s."""
REACH_SHARE = 2.0
"""Vehicles farther apart than both fly in so many times the guard's prediction are left out of it: what is known of
each may be 3 s old, and a position is uncertain by half of that way."""
GUARD = "guard"
"""Who ordered the brake after a veto."""
_PLACE = re.compile(r"\(-?[0-9.]+, -?[0-9.]+\)")
_AMOUNT = re.compile(r"-?[0-9.]+ (m/s|m|s)\b")

Steered = tuple[Flight, Course, Vehicle]
"""A flight, the course to judge, and its vehicle."""


class Steering:
    """Turns courses into set-points, judged by the guard."""

    def __init__(self, services: FlightServices) -> None:
        self._fleet, self._flights, self._guard = services.fleet, services.flights, services.guard
        self._firmware, self._commands = services.firmware, services.commands
        self._events, self._clock = services.events, services.clock
        self.lost_link_behaviour: Callable[[Vehicle, Vec3], LostLinkBehaviour | None] = lambda vehicle, home_m: None
        """What a vehicle, with its home there, does by itself when it hears nothing."""
        self.own_limits: Callable[[int], OwnLimits] = lambda vehicle: OwnLimits()
        """What a vehicle flies at most by its own parameters, whatever it is asked for."""
        self.vetoed_on_slot = 0
        """Set-points refused for vehicles that were on their slot: a planner fault."""

    def tick(self) -> None:
        """Judge and send every set-point that is due."""
        now = self._clock.now()
        # A take-off that has a course regains its layer in the air.
        steered = self._flights.in_phase(Phase.FLYING, Phase.BY_HAND, Phase.TAKEOFF)
        due = [f for f in steered if f.course is not None and now >= f.next_setpoint_s - 1e-9]
        if not due:
            return
        fresh: list[Steered] = []
        for flight in due:
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if vehicle is None or flight.course is None:
                continue
            if vehicle.freshness(now) is Freshness.OK:
                fresh.append((flight, flight.course, vehicle))
            else:
                # Nothing is sent: it follows its own failsafe, which was shown before the start.
                text = "no position for 3 s: no set-points"
                self._events.report(EventClass.SENSOR, f"vehicle {vehicle.id}", text, ALERT, every_s=5)
        for flight, course, vehicle in fresh:
            self._measure(flight, course, vehicle, now)
        verdicts = self._judge(fresh, now)
        for flight, course, vehicle in fresh:
            self._steer(flight, course, vehicle, verdicts.get(vehicle.id))

    def _judge(self, fresh: list[Steered], now: float) -> dict[int, Verdict]:
        """The guard's verdicts, by vehicle, on courses that are new or were judged some time ago."""
        due = [
            (flight, course, vehicle)
            for flight, course, vehicle in fresh
            if flight.passed is not course or now - flight.passed_s >= JUDGE_GAP_S - 1e-9
        ]
        if not due:
            return {}
        states = [self._state(vehicle, MotionModel.FOLLOWS, course, now) for _, course, vehicle in due]
        sent = [sent_reference(flight, course) for flight, course, _ in due]
        # Plans of 20 teams come in different ticks: each time only those near one team are predicted, not all 250.
        near = near_to([state.position_m for state in states], self._guard, now)
        verdicts = self._guard.judge(states, sent, self.known(now, near), now)
        return {vehicle.id: verdict for (*_, vehicle), verdict in zip(due, verdicts, strict=True)}

    def known(self, now: float, counts: Callable[[Vehicle], bool] = lambda vehicle: True) -> list[VehicleState]:
        """The state of every vehicle in the air that `counts`, in a team or not, as the guard sees it."""
        states = []
        for vehicle in self._fleet.vehicles.values():
            if vehicle.telemetry.airborne and vehicle.telemetry.has_position() and counts(vehicle):
                flight = self._flights.get(vehicle.id)
                motion, course = flight.motion() if flight is not None else (MotionModel.DRIFTS, None)
                states.append(self._state(vehicle, motion, course, now))
        return states

    def keep_out(self) -> tuple[KeepOut, ...]:
        """Where lost vehicles may be by now or later; others should not fly there."""
        now = self._clock.now()
        silent = self.known(now, lambda vehicle: now - vehicle.telemetry.position_s >= LOST_AGE_S)
        return keep_out(silent, self._guard.limits)

    def _state(self, vehicle: Vehicle, motion: MotionModel, course: Course | None, now: float) -> VehicleState:
        flight = self._flights.get(vehicle.id)
        state = VehicleState(
            vehicle.id,
            vehicle.telemetry.position_m,
            vehicle.telemetry.velocity_m_s,
            motion,
            course,
            age_s=now - vehicle.telemetry.position_s,
            error_m=error_m(vehicle),
            in_column=flight is not None and flight.in_own_column(vehicle),
            goal_m=flight.last_goal_m if flight is not None else None,
        )
        home = self._flights.home_m(vehicle)
        return (
            replace(state, lost_link_behaviour=self.lost_link_behaviour(vehicle, home))
            if state.is_lost and home is not None
            else state
        )

    def hold(self, vehicle: Vehicle, *, by: str = STATION, ordered: bool = True) -> None:
        """Stop a vehicle at once; see `hold_action`."""
        self._commands.submit(self.hold_action(vehicle, by=by, ordered=ordered))

    def hold_action(self, vehicle: Vehicle, *, by: str = STATION, ordered: bool = True) -> VehicleAction:
        """What stops a vehicle and is repeated until telemetry shows it at rest. A hold is never judged.

        `by` ordered it, for the journal. With `ordered` False no operator asked for it: it is then not sent while the
        vehicle's own failsafe flies it.
        """
        flight, firmware = self._flights.get(vehicle.id), self._firmware.of(vehicle)
        if flight is not None:
            flight.limited_m_s = math.nan
        action = firmware.hold(vehicle, self._stop_places(vehicle))
        action.by = by
        if not ordered:
            send_copy = action.send

            # Asked before every copy: a failsafe may begin while the hold is being repeated.
            def send_unless_in_failsafe(copy: int) -> None:
                if not firmware.acts_by_itself(vehicle):
                    send_copy(copy)

            action.send = send_unless_in_failsafe
        return action

    def blocked(
        self, flight: Flight, vehicle: Vehicle, counts: Callable[[Vehicle], bool] = lambda vehicle: True
    ) -> str:
        """What is in the way of the flight's course, in the guard's words, or "".

        Only vehicles that `counts` are looked at.
        """
        now = self._clock.now()
        me = self._state(vehicle, MotionModel.FOLLOWS, flight.course, now)
        # All of 250 that return look at all others twice a second.
        near = near_to([me.position_m], self._guard, now)
        return self._guard.separation(me, self.known(now, lambda other: near(other) and counts(other)), now).text

    def bypass_columns(
        self, vehicle: Vehicle, here_m: Vec3, layer_m: float, home_m: Vec3, taken_m: list[tuple[float, float]]
    ) -> list[Vec3]:
        """Free columns beside a vehicle (see `guard.bypass`).

        The straight way there stays inside the operating area.
        """
        others = [state for state in self.known(self._clock.now()) if state.id != vehicle.id]
        places = bypass_columns(here_m, layer_m, home_m[:2], others, taken_m, self._guard.limits)
        return [place for place in places if self._guard.is_way_inside(here_m, place)]

    def way_home(self, vehicle: Vehicle, home_m: Vec3) -> list[tuple[float, float]]:
        """Turning points of the shortest way home inside the operating area and around no-fly zones."""
        return route(self._guard.allowed, vehicle.telemetry.position_m[:2], home_m[:2])

    def passes(self, home_m: Vec3, way_m: list[tuple[float, float]]) -> bool:
        """Whether a vehicle on that way comes too near to one that lands at `home_m`."""
        gap_m = self._guard.limits.separation_horizontal_m + COLUMN_M
        return bool(LineString(way_m).distance(Point(home_m[:2])) < gap_m)

    @property
    def ceiling_m(self) -> float:
        """The greatest height in the operating area."""
        return self._guard.area.alt_max_m

    def off_course_m(self, vehicles: Iterable[int]) -> float:
        """How far beside a moving course the worst of these vehicles may be."""
        return self._firmware.off_course_m(vehicles)

    def stop_place(self, vehicle: Vehicle) -> Vec3:
        """Where `vehicle` comes to rest when it brakes now."""
        return stopping_point(
            vehicle.telemetry.position_m, vehicle.telemetry.velocity_m_s, self._guard.limits_of(vehicle.id).accel_m_s2
        )

    def _stop_places(self, vehicle: Vehicle) -> Callable[[], Vec3]:
        """A function that returns the stopping point while the vehicle moves, and the last one from then on."""
        places = [self.stop_place(vehicle)]

        def where() -> Vec3:
            if math.hypot(*vehicle.telemetry.velocity_m_s) > AT_REST_M_S:
                places[0] = self.stop_place(vehicle)
            x, y, z = places[0]
            return x, y, max(z, MIN_HOVER_M)

        return where

    def slot_error_m(self, flight: Flight, vehicle: Vehicle) -> float:
        """Distance from where the course wanted it when its newest position came.

        NaN without a course or a position.
        """
        if flight.course is None or flight.roams or not vehicle.telemetry.has_position():
            return math.nan
        telemetry, tracking = vehicle.telemetry, flight.tracking
        # Nearly always the steering has just compared this position with this course.
        if tracking is not None and tracking.compared is flight.course and tracking.compared_s == telemetry.position_s:
            return tracking.off_m
        return math.dist(reference_when(flight.course, telemetry.position_s)[0], telemetry.position_m)

    def _measure(self, flight: Flight, course: Course, vehicle: Vehicle, now: float) -> None:
        """Update the tracking error; a vehicle that does not follow at all raises an alert."""
        if flight.tracking is None:
            flight.tracking = TrackingMonitor(self._firmware.of(vehicle).lead)
        flight.tracking.update(course, vehicle)
        if flight.tracking.ignores(course, vehicle, now) and not flight.vetoed:
            text = "stands still although it is ordered to move: outside of its fence, or in a mode without set-points?"
            self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, ALERT, every_s=10)

    def _steer(self, flight: Flight, course: Course, vehicle: Vehicle, verdict: Verdict | None) -> None:
        """Send the set-point of one vehicle. A vetoed one brakes.

        `verdict` is None if the course was judged just before.
        """
        now = self._clock.now()
        firmware = self._firmware.of(vehicle)
        gap_s = STAND_GAP_S if isinstance(course, PositionTarget) else firmware.setpoint_gap_s
        flight.next_setpoint_s = next_due_s(flight.next_setpoint_s, now, gap_s)
        if verdict is not None:
            flight.passed, flight.passed_s, flight.verdict = (course, now, verdict) if verdict.ok else (None, now, None)
            if not verdict.ok:
                self._brake_for_veto(flight, vehicle, verdict.text)
                return
            flight.vetoed = ""
        if flight.verdict is None:
            return
        permission = _permission_of(flight, course, flight.verdict, now)
        # A hold of a veto or of a change of round may still be repeating: it would fight the new course.
        self._commands.cancel(vehicle.id, "hold")
        sent = sent_reference(flight, course)
        point, velocity = sent.at(now)
        if isinstance(course, PositionTarget):
            firmware.go_to(vehicle, point, course.speed_m_s, permission, anew=flight.limited_m_s != course.speed_m_s)
        else:
            firmware.follow(
                vehicle,
                point,
                velocity,
                permission,
                sent.feed_forward(now) if isinstance(sent, LeadCompensatedCourse) else STILL,
            )
        flight.limited_m_s = course.speed_m_s if isinstance(course, PositionTarget) else math.nan

    def _brake_for_veto(self, flight: Flight, vehicle: Vehicle, why: str) -> None:
        if flight.joined:
            self.vetoed_on_slot += 1
        if self._firmware.of(vehicle).acts_by_itself(vehicle):
            # It holds by its own failsafe, which a hold of ours would end, as a pilot's sticks do.
            flight.vetoed = ""
        else:
            if not flight.vetoed:
                self.hold(vehicle, by=GUARD, ordered=False)
            flight.vetoed = why
        if isinstance(flight.course, Orbit):
            # An orbit is flown by the clock: it would go round without the vehicle for ever.
            flight.course = flight.course.anew(
                self._clock.now(), vehicle.telemetry.velocity_m_s, self.stop_place(vehicle)
            )
        text = f"guard veto, holding: {why}"
        # Places and amounts differ in every text of one veto: without them the events are merged.
        same = _PLACE.sub("", _AMOUNT.sub("", text))
        source = f"vehicle {vehicle.id}"
        self._events.report(EventClass.PLANNER, source, text, WARNING, every_s=5, same=same, seldom_s=VETO_REPEAT_S)


def near_to(places_m: Sequence[Vec3], guard: Guard, now: float) -> Callable[[Vehicle], bool]:
    """A function that tells which vehicles could meet one of those at these places while the guard looks ahead.

    Predictions cost time: vehicles out of reach are left out, before their states are made. Where a silent one is by
    now is not known: it is never left out.
    """
    speed_m_s, reach_s = guard.limits.speed_m_s, REACH_SHARE * guard.looks_ahead_s
    spare_m = 2.0 * guard.limits.separation_horizontal_m  # of slow ones the limit is more than their way
    west, east = min(x for x, _, _ in places_m), max(x for x, _, _ in places_m)
    south, north = min(y for _, y, _ in places_m), max(y for _, y, _ in places_m)
    if not math.isfinite(west + east + south + north):
        return lambda other: True

    def is_near(other: Vehicle) -> bool:
        telemetry = other.telemetry
        if now - telemetry.position_s >= LOST_AGE_S:
            return True
        x, y, _ = telemetry.position_m
        away_m = math.hypot(max(west - x, 0.0, x - east), max(south - y, 0.0, y - north))
        fastest_m_s = max(speed_m_s, telemetry.ground_speed_m_s)  # one that a pilot flies may be above the limit
        return not away_m > reach_s * (speed_m_s + fastest_m_s) + spare_m + error_m(other)

    return is_near


def sent_reference(flight: Flight, course: Course) -> Course | LeadCompensatedCourse:
    """The reference that is sent for a course: a moving one is compensated for the vehicle's lag."""
    return (
        course
        if isinstance(course, PositionTarget) or not flight.tracking
        else LeadCompensatedCourse(course, flight.tracking.lead)
    )


def _permission_of(flight: Flight, course: Course, verdict: Verdict, now: float) -> SetpointPermission:
    """The verdict on the course; but where a nudge ends, the vehicle brakes as for any stop: over every path."""
    if flight.phase is Phase.BY_HAND and isinstance(course, Cruise) and 0.0 <= now - course.end_s < BRAKING_S:
        return StopReason("brake after a nudge", flight.ordered_by)
    return verdict


def next_due_s(due_s: float, now: float, gap_s: float) -> float:
    """When the next set-point of a stream is due. Ticks may come late or early, the rate is kept.

    A pause is not made up.
    """
    # Measured on a busy machine: counted from when the last one was sent, seven or eight of ten a second were sent.
    return max(due_s + gap_s, now + MIN_GAP_SHARE * gap_s)
