"""Collision avoidance: alters wanted velocities so that vehicles keep apart, before the guard has to veto them.

It is for planners whose vehicles share a height (`api.avoid`). The built-in planners keep each vehicle on its own
altitude layer, and layers are at least the vertical limit apart, so their vehicles may cross each other's ways.

Each vehicle takes half of every encounter: it approaches a neighbour no faster than it can brake within half of the
room between them. Each neighbour thus gives one half-plane of allowed velocities (a barrier certificate: Wang, Ames,
Egerstedt 2017). Standing still lies in all of them, so there always is a solution. Vehicles do not communicate: the
same fleet gives the same velocities. Like all reactive methods it may get stuck; two vehicles that meet head on pass
each other on the right.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.scenario.model import Limits

Floats = NDArray[np.floating[Any]]
Rows = NDArray[np.intp]

DELAY_S = 0.9
"""Time from a step until the vehicle follows it: the guard's own allowance and a step at 5 Hz."""
BRAKE_SHARE = 0.6
"""Share of the acceleration for one neighbour; the rest is for neighbours in other directions and for the autopilot."""
CLIMB_M_S, DESCENT_M_S, ACCEL_Z_M_S2 = 3.0, 1.5, 1.0
"""Climb and descent (m/s) and vertical acceleration (m/s²) that the guard allows."""
SPARE_M, SPARE_UP_M = 1.7, 0.6
"""Distance kept beyond the limits. The guard keeps a little less, and more the faster vehicles are (see `_slack_m`)."""
JERK_M_S3, SURGE_Z_M_S, WEAK_SHARE, ORDER_S = 4.0, 0.5, 0.8, 0.25
"""The guard's model of a vehicle: how soon an acceleration ends, what a climb gains until then, how hard it brakes, and
how late."""
PASSING_SHARE = 0.7
"""Share of the speed that a neighbour takes away which is turned into passing it on the right."""
MAX_SWEEPS = 24
"""Projections onto violated half-planes before what is left is slowed down."""


@dataclass(frozen=True)
class _NeighbourPairs:
    """p ordered pairs of neighbours: the first of each must not move along `normal` faster than `most_m_s`."""

    first: Rows
    normal: Floats
    """(p, 3) unit vectors towards the other vehicle, horizontal or vertical."""
    most_m_s: Floats


def avoid(
    position_m: Floats, velocity_m_s: Floats, wanted_m_s: Floats, limits: Limits, within_s: float = 0.5
) -> Floats:
    """Return (n, 3) velocities for the next step, as near to the wanted ones as separation allows.

    All arrays are (n, 3), ENU. The separation limits hold for reported positions; GPS errors come on top (wandering by
    0.5 m, in 40 random swarms: 1.16 of the limits as reported, 0.96 in truth). The result keeps the speed limits and
    can be reached `within_s`: the time of a step plus what a vehicle needs to follow.
    """
    velocity = np.asarray(velocity_m_s, dtype=float)
    wanted = _slow_enough(np.asarray(wanted_m_s, dtype=float), limits)
    if len(wanted) < 2:
        return _reached(velocity, velocity, wanted, limits, within_s)
    pairs = _pairs(np.asarray(position_m, dtype=float), velocity, limits)
    aimed = _slow_enough(_passing_right(wanted, pairs), limits)
    return _reached(velocity, _allowed(velocity, pairs), _allowed(aimed, pairs), limits, within_s)


def _pairs(position: Floats, velocity: Floats, limits: Limits) -> _NeighbourPairs:
    first, other = _neighbours(position, limits)
    gap = position[other] - position[first]
    level, upright = np.hypot(gap[:, 0], gap[:, 1]), np.abs(gap[:, 2])
    aside = np.zeros_like(gap)
    # Vehicles above each other are parted by the order of rows: any direction will do if both take opposite ones.
    aside[:, 0] = np.where(first < other, 1.0, -1.0)
    aside[:, :2] = np.where((level > 1e-6)[:, None], gap[:, :2] / np.maximum(level, 1e-6)[:, None], aside[:, :2])
    up = np.zeros_like(gap)
    up[:, 2] = np.where(gap[:, 2] == 0.0, np.where(first < other, 1.0, -1.0), np.sign(gap[:, 2]))
    slack = _slack_m(velocity, limits)[first] + _slack_m(velocity, limits)[other]
    room_m = level - limits.separation_horizontal_m - SPARE_M - slack[:, 0]
    room_up_m = upright - limits.separation_vertical_m - SPARE_UP_M - slack[:, 1]
    sideways = _max_approach_speed(room_m, BRAKE_SHARE * limits.accel_m_s2)
    vertical = _max_approach_speed(room_up_m, BRAKE_SHARE * ACCEL_Z_M_S2)
    # Separation in one direction is enough. Choose the one in which they are apart and have more to spare.
    approach_sideways = ((velocity[first] - velocity[other]) * aside).sum(axis=1) / 2
    approach_up = ((velocity[first] - velocity[other]) * up).sum(axis=1) / 2
    more = (vertical - approach_up) / CLIMB_M_S > (sideways - approach_sideways) / limits.speed_m_s
    # Too near in height: choose the direction in which less is missing; sideways if they are apart there. Above each
    # other, sideways alone would let them approach in height.
    nearly = room_up_m / limits.separation_vertical_m > room_m / limits.separation_horizontal_m
    by_height = np.where(vertical >= 0.0, more | (sideways < 0.0), nearly)
    normal = np.where(by_height[:, None], up, aside)
    return _NeighbourPairs(first, normal, np.where(by_height, vertical, sideways))


def _slack_m(velocity: Floats, limits: Limits) -> Floats:
    """Return (n, 2) how far a braking vehicle may end from its predicted place, sideways and in height.

    This is the guard's model of a vehicle.
    """
    surge = limits.accel_m_s2**2 / (2 * JERK_M_S3)
    slack = []
    level, upright = np.hypot(velocity[:, 0], velocity[:, 1]), np.abs(velocity[:, 2])
    for speed, accel, more in ((level, limits.accel_m_s2, surge), (upright, ACCEL_Z_M_S2, SURGE_Z_M_S)):
        slack.append(np.minimum(speed, more) * (ORDER_S + speed / (2 * WEAK_SHARE * accel)))
    return np.stack(slack, axis=1)


def _neighbours(position: Floats, limits: Limits) -> tuple[Rows, Rows]:
    """Return ordered pairs that may have to avoid each other: one of them at full speed would have to brake."""
    from scipy.spatial import cKDTree

    accel = BRAKE_SHARE * limits.accel_m_s2
    fastest = np.array([[limits.speed_m_s, 0.0, CLIMB_M_S]])
    slack_m, slack_up_m = 2 * _slack_m(fastest, limits)[0]
    room_m = 2 * (limits.speed_m_s * DELAY_S + limits.speed_m_s**2 / (2 * accel))
    reach_m = limits.separation_horizontal_m + SPARE_M + room_m + slack_m
    pairs = cKDTree(position[:, :2]).query_pairs(reach_m, output_type="ndarray")
    brake_up_m = 2 * (CLIMB_M_S * DELAY_S + CLIMB_M_S**2 / (2 * BRAKE_SHARE * ACCEL_Z_M_S2))
    high_m = limits.separation_vertical_m + SPARE_UP_M + brake_up_m + slack_up_m
    pairs = pairs[np.abs(position[pairs[:, 0], 2] - position[pairs[:, 1], 2]) < high_m]
    first, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    return first, other


def _max_approach_speed(room_m: Floats, accel_m_s2: float) -> Floats:
    """Return the speed from which half of the room is enough to brake after the delay.

    v delay + v² / 2a = room / 2, solved for v. Vehicles that are too near move apart, as fast as they are too near.
    """
    inside = accel_m_s2 * (np.sqrt(DELAY_S**2 + np.maximum(room_m, 0.0) / accel_m_s2) - DELAY_S)
    return np.where(room_m < 0.0, np.maximum(room_m, -1.0), inside)


def _passing_right(wanted: Floats, pairs: _NeighbourPairs) -> Floats:
    """Return the wanted velocities, with part of what neighbours take away from them turned to the right."""
    taken = np.maximum((wanted[pairs.first] * pairs.normal).sum(axis=1) - np.maximum(pairs.most_m_s, 0.0), 0.0)
    right = np.stack([pairs.normal[:, 1], -pairs.normal[:, 0], np.zeros(len(taken))], axis=1)
    aside = np.zeros_like(wanted)
    np.add.at(aside, pairs.first, PASSING_SHARE * taken[:, None] * right)
    return wanted + aside


def _allowed(wanted: Floats, pairs: _NeighbourPairs) -> Floats:
    """Return velocities near the wanted ones that all half-planes allow, by projection onto the most violated one.

    What is violated after `MAX_SWEEPS` is removed by slowing down: all half-planes but those of vehicles that are too
    near allow standing still.
    """
    velocity = wanted.copy()
    for _ in range(MAX_SWEEPS):
        over = (velocity[pairs.first] * pairs.normal).sum(axis=1) - pairs.most_m_s
        bad = np.flatnonzero(over > 1e-4)
        if not len(bad):
            return velocity
        worst = bad[np.lexsort((-over[bad], pairs.first[bad]))]
        worst = worst[np.unique(pairs.first[worst], return_index=True)[1]]
        velocity[pairs.first[worst]] -= over[worst, None] * pairs.normal[worst]
    along = (velocity[pairs.first] * pairs.normal).sum(axis=1)
    share = np.ones(len(wanted))
    over = along > np.maximum(pairs.most_m_s, 0.0)
    np.minimum.at(share, pairs.first[over], np.maximum(pairs.most_m_s[over], 0.0) / along[over])
    return velocity * share[:, None]


def _slow_enough(velocity: Floats, limits: Limits) -> Floats:
    """Limit velocities as the station counts them: the vertical speed is part of the speed."""
    up = np.clip(velocity[:, 2], -min(DESCENT_M_S, limits.speed_m_s), min(CLIMB_M_S, limits.speed_m_s))
    speed, most = np.hypot(velocity[:, 0], velocity[:, 1]), np.sqrt(limits.speed_m_s**2 - up**2)
    slowed = velocity * np.minimum(1.0, most / np.maximum(speed, 1e-9))[:, None]
    slowed[:, 2] = up
    return np.asarray(slowed)


def _reached(velocity: Floats, safe: Floats, target: Floats, limits: Limits, within_s: float) -> Floats:
    """Return the velocities that can be reached in that time.

    First comes the way to `safe`, then with the acceleration left the way towards `target`. Both are allowed, and so is
    everything between them.
    """
    most = limits.accel_m_s2 * within_s
    first, then = (safe - velocity)[:, :2], (target - safe)[:, :2]
    size = np.hypot(first[:, 0], first[:, 1])
    along, length2 = (first * then).sum(axis=1), np.maximum((then**2).sum(axis=1), 1e-12)
    left = np.maximum(most**2 - size**2, 0.0)
    share = np.clip((np.sqrt(along**2 + length2 * left) - along) / length2, 0.0, 1.0)
    share[size >= most] = 0.0
    change = np.empty_like(velocity)
    change[:, :2] = first * np.minimum(1.0, most / np.maximum(size, 1e-9))[:, None] + share[:, None] * then
    change[:, 2] = np.clip(target[:, 2] - velocity[:, 2], -ACCEL_Z_M_S2 * within_s, ACCEL_Z_M_S2 * within_s)
    return _slow_enough(velocity + change, limits)
