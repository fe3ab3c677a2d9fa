"""The guard, rule by rule. A square area of 200 m with 5 m margin, band 20-90 m, a vehicle that brakes at 2.5 m/s²."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.guard_rig import L_SHAPE, LIMITS, POND, SQUARE, guard, judge, passing, sight, stand, verdict
from tui_gcs.core.geometry.zones import Rectangle, Shape
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import predict, prediction_times
from tui_gcs.core.guard.permission import Order, OrderClass, Verdict
from tui_gcs.core.motion.course import PositionTarget, Trajectory, course_of, stopping_point
from tui_gcs.core.protocol.common import Intent, Vec3
from tui_gcs.core.scenario.model import Limits, OperatingArea

NO_MARGIN = Limits(geofence_margin_m=0.0)
TOO_FAST = ((60.0, 100.0, 40.0), passing(60.0, 100.0, vx=8.0), (8.0, 0.0, 0.0))
"""20 m before the pond with 8 m/s: half a second passes until it is told, and it brakes weaker than by the book."""

# ---------------------------------------------------------------- area


def test_a_place_inside_passes() -> None:
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(150.0, 150.0)) == ""


@pytest.mark.parametrize("place", [(199.0, 100.0), (300.0, 100.0), (100.0, -1.0), (1e9, 100.0)])
def test_a_place_in_the_margin_or_outside_is_vetoed(place: tuple[float, float]) -> None:
    g = guard()
    assert verdict(g, (50.0, 50.0, 40.0), stand(*place)) == "area"
    assert g.vetoes == {"area": 1}


def test_the_stopping_point_counts_not_only_the_place() -> None:
    """8 m/s stops in 12.8 m: 190 m east is inside, but not when passed eastwards at full speed."""
    assert verdict(guard(), (185.0, 100.0, 40.0), passing(190.0, 100.0, vx=8.0)) == "area"
    assert verdict(guard(), (185.0, 100.0, 40.0), passing(190.0, 100.0, vx=-8.0)) == ""
    assert verdict(guard(), (175.0, 100.0, 40.0), passing(180.0, 100.0, vx=8.0)) == ""
    reported = judge(guard(), sight((177.5, 100.0, 40.0), passing(182.5, 100.0, vx=8.0))).text
    assert reported == "(195, 100) is outside the operating area less its margin", "it ends at 195.3"


def test_nor_the_stopping_point_alone() -> None:
    """Back inwards at 8 m/s it would end at 184 m; but first it is told to be at 197 m."""
    reported = judge(guard(), sight((190.0, 100.0, 40.0), passing(197.0, 100.0, vx=-8.0))).text
    assert reported == "(197, 100) is outside the operating area less its margin"


def test_half_a_metre_in_the_margin_is_in_the_margin_and_the_text_says_where() -> None:
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(195.5, 100.0)) == "area"
    g = guard()
    reported = judge(g, sight((50.0, 50.0, 40.0), stand(197.0, 101.0))).text
    assert reported == "(197, 101) is outside the operating area less its margin"
    reported = judge(g, sight((185.0, 100.0, 40.0), passing(190.0, 100.0, vx=8.0)), now=1.0).text
    assert reported == "(211, 100) is outside the operating area less its margin", "where it stops is farther out"


def test_what_leads_back_inside_passes() -> None:
    outside = (230.0, 100.0, 40.0)
    assert verdict(guard(), outside, stand(150.0, 100.0)) == ""
    assert verdict(guard(), outside, stand(210.0, 100.0)) == "", "still outside, but nearer"
    assert verdict(guard(), outside, stand(240.0, 100.0)) == "area", "farther away"
    assert verdict(guard(), outside, stand(230.0, 120.0)) == "area", "as far"


def test_the_straight_way_must_stay_inside_a_concave_area() -> None:
    """From one arm of the L to the other: both ends are inside, the way between is not."""
    assert verdict(guard(L_SHAPE), (30.0, 180.0, 40.0), stand(180.0, 30.0)) == "area"
    assert verdict(guard(L_SHAPE), (30.0, 180.0, 40.0), stand(30.0, 30.0)) == ""


def test_from_inside_the_margin_the_way_may_not_leave_the_area_either() -> None:
    """2 m from the edge is inside the area, though not inside its margin: no licence to cut the corner."""
    assert verdict(guard(L_SHAPE), (58.0, 180.0, 40.0), stand(180.0, 30.0)) == "area"
    assert verdict(guard(L_SHAPE), (58.0, 180.0, 40.0), stand(30.0, 180.0)) == "", "straight back inside"


def test_a_way_from_inside_to_inside_keeps_the_margin_too() -> None:
    """Past the inner corner at (60, 60), 3 m from it."""
    reported = judge(guard(L_SHAPE), sight((54.9, 62.0, 40.0), stand(60.0, 54.9))).text
    assert reported == "the straight way there leaves the operating area less its margin"


def test_a_veto_names_the_no_fly_zone_that_is_cut() -> None:
    """The pond is a circle of 20 m about (100, 100)."""
    pond = guard(SQUARE, POND)
    assert (
        judge(pond, sight((60.0, 100.0, 40.0), stand(78.0, 100.0))).text
        == "(78, 100) is in no-fly zone pond or its margin"
    )
    across = judge(pond, sight((60.0, 100.0, 40.0), stand(140.0, 100.0))).text
    assert across == "the straight way there crosses no-fly zone pond"
    late = judge(Guard(NO_MARGIN, OperatingArea(SQUARE, 20.0, 90.0), (POND,)), sight(*TOO_FAST)).text
    assert late.startswith("it could not brake in time: ") and late.endswith(" m inside no-fly zone pond")


def test_from_outside_a_concave_area_straight_back_inside() -> None:
    assert verdict(guard(L_SHAPE), (62.0, 150.0, 40.0), stand(30.0, 150.0)) == ""


def test_beside_one_who_is_inside_the_way_of_one_in_the_margin_is_judged() -> None:
    inside, margin = sight((30.0, 30.0, 40.0), stand(40.0, 30.0)), sight((58.0, 180.0, 40.0), stand(180.0, 30.0), id_=2)
    verdicts = guard(L_SHAPE).judge([inside, margin], [stand(40.0, 30.0), stand(180.0, 30.0)], [inside, margin], 0.0)
    assert [one.code for one in verdicts] == ["", "area"]


def test_no_fly_zones_are_not_area() -> None:
    g = guard(SQUARE, POND)
    assert verdict(g, (50.0, 50.0, 40.0), stand(100.0, 100.0)) == "area"
    assert verdict(g, (50.0, 50.0, 40.0), stand(100.0, 122.0)) == "area", "the margin belongs to it"
    assert verdict(g, (50.0, 100.0, 40.0), stand(150.0, 100.0)) == "area", "the way leads across"
    assert verdict(g, (50.0, 50.0, 40.0), stand(150.0, 50.0)) == ""
    assert not g.inside((100.0, 100.0, 40.0)) and not g.inside((100.0, 119.9, 40.0))
    assert g.inside((50.0, 50.0, 40.0)) is True
    assert g.outside_m((100.0, 115.0, 40.0)) == pytest.approx(5.0, abs=0.1)


def test_how_far_outside() -> None:
    assert guard().outside_m((100.0, 100.0, 40.0)) == 0.0
    assert guard().outside_m((210.0, 100.0, 40.0)) == pytest.approx(10.0)


def test_another_round_is_another_area() -> None:
    g = guard()
    g.set_round(LIMITS, OperatingArea(Rectangle(centre_m=(50.0, 50.0), width_m=100.0, height_m=100.0), 20.0, 90.0), ())
    assert verdict(g, (50.0, 50.0, 40.0), stand(150.0, 150.0)) == "area"


# ---------------------------------------------------------------- band, speed, rate


@pytest.mark.parametrize("z", [10.0, 19.0, 91.0, 1e6])
def test_outside_the_altitude_band_is_vetoed(z: float) -> None:
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(60.0, 50.0, z)) == "band"


def test_half_a_metre_of_tolerance_in_height() -> None:
    assert verdict(guard(), (50.0, 50.0, 21.0), stand(60.0, 50.0, 19.6)) == ""
    assert verdict(guard(), (50.0, 50.0, 21.0), stand(60.0, 50.0, 19.4)) == "band"


def test_back_towards_the_band_passes() -> None:
    assert verdict(guard(), (50.0, 50.0, 120.0), stand(60.0, 50.0, 100.0)) == ""
    assert verdict(guard(), (50.0, 50.0, 5.0), stand(60.0, 50.0, 10.0)) == ""
    assert verdict(guard(), (50.0, 50.0, 100.0), stand(60.0, 50.0, 120.0)) == "band"
    assert verdict(guard(), (50.0, 50.0, 100.0), stand(60.0, 50.0, 100.0)) == "band", "as far"


def test_faster_than_the_limit_is_vetoed() -> None:
    assert verdict(guard(), (50.0, 50.0, 40.0), passing(50.0, 50.0, vx=8.5)) == "speed"
    assert verdict(guard(), (50.0, 50.0, 40.0), passing(50.0, 50.0, vx=8.3)) == "", "5 % of tolerance"


def test_set_points_too_close_in_time_are_vetoed_per_vehicle() -> None:
    g = guard()
    assert verdict(g, (50.0, 50.0, 40.0), stand(60.0, 50.0), now=0.0) == ""
    assert verdict(g, (50.0, 50.0, 40.0), stand(60.0, 50.0), now=0.05) == "rate"
    assert judge(g, sight((90.0, 50.0, 40.0), stand(90.0, 60.0), id_=2), now=0.05).ok, "another vehicle is not meant"
    assert verdict(g, (50.0, 50.0, 40.0), stand(60.0, 50.0), now=0.1) == "", "a vetoed one does not count"


def test_vetoes_found_elsewhere_are_counted_too() -> None:
    g = guard()
    assert g.veto("unknown vehicle", "planner names vehicle 9").text == "planner names vehicle 9"
    assert g.vetoes == {"unknown vehicle": 1}


@pytest.mark.parametrize("what", ["hold", "land", "disarm", "return"])
def test_stops_are_never_vetoed_other_actions_only_to_the_lost(what: str) -> None:
    """The class of the order decides, not how it is called."""
    g = guard()
    assert g.judge_action(Order(what, OrderClass.STOP), lost=True).ok
    assert g.judge_action(Order("arm", OrderClass.START), lost=False).ok
    assert g.judge_action(Order("arm", OrderClass.START), lost=True).code == "lost vehicle"
    assert g.judge_action(Order(what, OrderClass.SET), lost=True).code == "lost vehicle"
    assert g.vetoes == {"lost vehicle": 2}


# ---------------------------------------------------------------- separation


def test_a_predicted_meeting_is_vetoed() -> None:
    """Head on at 8 m/s from 60 m apart: within 10 m of each other after 3.2 s."""
    oncoming = sight((110.0, 50.0, 40.0), velocity=(-8.0, 0.0, 0.0), id_=2)
    judged = judge(guard(), sight((50.0, 50.0, 40.0), passing(50.0, 50.0, vx=8.0)), oncoming)
    assert (judged.code, judged.text) == ("separation", "too close to vehicle 2 in 3.2 s")


def test_who_is_in_the_way_may_be_asked_without_being_counted() -> None:
    g, oncoming = guard(), sight((110.0, 50.0, 40.0), velocity=(-8.0, 0.0, 0.0), id_=2)
    me = sight((50.0, 50.0, 40.0), passing(50.0, 50.0, vx=8.0))
    assert g.separation(me, [me, oncoming], 0.0) == Verdict("separation", "too close to vehicle 2 in 3.2 s")
    assert g.separation(me, [me], 0.0) == Verdict()
    assert not g.vetoes


def test_height_separates() -> None:
    oncoming = sight((110.0, 50.0, 47.0), velocity=(-8.0, 0.0, 0.0), id_=2)
    assert verdict(guard(), (50.0, 50.0, 40.0), passing(50.0, 50.0, vx=8.0), oncoming) == ""


def test_the_others_course_is_known_not_only_its_velocity() -> None:
    stops = sight((110.0, 50.0, 40.0), course=stand(100.0, 50.0), velocity=(-8.0, 0.0, 0.0), id_=2)
    assert verdict(guard(), (50.0, 50.0, 40.0), passing(50.0, 50.0, vx=5.0), stops) == ""


def test_leading_apart_is_allowed_and_staying_close_is_not_made_closer() -> None:
    near = sight((56.0, 50.0, 40.0), id_=2)
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(20.0, 50.0), near) == "", "away from it"
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(50.0, 50.0), near) == "", "no closer than now"
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(54.0, 50.0), near) == "separation"
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(90.0, 50.0), near) == "separation", "apart, but through it"


def test_who_is_in_its_own_column_and_the_ground_are_exempt_but_others_keep_clear_of_columns() -> None:
    goes = stand(60.0, 50.0)
    assert verdict(guard(), (50.0, 50.0, 40.0), goes, sight((60.0, 50.0, 40.0), id_=2)) == "separation"
    assert verdict(guard(), (50.0, 50.0, 40.0), goes, sight((60.0, 50.0, 40.0), id_=2, column=True)) == "separation"
    assert verdict(guard(), (50.0, 50.0, 40.0), stand(60.0, 50.0, 20.0), sight((60.0, 50.0, 1.0), id_=2)) == ""
    climbing = sight((50.0, 50.0, 40.0), goes, column=True)
    assert judge(guard(), climbing, sight((60.0, 50.0, 40.0), id_=2)).ok
    low = sight((50.0, 50.0, 1.0), stand(50.0, 50.0, 20.0))
    assert judge(guard(), low, sight((50.0, 52.0, 20.0), id_=2)).ok


def test_several_are_judged_as_each_alone() -> None:
    """One of each kind of verdict, in one go; they are far apart."""
    asked = [
        ((20.0, 20.0, 40.0), stand(30.0, 20.0)),
        ((100.0, 20.0, 40.0), stand(100.0, -1.0)),
        ((180.0, 20.0, 40.0), stand(170.0, 20.0, 95.0)),
        ((20.0, 100.0, 40.0), passing(20.0, 100.0, vx=9.0)),
        ((150.0, 100.0, 40.0), passing(150.0, 120.0, vx=1.0)),
        ((178.0, 150.0, 60.0), passing(182.5, 150.0, vx=8.0, z=60.0)),
        ((20.0, 180.0, 40.0), passing(20.0, 180.0, vx=5.0)),
        ((100.0, 180.0, 89.9), stand(100.0, 170.0, 60.0)),
    ]
    sights = [sight(place, course, id_=i) for i, (place, course) in enumerate(asked)]
    together = guard(SQUARE).judge(sights, [course for _, course in asked], sights, 0.0)
    assert together == [judge(guard(SQUARE), one, *sights) for one in sights]
    assert [verdict.code for verdict in together] == ["", "area", "band", "speed", "jump", "area", "", ""]


def test_nobody_is_too_close_to_himself() -> None:
    me = sight((50.0, 50.0, 40.0), stand(60.0, 50.0))
    assert judge(guard(), me, me).ok


def test_an_unknown_velocity_predicts_standing_still() -> None:
    lost = sight((1.0, 2.0, 3.0), velocity=(math.nan, math.nan, math.nan))
    path = predict([lost], LIMITS, prediction_times(LIMITS), 0.0).goes_m[0]
    assert path.tolist() == [[1.0, 2.0, 3.0]] * 21


# ---------------------------------------------------------------- property

targets = st.tuples(st.floats(-40.0, 240.0), st.floats(-40.0, 240.0), st.floats(0.0, 120.0))
speeds = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(shape=st.sampled_from([SQUARE, L_SHAPE]), wishes=st.lists(st.tuples(targets, speeds), min_size=1, max_size=12))
def test_whoever_follows_only_what_passed_stays_inside(
    shape: Shape, wishes: list[tuple[tuple[float, float, float], tuple[float, float]]]
) -> None:
    """A point mass obeys set-points that passed and brakes for others, as steering does; 3 s per wish, 5 Hz."""
    g = guard(shape)
    place, velocity = np.array([30.0, 30.0, 40.0]), np.zeros(3)
    now = 0.0
    for (x, y, z), (vx, vy) in wishes:
        t = np.arange(4.0)[:, None]
        moving = np.array([[vx, vy, 0.0]])
        track = Trajectory(now, 1.0, np.array([[x, y, z]]) + t * moving, np.repeat(moving, 4, axis=0))
        for course in (track, PositionTarget((x, y, z), 8.0)):
            hold: Vec3 | None = None
            for _ in range(15):
                here: Vec3 = (float(place[0]), float(place[1]), float(place[2]))
                v: Vec3 = (float(velocity[0]), float(velocity[1]), float(velocity[2]))
                if judge(g, sight(here, course, v), now=now).ok:
                    hold, wanted = None, course.at(now)[0]
                else:
                    hold = hold or stopping_point(here, v, LIMITS.accel_m_s2)
                    wanted = hold
                for _ in range(4):
                    place, velocity = _fly(place, velocity, np.array(wanted), 0.05)
                    assert g.outside_m((float(place[0]), float(place[1]), 0.0)) == 0.0
                    assert 19.0 <= place[2] <= 91.0
                now += 0.2


def _fly(place: np.ndarray, velocity: np.ndarray, target: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """One step of a vehicle that flies to `target` as fast as it can still stop there: 8 m/s, 2.5 m/s²."""
    gap = target - place
    distance = float(np.linalg.norm(gap))
    speed = min(8.0, math.sqrt(2 * 2.5 * distance), distance / dt)
    wanted = gap / distance * speed if distance > 1e-9 else np.zeros(3)
    change = wanted - velocity
    size = float(np.linalg.norm(change))
    velocity = velocity + change * min(1.0, 2.5 * dt / size if size > 1e-9 else 1.0)
    return place + velocity * dt, velocity


# ---------------------------------------------------------------- courses


def test_a_track_between_before_and_after_its_samples() -> None:
    track = Trajectory(10.0, 1.0, np.array([[0.0, 0.0, 30.0], [4.0, 0.0, 30.0]]), np.array([[4.0, 0.0, 0.0]] * 2))
    assert track.at(10.5) == ((2.0, 0.0, 30.0), (4.0, 0.0, 0.0))
    assert track.at(99.0) == ((4.0, 0.0, 30.0), (0.0, 0.0, 0.0)), "after the last sample it stays"
    assert track.at(5.0) == ((0.0, 0.0, 30.0), (0.0, 0.0, 0.0)), "before the first it waits there"


@pytest.mark.parametrize(
    ("intent", "why"),
    [
        (Intent(1, "goto"), "goto without a finite position"),
        (Intent(1, "goto", position_m=(math.nan, 0.0, 30.0)), "goto without a finite position"),
        (Intent(1, "goto", position_m=(0.0, math.inf, 30.0)), "goto without a finite position"),
        (Intent(1, "trajectory"), "at least two samples"),
        (Intent(1, "trajectory", dt_s=1.0, positions_m=((0.0, 0.0, 30.0),) * 2), "as many velocities"),
        (
            Intent(
                1, "trajectory", dt_s=0.0, positions_m=((0.0, 0.0, 30.0),) * 2, velocities_m_s=((0.0, 0.0, 0.0),) * 2
            ),
            "dt_s > 0",
        ),
        (
            Intent(
                1, "trajectory", dt_s=1.0, positions_m=((math.nan, 0.0, 30.0),) * 2, velocities_m_s=((0.0,) * 3,) * 2
            ),
            "not finite samples",
        ),
        (
            Intent(1, "trajectory", dt_s=1.0, positions_m=((0.0,) * 3,) * 601, velocities_m_s=((0.0,) * 3,) * 601),
            "too many",
        ),
        (
            Intent(
                1,
                "trajectory",
                t0_s=math.nan,
                dt_s=1.0,
                positions_m=((0.0,) * 3,) * 2,
                velocities_m_s=((0.0,) * 3,) * 2,
            ),
            "times are not finite",
        ),
    ],
)
def test_nonsense_is_no_course(intent: Intent, why: str) -> None:
    course = course_of(intent, 8.0)
    assert isinstance(course, str)
    assert why in course


def test_a_stop_is_v_squared_over_two_a_ahead() -> None:
    assert stopping_point((0.0, 0.0, 30.0), (8.0, 0.0, 0.0), 2.5) == pytest.approx((12.8, 0.0, 30.0))
    sinks = stopping_point((0.0, 0.0, 30.0), (8.0, 0.0, -1.0), 2.5)
    assert sinks == pytest.approx((12.8, 0.0, 29.8)), "flown: sent 1.4 m down it sank faster, out of the band"
    assert stopping_point((1.0, 2.0, 3.0), (math.nan, 0.0, 0.0), 2.5) == (1.0, 2.0, 3.0)


def test_a_way_inside_keeps_the_margin_only_if_it_begins_inside_of_it() -> None:
    g = guard(SQUARE, POND)
    assert g.is_way_inside((20.0, 20.0, 40.0), (180.0, 20.0, 40.0))
    assert not g.is_way_inside((20.0, 20.0, 40.0), (198.0, 20.0, 40.0)), "into the margin"
    assert g.is_way_inside((2.0, 20.0, 40.0), (198.0, 20.0, 40.0)), "from the margin"
    assert not g.is_way_inside((2.0, 20.0, 40.0), (201.0, 20.0, 40.0))
    assert not g.is_way_inside((20.0, 100.0, 40.0), (180.0, 100.0, 40.0)), "through the pond"
