"""The paths that a LOST vehicle may fly by its own failsafe: home, or down where it is.

Each is a row of segments. A segment is predicted like a lost vehicle on the way to the segment's end: it may be
anywhere between the beginning and where the fastest vehicle would be by now. A segment begins when the fastest vehicle
gets there that left at once, and is over when the slowest has passed that left at the latest.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tui_gcs.core.guard.motion_prediction import (
    CLIMB_M_S,
    RETURN_M_S,
    LostLinkBehaviour,
    VehicleState,
    lost_link_reach,
    turning_error_m,
)
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits

SLOW_M_S, SLOW_CLIMB_M_S, SLOW_DESCENT_M_S = 4.0, 2.0, 0.4
"""The slowest a path is flown, with a fifth to spare: MPC_XY_CRUISE 5, WPNAV_SPEED_UP 2.5, LAND_SPEED 0.5."""
WAITS_S = 10.0
"""The longest it waits in between: COM_FAIL_ACT_T and RTL_LOIT_TIME are 5 s."""
HOME_ERROR_M = 3.0
"""Home is known, and flown to, as well as this."""


def lost_link_paths(known: list[VehicleState], limits: Limits, ahead_s: float) -> list[VehicleState]:
    """The segments of all paths of lost vehicles in which those may be now or in the next seconds."""
    lost = [
        (state, state.lost_link_behaviour) for state in known if state.is_lost and state.lost_link_behaviour is not None
    ]
    return [part for state, lost_link_behaviour in lost for part in _ways(state, lost_link_behaviour, limits, ahead_s)]


def _ways(
    state: VehicleState, lost_link_behaviour: LostLinkBehaviour, limits: Limits, ahead_s: float
) -> Iterator[VehicleState]:
    """The segments of one vehicle's paths."""
    # It leaves from somewhere between where it was last seen and where it had come to by then.
    left = replace(state, age_s=min(state.age_s, lost_link_behaviour.leaves_s))
    seen = np.array(state.position_m, dtype=float)
    come = lost_link_reach(left, limits, np.zeros(1))[0]
    x, y = ((seen + come) / 2)[:2].tolist()
    z = float(seen[2])
    error_m = state.error_m + math.dist(seen[:2], come[:2]) / 2 + turning_error_m(left, limits)
    from_here = replace(state, error_m=error_m, velocity_m_s=(0.0, 0.0, 0.0), lost_link_behaviour=None, on_own_way=True)
    if lost_link_behaviour.sinks:
        yield from _parts(from_here, [(x, y, z), (x, y, 0.0)], lost_link_behaviour.leaves_s, ahead_s)
    if math.isfinite(lost_link_behaviour.height_m):
        yield from _parts(from_here, _way_home((x, y, z), lost_link_behaviour), lost_link_behaviour.leaves_s, ahead_s)


def _way_home(here_m: Vec3, lost_link_behaviour: LostLinkBehaviour) -> list[Vec3]:
    """The corners of a return: up, over to above home, and down."""
    (x, y, z), (home_x, home_y, home_z) = here_m, lost_link_behaviour.home_m
    high = max(z, home_z + lost_link_behaviour.height_m)
    # Near home both autopilots climb less (RTL_CONE_ANG, RTL_CONE_SLOPE): any height in between is possible.
    is_near = math.hypot(home_x - x, home_y - y) < lost_link_behaviour.height_m
    climb: list[Vec3] = [] if is_near or high == z else [(x, y, high)]
    return [here_m, *climb, (home_x, home_y, high), (home_x, home_y, home_z)]


def _parts(from_here: VehicleState, way_m: list[Vec3], leaves_s: float, ahead_s: float) -> Iterator[VehicleState]:
    begins_s, over_s = 0.0, leaves_s + WAITS_S
    for number, (begin, end) in enumerate(pairwise(way_m)):
        level_m, up_m = math.dist(begin[:2], end[:2]), end[2] - begin[2]
        over_s += level_m / SLOW_M_S + max(up_m / SLOW_CLIMB_M_S, -up_m / SLOW_DESCENT_M_S)
        if begins_s - ahead_s <= from_here.age_s <= over_s:
            error_m = HOME_ERROR_M if number > 0 and level_m == 0.0 else from_here.error_m
            age_s = from_here.age_s - begins_s
            yield replace(from_here, position_m=begin, goal_m=end, age_s=age_s, error_m=error_m)
        begins_s += max(level_m / RETURN_M_S, abs(up_m) / CLIMB_M_S)
