"""Battery returns: a vehicle that flies for its planner is sent home while its charge still brings it there.

A vehicle returns at the charge that the scenario's `[battery]` table names, or earlier, when the flight time that is
left would not suffice for the way home, the landing and a reserve. Before this existed a patrol flew on at 0 %: there
were alarms, and nothing acted. A team with vehicles in reserve relieves one before that
(`planner.api.LOW_BATTERY_PCT`). A vehicle that an operator holds, flies by hand, has sent home or onto its mission is
left to the operator: its alarms go on.
"""

import math
from collections import deque
from dataclasses import dataclass, field

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.executive import Executive
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight
from tui_gcs.core.guard.permission import STATION
from tui_gcs.core.protocol.common import EventClass, Phase
from tui_gcs.core.records.event_log import ALERT, WARNING
from tui_gcs.core.scenario.model import BatteryLimits

LASTS_S = 3.0
"""A vehicle returns when its charge has been too low for this long: one wrong message sends no vehicle home."""
DRAIN_WINDOW_S = 120.0
"""The drain is measured over at most this time: what a climb at the start took is not what the cruise takes."""
MIN_DRAIN_SPAN_S, MIN_DRAIN_PCT = 20.0, 3.0
"""The drain is known when the charge has fallen for this long and by this much: it is reported in whole percent."""
MAX_STEP_PCT = 5.0
"""A charge that falls by more from one sample to the next was not used up in between: the gauge corrects itself."""
TIMED_BELOW_PCT = 50.0
"""The drain counts below half a charge only. PX4's battery simulator falls to half within a minute and stays there
(docs/autopilots.md); no vehicle is called home from its first minutes by that."""
VERTICAL_M_S, LAND_M_S, LAND_SLOW_M = 1.5, 0.5, 10.0
"""Descents and the last metres: WPNAV_SPEED_DN, LAND_SPEED, LAND_ALT_LOW of ArduCopter; PX4's are not slower."""


@dataclass
class _Drain:
    """How the charge of one vehicle has fallen."""

    samples: deque[tuple[float, float]] = field(default_factory=deque)
    """Time and percent at each change."""
    low_since_s: float = math.nan

    def add(self, now: float, charge_pct: float) -> None:
        """Take the present charge; one that rises or jumps is another battery, or a gauge that corrects itself."""
        if self.samples and not 0.0 <= self.samples[-1][1] - charge_pct <= MAX_STEP_PCT:
            self.samples.clear()
        if not self.samples or charge_pct != self.samples[-1][1]:
            self.samples.append((now, charge_pct))
        while len(self.samples) > 1 and now - self.samples[1][0] >= DRAIN_WINDOW_S:
            self.samples.popleft()

    def left_s(self, now: float, charge_pct: float) -> float:
        """Time until the charge is used up at the present drain; inf while that is unknown."""
        begin_s, begin_pct = self.samples[0]
        lost_pct, span_s = begin_pct - charge_pct, now - begin_s
        if charge_pct >= TIMED_BELOW_PCT or span_s < MIN_DRAIN_SPAN_S or lost_pct < MIN_DRAIN_PCT:
            return math.inf
        return charge_pct * span_s / lost_pct


class BatteryReturnController:
    """Sends vehicles home for their batteries; `tick` is called about once a second."""

    def __init__(self, services: FlightServices, limits: BatteryLimits, executive: Executive) -> None:
        """`executive` returns the vehicles."""
        self.limits = limits
        self._fleet, self._flights = services.fleet, services.flights
        self._events, self._clock = services.events, services.clock
        self._executive = executive
        self._drains: dict[int, _Drain] = {}

    def tick(self) -> None:
        """Look at the batteries of all vehicles in the teams."""
        now = self._clock.now()
        for flight in self._flights:
            vehicle = self._fleet.vehicles.get(flight.vehicle)
            # A vehicle of unknown charge (NaN) is not sent home: it has an alarm of its own.
            if vehicle is None or not vehicle.telemetry.armed or math.isnan(vehicle.telemetry.battery_pct):
                self._drains.pop(flight.vehicle, None)
                continue
            drain = self._drains.setdefault(flight.vehicle, _Drain())
            drain.add(now, vehicle.telemetry.battery_pct)
            steered = flight.phase is Phase.FLYING or (flight.phase is Phase.HOLDING and flight.held_by_station)
            why = self._why_home(flight, vehicle, drain, now) if steered else ""
            if not why:
                drain.low_since_s = math.nan
            elif math.isnan(drain.low_since_s):
                drain.low_since_s = now
            elif now - drain.low_since_s >= LASTS_S:
                self._return(vehicle, why)

    def _why_home(self, flight: Flight, vehicle: Vehicle, drain: _Drain, now: float) -> str:
        """Why the vehicle has to go home now, in words; or ""."""
        charge_pct, limits = vehicle.telemetry.battery_pct, self.limits
        if limits.return_pct <= 0.0:
            return ""
        if charge_pct <= limits.return_pct:
            return f"battery at {charge_pct:.0f} %"
        left_s, home_s = drain.left_s(now, charge_pct), self._home_s(flight, vehicle)
        if left_s < home_s + limits.reserve_s:
            return f"battery at {charge_pct:.0f} % lasts {left_s:.0f} s, the way home and landing take {home_s:.0f} s"
        return ""

    def _home_s(self, flight: Flight, vehicle: Vehicle) -> float:
        """How long the way to its layer, to above its home and down takes; 0 without a home or a position."""
        home = self._flights.home_m(vehicle)
        if home is None or not vehicle.telemetry.has_position():
            return 0.0
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
