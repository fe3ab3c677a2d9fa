"""Steering: streams the set-points of flying vehicles, each judged by the guard at the door.

A vetoed vehicle brakes and holds; the next good set-point lets it go on. Holds and returns are sent from here too,
but nobody judges them.
"""

import math
from collections.abc import Callable

from tui_gcs.core.clock import Clock
from tui_gcs.core.course import Course, Stand, stopping_point
from tui_gcs.core.events import ALERT, WARNING, EventLog
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.fleet import Fleet
from tui_gcs.core.flights import Flight, FlightBook
from tui_gcs.core.guard import Guard, Mover
from tui_gcs.core.messages import EventClass, Freshness, Phase, Vec3
from tui_gcs.core.route import route
from tui_gcs.core.services.command import CommandService
from tui_gcs.core.vehicle import Vehicle

STANDS_M_S = 1.0
"""Slower than this a vehicle that brakes is as good as there."""
LEAST_HOVER_M = 2.5
"""Nobody is held lower: a copter told to stay at 0 m sits on the ground with its motors running."""
SETPOINT_GAP_S = 0.2
"""5 Hz: ArduCopter needs one within 3 s, PX4 two a second; a patrol slot moves 1.6 m between two."""


class Steering:
    """Turns courses into set-points."""

    def __init__(
        self,
        fleet: Fleet,
        book: FlightBook,
        guard: Guard,
        firmware: ArduCopter,
        commands: CommandService,
        events: EventLog,
        clock: Clock,
    ) -> None:
        """Wire it up."""
        self._fleet = fleet
        self._book = book
        self._guard = guard
        self._firmware = firmware
        self._commands = commands
        self._events = events
        self._clock = clock
        self.vetoed_on_slot = 0
        """Set-points refused for vehicles that were on their slot: a planner fault."""

    def tick(self) -> None:
        """Send every set-point that is due."""
        now = self._clock.now()
        # A take-off that has a course regains its layer in the air.
        steered = self._book.in_phase(Phase.FLYING, Phase.TAKEOFF)
        due = [f for f in steered if f.course is not None and now >= f.next_setpoint_s - 1e-9]
        if not due:
            return
        movers = self._movers(now)
        for flight in due:
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            if vehicle is None or flight.course is None:
                continue
            if vehicle.freshness(now) is Freshness.OK:
                self._steer(flight, flight.course, vehicle, movers)
            else:  # nobody knows where it is: without set-points it brakes by itself after 3 s
                text = "no position for 3 s: no set-points"
                self._events.say(EventClass.SENSOR, f"vehicle {vehicle.id}", text, ALERT, every_s=5)

    def _movers(self, now: float) -> list[Mover]:
        """Everybody in the air, in a team or not, as the guard sees them."""
        movers = []
        for vehicle in self._fleet.vehicles.values():
            if vehicle.airborne and vehicle.has_position():
                flight = self._book.get(vehicle.id) or Flight(vehicle.id, "", 0.0, Phase.TAKEN_OUT)
                movers.append(flight.mover(vehicle, now))
        return movers

    def hold(self, vehicle: Vehicle) -> None:
        """Stop it, and see to it that it stops. Never judged."""
        flight = self._book.get(vehicle.id)
        if flight is not None:
            flight.limited = False
        self._commands.submit(self._firmware.hold(vehicle, self._stop_places(vehicle)))

    def blocked(self, flight: Flight, vehicle: Vehicle) -> str:
        """Who is in the way of the flight's course, or ""."""
        now = self._clock.now()
        return self._guard.separation(flight.mover(vehicle, now), self._movers(now)).text

    def way_home(self, vehicle: Vehicle, home_m: Vec3) -> list[tuple[float, float]]:
        """Turning points of the shortest way home inside the operating area and around no-fly zones."""
        return route(self._guard.allowed, vehicle.position_m[:2], home_m[:2])

    def stop_place(self, vehicle: Vehicle) -> Vec3:
        """Where `vehicle` comes to rest when it brakes now."""
        return stopping_point(vehicle.position_m, vehicle.velocity_m_s, self._guard.limits.accel_m_s2)

    def _stop_places(self, vehicle: Vehicle) -> Callable[[], Vec3]:
        """Gives the stopping point as long as the vehicle moves; then the last one, so that it stays there."""
        places = [self.stop_place(vehicle)]

        def where() -> Vec3:
            if math.hypot(*vehicle.velocity_m_s) > STANDS_M_S:
                places[0] = self.stop_place(vehicle)
            x, y, z = places[0]
            return x, y, max(z, LEAST_HOVER_M)

        return where

    def slot_error_m(self, flight: Flight, vehicle: Vehicle) -> float:
        """Distance from where the course wants it now; NaN without a course."""
        if flight.course is None or not vehicle.has_position():
            return math.nan
        return math.dist(flight.course.at(self._clock.now())[0], vehicle.position_m)

    def _steer(self, flight: Flight, course: Course, vehicle: Vehicle, movers: list[Mover]) -> None:
        now = self._clock.now()
        flight.next_setpoint_s = now + SETPOINT_GAP_S
        verdict = self._guard.judge(flight.mover(vehicle, now), course, movers, now)
        if not verdict.ok:
            self._brake_for_veto(flight, vehicle, verdict.text)
            return
        flight.vetoed = ""
        self._commands.cancel(vehicle.id, "hold")  # of a veto or a change of round: it would fight the new course
        point, velocity = course.at(now)
        if isinstance(course, Stand):
            self._firmware.position(vehicle.id, point)
            if not flight.limited:  # ArduCopter takes its own speed again whenever it begins to fly to a place
                self._commands.submit(self._firmware.speed(vehicle.id, course.speed_m_s))
        else:
            self._firmware.moving(vehicle.id, point, velocity)
        flight.limited = isinstance(course, Stand)

    def _brake_for_veto(self, flight: Flight, vehicle: Vehicle, why: str) -> None:
        if flight.joined:
            self.vetoed_on_slot += 1
        if not flight.vetoed:
            self.hold(vehicle)
        flight.vetoed = why
        text = f"guard veto, holding: {why}"
        self._events.say(EventClass.PLANNER, f"vehicle {vehicle.id}", text, WARNING, every_s=5)
