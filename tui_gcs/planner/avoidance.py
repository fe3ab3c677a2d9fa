"""Avoidance: wanted velocities altered so that vehicles keep apart, before the guard has to veto them.

For planners whose vehicles share a height (`api.avoid`). Those that come with tui-gcs keep each vehicle on its layer,
and a scenario's layers are at least the vertical limit apart: they cross each other's ways without minding.

Each vehicle takes half of every encounter: it closes in on a neighbour no faster than it can brake within half of the
room between them. That is one half-plane of allowed velocities per neighbour (a barrier certificate: Wang, Ames,
Egerstedt 2017), and standing still lies in all of them, so there always is a solution. Nobody talks to anybody: the
same fleet gives the same velocities. Like everything that looks at the next moment only it may get stuck; two that meet
head on pass each other on the right.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.scenario.model import Limits

Floats = NDArray[np.floating[Any]]
Rows = NDArray[np.intp]

DELAY_S = 0.9
"""From a step until the vehicle does what it says; the guard's own allowance and a step of 5 Hz."""
BRAKE_SHARE = 0.6
"""Of the acceleration; the rest is for neighbours in other directions, and the autopilot's."""
CLIMB_M_S, DESCENT_M_S, ACCEL_Z_M_S2 = 3.0, 1.5, 1.0
"""As the guard's."""
SPARE_M, SPARE_UP_M = 1.7, 0.6
"""Kept beyond the limits: a little more than the guard keeps, that is more the faster they are: see `_slack_m`."""
JERK_M_S3, SURGE_Z_M_S, WEAK_SHARE, ORDER_S = 4.0, 0.5, 0.8, 0.25
"""As the guard's: how soon an acceleration ends, what a climb gains until then, how vehicles brake, and how late."""
ASIDE = 0.7
"""So much of the speed that a neighbour takes away is spent on passing it on the right."""
SWEEPS = 24


@dataclass(frozen=True)
class _Pairs:
    """p ordered pairs of neighbours: the first of each must not move along `normal` faster than `most_m_s`."""

    first: Rows
    normal: Floats
    """(p, 3) unit vectors towards the other, level or upright."""
    most_m_s: Floats


def avoid(
    position_m: Floats, velocity_m_s: Floats, wanted_m_s: Floats, limits: Limits, within_s: float = 0.5
) -> Floats:
    """(n, 3) velocities for the next step, as near to the wanted ones as keeps everybody apart.

    All arrays are (n, 3), ENU. The limits are kept as places are told: what GPS is wrong by comes on top (wandering by
    0.5 m, in 40 random swarms: 1.16 of the limits as told, 0.96 in truth). The result keeps the speed limits; it can be
    had `within_s`: a step, and what a vehicle needs to follow.
    """
    velocity = np.asarray(velocity_m_s, dtype=float)
    wanted = _slow_enough(np.asarray(wanted_m_s, dtype=float), limits)
    if len(wanted) < 2:
        return _reached(velocity, velocity, wanted, limits, within_s)
    pairs = _pairs(np.asarray(position_m, dtype=float), velocity, limits)
    aimed = _slow_enough(_passing_right(wanted, pairs), limits)
    return _reached(velocity, _allowed(velocity, pairs), _allowed(aimed, pairs), limits, within_s)


def _pairs(position: Floats, velocity: Floats, limits: Limits) -> _Pairs:
    first, other = _neighbours(position, limits)
    gap = position[other] - position[first]
    level, upright = np.hypot(gap[:, 0], gap[:, 1]), np.abs(gap[:, 2])
    aside = np.zeros_like(gap)
    # Those above each other are parted by their ids' order: any direction will do, if both take opposite ones.
    aside[:, 0] = np.where(first < other, 1.0, -1.0)
    aside[:, :2] = np.where((level > 1e-6)[:, None], gap[:, :2] / np.maximum(level, 1e-6)[:, None], aside[:, :2])
    up = np.zeros_like(gap)
    up[:, 2] = np.where(gap[:, 2] == 0.0, np.where(first < other, 1.0, -1.0), np.sign(gap[:, 2]))
    slack = _slack_m(velocity, limits)[first] + _slack_m(velocity, limits)[other]
    room_m = level - limits.separation_horizontal_m - SPARE_M - slack[:, 0]
    room_up_m = upright - limits.separation_vertical_m - SPARE_UP_M - slack[:, 1]
    sideways = _most_speed(room_m, BRAKE_SHARE * limits.accel_m_s2)
    vertical = _most_speed(room_up_m, BRAKE_SHARE * ACCEL_Z_M_S2)
    # Apart in one of the two directions is enough: the one in which it is apart, and in which there is more to spare.
    closing_sideways = ((velocity[first] - velocity[other]) * aside).sum(axis=1) / 2
    closing_up = ((velocity[first] - velocity[other]) * up).sum(axis=1) / 2
    more = (vertical - closing_up) / CLIMB_M_S > (sideways - closing_sideways) / limits.speed_m_s
    # Too near in height: there where less is missing, and that is sideways if it is apart there. Above each other,
    # sideways alone would let them close in by height.
    nearly = room_up_m / limits.separation_vertical_m > room_m / limits.separation_horizontal_m
    by_height = np.where(vertical >= 0.0, more | (sideways < 0.0), nearly)
    normal = np.where(by_height[:, None], up, aside)
    return _Pairs(first, normal, np.where(by_height, vertical, sideways))


def _slack_m(velocity: Floats, limits: Limits) -> Floats:
    """(n, 2) how far from where it is foreseen one that brakes may come, sideways and in height, by the guard."""
    surge = limits.accel_m_s2**2 / (2 * JERK_M_S3)
    slack = []
    level, upright = np.hypot(velocity[:, 0], velocity[:, 1]), np.abs(velocity[:, 2])
    for speed, accel, more in ((level, limits.accel_m_s2, surge), (upright, ACCEL_Z_M_S2, SURGE_Z_M_S)):
        slack.append(np.minimum(speed, more) * (ORDER_S + speed / (2 * WEAK_SHARE * accel)))
    return np.stack(slack, axis=1)


def _neighbours(position: Floats, limits: Limits) -> tuple[Rows, Rows]:
    """Ordered pairs that may have to mind each other: so near that somebody at full speed would have to brake."""
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


def _most_speed(room_m: Floats, accel_m_s2: float) -> Floats:
    """Speed from which half of the room is enough to brake after the delay; too near: away, as fast as it is too near.

    v delay + v² / 2a = room / 2, solved for v.
    """
    inside = accel_m_s2 * (np.sqrt(DELAY_S**2 + np.maximum(room_m, 0.0) / accel_m_s2) - DELAY_S)
    return np.where(room_m < 0.0, np.maximum(room_m, -1.0), inside)


def _passing_right(wanted: Floats, pairs: _Pairs) -> Floats:
    """Wanted velocities, with what neighbours take away from them turned to the right in part."""
    taken = np.maximum((wanted[pairs.first] * pairs.normal).sum(axis=1) - np.maximum(pairs.most_m_s, 0.0), 0.0)
    right = np.stack([pairs.normal[:, 1], -pairs.normal[:, 0], np.zeros(len(taken))], axis=1)
    aside = np.zeros_like(wanted)
    np.add.at(aside, pairs.first, ASIDE * taken[:, None] * right)
    return wanted + aside


def _allowed(wanted: Floats, pairs: _Pairs) -> Floats:
    """The velocity near to the wanted one that every half-plane allows: projected on the most violated again and again.

    What is left after that is taken away by slowing down: standing still is allowed by all (but those too near).
    """
    velocity = wanted.copy()
    for _ in range(SWEEPS):
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
    """Within the limits as the station counts them: the speed upwards is part of the speed."""
    up = np.clip(velocity[:, 2], -min(DESCENT_M_S, limits.speed_m_s), min(CLIMB_M_S, limits.speed_m_s))
    speed, most = np.hypot(velocity[:, 0], velocity[:, 1]), np.sqrt(limits.speed_m_s**2 - up**2)
    slowed = velocity * np.minimum(1.0, most / np.maximum(speed, 1e-9))[:, None]
    slowed[:, 2] = up
    return np.asarray(slowed)


def _reached(velocity: Floats, safe: Floats, target: Floats, limits: Limits, within_s: float) -> Floats:
    """What can be had in that time: first the way to `safe`, then, with what acceleration is left, towards `target`.

    Both are allowed, and so is everything between them.
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
