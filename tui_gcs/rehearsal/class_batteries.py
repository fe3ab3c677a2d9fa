"""Empties the batteries of a rehearsal's vehicles as their classes say, so that it shows who must return when."""

import numpy as np

from tui_gcs.core.motion.power import use_pct_s
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.rehearsal.lock_step import LockStep

EVERY_S = 1.0
"""Simulated time between two looks; batteries last for minutes."""
AIRBORNE_M = 0.5


class ClassBatteries:
    """Counts what vehicles use in the air whose classes have a `power`; the simulator's own batteries know none."""

    def __init__(self, scenario: Scenario, flight: LockStep) -> None:
        self._flight = flight
        kinds = {vehicle: kind for kind in scenario.classes if kind.power is not None for vehicle in kind.vehicles}
        self._kinds = {index: kinds[system] for index, system in enumerate(flight.systems) if system in kinds}
        self._used_pct = dict.fromkeys(self._kinds, 0.0)
        self._before_s = flight.clock.now()
        for index in self._kinds:
            flight.sim.stop_draining(index)

    def tick(self) -> None:
        """Take the charge of the time since the last call, if it is time."""
        passed_s = self._flight.clock.now() - self._before_s
        if not self._kinds or passed_s < EVERY_S:
            return
        self._before_s += passed_s
        sim = self._flight.sim
        flies, speed_m_s = sim.armed & (sim.alt_rel_m > AIRBORNE_M), np.hypot(*sim.velocity_m_s[:, :2].T)
        for index, kind in self._kinds.items():
            if flies[index]:
                self._used_pct[index] += passed_s * use_pct_s(kind, float(speed_m_s[index]))
                sim.discharge(index, max(0.0, 1.0 - self._used_pct[index] / 100.0))
