"""Return home: each vehicle flies on its layer to above its take-off place; then they land one after the other.

No vehicle descends before all of its group have arrived; groups land at the same time. On the way to its layer a
vehicle waits for others above or below it. Where the other one stays, for it may wait as well, or hold, the vehicle
goes to a bypass column and changes its height there.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight, ReturnStep
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.guard.permission import STATION, StopReason
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.protocol.common import EventClass, Phase, Vec3, VehicleResult
from tui_gcs.core.records.event_log import ALERT, WARNING

LAYER_TOLERANCE_M = 1.0
"""A vehicle whose height differs by at most this from that of its layer is on it."""
OVER_HOME_M = 1.5
"""A vehicle is above a place at most this far beside it, ..."""
OVER_HOME_SPEED_M_S = 0.7
"""... and this fast: a faster one would land beside it."""
LANDING_GAP_S = 2.0
"""Time from the beginning of one landing of a group to the next."""
RETURN_WAIT_S = 240.0
"""Vehicles above their homes wait at most this long for one that does not come."""
# Flown: three real ArduCopters above their homes, at 0 %, waiting for one with a weak motor.
LAND_NOW_PCT = 15.0
"""With less battery left a vehicle above its home lands without waiting, unless others pass below it."""
STUCK_S = 15.0
"""A returning vehicle that does not move for this long raises an alert."""
BYPASS_AFTER_S = 5.0
"""A vehicle that has waited this long goes to a bypass column. By then those that only pass have passed."""
RETURN = "return"
"""Name of the stop reason with which the change of mode and the targets of a return are sent."""
TARGET_GAP_S = 0.5
"""Return targets are sent again, and the way is checked for other vehicles, this often: the guard predicts as far
ahead."""


class ReturnController:
    """Moves returning flights on; the executive decides which vehicles return."""

    def __init__(self, services: FlightServices, steering: Steering, speed_m_s: float) -> None:
        """`speed_m_s` limits flights to a place."""
        self.speed_m_s = speed_m_s
        self.lift_m: Callable[[int], float] = lambda vehicle: 0.0
        """How much lower than it reports a vehicle may be."""
        self._fleet, self._flights, self._firmware = services.fleet, services.flights, services.firmware
        self._commands, self._events, self._clock = services.commands, services.events, services.clock
        self._steering, self._guard = steering, services.guard
        self._next_target_s: dict[int, float] = {}
        self._waits_s: dict[int, float] = {}
        """Since when each waiting vehicle has had another one in its way."""
        self._last_landing_s: dict[int, float] = {}
        """When the last landing of each group began."""

    def begin(self, flight: Flight, vehicle: Vehicle, now: float, by: str = STATION) -> VehicleResult:
        """Start the return of a vehicle in the air, as `by` orders; the result has the reason if it cannot return."""
        home = flight.home_m or vehicle.telemetry.home_m
        if not vehicle.telemetry.airborne or home is None:
            return VehicleResult(vehicle=vehicle.id, ok=False, text="is not in the air" if home else "has no home")
        flight.home_m = home
        flight.lift_m = self._lift_m(flight)
        self._commands.cancel(vehicle.id)
        if (order := self._firmware.of(vehicle).engage(vehicle)) is not None:
            order.stop = StopReason(RETURN, by)
            self._commands.submit(order)
        flight.enter(Phase.RETURNING, now, ReturnStep.TO_LAYER)
        flight.ordered_by = by
        x, y, z = self._steering.stop_place(vehicle)
        if self._is_near(vehicle, home[:2]):  # above its home already: only down, not up to its layer first
            flight.go_to_step(ReturnStep.OVER_HOME, now)
            flight.course = self._stand((x, y, z))
        else:
            flight.course = self._stand((x, y, flight.home_layer_m))
        self._next_target_s[vehicle.id] = now
        self._waits_s.pop(vehicle.id, None)
        text = f"returns {flight.lift_m:.0f} m above its layer: its height is in doubt" if flight.lift_m else "returns"
        return VehicleResult(vehicle=vehicle.id, ok=True, text=text)

    def _lift_m(self, flight: Flight) -> float:
        """How much above its layer it returns.

        Its true height is then at least that of the layer, as far as the area allows.
        """
        return max(0.0, min(self.lift_m(flight.vehicle), self._steering.ceiling_m - flight.layer_m))

    def follow(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """Move one return on: to the layer, by a bypass column if need be, then above home, where it waits to land."""
        home, anew = flight.home_m, False
        if home is None or flight.course is None:
            return
        if (
            flight.step is ReturnStep.TO_LAYER
            and abs(vehicle.telemetry.alt_rel_m - flight.home_layer_m) <= LAYER_TOLERANCE_M
        ):
            flight.go_to_step(ReturnStep.TO_HOME, now)
            flight.route_m = self._steering.way_home(vehicle, home)
            self._begin_leg(flight, now)
            anew = True
        elif flight.step is ReturnStep.BYPASS and self._is_over(vehicle, flight.course.at(now)[0]):
            flight.go_to_step(ReturnStep.TO_LAYER, now)
            x, y, _ = flight.course.at(now)[0]
            flight.course = self._stand((x, y, flight.home_layer_m))
        elif (
            flight.step is ReturnStep.TO_HOME and len(flight.route_m) > 1 and self._is_near(vehicle, flight.route_m[0])
        ):
            del flight.route_m[0]
            flight.since_s = now
            self._begin_leg(flight, now)
        elif flight.step is ReturnStep.TO_HOME and self._is_over(vehicle, home):
            flight.go_to_step(ReturnStep.OVER_HOME, now)
        if now >= self._next_target_s.get(flight.vehicle, 0.0):
            self._next_target_s[flight.vehicle] = now + TARGET_GAP_S
            target = self._return_target(flight, vehicle, home, now)
            reason = StopReason(RETURN, flight.ordered_by)
            speed_m_s = min(self.speed_m_s, self._guard.limits_of(vehicle.id).speed_m_s)
            self._firmware.of(vehicle).go_to(vehicle, target, speed_m_s, reason, anew=anew)
            if (
                flight.step is not ReturnStep.OVER_HOME
                and now - flight.since_s > STUCK_S
                and math.hypot(*vehicle.telemetry.velocity_m_s) < 0.3
            ):
                text = f"does not return: stands still for {STUCK_S:.0f} s"
                self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, ALERT, every_s=10)

    def _return_target(self, flight: Flight, vehicle: Vehicle, home: Vec3, now: float) -> Vec3:
        """Where to fly now. The vehicle waits while another is in its way, and bypasses one that stays there."""
        course = flight.course if flight.course is not None else self._stand(self._steering.stop_place(vehicle))
        why = "" if flight.step is ReturnStep.OVER_HOME else self._blocked_by(flight, vehicle)
        if not why:
            self._waits_s.pop(flight.vehicle, None)
            return course.at(now)[0]
        since_s = self._waits_s.setdefault(flight.vehicle, now)
        text = f"waits on its way home: {why}"
        if now - since_s >= BYPASS_AFTER_S:
            place = self._bypass_place(flight, vehicle, home)
            if place is not None:
                self._waits_s.pop(flight.vehicle)
                flight.go_to_step(ReturnStep.BYPASS, now)
                flight.course = self._stand(place)
                text = f"goes aside on its way home: {why}"
                self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, WARNING)
                return place
            text += "; there is no free place beside it: move the other one, or land"
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, WARNING, every_s=10)
        return self._steering.stop_place(vehicle)

    def _blocked_by(self, flight: Flight, vehicle: Vehicle) -> str:
        """Which vehicle is in the way, in words, or ""."""
        # On its way up or down to its layer all vehicles count. On the layer those on layers of their own do not.
        if flight.step is not ReturnStep.TO_HOME:
            return self._steering.blocked(flight, vehicle)
        return self._steering.blocked(flight, vehicle, lambda other: not self._is_on_another_layer(other, flight))

    def _is_on_another_layer(self, vehicle: Vehicle, than: Flight) -> bool:
        """Whether it is in its own column, or on a layer that is not that of the flight `than`."""
        flight = self._flights.get(vehicle.id)
        if flight is None:
            return False
        if flight.in_own_column(vehicle):
            return True
        shares = flight is not than and abs(flight.layer_m - than.layer_m) <= LAYER_TOLERANCE_M
        return not shares and abs(vehicle.telemetry.alt_rel_m - flight.layer_m) <= LAYER_TOLERANCE_M

    def _bypass_place(self, flight: Flight, vehicle: Vehicle, home: Vec3) -> Vec3 | None:
        """A place beside from which it can get to its layer, and which it can reach; None if there is none."""
        taken = [
            other.course.at(self._clock.now())[0][:2]
            for other in self._flights.in_phase(Phase.RETURNING)
            if other is not flight
            and other.course is not None
            and other.step in (ReturnStep.BYPASS, ReturnStep.TO_LAYER)
        ]
        here = self._steering.stop_place(vehicle)
        for place in self._steering.bypass_columns(vehicle, here, flight.home_layer_m, home, taken):
            if not self._steering.blocked(replace(flight, course=self._stand(place)), vehicle):
                return place
        return None

    def _begin_leg(self, flight: Flight, now: float) -> None:
        """Set the course to the next turning point; the target is sent at once if the way is clear."""
        x, y = flight.route_m[0]
        flight.course = self._stand((x, y, flight.home_layer_m))
        self._next_target_s[flight.vehicle] = now

    def _is_near(self, vehicle: Vehicle, place_m: tuple[float, float]) -> bool:
        return math.dist(vehicle.telemetry.position_m[:2], place_m) <= OVER_HOME_M

    def _is_over(self, vehicle: Vehicle, place_m: Vec3) -> bool:
        return self._is_near(vehicle, place_m[:2]) and vehicle.telemetry.ground_speed_m_s <= OVER_HOME_SPEED_M_S

    def land_in_turn(self, now: float) -> None:
        """Land the vehicles above their homes when all of their group have arrived.

        In each group the lowest layer comes first, one every few seconds. A vehicle that does not arrive (an alert has
        named it) is waited for only so long, and not with an empty battery.
        """
        returning = self._flights.in_phase(Phase.RETURNING)
        for group in sorted({flight.group for flight in returning}):
            self._land_next(group, [flight for flight in returning if flight.group == group], now)

    def _land_next(self, group: int, returning: list[Flight], now: float) -> None:
        """Begin the next landing of a group, if it is time."""
        there = [flight for flight in returning if flight.step is ReturnStep.OVER_HOME]
        coming = [f for f in returning if f.step is not ReturnStep.OVER_HOME]
        # Vehicles descend through the layers below: they wait until those are free.
        if any(now - f.since_s < RETURN_WAIT_S for f in coming):
            there = [flight for flight in there if self._must_land_now(flight, coming)]
        if not there or now - self._last_landing_s.get(group, -math.inf) < LANDING_GAP_S:
            return
        self._last_landing_s[group] = now
        flight = min(there, key=lambda f: f.layer_m)
        flight.enter(Phase.LANDING, now)
        vehicle = self._fleet.vehicles[flight.vehicle]
        landing = self._firmware.of(vehicle).land(vehicle)
        landing.by = flight.ordered_by
        self._commands.submit(landing)

    def _must_land_now(self, flight: Flight, coming: list[Flight]) -> bool:
        """Whether its battery is nearly empty and no vehicle still on its way home passes below it."""
        own = self._fleet.vehicles[flight.vehicle]
        charge_pct = own.telemetry.battery_pct
        if flight.home_m is None or not charge_pct < LAND_NOW_PCT:
            return False
        for other in coming:
            vehicle, home = self._fleet.vehicles[other.vehicle], other.home_m
            if (
                other.layer_m > flight.layer_m
                and vehicle.telemetry.alt_rel_m > own.telemetry.alt_rel_m + LAYER_TOLERANCE_M
            ):
                continue  # above it, and stays there
            if home is None or not vehicle.telemetry.has_position():
                return False
            ahead = other.route_m if other.step is ReturnStep.TO_HOME else self._steering.way_home(vehicle, home)
            if self._steering.passes(flight.home_m, [vehicle.telemetry.position_m[:2], *ahead]):
                return False
        text = f"battery at {charge_pct:.0f} %: lands before the others are above their homes"
        self._events.report(EventClass.MISSION, f"vehicle {flight.vehicle}", text, WARNING, every_s=10)
        return True

    def _stand(self, point_m: Vec3) -> PositionTarget:
        return PositionTarget(point_m, self.speed_m_s)
