"""How long batteries last: by what the scenario says about a vehicle's class, corrected by its use in this flight."""

import math
from collections import deque
from dataclasses import dataclass, field

from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.motion.power import most_use_pct_s, use_pct_s
from tui_gcs.core.scenario.model import Scenario

WINDOW_S = 120.0
"""The use is measured over this time: what a climb at the start took is not what the cruise takes."""
MIN_SPAN_S, MIN_USED_PCT = 20.0, 3.0
"""The use is known when the charge has fallen for this long and by this much: it is reported in whole percent. Where it
falls slowly the use is measured over a longer time than `WINDOW_S`."""
MAX_STEP_PCT = 5.0
"""A charge that falls by more from one sample to the next was not used up in between: the gauge corrects itself."""


@dataclass
class BatteryUse:
    """How the charge of one vehicle has fallen, beside how it should have fallen by the model of its class."""

    samples: deque[tuple[float, float, float]] = field(default_factory=deque)
    """Time, charge in percent, and the modelled use until then in percent, at each change of the charge."""
    modelled_pct: float = 0.0
    newest_s: float = math.nan

    def add(self, now: float, charge_pct: float, modelled_pct_s: float) -> None:
        """Take the present charge, and the modelled use since the call before.

        A charge that rises or jumps is another battery, or a gauge that corrects itself: the measurement begins anew.
        """
        if not math.isnan(self.newest_s):
            self.modelled_pct += modelled_pct_s * (now - self.newest_s)
        self.newest_s, samples = now, self.samples
        if samples and not 0.0 <= samples[-1][1] - charge_pct <= MAX_STEP_PCT:
            samples.clear()
        if not samples or charge_pct != samples[-1][1]:
            samples.append((now, charge_pct, self.modelled_pct))
        while len(samples) > 1 and now - samples[1][0] >= WINDOW_S and samples[1][1] - charge_pct >= MIN_USED_PCT:
            samples.popleft()

    def ratio(self) -> float:
        """Return the measured use over the modelled one; NaN while it is unknown."""
        begin_s, begin_pct, begin_modelled_pct = self.samples[0]
        used_pct, modelled_pct = begin_pct - self.samples[-1][1], self.modelled_pct - begin_modelled_pct
        if self.newest_s - begin_s < MIN_SPAN_S or used_pct < MIN_USED_PCT or modelled_pct <= 0.0:
            return math.nan
        return used_pct / modelled_pct


class EnergyMonitor:
    """Measures what vehicles in the air use of their batteries; `tick` is called about once a second."""

    def __init__(self, fleet: VehicleRegistry, scenario: Scenario) -> None:
        self.scenario = scenario
        self.left_s: dict[int, float] = {}
        """By vehicle: flight time until its battery is empty, in hover or at its speed limit, where it uses more.

        Vehicles of which it is unknown are missing: those on the ground, those that report no charge, and those of a
        class without a model until their use is measured."""
        self._fleet = fleet
        self._uses: dict[int, BatteryUse] = {}

    def is_modelled(self, vehicle: int) -> bool:
        """Whether the scenario says what flying takes of the vehicle's battery."""
        return self.scenario.class_of(vehicle).power is not None

    def tick(self, now: float) -> None:
        """Look at the batteries of all vehicles."""
        self.left_s = {}
        for vehicle in self._fleet.vehicles.values():
            # One that is disarmed may get another battery.
            if not vehicle.telemetry.armed or math.isnan(vehicle.telemetry.battery_pct):
                self._uses.pop(vehicle.id, None)
            elif vehicle.telemetry.airborne:
                self._measure(vehicle, now)

    def _measure(self, vehicle: Vehicle, now: float) -> None:
        kind, report = self.scenario.class_of(vehicle.id), vehicle.telemetry
        use = self._uses.setdefault(vehicle.id, BatteryUse())
        speed_m_s = math.hypot(*report.velocity_m_s[:2])
        use.add(now, report.battery_pct, use_pct_s(kind, 0.0 if math.isnan(speed_m_s) else speed_m_s))
        ratio = use.ratio()
        if math.isnan(ratio):
            if kind.power is None:
                return
            ratio = 1.0
        self.left_s[vehicle.id] = report.battery_pct / (ratio * most_use_pct_s(kind))
