"""Separation: 10 m sideways or 5 m in height, and a little more; foreseen for those who go on and those who brake."""

import numpy as np
import pytest
from shapely import LineString

from tests.core.rigs.guard_rig import LIMITS, passing, sight, stand
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState, predict, prediction_times
from tui_gcs.core.guard.separation_check import (
    SeparationConflict,
    _apart,
    _is_no_worse,
    _level_m,
    _may_be_close,
    _Reach,
    _VehiclePairs,
    separation_conflicts,
)
from tui_gcs.core.motion.course import Trajectory

HERE = (50.0, 50.0, 40.0)
STILL = (0.0, 0.0, 0.0)


def met(me: VehicleState, *others: VehicleState) -> SeparationConflict | None:
    return judged([me], list(others)).get(0)


def judged(
    sights: list[VehicleState], known: list[VehicleState], passed: list[bool] | None = None
) -> dict[int, SeparationConflict]:
    prediction = predict(sights + known, LIMITS, prediction_times(LIMITS), 0.0)
    return separation_conflicts(*prediction.split(len(sights)), passed or [True] * len(sights), LIMITS)


def holder(x: float, y: float, z: float = 40.0, id_: int = 2, error_m: float = 0.0) -> VehicleState:
    return VehicleState(id_, (x, y, z), STILL, MotionModel.STOPS, error_m=error_m)


# ---------------------------------------------------------------- limits


@pytest.mark.parametrize(("y", "close"), [(60.9, True), (61.1, False), (39.1, True), (38.9, False)])
def test_a_metre_more_than_the_limit_is_kept_sideways(y: float, *, close: bool) -> None:
    assert bool(met(sight((30.0, 50.0, 40.0), stand(50.0, 50.0)), holder(50.0, y))) is close


@pytest.mark.parametrize(("z", "close"), [(45.2, True), (45.4, False), (34.8, True), (34.6, False)])
def test_and_a_third_of_a_metre_in_height(z: float, *, close: bool) -> None:
    assert bool(met(sight((30.0, 50.0, 40.0), stand(50.0, 50.0)), holder(50.0, 50.0, z))) is close


def test_what_may_be_wrong_of_either_position_is_added() -> None:
    goes = sight((30.0, 50.0, 40.0), stand(50.0, 50.0))
    vague = VehicleState(1, goes.position_m, STILL, MotionModel.FOLLOWS, goes.course, error_m=2.0)
    assert met(goes, holder(50.0, 62.0)) is None and met(goes, holder(50.0, 64.1, error_m=3.0)) is None
    assert met(vague, holder(50.0, 62.0)) and met(goes, holder(50.0, 62.0, error_m=2.0))
    assert met(vague, holder(50.0, 64.0, error_m=2.0)) and not met(vague, holder(50.0, 65.2, error_m=2.0))


# ---------------------------------------------------------------- whom


def test_the_first_to_be_met_is_named() -> None:
    found = met(sight(HERE, passing(50.0, 50.0, vx=8.0)), holder(90.0, 50.0, id_=7), holder(75.0, 50.0, id_=5))
    assert found == SeparationConflict(5, 1.75), "14.0 m at 8 m/s"
    found = met(sight(HERE, passing(50.0, 50.0, vx=8.0)), holder(75.0, 50.0, id_=5), holder(90.0, 50.0, id_=7))
    assert found == SeparationConflict(5, 1.75)


def test_of_two_that_are_met_at_once_the_first_known_is_named() -> None:
    goes = sight(HERE, passing(50.0, 50.0, vx=8.0))
    for first, second in ((7, 5), (5, 7)):
        found = met(goes, holder(75.0, 53.0, id_=first), holder(75.0, 47.0, id_=second))
        assert found is not None and found.vehicle == first


def test_who_is_on_the_ground_matters_to_nobody_and_minds_nobody() -> None:
    goes = sight((30.0, 50.0, 4.0), stand(50.0, 50.0, 4.0))
    assert met(goes, holder(50.0, 50.0, 1.9)) is None
    assert met(goes, holder(50.0, 50.0, 2.0))
    low = sight((30.0, 50.0, 1.9), stand(50.0, 50.0, 1.9))
    assert met(low, holder(50.0, 50.0, 4.0)) is None
    assert met(sight((30.0, 50.0, 2.0), stand(50.0, 50.0, 2.0)), holder(50.0, 50.0, 4.0))


def test_a_column_is_exempt_but_others_keep_clear_of_it() -> None:
    climbs = sight(HERE, stand(50.0, 50.0, 60.0), column=True)
    assert met(climbs, holder(50.0, 50.0, 60.0)) is None
    assert met(sight((30.0, 50.0, 40.0), stand(50.0, 50.0)), VehicleState(2, HERE, STILL, in_column=True))


def test_nobody_meets_himself_or_nobody() -> None:
    me = sight(HERE, stand(60.0, 50.0))
    assert met(me, me) is None and met(me) is None


# ---------------------------------------------------------------- who brakes


def test_behind_somebody_as_fast_there_must_be_room_for_him_to_brake() -> None:
    """12 m behind at 8 m/s the distance stays, as long as he goes on.

    He may brake half a second before us, at once and hard: 10.2 m instead of 4 + 18 m. Either may still speed up for a
    moment: 0.8 m/s for 2.25 s of that braking. 11 m must be left.
    """
    ahead = sight((62.0, 50.0, 40.0), passing(62.0, 50.0, vx=8.0), id_=2)
    assert met(sight(HERE, passing(50.0, 50.0, vx=8.0)), ahead)
    for x, meets in ((76.1, True), (76.4, False)):
        farther = sight((x, 50.0, 40.0), passing(x, 50.0, vx=8.0), id_=2)
        assert bool(met(sight(HERE, passing(50.0, 50.0, vx=8.0)), farther)) is meets


def dodging(x: float, sign: float) -> VehicleState:
    """East (+) or west (-) at 8 m/s, and from half a second on in a turn to the right, as sharp as allowed."""
    t = np.arange(0.0, 6.0, 0.25)
    turn = np.maximum(t - 0.5, 0.0) * 2.5 / 8.0
    east, south = np.minimum(t, 0.5) * 8.0 + 25.6 * np.sin(turn), 25.6 * (1.0 - np.cos(turn))
    flat = np.zeros_like(t)
    places = np.stack([x + sign * east, 50.0 - sign * south, flat + 40.0], axis=1)
    speeds = np.stack([sign * 8.0 * np.cos(turn), -sign * 8.0 * np.sin(turn), flat], axis=1)
    return sight((x, 50.0, 40.0), Trajectory(0.0, 0.25, places, speeds), id_=1 if sign > 0 else 2)


def test_head_on_there_must_be_room_for_both_to_brake_whatever_their_courses_say() -> None:
    """Both dodge in time. If both brake in half a second, each needs 22 m, and 1.8 m more; 11 m must be left."""
    assert met(dodging(50.0, 1.0), dodging(109.0, -1.0)) is None
    assert met(dodging(50.0, 1.0), dodging(107.0, -1.0)) == SeparationConflict(2, 4.0)
    assert met(dodging(50.0, 1.0), dodging(102.0, -1.0)) == SeparationConflict(2, 3.0)


def test_nobody_relies_on_somebody_sliding_out_of_the_way() -> None:
    """Flown: it climbed across somebody else and was to brake behind him; it braked harder, and stood below him."""
    above = holder(60.0, 50.0, 47.0)
    across = VehicleState(1, (50.0, 50.0, 40.0), (7.0, 0.0, 1.5), MotionModel.FOLLOWS, stand(90.0, 50.0, 44.0))
    assert met(across, above)
    assert (
        met(VehicleState(1, across.position_m, (7.0, 0.0, 0.0), MotionModel.FOLLOWS, stand(90.0, 50.0)), above) is None
    )


def test_two_ways_of_braking_that_cross_meet_though_their_ends_are_apart() -> None:
    """East and north at 8 m/s: where each may come to rest are straights that cross, their ends 11 m and more apart."""
    east = sight(HERE, passing(50.0, 50.0, vx=8.0))
    north = sight((66.0, 34.0, 40.0), passing(66.0, 34.0, vx=0.0, vy=8.0), id_=2)
    assert met(east, north)


def test_what_is_between_two_looks_is_seen() -> None:
    """After 3 s apart sideways, a quarter of a second later in height; between them it is neither."""
    rises = VehicleState(2, (85.5, 50.0, 13.2), (0.0, 0.0, 10.0))
    assert met(sight(HERE, passing(50.0, 50.0, vx=8.0)), rises) == SeparationConflict(2, 3.25)
    sooner = VehicleState(2, (85.5, 50.0, 15.7), (0.0, 0.0, 10.0))
    assert met(sight(HERE, passing(50.0, 50.0, vx=8.0)), sooner) is None


def test_a_course_that_leads_away_in_time_is_no_excuse_for_not_being_able_to_brake() -> None:
    """Braking now ends 18 m ahead, in half a second 22 m ahead: there 11 m must be left."""
    assert met(dodging(50.0, 1.0), holder(81.0, 53.0))
    assert met(dodging(50.0, 1.0), holder(80.0, 56.0)), "though on its course it gets less near than by braking now"
    assert met(dodging(50.0, 1.0), holder(85.5, 53.0)) is None


# ---------------------------------------------------------------- what leads apart


def test_from_too_near_only_what_leads_apart_passes() -> None:
    near = holder(56.0, 50.0)
    assert met(sight(HERE, stand(20.0, 50.0)), near) is None
    assert met(sight(HERE, stand(50.0, 50.0)), near) is None, "no nearer than now"
    assert met(sight(HERE, stand(54.0, 50.0)), near)
    assert met(sight(HERE, stand(90.0, 50.0)), near), "in the end apart, but through it"


def test_a_promise_to_be_farther_away_later_is_no_excuse_for_coming_nearer_now() -> None:
    """It would climb past the other one; until it is above him it is nearer than if it stood."""
    assert met(sight(HERE, stand(50.0, 50.0, 60.0)), holder(56.0, 50.0, 44.0))


def test_slower_than_weak_braking_leads_is_not_yet_apart() -> None:
    """It climbs towards somebody at 2 m/s and is told to climb at 1.5: less near than it may slide, but not apart."""
    rises = VehicleState(1, HERE, (0.0, 0.0, 2.0), MotionModel.FOLLOWS, passing_up(1.5))
    assert met(rises, holder(51.0, 50.0, 47.0))
    sinks = VehicleState(1, HERE, (0.0, 0.0, -1.0), MotionModel.FOLLOWS, passing_up(-1.5))
    assert met(sinks, holder(51.0, 50.0, 44.0)) is None


def passing_up(speed: float) -> Trajectory:
    t = np.arange(0.0, 10.5, 0.5)[:, None]
    return Trajectory(
        0.0, 0.5, np.array([HERE]) + t * [[0.0, 0.0, speed]], np.repeat([[0.0, 0.0, speed]], len(t), axis=0)
    )


def test_a_lost_one_may_be_anywhere_on_its_way() -> None:
    """It was sent from (60, 50) to (140, 50); half a minute later nobody crosses that way at its height."""
    lost_link_reach = VehicleState(2, (60.0, 50.0, 40.0), (4.0, 0.0, 0.0), age_s=30.0, goal_m=(140.0, 50.0, 40.0))
    crosses = sight((100.0, 20.0, 40.0), stand(100.0, 80.0))
    assert met(crosses, lost_link_reach)
    assert met(sight((100.0, 20.0, 46.0), stand(100.0, 80.0, 46.0)), lost_link_reach) is None
    assert met(sight((100.0, 20.0, 40.0), stand(150.0, 20.0)), lost_link_reach) is None


def test_who_flees_from_somebody_who_comes_nearer_may() -> None:
    comes = VehicleState(2, (35.0, 50.0, 40.0), (8.0, 0.0, 0.0))
    assert met(sight(HERE, stand(120.0, 50.0)), comes) is None
    assert met(sight(HERE, stand(50.0, 120.0)), comes) is None
    assert met(sight(HERE, stand(20.0, 50.0)), comes)


def test_into_somebody_who_comes_through_anyway_is_worse_than_waiting() -> None:
    """The smallest distance is the same; on average it is not."""
    comes = VehicleState(2, (80.0, 50.0, 40.0), (-8.0, 0.0, 0.0))
    assert met(sight(HERE, stand(70.0, 50.0)), comes)
    assert met(sight(HERE, stand(50.0, 50.0)), comes) is None


@pytest.mark.parametrize(("x", "y", "vx", "vy"), [(72.0, 20.0, 1.0, 4.0), (64.0, 25.0, 3.0, 3.0)])
def test_to_flee_is_only_for_those_who_cannot_wait_clear_of_him(x: float, y: float, vx: float, vy: float) -> None:
    """Who brakes now lets him pass in front, just clear. Going on is clearer, but braking a moment later is not."""
    comes = VehicleState(2, (x, y, 40.0), (vx, vy, 0.0), MotionModel.DRIFTS)
    assert met(sight(HERE, passing(50.0, 50.0, vx=8.0)), comes) == SeparationConflict(2, 4.75)


def test_farther_away_at_the_nearest_is_no_worse_only_if_it_is_much_farther() -> None:
    """On its way there it is nearer for a while: by a third of the limits and less that does not count as better."""
    braking = np.array([[0.9, 0.9, 0.2, 0.2]])
    for gained, better in ((0.25, False), (0.35, True), (0.44, True)):
        going = np.array([[0.2 + gained, 0.2 + gained, 0.2 + gained, 3.0]])
        assert _is_no_worse(going, braking).tolist() == [better]


def test_as_near_as_braking_is_no_worse() -> None:
    braking = np.array([[0.9, 0.2, 0.2]])
    assert _is_no_worse(braking, braking).tolist() == [True]


# ---------------------------------------------------------------- several at once, in their order


def test_two_to_the_same_place_the_first_may() -> None:
    """Both stand, as the others know; 40 m apart."""
    first, second = sight(HERE, stand(70.0, 50.0)), sight((90.0, 50.0, 40.0), stand(70.0, 50.0), id_=2)
    known = [holder(50.0, 50.0, id_=1), holder(90.0, 50.0)]
    assert judged([first, second], known) == {1: SeparationConflict(1, 3.75)}
    assert judged([second, first], known) == {1: SeparationConflict(2, 3.75)}


def test_who_is_refused_brakes_and_later_ones_see_that() -> None:
    """The first would make room, but may not."""
    room = sight((63.0, 50.0, 40.0), stand(120.0, 50.0), id_=2)
    follows = sight(HERE, stand(57.0, 50.0))
    known = [holder(50.0, 50.0, id_=1), holder(63.0, 50.0)]
    assert judged([room, follows], known) == {}, "it goes on"
    assert judged([room, follows], known, [False, True]).keys() == {1}, "it stays, for another reason"
    wall = holder(85.0, 50.0, id_=3)
    assert judged([room, follows], [*known, wall]).keys() == {0, 1}, "it stays, because of a third"
    assert judged([follows, room], known).keys() == {0}, "who comes later is seen as known"


def test_who_was_refused_meets_nobody() -> None:
    assert judged([sight(HERE, stand(56.0, 50.0))], [holder(60.0, 50.0)], [False]) == {}


def test_who_leaves_before_is_out_of_the_way_though_known_to_come() -> None:
    oncoming = VehicleState(2, (90.0, 50.0, 40.0), (-4.0, 0.0, 0.0), MotionModel.FOLLOWS, passing(90.0, 50.0, vx=-4.0))
    turned = VehicleState(2, (90.0, 50.0, 40.0), (-4.0, 0.0, 0.0), MotionModel.FOLLOWS, stand(90.0, 90.0))
    goes = sight(HERE, stand(68.0, 50.0))
    assert judged([goes], [oncoming]).keys() == {0}
    assert judged([turned, goes], [oncoming]) == {}
    assert judged([goes, turned], [oncoming]).keys() == {0}
    assert judged([sight((90.0, 50.0, 40.0), passing(90.0, 50.0, vx=-4.0), id_=2), goes], [turned]).keys() == {1}


# ---------------------------------------------------------------- straights, of those who are lost


def ways(
    rng: np.random.Generator, n: int, *, exact: bool = False, span_m: float = 20.0, slack_m: float = 0.0
) -> _Reach:
    """n of them at one moment: from a place to another one, or points; each up to `slack_m` wider."""
    begin, way = rng.uniform(-span_m, span_m, (2, n, 1, 3))
    return _Reach.between(begin, begin if exact else begin + way, rng.uniform(0.0, slack_m, (n, 1, 2)))


def line(way: _Reach, row: int) -> LineString:
    return LineString([way.short_m[row, 0, :2], way.far_m[row, 0, :2]])


@pytest.mark.parametrize("span_m", [20.0, 0.5])
@pytest.mark.parametrize(("mine", "theirs"), [(False, False), (True, False), (False, True), (True, True)])
def test_straights_are_as_far_apart_as_their_nearest_points_and_as_the_gap_between_their_heights(
    mine: bool, theirs: bool, span_m: float
) -> None:
    rng, n = np.random.default_rng(7), 200
    a, b = (ways(rng, n, exact=exact, span_m=span_m, slack_m=3.0) for exact in (mine, theirs))
    level = np.array([line(a, row).distance(line(b, row)) for row in range(n)])
    assert _level_m(a, b)[:, 0] == pytest.approx(level, abs=1e-9)
    spans = [np.sort(np.stack([way.short_m, way.far_m])[:, :, 0, 2], axis=0) for way in (a, b)]
    upright = np.maximum(spans[1][0] - spans[0][1], spans[0][0] - spans[1][1])
    slack = (a.slack_m + b.slack_m)[:, 0]
    wide, high = np.full((n, 1), 6.0), 5.0
    apart = _apart(a, b, wide, high)[:, 0]
    assert apart == pytest.approx(np.maximum((level - slack[:, 0]) / 6.0, (upright - slack[:, 1]) / high), abs=1e-9)
    pairs = _VehiclePairs(np.arange(n), np.arange(n), np.full(n, -1), wide, np.zeros(n, dtype=bool))
    assert _may_be_close(a, pairs, b, np.arange(n), high)[apart < 1.0].all(), "nobody who is too near is left out"


def test_the_circle_about_a_way_holds_all_of_it_and_no_more() -> None:
    way = ways(np.random.default_rng(3), 50, slack_m=3.0)
    for end_m in (way.short_m, way.far_m):
        off = end_m - way.middle_m
        assert np.hypot(off[..., 0], off[..., 1]) == pytest.approx(way.reach_m[..., 0] - way.slack_m[..., 0])
        assert np.abs(off[..., 2]) == pytest.approx(way.reach_m[..., 1] - way.slack_m[..., 1])
