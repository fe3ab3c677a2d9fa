"""The paths that a LOST vehicle may fly by its own failsafe: home, or down where it is.

Each is a row of segments. A segment is predicted like a lost vehicle on the way to the segment's end: it may be
anywhere between the beginning and where the fastest vehicle would be by now. A segment begins when the fastest vehicle
gets there that left at once, and is over when the slowest has passed that left at the latest.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

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
    error_m = state.error_m + turning_error_m(left, limits)
    from_here = replace(
        state,
        error_m=error_m,
        velocity_m_s=(0.0, 0.0, 0.0),
        goal_m=None,
        lost_link_behaviour=None,
        on_own_way=True,
    )
    leaves = _Departure(seen[:2].tolist(), come[:2].tolist(), float(seen[2]), error_m)
    if lost_link_behaviour.sinks:
        yield from _parts(from_here, [leaves.to_height(0.0)], lost_link_behaviour.leaves_s, ahead_s)
    if math.isfinite(lost_link_behaviour.height_m):
        way_home = _way_home(leaves, lost_link_behaviour)
        yield from _parts(from_here, way_home, lost_link_behaviour.leaves_s, ahead_s)


@dataclass(frozen=True)
class _PathLeg:
    """One straight part of a path, from a place to a place, and by how much both may be wrong."""

    begin_m: Vec3
    end_m: Vec3
    error_m: float
    level_m: float
    """How far it flies sideways on it."""


@dataclass(frozen=True)
class _Departure:
    """Where a lost vehicle leaves its course: somewhere between two places, `error_m` aside, at one height.

    It is as narrow as it is known: a disc over the whole of it would close the tours beside the one that it flew, too.
    """

    seen_m: tuple[float, float]
    come_m: tuple[float, float]
    height_m: float
    error_m: float

    def to_height(self, height_m: float) -> _PathLeg:
        """The leg straight up or down from there."""
        begin, end = (*self.seen_m, self.height_m), (*self.come_m, height_m)
        return _PathLeg(begin, end, self.error_m, 0.0)

    def over_to(self, begins_m: float, end_m: Vec3) -> _PathLeg:
        """The leg from above there, at the height `begins_m`, to another place."""
        (x0, y0), (x1, y1) = self.seen_m, self.come_m
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
        error_m = self.error_m + math.dist(self.seen_m, self.come_m) / 2
        return _PathLeg((x, y, begins_m), end_m, error_m, math.dist((x, y), end_m[:2]))


def _way_home(leaves: _Departure, lost_link_behaviour: LostLinkBehaviour) -> list[_PathLeg]:
    """The legs of a return: up, over to above home, and down."""
    home_x, home_y, home_z = lost_link_behaviour.home_m
    high = max(leaves.height_m, home_z + lost_link_behaviour.height_m)
    above_home = (home_x, home_y, high)
    down = _PathLeg(above_home, lost_link_behaviour.home_m, HOME_ERROR_M, 0.0)
    # Near home both autopilots climb less (RTL_CONE_ANG, RTL_CONE_SLOPE): any height in between is possible.
    is_near = leaves.over_to(high, above_home).level_m < lost_link_behaviour.height_m
    if is_near or high == leaves.height_m:
        return [leaves.over_to(leaves.height_m, above_home), down]
    return [leaves.to_height(high), leaves.over_to(high, above_home), down]


def _parts(from_here: VehicleState, legs: list[_PathLeg], leaves_s: float, ahead_s: float) -> Iterator[VehicleState]:
    begins_s, over_s = 0.0, leaves_s + WAITS_S
    for leg in legs:
        up_m = leg.end_m[2] - leg.begin_m[2]
        over_s += leg.level_m / SLOW_M_S + max(up_m / SLOW_CLIMB_M_S, -up_m / SLOW_DESCENT_M_S)
        if begins_s - ahead_s <= from_here.age_s <= over_s:
            age_s = from_here.age_s - begins_s
            yield replace(from_here, position_m=leg.begin_m, goal_m=leg.end_m, age_s=age_s, error_m=leg.error_m)
        begins_s += max(leg.level_m / RETURN_M_S, abs(up_m) / CLIMB_M_S)
