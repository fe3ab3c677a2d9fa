"""Course monitor: vehicles that do not fly what this station asks of them, in a mode in which they should.

Another station may send targets to a vehicle in GUIDED or OFFBOARD, which changes no mode. Seen with a real ArduCopter:
all that its station reported was a veto, while another station flew the vehicle away at 9.7 m/s.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight, HoldStep, TakenOut
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.protocol.common import EventClass, Freshness, Phase, Vec3
from tui_gcs.core.records.event_log import WARNING

MOVES_M_S = 2.0
"""A vehicle that should hold and is faster than this does not. In wind of 4 m/s one that holds wanders by 0.6 m."""
BRAKES_S = 6.0
"""From 8 m/s braking takes 3.2 s at 2.5 m/s²; a slow link delays what shows it."""
AWAY_M = 25.0
"""A vehicle that is this much farther from its goal than it once was flies away from it. A turn at full speed alone
leads 18 m away (see `BRAKE_SHARE` of the guard)."""
BESIDE_M = 15.0
"""A vehicle that was on its path and is this far beside it is led by something else. The worst wind brought 8 m."""
ORDERED_S = 5.0
"""What a vehicle does this soon after an order of this station is taken for the effect of that."""
LEFT_S = 3.0
"""A heartbeat that shows the mission's end may come this much before the item that shows that it is over."""


@dataclass
class _Course:
    """What was seen of one vehicle under one order."""

    stopped_s: float = math.nan
    """Since when it should stand."""
    goal_m: Vec3 | None = None
    nearest_m: float = math.inf
    """The nearest that it was to `goal_m`."""


class CourseMonitor:
    """Looks at all vehicles that this station steers; `found` holds what they do that was not asked of them."""

    def __init__(self, services: FlightServices) -> None:
        self._other_stations, self._flights = services.fleet.other_stations, services.flights
        self._events, self._firmware, self._clock = services.events, services.firmware, services.clock
        self._courses: dict[int, _Course] = {}
        self._missions: dict[int, float] = {}
        """Vehicles of no team on missions that this station started, by when they were last seen to fly them."""
        self._ordered_s: dict[int, float] = {}
        """When each of these was sent on its mission."""
        self.found: dict[int, str] = {}
        """By vehicle."""

    def watch_mission(self, vehicle: int, seen_s: float = math.nan) -> None:
        """A vehicle of no team was sent on its mission; the executive watches those of teams.

        `seen_s` is when it was last seen to fly it; NaN while the order is under way.
        """
        self._missions[vehicle] = seen_s
        self._ordered_s[vehicle] = self._clock.now()
        self._flights.sent.add(vehicle)

    def look(self, vehicles: Mapping[int, Vehicle], now: float) -> dict[int, str]:
        """Bring `found` up to date and return it; to be called some times a second."""
        found = {}
        for flight in self._flights:
            vehicle = vehicles.get(flight.vehicle)
            if vehicle is None or vehicle.freshness(now) is not Freshness.OK or not vehicle.telemetry.airborne:
                self._courses.pop(flight.vehicle, None)
            elif text := self._strays(flight, vehicle, now) or self._led_on(flight, vehicle, now):
                found[vehicle.id] = text
        found |= self._off_mission(vehicles, now)
        for vehicle_id in found.keys() - self.found.keys():
            stations = self._other_stations.words(vehicles[vehicle_id], now)
            text = f"does not follow this station: {found[vehicle_id]}" + (f"; {stations}" if stations else "")
            self._events.report(EventClass.MISSION, f"vehicle {vehicle_id}", text, WARNING, every_s=5)
        self.found = found
        return found

    def _led_on(self, flight: Flight, vehicle: Vehicle, now: float) -> str:
        """What another station made a vehicle do that this one flies, or lets fly its mission; "" if nothing."""
        change = self._other_stations.change(vehicle, now)
        on_mission = flight.step is TakenOut.ON_BOARD
        ours = on_mission or flight.phase not in (Phase.GROUND, Phase.TAKEN_OUT)
        if change is None or not ours or change.at_s <= flight.since_s + ORDERED_S:
            return ""
        return change.text if on_mission or not change.of_mission else ""

    def _off_mission(self, vehicles: Mapping[int, Vehicle], now: float) -> dict[int, str]:
        found = {}
        for vehicle_id, seen_s in list(self._missions.items()):
            vehicle = vehicles.get(vehicle_id)
            # After a restart it was not heard yet, or it is not known yet whether it is in the air.
            if vehicle is None or vehicle.freshness(now) is not Freshness.OK:
                continue
            if not vehicle.telemetry.airborne or vehicle_id not in self._flights.sent:
                del self._missions[vehicle_id]
                self._flights.sent.discard(vehicle_id)
            elif self._firmware.of(vehicle).flies_mission(vehicle):
                self._missions[vehicle_id] = now
                change = self._other_stations.change(vehicle, now)
                if change is not None and change.at_s > self._ordered_s[vehicle_id] + ORDERED_S:
                    found[vehicle_id] = change.text
            elif now - seen_s > LEFT_S:  # False while it is NaN
                mode = vehicle.mode_name
                found[vehicle_id] = f"left its mission (now {mode})"
        return found

    def _strays(self, flight: Flight, vehicle: Vehicle, now: float) -> str:
        course = self._courses.setdefault(vehicle.id, _Course())
        speed_m_s = math.hypot(*vehicle.telemetry.velocity_m_s)
        holds = flight.phase is Phase.HOLDING and flight.step not in (HoldStep.READY, HoldStep.FOUND)
        if not (holds or flight.vetoed):
            course.stopped_s = math.nan
        else:
            course.stopped_s = now if math.isnan(course.stopped_s) else course.stopped_s
            moves = now - course.stopped_s > BRAKES_S and speed_m_s > MOVES_M_S
            return f"moves at {speed_m_s:.0f} m/s, was ordered to hold" if moves else ""
        if isinstance(flight.course, PositionTarget):
            return self._goes_away(course, flight.course.point_m, vehicle.telemetry.position_m, speed_m_s)
        course.goal_m = None
        beside_m = flight.tracking.cross_m if flight.tracking is not None and flight.joined else math.nan
        return f"{beside_m:.0f} m beside its way" if beside_m > BESIDE_M else ""

    def _goes_away(self, course: _Course, goal_m: Vec3, here_m: Vec3, speed_m_s: float) -> str:
        away_m = math.dist(goal_m, here_m)
        if course.goal_m != goal_m:
            course.goal_m, course.nearest_m = goal_m, away_m
        course.nearest_m = min(course.nearest_m, away_m)
        strays = away_m > course.nearest_m + AWAY_M and speed_m_s > MOVES_M_S
        return f"{away_m:.0f} m from its place, and was {course.nearest_m:.0f} m from it" if strays else ""
