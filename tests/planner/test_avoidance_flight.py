"""Vehicles that leave their layers for one height, by a planner in a file: with `avoid` the guard is silent."""

from pathlib import Path

import numpy as np
import pytest

from tests.core.rigs.rig import Rig, scenario, toml
from tui_gcs.core.protocol.common import Intent
from tui_gcs.planner.api import avoid

STEP_S = 0.2
CORNERS = np.array([[260.0, 160.0, 40.0], [340.0, 160.0, 40.0], [340.0, 240.0, 40.0], [260.0, 240.0, 40.0]])


class Swarm:
    """Flies every vehicle straight to a place of its own; all at 40 m."""

    def __init__(self, flight: Rig) -> None:
        self.flight = flight
        self.closest = np.inf
        """Of all pairs that ever were, as the larger share of the two limits."""

    def fly(self, goals: np.ndarray, seconds: float, *, avoiding: bool) -> np.ndarray:
        """The last positions of all vehicles."""
        flight, limits = self.flight, self.flight.scenario.limits
        for _ in range(round(seconds / STEP_S)):
            places = np.array([flight.place(v) for v in flight.ids])
            wanted = 0.5 * (goals - places)
            wanted *= np.minimum(1.0, 7.0 / np.maximum(np.linalg.norm(wanted, axis=1), 1e-9))[:, None]
            wanted[:, 2] = np.clip(wanted[:, 2], -1.0, 1.0)
            velocity = np.array([flight.sim.velocity_m_s[flight.sim_index[v]] for v in flight.ids])
            told = avoid(places, velocity, wanted, limits) if avoiding else wanted
            flight.plan(
                *(
                    Intent(v, "velocity", velocity_m_s=(x, y, z), valid_s=2 * STEP_S)
                    for v, (x, y, z) in zip(flight.ids, told.tolist(), strict=True)
                )
            )
            flight.run(STEP_S)
            gap = np.abs(places[:, None] - places[None])
            level = np.hypot(gap[..., 0], gap[..., 1]) / limits.separation_horizontal_m
            apart = np.maximum(level, gap[..., 2] / limits.separation_vertical_m) + 1e9 * np.eye(len(places))
            self.closest = min(self.closest, float(apart.min()))
        return np.array([flight.place(v) for v in flight.ids])


@pytest.mark.long
def test_through_each_other_at_one_height(tmp_path: Path) -> None:
    flight = Rig(scenario(4), toml(), tmp_path)
    try:
        flight.flying()
        flight.planning = False
        vetoes, swarm = flight.station.flight.guard.vetoes, Swarm(flight)
        swarm.fly(CORNERS, 45.0, avoiding=True)
        there = swarm.fly(CORNERS[[2, 3, 0, 1]], 45.0, avoiding=True)
        assert vetoes["separation"] == 0 and swarm.closest >= 1.0
        assert np.abs(there - CORNERS[[2, 3, 0, 1]]).max() < 3.0, "all of them changed places"
        swarm.fly(CORNERS, 15.0, avoiding=False)
        assert vetoes["separation"] > 0 and swarm.closest >= 1.0, "without it the guard has to hold them"
    finally:
        flight.close()
