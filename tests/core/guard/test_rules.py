"""What the guard says to courses that cannot be flown, that jump, contradict themselves, or brake too late."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from tests.core.rigs.guard_rig import L_SHAPE, LIMITS, SQUARE, guard, judge, passing, sight, stand, verdict
from tui_gcs.core.geometry.zones import Rectangle, Role, Zone
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.guard.permission import Verdict
from tui_gcs.core.motion.course import PositionTarget, Trajectory
from tui_gcs.core.motion.cruise import Cruise
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits, OperatingArea

HERE = (50.0, 50.0, 40.0)
BOX = Rectangle(centre_m=(100.0, 100.0), width_m=40.0, height_m=40.0)
TOWER = Zone(name="tower", role=Role.NO_FLY, shape=BOX, alt_min_m=None, alt_max_m=50.0)


def samples(velocities: list[Vec3], dt_s: float = 0.5, **changed: Any) -> Trajectory:
    """From `HERE` with these velocities one after the other; places follow from them."""
    speeds = np.array(velocities)
    places = np.cumsum(np.vstack([[HERE], (speeds[1:] + speeds[:-1]) / 2 * dt_s]), axis=0)
    return dataclasses.replace(Trajectory(0.0, dt_s, places, speeds), **changed)


def shifted(course: Trajectory, *by_m: float) -> Trajectory:
    return dataclasses.replace(course, positions_m=course.positions_m + np.array(by_m))


def said(course: Any, velocity: Vec3 | None = None, position: Vec3 = HERE, now: float = 0.0) -> Verdict:
    return judge(guard(), sight(position, course, velocity), now=now)


# ---------------------------------------------------------------- numbers


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_number_that_is_none_is_vetoed_wherever_it_is(bad: float, axis: int) -> None:
    place, velocity = list(HERE), [0.0, 0.0, 0.0]
    place[axis] = velocity[axis] = bad
    known = PositionTarget((60.0, 50.0, 40.0), 8.0)
    for me in (
        VehicleState(
            1, HERE, (0.0, 0.0, 0.0), MotionModel.FOLLOWS, PositionTarget((place[0], place[1], place[2]), 8.0)
        ),
        VehicleState(1, (place[0], place[1], place[2]), (0.0, 0.0, 0.0), MotionModel.FOLLOWS, known),
        VehicleState(1, HERE, (velocity[0], velocity[1], velocity[2]), MotionModel.FOLLOWS, known),
    ):
        assert judge(guard(), me).code == "number"


def test_one_that_comes_later_in_a_course_too() -> None:
    for later in ("positions_m", "velocities_m_s"):
        course = passing(50.0, 50.0, vx=2.0)
        getattr(course, later)[7, 1] = math.nan
        assert said(course) == Verdict("number", "its course is not finite")
    assert said(PositionTarget((60.0, 50.0, 40.0), math.nan)).code == "speed"


# ---------------------------------------------------------------- speed


@pytest.mark.parametrize(
    ("up", "code"), [(3.1, ""), (3.2, "speed"), (-1.5, ""), (-1.6, "speed"), (5.0, "speed"), (-5.0, "speed")]
)
def test_climbing_and_sinking_have_limits_of_their_own(up: float, code: str) -> None:
    assert said(samples([(0.0, 0.0, up)] * 20, 0.1)).code == code


def test_the_texts_say_what_is_asked_and_allowed() -> None:
    assert said(passing(50.0, 50.0, vx=8.5)).text == "8.5 m/s asked, 8.0 allowed"
    assert said(samples([(0.0, 0.0, 4.0)] * 9)).text == "+4.0 m/s up asked, -1.5 to +3.0 allowed"
    assert said(samples([(0.0, 0.0, -4.0)] * 9)).text == "-4.0 m/s up asked, -1.5 to +3.0 allowed"


def test_what_comes_within_five_seconds_counts() -> None:
    slowly = [(v, 0.0, 0.0) for v in np.arange(0.0, 16.0, 0.5).tolist()]
    assert said(samples(slowly, 0.25)).code == "speed", "4.25 s from now it is faster than 8.4 m/s"
    assert said(samples(slowly, 0.4)).code == "", "in 6.8 s: not our business yet"


def test_a_place_is_flown_to_no_faster_than_allowed() -> None:
    assert said(PositionTarget((60.0, 50.0, 40.0), 8.4)).code == ""
    assert said(PositionTarget((60.0, 50.0, 40.0), 8.5)) == Verdict("speed", "8.5 m/s asked, 8.0 allowed")


def test_a_set_point_that_differs_from_its_course_is_judged_itself() -> None:
    """What is sent is ahead of the course by the vehicle's lead."""
    g, me = guard(), sight(HERE, passing(50.0, 50.0, vx=4.0))

    def told(seen: VehicleState, sent: Trajectory) -> Verdict:
        return g.judge([seen], [sent], [], 0.0)[0]

    assert told(me, passing(50.0, 50.0, vx=9.0)).code == "speed"
    assert told(me, passing(50.0, 300.0, vx=4.0)).code in ("jump", "area")
    without_course = dataclasses.replace(me, course=None, motion=MotionModel.STOPS)
    assert told(without_course, passing(50.0, 50.0, vx=9.0)).code == "speed"
    assert told(without_course, passing(50.0, 50.0, vx=4.0)).ok


# ---------------------------------------------------------------- acceleration


@pytest.mark.parametrize(("accel", "code"), [(3.1, ""), (3.2, "acceleration"), (-3.1, ""), (-3.2, "acceleration")])
def test_no_more_acceleration_than_allowed_with_a_tolerance(accel: float, code: str) -> None:
    """2.5 m/s² and a quarter more."""
    assert said(samples([(4.0 + accel * t, 0.0, 0.0) for t in (0.0, 0.5, 1.0)])).code == code
    assert said(samples([(4.0, accel * t, 0.0) for t in (0.0, 0.5, 1.0)])).code == code


def test_what_a_trajectory_asks_between_two_looks_is_seen_too() -> None:
    """Velocities that are back where they were whenever the guard looks."""
    shaking = [(2.0, 0.0, 0.0), (2.0, 4.0, 0.0)] * 30
    assert said(samples(shaking, 0.125)) == Verdict("acceleration", "32.0 m/s² asked, 2.5 allowed")


def test_what_is_over_is_over() -> None:
    course = samples([(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), *[(4.0, 0.0, 0.0)] * 20])
    assert said(course).code == "acceleration"
    assert said(course, now=0.4, position=(50.5, 50.0, 40.0), velocity=(3.2, 0.0, 0.0)).code == "acceleration"
    assert said(course, now=0.5, position=(51.0, 50.0, 40.0), velocity=(4.0, 0.0, 0.0)).code == ""


def test_the_end_of_a_trajectory_is_a_stop_and_no_acceleration() -> None:
    course = samples([(8.0, 0.0, 0.0)] * 4)
    assert said(course).code == ""
    assert said(course, now=60.0, position=(62.0, 50.0, 40.0), velocity=(8.0, 0.0, 0.0)).code == ""
    early = dataclasses.replace(course, t0_s=1e12)
    assert said(early, velocity=(0.0, 0.0, 0.0)).code == "", "it waits at its first place"


def test_tiny_and_huge_steps_are_judged_as_any() -> None:
    assert said(samples([(4.0, 0.0, 0.0), (4.1, 0.0, 0.0)] * 5, 1e-6)).code == "acceleration"
    assert said(samples([(4.0, 0.0, 0.0)] * 2, 1e9)).code == ""
    assert said(samples([(4.0, 0.0, 0.0)] * 600, 1e-9)).code == ""


# ---------------------------------------------------------------- contradictions


def test_places_must_move_as_the_velocities_say() -> None:
    """Told to stay and to move at once, it would hang 2 m ahead of where it should be, or run away."""
    still = np.array([HERE] * 9)
    assert said(samples([(2.0, 0.0, 0.0)] * 9, positions_m=still)) == Verdict(
        "motion", "places and velocities of its course contradict each other"
    )
    assert said(samples([(0.9, 0.0, 0.0)] * 9, positions_m=still)).code == ""
    assert said(samples([(0.0, 1.1, 0.0)] * 9, positions_m=still)).code == "motion"
    leaping = still.copy()
    leaping[6:, 0] += 10.0
    assert said(samples([(0.0, 0.0, 0.0)] * 9, positions_m=leaping)).code == "motion"


# ---------------------------------------------------------------- jumps


@pytest.mark.parametrize(("away_m", "code"), [(14.0, ""), (16.0, "jump")])
def test_a_course_far_away_is_a_jump(away_m: float, code: str) -> None:
    """It would be caught up with at the autopilot's own speed."""
    course = passing(50.0, 50.0 + away_m, vx=2.0)
    assert said(course).code == code
    if code:
        assert said(course).text == "its course is 16 m away from it"


@pytest.mark.parametrize(("has", "code"), [(2.9, "jump"), (3.1, "")])
def test_another_velocity_must_be_had_within_two_seconds(has: float, code: str) -> None:
    """8 m/s asked, 2.5 m/s²."""
    assert said(passing(50.0, 50.0, vx=8.0), velocity=(has, 0.0, 0.0)).code == code


@pytest.mark.parametrize(
    ("age_s", "has", "code"), [(1.0, 0.4, "jump"), (1.0, 0.6, ""), (3.0, -4.4, ""), (9.0, -4.6, "jump")]
)
def test_a_vehicle_that_is_silent_may_have_turned_as_it_was_told(age_s: float, has: float, code: str) -> None:
    """For each second since it was heard its velocity may have changed by another 2.5 m/s, up to three seconds."""
    me = sight(HERE, passing(50.0, 50.0, vx=8.0), (has, 0.0, 0.0))
    assert judge(guard(), dataclasses.replace(me, age_s=age_s)).code == code


def test_who_is_asked_to_stop_may_stop() -> None:
    assert said(samples([(0.9, 0.0, 0.0)] * 9), velocity=(8.0, 0.0, 0.0)).code == ""
    assert said(samples([(1.1, 0.0, 0.0)] * 9), velocity=(8.0, 0.0, 0.0)).text == (
        "its course moves 6.9 m/s otherwise than it does"
    )


# ---------------------------------------------------------------- courses of the station itself


def test_cruises_and_orbits_can_be_flown() -> None:
    cruise = Cruise(0.0, HERE, (0.0, 0.0, 0.0), (5.0, 5.0, 1.0), 4.0, 0.9 * LIMITS.accel_m_s2)
    assert said(cruise).code == ""
    assert said(Cruise(0.0, HERE, (0.0, 0.0, 0.0), (5.0, 5.0, -4.0), 4.0, 2.25)).code == "speed"
    orbit = Orbit.about(0.0, HERE, (100.0, 100.0, 40.0), 30.0, 8.0, LIMITS.accel_m_s2)
    for now in (0.0, 3.0, orbit.circle_s, orbit.circle_s + 2.0, orbit.circle_s + 20.0):
        place, velocity = orbit.at(now)
        assert said(orbit, position=place, velocity=velocity, now=now).code == ""


# ---------------------------------------------------------------- braking in time


NO_MARGIN = Limits(geofence_margin_m=0.0)


def at_the_edge(x: float, vx: float, asked: float) -> Verdict:
    g = Guard(NO_MARGIN, OperatingArea(SQUARE, 20.0, 90.0), ())
    return judge(g, sight((x, 50.0, 40.0), passing(x, 50.0, vx=asked), (vx, 0.0, 0.0)))


def test_a_vehicle_needs_more_room_to_stop_than_its_set_point() -> None:
    """12.8 m from 8 m/s by the book; but half a second passes until it is told, and it brakes weaker: 22 m."""
    assert at_the_edge(177.0, 8.0, asked=8.0).code == ""
    assert at_the_edge(180.0, 8.0, asked=8.0) == Verdict(
        "area", "it could not brake in time: 2 m outside the operating area"
    )
    assert at_the_edge(188.0, 8.0, asked=8.0).text.endswith("less its margin"), "and by the book it is too late, too"


def test_a_vehicle_that_does_not_know_where_it_is_is_not_called_outside() -> None:
    """Seen: a real PX4 without GPS in the middle of the area was "25 m outside the operating area"."""
    area = OperatingArea(SQUARE, 20.0, 90.0)
    here = sight((150.0, 50.0, 40.0), passing(150.0, 50.0, vx=8.0), (8.0, 0.0, 0.0))
    assert judge(Guard(NO_MARGIN, area, ()), here).code == ""
    reported = judge(Guard(NO_MARGIN, area, ()), dataclasses.replace(here, error_m=80.0))
    assert reported.code == "area"
    assert reported.text.startswith("its place is known to ±80 m only: it could come "), reported.text


def test_its_real_velocity_counts() -> None:
    """Asked for 6 m/s it has 3 or 8."""
    assert at_the_edge(184.0, 3.0, asked=6.0).code == ""
    assert at_the_edge(184.0, 8.0, asked=6.0).code == "", "it brakes no worse on its course than by being told"
    assert at_the_edge(187.0, 6.0, asked=6.0).code == "area"


def test_much_too_fast_it_stops_later_than_is_looked_at() -> None:
    """From 16 m/s: after 5 s of braking it is 7 m outside, in the end 18 m; by turning at once 16 m."""
    assert said(stand(50.0, 50.0), position=(150.0, 50.0, 40.0), velocity=(16.0, 0.0, 0.0)).code == ""


def test_what_turns_away_better_than_braking_passes() -> None:
    """10 m from the edge at 8 m/s it will be outside anyway; back at once is better than a stop."""
    assert said(stand(50.0, 50.0), position=(189.0, 50.0, 40.0), velocity=(8.0, 0.0, 0.0)).code == ""


@pytest.mark.parametrize(
    ("z", "up", "code"), [(21.1, -1.5, ""), (20.6, -1.5, "band"), (88.9, 1.5, ""), (89.4, 1.5, "band")]
)
def test_up_and_down_too(z: float, up: float, code: str) -> None:
    """From 1.5 m/s: half a second on, and 0.8 m/s² after another quarter; 1.5 m may be outside."""
    sinks = shifted(samples([(0.0, 0.0, up)] * 9), 0.0, 0.0, z - 40.0)
    reported = said(sinks, position=(50.0, 50.0, z))
    assert reported.code == code
    assert not code or reported.text == "it could not brake in time: 2 m outside the altitude band"


def test_below_the_band_and_up_again_is_below_the_band() -> None:
    """Told to be at 19.2 m and to climb with 2 m/s: it would end at 20 m."""
    climbs = shifted(samples([(0.0, 0.0, 2.0)] * 9), 0.0, 0.0, 19.2 - 40.0)
    assert said(climbs, position=(50.0, 50.0, 20.5)).text == "19.2 m is outside the altitude band 20-90 m"


def test_with_a_bad_position_the_edge_is_nearer() -> None:
    me = sight((170.0, 50.0, 40.0), stand(180.0, 50.0))
    assert judge(guard(), me).ok
    assert judge(guard(), dataclasses.replace(me, error_m=15.0)).ok
    assert judge(guard(), dataclasses.replace(me, error_m=30.0)).code == "area"
    back = dataclasses.replace(me, course=stand(100.0, 50.0), error_m=40.0)
    assert judge(guard(), back).ok, "what leads away from the edge always passes"


def test_a_stop_behind_a_corner_is_no_stop_inside() -> None:
    """From one arm of the L at 8 m/s: place and stop are inside, between them is the corner."""
    g = guard(L_SHAPE)
    assert verdict(g, (52.0, 68.0, 40.0), passing(52.0, 66.0, vx=4.0, vy=-6.0)) == "area"


# ---------------------------------------------------------------- no-fly zones with heights


def test_above_a_low_tower_one_may_fly() -> None:
    over = guard(SQUARE, TOWER)
    assert verdict(over, (100.0, 50.0, 60.0), stand(100.0, 150.0, 60.0)) == ""
    assert verdict(over, (100.0, 50.0, 40.0), stand(100.0, 150.0, 40.0), now=1.0) == "area"
    assert verdict(over, (100.0, 100.0, 60.0), stand(100.0, 100.0, 52.0), now=2.0) == "area", "5 m in height, too"
    assert verdict(over, (50.0, 100.0, 40.0), stand(150.0, 100.0, 60.0), now=3.0) == "area", "who knows when it climbs"
    assert not over.inside((100.0, 100.0, 60.0)), "for starts, returns and other stations it is closed altogether"
    assert over.outside_m((100.0, 90.0, 60.0)) == pytest.approx(10.0)
    assert over.outside_walls_m(np.array([(100.0, 100.0, 60.0), (100.0, 100.0, 47.0)])).tolist() == [0.0, 3.0]


def test_sinking_onto_a_tower_is_braked_in_time() -> None:
    falls = samples([(0.0, 0.0, -1.5)] * 9)
    for margin_m, z, code in ((5.0, 58.0, ""), (5.0, 52.0, "area"), (0.0, 52.7, ""), (0.0, 52.3, "area")):
        over = Guard(Limits(geofence_margin_m=margin_m), OperatingArea(SQUARE, 20.0, 90.0), (TOWER,))
        course = shifted(falls, 50.0, 50.0, z - 40.0)
        assert verdict(over, (100.0, 100.0, z), course) == code, z
