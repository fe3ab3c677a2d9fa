"""The way home: each on its layer to above its take-off place; nobody descends before all are there, then in turn."""

import math

from tui_gcs.core.clock import Clock
from tui_gcs.core.course import Course, Stand
from tui_gcs.core.events import ALERT, WARNING, EventLog
from tui_gcs.core.firmware.registry import Firmwares
from tui_gcs.core.fleet import Fleet
from tui_gcs.core.flights import Flight, FlightBook
from tui_gcs.core.messages import EventClass, Phase, Vec3, VehicleResult
from tui_gcs.core.services.command import CommandService
from tui_gcs.core.steering import Steering
from tui_gcs.core.vehicle import Vehicle

LAYER_TOLERANCE_M = 1.0
OVER_HOME_M = 1.5
OVER_HOME_SPEED_M_S = 0.7
LANDING_GAP_S = 2.0
RETURN_WAIT_S = 240.0
"""Vehicles above their homes wait at most this long for one that does not come."""
STUCK_S = 15.0
"""A returning vehicle that does not move for this long is told."""
TARGET_GAP_S = 1.0
"""Return targets are said again this often."""


class Homing:
    """Moves returning flights on; the executive says which."""

    def __init__(
        self,
        fleet: Fleet,
        book: FlightBook,
        firmware: Firmwares,
        commands: CommandService,
        steering: Steering,
        events: EventLog,
        clock: Clock,
        speed_m_s: float,
    ) -> None:
        """`speed_m_s` limits flights to a place."""
        self.speed_m_s = speed_m_s
        self._fleet = fleet
        self._book = book
        self._firmware = firmware
        self._commands = commands
        self._steering = steering
        self._events = events
        self._clock = clock
        self._next_target_s: dict[int, float] = {}
        self._last_landing_s = -math.inf

    def begin(self, flight: Flight, vehicle: Vehicle, now: float) -> VehicleResult:
        """Bring one home that is in the air."""
        home = flight.home_m or vehicle.home_m
        if not vehicle.airborne or home is None:
            return VehicleResult(vehicle=vehicle.id, ok=False, text="is not in the air" if home else "has no home")
        flight.home_m = home
        self._commands.cancel(vehicle.id)
        if (order := self._firmware.of(vehicle).engage(vehicle)) is not None:
            self._commands.submit(order)
        flight.enter(Phase.RETURNING, now, "layer")
        x, y, z = self._steering.stop_place(vehicle)
        if self._is_near(vehicle, home[:2]):  # above its home already: only down, not up to its layer first
            flight.go_to_step("over home", now)
            flight.course = self._stand((x, y, z))
        else:
            flight.course = self._stand((x, y, flight.layer_m))
        self._next_target_s[vehicle.id] = now
        return VehicleResult(vehicle=vehicle.id, ok=True, text="returns")

    def follow(self, flight: Flight, vehicle: Vehicle, now: float) -> None:
        """To its layer, then above home, then wait for its turn."""
        home = flight.home_m
        if home is None or flight.course is None:
            return
        if flight.step == "layer" and abs(vehicle.alt_rel_m - flight.layer_m) <= LAYER_TOLERANCE_M:
            flight.go_to_step("home", now)
            flight.way_m = self._steering.way_home(vehicle, home)
            self._fly_leg(flight, vehicle, now, anew=True)
        elif flight.step == "home" and len(flight.way_m) > 1 and self._is_near(vehicle, flight.way_m[0]):
            del flight.way_m[0]
            flight.since_s = now
            self._fly_leg(flight, vehicle, now, anew=False)
        elif flight.step == "home" and self._is_over_home(flight, vehicle, home):
            flight.go_to_step("over home", now)
        if now >= self._next_target_s.get(flight.vehicle, 0.0):
            self._next_target_s[flight.vehicle] = now + TARGET_GAP_S
            target = self._return_target(flight, flight.course, vehicle, now)
            self._firmware.of(vehicle).go_to(vehicle, target, self.speed_m_s, anew=False)
            if (
                flight.step != "over home"
                and now - flight.since_s > STUCK_S
                and math.hypot(*vehicle.velocity_m_s) < 0.3
            ):
                text = f"does not return: stands still for {STUCK_S:.0f} s"
                self._events.say(EventClass.MISSION, f"vehicle {vehicle.id}", text, ALERT, every_s=10)

    def _return_target(self, flight: Flight, course: Course, vehicle: Vehicle, now: float) -> Vec3:
        """Where to: on the way to its layer it waits for whoever is above or below it."""
        if flight.step == "layer" and (why := self._steering.blocked(flight, vehicle)):
            text = f"waits with changing its height: {why}"
            self._events.say(EventClass.MISSION, f"vehicle {vehicle.id}", text, WARNING, every_s=10)
            return self._steering.stop_place(vehicle)
        return course.at(now)[0]

    def _fly_leg(self, flight: Flight, vehicle: Vehicle, now: float, *, anew: bool) -> None:
        x, y = flight.way_m[0]
        flight.course = self._stand((x, y, flight.layer_m))
        self._next_target_s[flight.vehicle] = now + TARGET_GAP_S
        self._firmware.of(vehicle).go_to(vehicle, flight.course.point_m, self.speed_m_s, anew=anew)

    def _is_near(self, vehicle: Vehicle, place_m: tuple[float, float]) -> bool:
        return math.dist(vehicle.position_m[:2], place_m) <= OVER_HOME_M

    def _is_over_home(self, flight: Flight, vehicle: Vehicle, home: Vec3) -> bool:
        return self._is_near(vehicle, home[:2]) and vehicle.ground_speed_m_s <= OVER_HOME_SPEED_M_S

    def land_in_turn(self, now: float) -> None:
        """When every returning vehicle is above its home, they land, lowest layer first, one every few seconds.

        One that does not get there (it was told about) is waited for only so long.
        """
        returning = self._book.in_phase(Phase.RETURNING)
        there = [flight for flight in returning if flight.step == "over home"]
        if any(f.step != "over home" and now - f.since_s < RETURN_WAIT_S for f in returning):
            return
        if not there or now - self._last_landing_s < LANDING_GAP_S:
            return
        self._last_landing_s = now
        flight = min(there, key=lambda f: f.layer_m)
        flight.enter(Phase.LANDING, now)
        vehicle = self._fleet.vehicles[flight.vehicle]
        self._commands.submit(self._firmware.of(vehicle).land(vehicle))

    def _stand(self, point_m: Vec3) -> Stand:
        return Stand(point_m, self.speed_m_s)
