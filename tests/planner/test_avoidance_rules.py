"""What avoidance asks of a few vehicles in a moment, worked out by hand. Swarms fly in test_avoidance.py.

Limits: 8 m/s, 2.5 m/s², 10 m apart or 5 m above each other. Beyond these 1.7 m and 0.6 m are spared, and more by those
who move; of the room that is left each has half, and begins to brake with 1.5 m/s² (0.6 m/s² in height) after 0.9 s.
"""

import math

import numpy as np
import pytest

from tui_gcs.core.guard import motion_prediction as guard_motion
from tui_gcs.planner import avoidance
from tui_gcs.planner.api import Limits
from tui_gcs.planner.avoidance import _allowed, _NeighbourPairs, _neighbours, _reached, avoid

LIMITS = Limits()
Triple = tuple[float, float, float]
STILL: Triple = (0.0, 0.0, 0.0)


def asked(*vehicles: tuple[Triple, Triple, Triple], limits: Limits = LIMITS, within_s: float = 100.0) -> np.ndarray:
    """Velocities for vehicles (place, velocity, wanted velocity) that have time enough to reach these."""
    places, velocities, wanted = (np.array(rows) for rows in zip(*vehicles, strict=True))
    return avoid(places, velocities, wanted, limits, within_s)


def test_its_manners_are_those_that_the_guard_counts_with() -> None:
    guards = guard_motion.JERK_M_S3, guard_motion.SURGE_Z_M_S, guard_motion.BRAKE_SHARE, guard_motion.BRAKE_DELAY_S
    assert guards == (avoidance.JERK_M_S3, avoidance.SURGE_Z_M_S, avoidance.WEAK_SHARE, avoidance.ORDER_S)
    guards = guard_motion.CLIMB_M_S, guard_motion.DESCENT_M_S, guard_motion.ACCEL_Z_M_S2
    assert guards == (avoidance.CLIMB_M_S, avoidance.DESCENT_M_S, avoidance.ACCEL_Z_M_S2)


# ---------------------------------------------------------------- sideways


def test_two_that_stand_30_m_apart_close_in_so_fast_that_each_can_stop_in_half_the_room_and_turn_right() -> None:
    """18.3 m of room: 0.9 s * 4.06 m/s + 4.06² / (2 * 1.5) = 9.15 m. Of the 3.94 m/s taken away 0.7 go to the right."""
    one, other = asked(((0.0, 0.0, 40.0), STILL, (8.0, 0.0, 0.0)), ((30.0, 0.0, 40.0), STILL, (-8.0, 0.0, 0.0)))
    closing = 4.0604
    right = 0.7 * (8.0 - closing)
    right *= 8.0 / math.hypot(8.0, right)
    assert one == pytest.approx([closing, -right, 0.0], abs=1e-3)
    assert other == pytest.approx([-closing, right, 0.0], abs=1e-3)


def test_a_moving_vehicle_keeps_more_room_by_what_the_guard_adds_for_its_speed() -> None:
    """1.758 m at 8 m/s: 0.78 m/s more until the acceleration has ended, for 0.25 s and as long as braking takes."""
    at, there = (0.0, 0.0, 40.0), (60.0, 0.0, 40.0)
    east, west = (8.0, 0.0, 0.0), (-8.0, 0.0, 0.0)
    for speeds, room_m in (((east, west), 48.3 - 2 * 1.758), ((east, STILL), 48.3 - 1.758), ((STILL, STILL), 48.3)):
        one, other = asked((at, speeds[0], east), (there, speeds[1], west))
        for closing in (one[0], -other[0]):
            assert closing * 0.9 + closing**2 / 3.0 == pytest.approx(room_m / 2, abs=2e-3)


@pytest.mark.parametrize(("gap_m", "apart_m_s"), [(11.7, 0.0), (11.2, 0.5), (9.7, 1.0)])
def test_vehicles_too_near_part_as_fast_as_they_are_too_near_and_1_m_s_at_most(gap_m: float, apart_m_s: float) -> None:
    one, other = asked(((0.0, 0.0, 40.0), STILL, STILL), ((0.0, gap_m, 40.0), STILL, STILL))
    assert one == pytest.approx([0.0, -apart_m_s, 0.0], abs=1e-6)
    assert other == pytest.approx([0.0, apart_m_s, 0.0], abs=1e-6)


def test_a_velocity_away_from_a_neighbour_is_not_limited() -> None:
    away = asked(((0.0, 0.0, 40.0), STILL, (-6.0, 2.0, 0.0)), ((12.0, 0.0, 40.0), STILL, (5.0, -1.0, 1.0)))
    assert away == pytest.approx(np.array([[-6.0, 2.0, 0.0], [5.0, -1.0, 1.0]]))


# ---------------------------------------------------------------- above each other


def test_a_vehicle_above_another_descends_so_slowly_that_both_can_stop() -> None:
    """7 m: 1.4 m of room. 0.9 s * 0.524 m/s + 0.524² / (2 * 0.6) = 0.7 m. Nothing keeps them apart sideways."""
    low, high = asked(((0.0, 0.0, 40.0), STILL, (2.0, 0.0, 1.0)), ((0.0, 0.0, 47.0), STILL, (-2.0, 0.0, -1.0)))
    assert low == pytest.approx([2.0, 0.0, 0.5238], abs=1e-3)
    assert high == pytest.approx([-2.0, 0.0, -0.5238], abs=1e-3)


def test_a_climbing_vehicle_keeps_more_room_above_it() -> None:
    """1.0625 m at 3 m/s, 0.297 m at 1.5 m/s down: 0.5 m/s more for 0.25 s and as long as braking takes."""
    low, high = (0.0, 0.0, 40.0), (0.0, 0.0, 55.0)
    climbing, descending = asked((low, (0.0, 0.0, 3.0), (0.0, 0.0, 3.0)), (high, (0.0, 0.0, -1.5), (0.0, 0.0, -1.5)))
    room_m = 15.0 - 5.6 - 1.0625 - 0.5 * (0.25 + 1.5 / 1.6)
    most = climbing[2]
    assert most * 0.9 + most**2 / 1.2 == pytest.approx(room_m / 2, abs=1e-3)
    assert descending[2] == pytest.approx(-1.5), "slower than that anyway"


def test_two_in_one_place_part_by_height_one_down_and_one_up() -> None:
    one, other = asked(((5.0, 5.0, 40.0), STILL, STILL), ((5.0, 5.0, 40.0), STILL, STILL))
    assert one == pytest.approx([0.0, 0.0, -1.0])
    assert other == pytest.approx([0.0, 0.0, 1.0])


def test_two_in_one_place_part_west_and_east() -> None:
    """Without a direction the first one goes west. Limits of which less is missing sideways."""
    wide = Limits(separation_horizontal_m=100.0, separation_vertical_m=1.0)
    one, other = asked(((5.0, 5.0, 40.0), STILL, STILL), ((5.0, 5.0, 40.1), STILL, STILL), limits=wide)
    assert one == pytest.approx([-1.0, 0.0, 0.0])
    assert other == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize(("up_m", "expected"), [(4.0, (-1.0, 0.0, 0.0)), (4.5, (0.0, 0.0, -1.0))])
def test_too_near_in_both_they_part_where_less_is_missing(up_m: float, expected: Triple) -> None:
    """9 m apart 2.7 m of 10 are missing; in height 1.6 m or 1.1 m of 5."""
    one, other = asked(((0.0, 0.0, 40.0), STILL, STILL), ((9.0, 0.0, 40.0 + up_m), STILL, STILL))
    assert one == pytest.approx(expected)
    assert other == pytest.approx(-np.array(expected))


def test_apart_in_both_they_keep_apart_where_there_is_more_to_spare() -> None:
    """40 m and 12 m: 5.30 of 8 m/s against 1.49 of 3 m/s; a vehicle that approaches at 4 m/s has less left sideways."""
    low, high = (0.0, 0.0, 40.0), (40.0, 0.0, 52.0)
    together, apart = (6.0, 0.0, 2.0), (-6.0, 0.0, -1.5)
    standing = asked((low, STILL, together), (high, STILL, apart))
    assert standing[:, 0] == pytest.approx([5.304, -5.304], abs=1e-3)
    assert standing[:, 2] == pytest.approx([2.0, -1.5])
    moving = asked((low, (4.0, 0.0, 0.0), together), (high, (-4.0, 0.0, 0.0), apart))
    assert moving == pytest.approx(np.array([[6.0, 0.0, 1.4926], [-6.0, 0.0, -1.4926]]), abs=1e-3)
    sinking = asked((low, (4.0, 0.0, 1.5), together), (high, (-4.0, 0.0, -1.5), apart))
    assert sinking[:, 2] == pytest.approx([2.0, -1.5]), "now there is less left by height"


@pytest.mark.parametrize(("climb_m_s", "keep"), [(0.0, "height"), (0.04, "height"), (0.12, "place")])
def test_what_there_is_to_spare_is_less_by_how_fast_each_closes_in(climb_m_s: float, keep: str) -> None:
    """Each at 1.5 m/s: 3.69 of 8 m/s are left sideways, 0.462. In height 0.483 at 0.04 m/s, 0.454 at 0.12 m/s."""
    low, high = (0.0, 0.0, 40.0), (40.0, 0.0, 52.0)
    one, other = asked(
        (low, (1.5, 0.0, climb_m_s), (6.0, 0.0, 2.0)), (high, (-1.5, 0.0, -climb_m_s), (-6.0, 0.0, -1.5))
    )
    if keep == "height":
        assert (one[0], other[0]) == (pytest.approx(6.0), pytest.approx(-6.0))
        assert one[2] < 1.5 and other[2] > -1.5
    else:
        assert one[0] < 5.2 and other[0] > -5.2
        assert (one[2], other[2]) == (pytest.approx(2.0), pytest.approx(-1.5))


# ---------------------------------------------------------------- who minds whom


@pytest.mark.parametrize(
    ("gap_m", "minds"),
    [
        ((72.2, 0.0, 0.0), True),
        ((72.4, 0.0, 0.0), False),
        ((0.0, -72.2, 20.0), True),
        ((1.0, 0.0, 28.1), True),
        ((1.0, 0.0, -28.1), True),
        ((1.0, 0.0, 28.2), False),
    ],
)
def test_neighbours_are_those_that_would_have_to_brake_at_full_speed(gap_m: Triple, minds: bool) -> None:
    """Sideways 11.7 + 2 * (8 * 0.9 + 8² / 3 + 1.758) m, in height 5.6 + 2 * (3 * 0.9 + 3² / 1.2 + 1.0625) m."""
    first, other = _neighbours(np.array([(3.0, 4.0, 30.0), np.add((3.0, 4.0, 30.0), gap_m)]), LIMITS)
    assert sorted(zip(first, other, strict=True)) == ([(0, 1), (1, 0)] if minds else [])


# ---------------------------------------------------------------- several neighbours


def pairs(*rows: tuple[Triple, float]) -> _NeighbourPairs:
    """One vehicle that may close in on each of its neighbours so fast."""
    normals, most = zip(*rows, strict=True)
    return _NeighbourPairs(np.zeros(len(rows), dtype=np.intp), np.array(normals), np.array(most))


def test_between_two_neighbours_ahead_it_goes_on_as_far_as_both_allow() -> None:
    c = math.sqrt(0.5)
    ahead = pairs(((c, c, 0.0), 1.0), ((c, -c, 0.0), 1.0))
    assert _allowed(np.array([[8.0, 0.0, 0.0]]), ahead)[0] == pytest.approx([math.sqrt(2.0), 0.0, 0.0])


def test_pressed_from_both_sides_it_stands() -> None:
    pressed = pairs(((1.0, 0.0, 0.0), -1.0), ((-1.0, 0.0, 0.0), -1.0))
    assert _allowed(np.array([[0.0, 3.0, 0.0]]), pressed)[0] == pytest.approx(STILL)


def test_what_comes_out_is_allowed_by_every_neighbour_however_many() -> None:
    rng = np.random.default_rng(1)
    for _ in range(100):
        normals = rng.normal(size=(7, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        around = _NeighbourPairs(rng.integers(0, 2, 7), normals, rng.uniform(0.0, 3.0, 7))
        velocity = _allowed(rng.normal(0.0, 6.0, (2, 3)), around)
        assert ((velocity[around.first] * normals).sum(axis=1) <= around.most_m_s + 2e-4).all()


# ---------------------------------------------------------------- what can be had in a step


@pytest.mark.parametrize(
    ("safe", "target", "expected"),
    [
        ((0.3, 0.0), (0.3, 1.0), (0.3, 0.4)),  # 0.5 m/s can be had: what safety leaves is 0.4
        ((0.3, 0.0), (0.9, 0.0), (0.5, 0.0)),
        ((0.3, 0.0), (0.0, 0.0), (0.0, 0.0)),
        ((2.0, 0.0), (2.0, 1.0), (0.5, 0.0)),  # safety takes all
        ((0.0, 0.0), (0.1, -0.2), (0.1, -0.2)),
        ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),
    ],
)
def test_first_what_is_safe_then_what_is_wanted(
    safe: tuple[float, float], target: tuple[float, float], expected: tuple[float, float]
) -> None:
    velocity = np.array([[2.0, 1.0, 0.0]])
    allowed, wanted = velocity + np.array([*safe, 0.0]), velocity + np.array([*target, 0.0])
    change = _reached(velocity, allowed, wanted, LIMITS, 0.2) - velocity
    assert change[0] == pytest.approx([*expected, 0.0], abs=1e-6)


@pytest.mark.parametrize(("up", "expected"), [(1.0, 0.2), (-1.0, -0.2), (0.1, 0.1)])
def test_a_climb_begins_and_ends_with_1_m_s2(up: float, expected: float) -> None:
    assert asked(((0.0, 0.0, 40.0), STILL, (0.0, 0.0, up)), within_s=0.2)[0] == pytest.approx([0.0, 0.0, expected])


def test_limits_below_a_climbs_speed_are_kept_too() -> None:
    slow = Limits(speed_m_s=1.0)
    assert asked(((0.0, 0.0, 40.0), STILL, (5.0, 0.0, 9.0)), limits=slow)[0] == pytest.approx([0.0, 0.0, 1.0])
    assert asked(((0.0, 0.0, 40.0), STILL, (5.0, 0.0, -9.0)), limits=slow)[0] == pytest.approx([0.0, 0.0, -1.0])
