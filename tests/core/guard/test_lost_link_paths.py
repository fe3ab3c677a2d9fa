"""Ways that a LOST vehicle may fly by its own failsafe: home, or down where it is."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.core.rigs.guard_rig import LIMITS, guard, sight, stand
from tui_gcs.core.guard.lost_link_paths import lost_link_paths
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour, MotionModel, VehicleState, lost_link_reach
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits

HOME = (20.0, 50.0, 0.0)
RETURNS = LostLinkBehaviour(HOME, leaves_s=5.0, height_m=60.0)
STANDS = VehicleState(2, (140.0, 50.0, 40.0), (0.0, 0.0, 0.0), age_s=4.0, error_m=1.0, lost_link_behaviour=RETURNS)
"""120 m from home, and 20 m below the height it returns at."""
UP, OVER, DOWN = (
    ((140.0, 50.0, 40.0), (140.0, 50.0, 60.0)),
    ((140.0, 50.0, 60.0), (20.0, 50.0, 60.0)),
    (
        (20.0, 50.0, 60.0),
        HOME,
    ),
)


def parts(lost: VehicleState, age_s: float, ahead_s: float = 5.0) -> list[tuple[Vec3, Vec3 | None]]:
    return [(part.position_m, part.goal_m) for part in lost_link_paths([replace(lost, age_s=age_s)], LIMITS, ahead_s)]


def met(lost: VehicleState, x: float, y: float, z: float) -> bool:
    """Whether somebody may not fly from 6 m south of a place to 6 m north of it."""
    me = sight((x, y - 6.0, z), stand(x, y + 6.0, z))
    return not guard().separation(me, [lost], 0.0).ok


def come(part: VehicleState, speed_m_s: float = 8.0) -> list[float]:
    """Where the fastest is by now."""
    return [float(x) for x in lost_link_reach(part, Limits(speed_m_s=speed_m_s), np.zeros(1))[0]]


# ---------------------------------------------------------------- parts


@pytest.mark.parametrize(
    ("age_s", "expected"),
    [
        (3.0, [UP, OVER]),  # the fastest is 20 m higher after 6.7 s, and 5 s are foreseen
        (11.0, [UP, OVER]),
        (12.0, [UP, OVER, DOWN]),  # and above home 10 s later
        (25.0, [UP, OVER, DOWN]),  # the slowest leaves after 5 s, waits for 10 s and climbs for 10 s
        (26.0, [OVER, DOWN]),
        (55.0, [OVER, DOWN]),  # flies home for 30 s
        (56.0, [DOWN]),
        (205.0, [DOWN]),  # and lands for 150 s
        (206.0, []),
    ],
)
def test_home_is_up_over_and_down(age_s: float, expected: list[tuple[Vec3, Vec3]]) -> None:
    assert parts(STANDS, age_s) == expected


def test_farther_ahead_the_next_part_is_seen_sooner() -> None:
    assert parts(STANDS, 4.7, ahead_s=1.9) == [UP]
    assert parts(STANDS, 4.7, ahead_s=2.0) == [UP, OVER]


def test_who_is_high_enough_does_not_climb() -> None:
    high = replace(STANDS, position_m=(140.0, 50.0, 60.0))
    higher = replace(STANDS, position_m=(140.0, 50.0, 70.0))
    assert parts(high, 4.0)[0] == OVER
    assert parts(higher, 4.0)[0] == ((140.0, 50.0, 70.0), (20.0, 50.0, 70.0))


def test_height_is_above_home() -> None:
    on_a_hill = replace(STANDS, lost_link_behaviour=LostLinkBehaviour((20.0, 50.0, 15.0), 5.0, 60.0))
    assert parts(on_a_hill, 4.0)[0][1] == (140.0, 50.0, 75.0)


def test_near_home_it_may_climb_less_so_both_are_one_part() -> None:
    near = replace(STANDS, position_m=(79.0, 50.0, 40.0))
    assert parts(near, 4.0) == [((79.0, 50.0, 40.0), (20.0, 50.0, 60.0)), ((20.0, 50.0, 60.0), HOME)]
    assert parts(replace(STANDS, position_m=(80.0, 50.0, 40.0)), 4.0)[0] == ((80.0, 50.0, 40.0), (80.0, 50.0, 60.0))


def test_down_where_it_is() -> None:
    """The slowest needs 5 s until it leaves, 10 s of waiting and 100 s for 40 m."""
    sinks = replace(STANDS, lost_link_behaviour=LostLinkBehaviour(HOME, 5.0, sinks=True))
    down = ((140.0, 50.0, 40.0), (140.0, 50.0, 0.0))
    assert parts(sinks, 4.0) == [down] and parts(sinks, 115.0) == [down] and parts(sinks, 116.0) == []
    both = replace(STANDS, lost_link_behaviour=LostLinkBehaviour(HOME, 5.0, 60.0, sinks=True))
    assert parts(both, 4.0) == [down, UP, OVER]


def test_only_who_is_lost_and_does_something() -> None:
    assert parts(STANDS, 2.9) == []
    assert parts(replace(STANDS, motion=MotionModel.STOPS), 9.0) == []
    assert parts(replace(STANDS, lost_link_behaviour=None), 9.0) == []


# ---------------------------------------------------------------- from where


def test_it_leaves_from_between_where_it_was_seen_and_where_it_may_have_come_to() -> None:
    """East at 8 m/s: after 4 s it is up to 48 m on, with 16 m of braking; it may be 10 m aside, and 1."""
    flies = replace(STANDS, velocity_m_s=(8.0, 0.0, 0.0))
    climbs, over = lost_link_paths([flies], LIMITS, 5.0)
    assert (climbs.position_m, climbs.goal_m) == ((140.0, 50.0, 40.0), (188.0, 50.0, 60.0))
    assert climbs.error_m == 10.0 + 1.0
    assert climbs.velocity_m_s == (0.0, 0.0, 0.0) and climbs.id == 2 and climbs.on_own_way
    assert over.position_m == (164.0, 50.0, 60.0) and over.error_m == 24.0 + 10.0 + 1.0, "from somewhere there"
    much_later = lost_link_paths([replace(flies, age_s=20.0)], LIMITS, 5.0)[0]
    assert much_later.goal_m == (196.0, 50.0, 60.0), "it left after 5 s at the latest"
    assert much_later.error_m == 12.5 + 1.0


def test_northwards_as_eastwards() -> None:
    flies = replace(STANDS, velocity_m_s=(0.0, 8.0, 3.0))
    climbs, over = lost_link_paths([flies], LIMITS, 5.0)
    assert climbs.goal_m == (140.0, 98.0, 60.0) and climbs.error_m == 10.0 + 1.0
    assert over.position_m == (140.0, 74.0, 60.0) and over.error_m == 24.0 + 10.0 + 1.0


def test_it_leaves_from_its_way_to_where_it_was_sent() -> None:
    sent = replace(STANDS, goal_m=(140.0, 100.0, 40.0))
    climbs, over = lost_link_paths([sent], LIMITS, 5.0)
    assert climbs.goal_m == (140.0, 82.0, 60.0) and climbs.error_m == 1.0
    assert over.position_m == (140.0, 66.0, 60.0) and over.error_m == 16.0 + 1.0


def test_it_takes_no_longer_to_sink_from_a_long_way_than_from_a_place() -> None:
    """How far it had come when it left is not flown while it sinks: 5 s, 10 s of waiting and 100 s for 40 m."""
    flies = replace(STANDS, velocity_m_s=(8.0, 0.0, 0.0), lost_link_behaviour=LostLinkBehaviour(HOME, 5.0, sinks=True))
    assert parts(flies, 115.0) == [((140.0, 50.0, 40.0), (196.0, 50.0, 0.0))] and parts(flies, 116.0) == []


def test_it_sinks_no_faster_than_autopilots_descend() -> None:
    """1.5 m/s: those two layers below have the time to fly round. With the rate of a climb they were held at once."""
    sinks = replace(STANDS, lost_link_behaviour=LostLinkBehaviour(HOME, 5.0, sinks=True))
    (down,) = lost_link_paths([sinks], LIMITS, 5.0)
    assert come(down) == [140.0, 50.0, 34.0] and come(replace(down, age_s=20.0)) == [140.0, 50.0, 10.0]
    assert not met(sinks, 140.0, 50.0, 20.0) and met(replace(sinks, age_s=10.0), 140.0, 50.0, 20.0)


def test_beside_the_way_on_which_it_was_lost_others_go_on() -> None:
    """Flown: a disc over the whole of that way held vehicles on the next lanes of their tour, 40 m beside it."""
    sinks = LostLinkBehaviour(HOME, 5.0, sinks=True)
    flies = replace(STANDS, position_m=(80.0, 100.0, 40.0), velocity_m_s=(8.0, 0.0, 0.0), lost_link_behaviour=sinks)
    later = replace(flies, age_s=20.0)
    assert met(later, 80.0, 100.0, 30.0) and met(later, 136.0, 100.0, 30.0) and met(later, 108.0, 80.0, 30.0)
    assert not met(later, 108.0, 60.0, 30.0) and not met(later, 180.0, 100.0, 30.0)


def test_above_home_it_is_where_home_is() -> None:
    flies = replace(STANDS, velocity_m_s=(8.0, 0.0, 0.0), age_s=30.0)
    *_, over, down = lost_link_paths([flies], LIMITS, 5.0)
    assert over.error_m > 40.0 and down.error_m == 3.0
    over, down = lost_link_paths([replace(flies, position_m=(40.0, 50.0, 40.0), age_s=9.0)], LIMITS, 5.0)
    assert over.error_m > 40.0 and down.error_m == 3.0, "near home, too"


# ---------------------------------------------------------------- judged


def test_others_keep_clear_of_its_climb_its_way_and_its_landing() -> None:
    at_once, later = replace(STANDS, age_s=4.0), replace(STANDS, age_s=25.0)
    assert met(at_once, 140.0, 50.0, 50.0) and met(at_once, 140.0, 50.0, 60.0), "it climbs"
    assert not met(at_once, 140.0, 50.0, 30.0)
    assert not met(at_once, 70.0, 50.0, 60.0) and met(later, 70.0, 50.0, 60.0), "it flies home at 60 m"
    assert not met(later, 70.0, 50.0, 50.0)
    assert met(replace(STANDS, age_s=35.0), 20.0, 50.0, 30.0), "and lands there"
    assert not met(replace(STANDS, age_s=210.0), 20.0, 50.0, 30.0)


def test_on_its_way_it_may_be_faster_than_the_limit_and_not_before_the_part_begins() -> None:
    """12 m/s: it is above (140, 50) after 6.7 s at the earliest, and 36 m on 3 s later."""
    over = lost_link_paths([replace(STANDS, age_s=20.0 / 3.0 + 3.0)], LIMITS, 5.0)[1]
    assert over.age_s == pytest.approx(3.0)
    assert come(replace(over, age_s=3.0)) == [104.0, 50.0, 60.0]
    assert come(replace(over, age_s=3.0), speed_m_s=20.0) == [80.0, 50.0, 60.0], "where the limit is higher, that"
    assert come(replace(over, age_s=-3.0)) == [140.0, 50.0, 60.0]
    assert met(replace(over, age_s=3.0), 104.0, 50.0, 60.0)
    assert not met(replace(over, age_s=-20.0), 104.0, 50.0, 60.0)


def test_no_number_does_no_harm() -> None:
    odd = replace(STANDS, velocity_m_s=(math.nan, math.inf, 0.0))
    assert parts(odd, 4.0) == parts(STANDS, 4.0)


def test_what_it_may_begin_until_the_end_of_what_is_foreseen_counts() -> None:
    """5 s: from 140 m east it may be over home after 10 s, and come down there, where it is less sure where home is."""
    at_height = replace(STANDS, position_m=(140.0, 50.0, 60.0))
    assert met(replace(at_height, age_s=5.1), 8.0, 50.0, 60.0)
    assert not met(replace(at_height, age_s=4.9), 8.0, 50.0, 60.0)
    assert met(replace(at_height, position_m=(80.0, 50.0, 60.0)), 20.0, 50.0, 54.0), "over home in 1 s, then down"
