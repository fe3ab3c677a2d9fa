"""Intruders and sensors of the simulator."""

import math

import numpy as np
import pytest

from sitl.common.states import Phase
from sitl.launch.fleet import IntruderSpec, SensorSpec, SimFleet, VehicleSpec, WorldSpec
from sitl.links.wire import cut

LAT, LON, GROUND_M = 52.0, 0.0, 100.0
M_PER_LAT = 111_260.0
NORTH_200 = LAT + 200.0 / M_PER_LAT


def fleet(sensor: SensorSpec | None, *intruders: IntruderSpec, seed: int = 1) -> SimFleet:
    made = SimFleet([VehicleSpec(1, LAT, LON, GROUND_M)], seed=seed, world=WorldSpec(intruders, sensor))
    made._vehicles.flying[0] = True
    made._vehicles.position_m[0] = (0.0, 0.0, 30.0)
    made._vehicles.target_m[0] = (0.0, 0.0, 30.0)
    made._pilots[0].platform.state.phase = Phase.AIRBORNE
    return made


def intruder(speed_m_s: float = 5.0, begin_s: float = 0.0) -> IntruderSpec:
    """From 200 m north towards the vehicle."""
    return IntruderSpec(NORTH_200, LON, GROUND_M + 40.0, LAT, LON, speed_m_s, begin_s)


def reports(made: SimFleet, seconds: float) -> list[dict[str, float]]:
    found = []
    for _ in range(round(seconds / 0.05)):
        made.step(0.05)
        for _, datagram in made.drain():
            found += [f.fields for f in cut(datagram) if f.name == "CAMERA_TRACKING_GEO_STATUS" and f.component == 100]
    return found


def test_an_intruder_comes_straight_and_is_reported_only_within_range() -> None:
    made = fleet(SensorSpec(range_m=60.0, probability=1.0, sigma_m=0.5), intruder())
    assert reports(made, 27.0) == [], "still 65 m away"
    seen = reports(made, 2.0)
    assert 5 <= len(seen) <= 10, "five times a second"
    assert (seen[-1]["lat"] / 1e7 - LAT) * M_PER_LAT == pytest.approx(56.0, abs=3.0)
    assert seen[-1]["alt"] == pytest.approx(GROUND_M + 40.0, abs=12.0)
    assert seen[-1]["h_acc"] == 0.5
    assert math.isnan(seen[-1]["vel_n"]), "not measured"


def test_met_from_near_it_turns_round_and_is_gone() -> None:
    made = fleet(None, intruder(speed_m_s=20.0, begin_s=1.0))
    reports(made, 9.8)
    world = made.world
    assert world is not None
    assert world.present[0]
    reports(made, 1.0)
    assert world.met_s[0] == pytest.approx(10.0, abs=0.2), "180 m at 20 m/s, from 1 s on"
    reports(made, 9.5)
    assert not world.present[0]


def test_some_are_missed_and_some_alarms_are_false_and_the_same_seed_gives_the_same() -> None:
    sensor = SensorSpec(range_m=300.0, probability=0.5, false_per_min=60.0, sigma_m=1.0)
    first, again, other = (reports(fleet(sensor, intruder(), seed=s), 30.0) for s in (1, 1, 2))
    assert str(first) == str(again) != str(other)
    true = [r for r in first if abs(r["lon"]) < 600]
    assert len(true) == pytest.approx(75, abs=25), "half of 150 looks"
    assert len(first) - len(true) == pytest.approx(30, abs=15), "one a second"


def test_nobody_on_the_ground_sees_anything() -> None:
    made = SimFleet([VehicleSpec(1, LAT, LON, GROUND_M)], world=WorldSpec((intruder(),), SensorSpec(range_m=1e3)))
    assert reports(made, 5.0) == []


@pytest.mark.parametrize("wrong", [{"range_m": math.nan}, {"probability": 1.5}, {"rate_hz": 0.0}, {"sigma_m": -1.0}])
def test_nonsense_makes_no_sensor(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="sensor"):
        SensorSpec(**wrong)


def test_positions_are_as_many_as_intruders() -> None:
    made = fleet(None)
    assert made.world is not None
    assert made.world.position_m.shape == (0, 2)
    assert reports(made, 0.5) == []
    assert np.isfinite(made.position_m).all()
