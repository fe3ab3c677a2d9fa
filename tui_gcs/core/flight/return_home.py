"""The way home: each on its layer to above its take-off place; nobody descends before all are there, then in turn.

On its way to its layer a vehicle waits for whoever is above or below it. Where that one stays, for it may wait, too, or
hold, it goes aside and changes its height there.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight, ReturnStep
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.protocol.common import EventClass, Phase, Vec3, VehicleResult
from tui_gcs.core.records.event_log import ALERT, WARNING

LAYER_TOLERANCE_M = 1.0
OVER_HOME_M = 1.5
OVER_HOME_SPEED_M_S = 0.7
LANDING_GAP_S = 2.0
RETURN_WAIT_S = 240.0
"""Vehicles above their homes wait at most this long for one that does not come."""
LAND_NOW_PCT = 15.0
"""With less left in its battery nobody waits for others above its home, unless they pass there. Flown: three real
ArduCopters above their homes, at 0 %, waiting for one with a weak motor."""
STUCK_S = 15.0
"""A returning vehicle that does not move for this long is told."""
ASIDE_AFTER_S = 5.0
"""One that waits for so long goes aside. By then those who only pass have passed."""
TARGET_GAP_S = 0.5
"""Return targets are said again, and it is looked who is in the way, this often: the guard foresees as long."""


class ReturnController:
    """Moves returning flights on; the executive says which."""

    def __init__(self, services: FlightServices, steering: Steering, speed_m_s: float) -> None:
        """`speed_m_s` limits flights to a place."""
        self.speed_m_s = speed_m_s
        self.lift_m: Callable[[int], float] = lambda vehicle: 0.0
        """How much lower than it says a vehicle may be."""
        self._fleet, self._flights, self._firmware = services.fleet, services.flights, services.firmware
        self._commands, self._events, self._clock = services.commands, services.events, services.clock
        self._steering = steering
        self._next_target_s: dict[int, float] = {}
        self._waits_s: dict[int, float] = {}
        """Since when a vehicle has been waiting for somebody in its way."""
        self._last_landing_s = -math.inf

    def begin(self, flight: Flight, vehicle: Vehicle, now: float) -> VehicleResult:
        """Bring one home that is in the air."""
        home = flight.home_m or vehicle.telemetry.home_m
        if not vehicle.telemetry.airborne or home is None:
            return VehicleResult(vehicle=vehicle.id, ok=False, text="is not in the air" if home else "has no home")
        flight.home_m = home
        flight.lift_m = self._lift_m(flight)
        self._commands.cancel(vehicle.id)
        if (order := self._firmware.of(vehicle).engage(vehicle)) is not None:
            self._commands.submit(order)
        flight.enter(Phase.RETURNING, now, ReturnStep.TO_LAYER)
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
        """Who may be lower than it says keeps to its layer by the lower of the two, as far as the area allows it."""
        return max(0.0, min(self.lift_m(flight.vehicle), self._steering.ceiling_m - flight.layer_m))

    def follow(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """To its layer, aside if need be, then above home, then wait for its turn."""
        home, anew = flight.home_m, False
        if home is None or flight.course is None:
            return
        if (
            flight.step is ReturnStep.TO_LAYER
            and abs(vehicle.telemetry.alt_rel_m - flight.home_layer_m) <= LAYER_TOLERANCE_M
        ):
            flight.go_to_step(ReturnStep.TO_HOME, now)
            flight.way_m = self._steering.way_home(vehicle, home)
            self._begin_leg(flight, now)
            anew = True
        elif flight.step is ReturnStep.BYPASS and self._is_over(vehicle, flight.course.at(now)[0]):
            flight.go_to_step(ReturnStep.TO_LAYER, now)
            x, y, _ = flight.course.at(now)[0]
            flight.course = self._stand((x, y, flight.home_layer_m))
        elif flight.step is ReturnStep.TO_HOME and len(flight.way_m) > 1 and self._is_near(vehicle, flight.way_m[0]):
            del flight.way_m[0]
            flight.since_s = now
            self._begin_leg(flight, now)
        elif flight.step is ReturnStep.TO_HOME and self._is_over(vehicle, home):
            flight.go_to_step(ReturnStep.OVER_HOME, now)
        if now >= self._next_target_s.get(flight.vehicle, 0.0):
            self._next_target_s[flight.vehicle] = now + TARGET_GAP_S
            target = self._return_target(flight, vehicle, home, now)
            self._firmware.of(vehicle).go_to(vehicle, target, self.speed_m_s, anew=anew)
            if (
                flight.step is not ReturnStep.OVER_HOME
                and now - flight.since_s > STUCK_S
                and math.hypot(*vehicle.telemetry.velocity_m_s) < 0.3
            ):
                text = f"does not return: stands still for {STUCK_S:.0f} s"
                self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, ALERT, every_s=10)

    def _return_target(self, flight: Flight, vehicle: Vehicle, home: Vec3, now: float) -> Vec3:
        """Where to: it waits for whoever is in its way, and goes aside of one who stays there."""
        course = flight.course if flight.course is not None else self._stand(self._steering.stop_place(vehicle))
        why = "" if flight.step is ReturnStep.OVER_HOME else self._in_the_way(flight, vehicle)
        if not why:
            self._waits_s.pop(flight.vehicle, None)
            return course.at(now)[0]
        since_s = self._waits_s.setdefault(flight.vehicle, now)
        text = f"waits on its way home: {why}"
        if now - since_s >= ASIDE_AFTER_S:
            place = self._aside(flight, vehicle, home)
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

    def _in_the_way(self, flight: Flight, vehicle: Vehicle) -> str:
        """Who is, or "". On its layer only those are who are not on their own: all others are above or below."""
        relevant = None
        if flight.step is ReturnStep.TO_HOME:
            relevant = {v.id for v in self._fleet.vehicles.values() if not self._is_on_layer(v)}
        return self._steering.blocked(flight, vehicle, relevant)

    def _is_on_layer(self, vehicle: Vehicle) -> bool:
        flight = self._flights.get(vehicle.id)
        if flight is None:
            return False
        return flight.in_own_column(vehicle) or abs(vehicle.telemetry.alt_rel_m - flight.layer_m) <= LAYER_TOLERANCE_M

    def _aside(self, flight: Flight, vehicle: Vehicle, home: Vec3) -> Vec3 | None:
        """A place beside from where it can get to its layer, and that it can reach; None if there is none."""
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
        """Its course leads to the next turning point; it is told at once, if nobody is in the way."""
        x, y = flight.way_m[0]
        flight.course = self._stand((x, y, flight.home_layer_m))
        self._next_target_s[flight.vehicle] = now

    def _is_near(self, vehicle: Vehicle, place_m: tuple[float, float]) -> bool:
        return math.dist(vehicle.telemetry.position_m[:2], place_m) <= OVER_HOME_M

    def _is_over(self, vehicle: Vehicle, place_m: Vec3) -> bool:
        return self._is_near(vehicle, place_m[:2]) and vehicle.telemetry.ground_speed_m_s <= OVER_HOME_SPEED_M_S

    def land_in_turn(self, now: float) -> None:
        """When every returning vehicle is above its home, they land, lowest layer first, one every few seconds.

        One that does not get there (it was told about) is waited for only so long, and not with an empty battery.
        """
        returning = self._flights.in_phase(Phase.RETURNING)
        there = [flight for flight in returning if flight.step is ReturnStep.OVER_HOME]
        coming = [f for f in returning if f.step is not ReturnStep.OVER_HOME]
        if any(now - f.since_s < RETURN_WAIT_S for f in coming):
            there = [flight for flight in there if self._may_not_wait(flight, coming)]
        if not there or now - self._last_landing_s < LANDING_GAP_S:
            return
        self._last_landing_s = now
        flight = min(there, key=lambda f: f.layer_m)
        flight.enter(Phase.LANDING, now)
        vehicle = self._fleet.vehicles[flight.vehicle]
        self._commands.submit(self._firmware.of(vehicle).land(vehicle))

    def _may_not_wait(self, flight: Flight, coming: list[Flight]) -> bool:
        """Whether its battery is nearly empty, and nobody who is still on his way home passes below it."""
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
            ahead = other.way_m if other.step is ReturnStep.TO_HOME else self._steering.way_home(vehicle, home)
            if self._steering.passes(flight.home_m, [vehicle.telemetry.position_m[:2], *ahead]):
                return False
        text = f"battery at {charge_pct:.0f} %: lands before the others are above their homes"
        self._events.report(EventClass.MISSION, f"vehicle {flight.vehicle}", text, WARNING, every_s=10)
        return True

    def _stand(self, point_m: Vec3) -> PositionTarget:
        return PositionTarget(point_m, self.speed_m_s)
