"""Waves of simulated intruders against a scenario's defended zone: what the simulator is told to fly.

The model of planning.md C3: bearings evenly distributed, spawned 250 m from the centre within 10 s, straight to the
centre at 5 m/s. A wave comes every few minutes, so that an operator who starts late misses only one.
"""

import math

import numpy as np

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Role, polygon_of
from tui_gcs.core.scenario.model import Scenario

FAR_M, WITHIN_S, SPEED_M_S = 250.0, 10.0, 5.0
FIRST_S, EVERY_S, WAVES = 90.0, 150.0, 20
MOST = 64
"""Intruders of a wave."""
ABOVE_M = 5.0
"""They fly so much above the middle of the first round's altitude band."""


def waves(scenario: Scenario, count: int, seed: int) -> list[dict[str, float]]:
    """`WAVES` times `count` intruders as fields of the simulator's `IntruderSpec`; the same seed gives the same.

    Raises:
        ValueError: a count that cannot be, or no zone with the role "defend" in the first round.
    """
    if not 1 <= count <= MOST:
        raise ValueError(f"intruders: 1 to {MOST} in a wave, not {count}")
    round_ = scenario.rounds[0]
    zone = next((z for z in round_.zones if z.role is Role.DEFEND), None)
    if zone is None:
        raise ValueError(f"intruders need a zone with role defend; {round_.name} has none")
    centre = polygon_of(zone.shape).centroid
    frame, rng = LocalFrame(scenario.origin), np.random.default_rng((seed, 3))
    goal_lat, goal_lon = frame.to_geodetic(centre.x, centre.y)
    height_m = (round_.area.alt_min_m + round_.area.alt_max_m) / 2.0 + ABOVE_M
    made = []
    for wave in range(WAVES):
        for bearing, share in zip(rng.random(count) * 2.0 * math.pi, rng.random(count), strict=True):
            x, y = centre.x + FAR_M * math.sin(bearing), centre.y + FAR_M * math.cos(bearing)
            lat, lon = frame.to_geodetic(x, y)
            made.append(
                {
                    "lat_deg": lat,
                    "lon_deg": lon,
                    "alt_amsl_m": scenario.origin.ground_amsl_m + height_m,
                    "goal_lat_deg": goal_lat,
                    "goal_lon_deg": goal_lon,
                    "speed_m_s": SPEED_M_S,
                    "begin_s": FIRST_S + wave * EVERY_S + share * WITHIN_S,
                }
            )
    return made
