"""The guardian flown by simulated autopilots against a wave: what sensors report, through the whole station."""

import math
from itertools import combinations
from pathlib import Path

import msgspec
import numpy as np
import pytest

from sitl.launch.fleet import IntruderSpec, SensorSpec, WorldSpec
from tests.core.rigs.rig import Rig, scenario, toml
from tui_gcs.core.geometry.local_frame import LocalFrame

MIDDLE, ZONE_M = (150.0, 200.0), 80.0
BEGIN_S, FAR_M, SPEED_M_S = 65.0, 180.0, 5.0


def wave(*bearings_deg: float) -> WorldSpec:
    frame = LocalFrame(scenario(2).origin)
    goal = frame.to_geodetic(*MIDDLE)
    made = []
    for bearing in np.radians(bearings_deg):
        start = frame.to_geodetic(MIDDLE[0] + FAR_M * math.sin(bearing), MIDDLE[1] + FAR_M * math.cos(bearing))
        made.append(IntruderSpec(*start, 160.0, *goal, SPEED_M_S, BEGIN_S))
    return WorldSpec(tuple(made), SensorSpec(range_m=60.0))


@pytest.mark.long
def test_a_wave_is_met_before_the_zone_and_vehicles_keep_apart(tmp_path: Path) -> None:
    plain = scenario(2)
    team = msgspec.structs.replace(plain.teams[0], planner="guardian")
    guarded = msgspec.structs.replace(plain, teams=(team,))
    rig = Rig(guarded, toml(), tmp_path, wants=None, world=wave(20.0, 200.0)).flying()
    world, limits, too_near, deadline_s = rig.sim.world, guarded.limits, 0, BEGIN_S + (FAR_M - ZONE_M) / SPEED_M_S
    assert world is not None
    while rig.clock.now() < deadline_s + 2.0:
        rig.step()
        for a, b in combinations(map(rig.place, rig.ids), 2):
            level = math.hypot(a[0] - b[0], a[1] - b[1])
            too_near += level < limits.separation_horizontal_m and abs(a[2] - b[2]) < limits.separation_vertical_m
    assert (world.met_s < deadline_s).all(), world.met_s
    assert too_near == 0
    assert sum(rig.station.flight.guard.vetoes.values()) == 0, rig.station.flight.guard.vetoes
    rig.until(lambda: rig.station.active.team_controllers["defend"].metrics["joined"] == 2, 30.0, "back on the ring")
