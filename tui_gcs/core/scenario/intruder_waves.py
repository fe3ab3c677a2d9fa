"""Waves of simulated intruders that approach a scenario's defended zone.

The model of docs/planning.md C3: bearings evenly distributed, spawned 250 m from the centre within 10 s, straight to
the centre at 5 m/s. A wave comes every few minutes, so that an operator starting late misses only one.
"""

import math

import numpy as np

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Role, polygon_of
from tui_gcs.core.scenario.model import Scenario

SPAWN_DISTANCE_M, SPAWN_WITHIN_S, SPEED_M_S = 250.0, 10.0, 5.0
FIRST_WAVE_S, WAVE_INTERVAL_S, WAVE_COUNT = 90.0, 150.0, 20
MAX_INTRUDERS = 64
"""The largest number of intruders in a wave."""
ABOVE_BAND_MIDDLE_M = 5.0
"""How far above the middle of the first round's altitude band intruders fly."""


def intruder_waves(scenario: Scenario, count: int, seed: int) -> list[dict[str, float]]:
    """Return `WAVE_COUNT` waves of `count` intruders as fields of the simulator's `IntruderSpec`.

    The same seed gives the same intruders.

    Raises:
        ValueError: the count is out of range, or the first round has no zone with the role "defend".
    """
    if not 1 <= count <= MAX_INTRUDERS:
        raise ValueError(f"intruders: 1 to {MAX_INTRUDERS} in a wave, not {count}")
    round_ = scenario.rounds[0]
    zone = next((z for z in round_.zones if z.role is Role.DEFEND), None)
    if zone is None:
        raise ValueError(f"intruders need a zone with role defend; {round_.name} has none")
    centre = polygon_of(zone.shape).centroid
    frame, rng = LocalFrame(scenario.origin), np.random.default_rng((seed, 3))
    goal_lat, goal_lon = frame.to_geodetic(centre.x, centre.y)
    height_m = (round_.area.alt_min_m + round_.area.alt_max_m) / 2.0 + ABOVE_BAND_MIDDLE_M
    made = []
    for wave in range(WAVE_COUNT):
        for bearing, share in zip(rng.random(count) * 2.0 * math.pi, rng.random(count), strict=True):
            x, y = centre.x + SPAWN_DISTANCE_M * math.sin(bearing), centre.y + SPAWN_DISTANCE_M * math.cos(bearing)
            lat, lon = frame.to_geodetic(x, y)
            made.append(
                {
                    "lat_deg": lat,
                    "lon_deg": lon,
                    "alt_amsl_m": scenario.origin.ground_amsl_m + height_m,
                    "goal_lat_deg": goal_lat,
                    "goal_lon_deg": goal_lon,
                    "speed_m_s": SPEED_M_S,
                    "begin_s": FIRST_WAVE_S + wave * WAVE_INTERVAL_S + share * SPAWN_WITHIN_S,
                }
            )
    return made
