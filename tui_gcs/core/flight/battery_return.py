"""Battery returns: a vehicle that flies for its planner is sent home while its charge still brings it there.

A vehicle returns at the charge that the scenario's `[battery]` table names, or earlier, when the flight time that is
left would not suffice for the way home, the landing and a reserve. Before this existed a patrol flew on at 0 %: there
were alarms, and nothing acted. A team with vehicles in reserve relieves one before that
(`planner.api.LOW_BATTERY_PCT`). A vehicle that an operator holds, flies by hand, has sent home or onto its mission is
left to the operator: its alarms go on.
"""

import math

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.energy_use import EnergyMonitor
from tui_gcs.core.flight.executive import Executive
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight
from tui_gcs.core.guard.permission import STATION
from tui_gcs.core.protocol.common import EventClass, Phase
from tui_gcs.core.records.event_log import ALERT, WARNING
from tui_gcs.core.scenario.model import Scenario

LASTS_S = 3.0
"""A vehicle returns when its charge has been too low for this long: one wrong message sends no vehicle home."""
TIMED_BELOW_PCT = 50.0
"""Where the scenario says nothing about a vehicle's power, the flight time that is left counts below this charge only.
PX4's battery simulator falls to half within a minute and stays there (docs/autopilots.md); no vehicle is called home
from its first minutes by that."""
VERTICAL_M_S, LAND_M_S, LAND_SLOW_M = 1.5, 0.5, 10.0
"""Descents and the last metres: WPNAV_SPEED_DN, LAND_SPEED, LAND_ALT_LOW of ArduCopter; PX4's are not slower."""


class BatteryReturnController:
    """Sends vehicles home for their batteries; `tick` is called about once a second."""

    def __init__(self, services: FlightServices, scenario: Scenario, executive: Executive) -> None:
        """`executive` returns the vehicles."""
        self.limits = scenario.battery
        self.energy = EnergyMonitor(services.fleet, scenario)
        self.home_s: dict[int, float] = {}
        """By vehicle of the teams in the air: how long the way home and the landing take."""
        self._fleet, self._flights = services.fleet, services.flights
        self._events, self._clock = services.events, services.clock
        self._executive = executive
        self._low_since_s: dict[int, float] = {}
        """By vehicle: since when it should go home."""

    def set_scenario(self, scenario: Scenario) -> None:
        """Use the limits and the classes of another scenario from now on."""
        self.limits, self.energy.scenario = scenario.battery, scenario

    def tick(self) -> None:
        """Look at the batteries of all vehicles, and send those of the teams home that have to go."""
        now = self._clock.now()
        self.energy.tick(now)
        self.home_s = {}
        for flight in self._flights:
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            # A vehicle of unknown charge (NaN) is not sent home: it has an alarm of its own.
            if vehicle is None or not vehicle.telemetry.armed or math.isnan(vehicle.telemetry.battery_pct):
                self._low_since_s.pop(flight.vehicle, None)
                continue
            self.home_s[vehicle.id] = self._home_s(flight, vehicle)
            steered = flight.phase is Phase.FLYING or (flight.phase is Phase.HOLDING and flight.held_by_station)
            why = self._why_home(vehicle) if steered else ""
            if not why:
                self._low_since_s.pop(vehicle.id, None)
            elif now - self._low_since_s.setdefault(vehicle.id, now) >= LASTS_S:
                self._return(vehicle, why)

    def _why_home(self, vehicle: Vehicle) -> str:
        """Why the vehicle has to go home now, in words; or ""."""
        charge_pct, limits = vehicle.telemetry.battery_pct, self.limits
        if limits.return_pct <= 0.0:
            return ""
        if charge_pct <= limits.return_pct:
            return f"battery at {charge_pct:.0f} %"
        if charge_pct >= TIMED_BELOW_PCT and not self.energy.is_modelled(vehicle.id):
            return ""
        left_s, home_s = self.energy.left_s.get(vehicle.id, math.inf), self.home_s[vehicle.id]
        home_s = 0.0 if math.isnan(home_s) else home_s
        if left_s < home_s + limits.reserve_s:
            return f"battery at {charge_pct:.0f} % lasts {left_s:.0f} s, the way home and landing take {home_s:.0f} s"
        return ""

    def _home_s(self, flight: Flight, vehicle: Vehicle) -> float:
        """How long the way to its layer, to above its home and down takes; NaN without a home or a position."""
        home = self._flights.home_m(vehicle)
        if home is None or not vehicle.telemetry.has_position():
            return math.nan
        layer_m = max(flight.home_layer_m, 0.0)
        to_layer_s = abs(vehicle.telemetry.alt_rel_m - layer_m) / VERTICAL_M_S
        level_s = math.dist(vehicle.telemetry.position_m[:2], home[:2]) / self._executive.return_control.speed_m_s
        slow_m = min(layer_m, LAND_SLOW_M)
        return to_layer_s + level_s + (layer_m - slow_m) / VERTICAL_M_S + slow_m / LAND_M_S

    def _return(self, vehicle: Vehicle, why: str) -> None:
        refusal = self._executive.send_home(vehicle.id, STATION)
        text = f"{why}: returns and lands" if not refusal else f"{why}, and it cannot return: {refusal}"
        severity = WARNING if not refusal else ALERT
        self._events.report(EventClass.MISSION, f"vehicle {vehicle.id}", text, severity, every_s=10)
