"""The wind as the fleet estimates it."""

import math
from pathlib import Path

import pytest

from tests.core.rigs.service_rig import PX4, Peer, ServiceRig

NOTHING = dict.fromkeys(
    ("time_usec", "wind_x", "wind_y", "wind_z", "var_horiz", "var_vert", "wind_alt", "horiz_accuracy", "vert_accuracy"),
    0,
)


def test_the_wind_is_the_median_of_what_vehicles_say_and_blows_where_it_goes(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), Peer(2), Peer(3, autopilot=PX4)).heard()
    assert rig.station.picture.wind.estimate() is None, "nobody knows"
    rig.peers[1].say("WIND", direction=270.0, speed=5.0, speed_z=0.0)  # a west wind
    rig.peers[2].say("WIND", direction=90.0, speed=50.0, speed_z=0.0)  # nonsense, outvoted
    rig.peers[3].say("WIND_COV", **NOTHING | {"wind_x": 0.5, "wind_y": 4.0})
    rig.run(0.2)
    assert rig.station.picture.wind.estimate() == pytest.approx((4.0, 0.0), abs=0.6)
    assert rig.station.picture.wind.of(1) == pytest.approx((5.0, 0.0), abs=1e-6)
    rig.run(31.0)
    assert rig.station.picture.wind.estimate() is None, "half a minute old"


@pytest.mark.parametrize(
    "said",
    [
        {"direction": 0.0, "speed": 0.0},
        {"direction": -180.0, "speed": 0.0},  # real ArduCopters, in 6 m/s: "wind 0.0 m/s from 180°" was on the screen
        {"direction": math.nan, "speed": 4.0},
        {"direction": 10.0, "speed": 1e9},
    ],
)
def test_no_estimate_and_nonsense_are_no_wind(tmp_path: Path, said: dict[str, float]) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    rig.peers[1].say("WIND", speed_z=0.0, **said)
    rig.run(0.2)
    assert rig.station.picture.wind.estimate() is None
