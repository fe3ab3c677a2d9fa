"""Batteries in rehearsals: a vehicle whose class has a power model uses what that says, others what they simulate."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from sitl.common.vehicle_spec import VehicleSpec
from sitl.launch.fleet import SimFleet
from tests.core.rigs.rig import toml
from tui_gcs.core.scenario.load import parse
from tui_gcs.rehearsal.class_batteries import ClassBatteries

SMALL = '\n[[class]]\nname = "small"\nvehicles = [2]\ncapacity_wh = 1.0\nhover_w = 72.0\ncruise_w = 36.0\n'
"""In hover 2 % of its battery a second, at 8 m/s half as much."""


@dataclass
class Simulated:
    """Two vehicles in the air; the second one flies 8 m/s."""

    armed: Any = field(default_factory=lambda: np.array([True, True]))
    alt_rel_m: Any = field(default_factory=lambda: np.array([20.0, 20.0]))
    velocity_m_s: Any = field(default_factory=lambda: np.array([[0.0, 0.0, 0.0], [0.0, 8.0, 0.0]]))
    left: dict[int, float] = field(default_factory=dict)
    kept: list[int] = field(default_factory=list)

    def discharge(self, index: int, left: float) -> None:
        self.left[index] = left

    def stop_draining(self, index: int) -> None:
        self.kept.append(index)


@dataclass
class Flight:
    """What a flight in lock-step has of these."""

    sim: Simulated = field(default_factory=Simulated)
    systems: tuple[int, ...] = (1, 2)
    clock: Any = None
    t_s: float = 100.0

    def __post_init__(self) -> None:
        self.clock = self

    def now(self) -> float:
        return self.t_s

    def fly(self, batteries: ClassBatteries, seconds: int) -> None:
        for _ in range(20 * seconds):
            self.t_s += 0.05
            batteries.tick()


def test_a_class_uses_in_the_air_what_it_says() -> None:
    flight = Flight()
    batteries = ClassBatteries(parse(toml() + SMALL), flight)  # type: ignore[arg-type]  # it is like one
    flight.fly(batteries, 30)
    assert flight.sim.left == {1: pytest.approx(0.7, abs=0.011)}, "at 8 m/s 1 % a second; vehicle 1 has no class"
    flight.sim.velocity_m_s[1] = 0.0
    flight.fly(batteries, 20)
    assert flight.sim.left == {1: pytest.approx(0.3, abs=0.031)}, "in hover 2 %"
    flight.sim.alt_rel_m[1] = 0.0
    flight.fly(batteries, 20)
    assert flight.sim.left == {1: pytest.approx(0.3, abs=0.031)}, "on the ground nothing"
    assert flight.sim.kept == [1], "the simulator's own battery would count twice"


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_battery_that_does_not_drain_has_what_was_left_in_it(autopilot: Any) -> None:
    sim = SimFleet([VehicleSpec(1, 47.0, 8.0, 400.0, autopilot=autopilot)])
    sim.step(0.1)
    sim.stop_draining(0)
    battery = sim._pilots[0]._parts.battery  # type: ignore[attr-defined]  # both autopilots have one
    sim.discharge(0, 0.99)
    for _ in range(500):
        battery.drain(*[30.0] * (autopilot == "ardupilot"))
    assert (battery.charge if autopilot == "px4" else battery.percent / 100) == pytest.approx(0.99)
