"""Wind and GPS noise: seeded, felt, and nothing at all when not asked for."""

import numpy as np
import pytest

from sitl.launch.fleet import WeatherSpec
from tests.sitl.conftest import px4_take_off

NOISE_M = 1.5
POSITION_VELOCITY = 0xDC0


def test_positions_by_gps_wander_and_the_vehicle_follows_what_it_believes(booted):
    ground = booted(weather=WeatherSpec(gps_noise_m=NOISE_M))
    ground.ask("GLOBAL_POSITION_INT", 2)
    assert ground.mode(4) == 0 and ground.command(400, 1) == 0
    assert ground.command(22, 0, 0, 0, 0, 0, 0, 15.0) == 0
    ground.run(15.0)
    ground.target(0.0, 0.0, 15.0)
    ground.run(200.0, tick_s=0.1)
    lats = np.array([m["lat"] for m in ground.of("GLOBAL_POSITION_INT", since_s=60.0)]) / 1e7
    spec = ground.fleet.specs[0]
    shown_m = (lats - spec.lat_deg) * 111_000.0
    assert abs(shown_m.mean()) < 0.3, "it believes to be at its target"
    assert np.std(shown_m) < 0.3
    assert 0.2 < abs(ground.fleet.position_m[0, :2]).max() < 4 * NOISE_M, "but it is not"


def test_noise_is_the_same_for_the_same_seed(booted):
    def shown(seed):
        ground = booted(seed=seed, weather=WeatherSpec(gps_noise_m=NOISE_M, wind_m_s=(3.0, 0.0)))
        ground.ask("GLOBAL_POSITION_INT", 5)
        ground.run(5.0)
        return [(m["lat"], m["lon"], m["alt"]) for m in ground.of("GLOBAL_POSITION_INT")]

    assert shown(1) == shown(1)
    assert shown(1) != shown(2)
    assert len(set(shown(1))) > 10


def test_on_the_ground_nothing_moves_and_home_is_where_it_believes_to_be(booted):
    ground = booted(weather=WeatherSpec(wind_m_s=(8.0, 0.0), gps_noise_m=NOISE_M))
    ground.run(20.0)
    assert (ground.fleet.position_m == 0.0).all()


@pytest.mark.parametrize("wind_m_s", [(6.0, 0.0), (0.0, -6.0)])
def test_copter_is_pushed_a_little_and_holds_its_place_in_wind(booted, wind_m_s):
    ground = booted(weather=WeatherSpec(wind_m_s=wind_m_s))
    ground.mode(4)
    ground.command(400, 1)
    ground.command(22, 0, 0, 0, 0, 0, 0, 15.0)
    farthest = 0.0
    for _ in range(60):
        ground.run(1.0)
        farthest = max(farthest, float(np.abs(ground.fleet.position_m[0, :2]).max()))
    assert 0.05 < farthest < 3.0
    assert np.abs(ground.fleet.position_m[0, :2]).max() < 1.5


@pytest.mark.parametrize(("wind_m_s", "behind_m"), [((-3.0, 0.0), (-1.0, 1.0)), ((-8.0, 0.0), (40.0, 120.0))])
def test_a_copter_flies_against_the_wind_as_fast_as_its_lean_takes_it(booted, wind_m_s, behind_m):
    """30 degrees of lean give 5.7 m/s2, what air at 13.7 m/s takes: 8 m/s against 3 m/s it flies, against 8 not."""
    ground = booted(weather=WeatherSpec(wind_m_s=wind_m_s))
    ground.take_off(15.0)
    behind, way_m = [], 0.0
    for _ in range(200):
        ground.target(way_m, 0.0, 15.0, (8.0, 0.0, 0.0), POSITION_VELOCITY)
        ground.run(0.1)
        way_m += 0.8
        behind.append(way_m - ground.fleet.position_m[0, 0])
    assert behind_m[0] < behind[-1] < behind_m[1]


def test_px4_holds_its_place_in_wind(px4):
    ground = px4(weather=WeatherSpec(wind_m_s=(5.0, 0.0)))
    px4_take_off(ground)
    ground.beat(20.0)
    assert np.abs(ground.fleet.position_m[0, :2]).max() < 2.0
    assert np.hypot(*ground.fleet.velocity_m_s[0, :2]) < 1.5
    assert np.abs(ground.fleet.position_m[0, :2]).max() > 0.0


def test_without_weather_there_is_none(booted):
    ground = booted()
    ground.take_off(15.0)
    assert ground.fleet.position_m[0, :2] == pytest.approx([0.0, 0.0], abs=1e-9)
