"""What becomes of a planner's intents: courses, or a refusal in words. No simulator; flown in test_intents.py."""

import math
from typing import Any

import pytest

from tests.core.rigs.flight_rig import Watch
from tui_gcs.core.base.text import clean
from tui_gcs.core.flight.intents import IntentController
from tui_gcs.core.motion.course import Course, PositionTarget, Trajectory
from tui_gcs.core.motion.cruise import Cruise
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol.common import Intent, Phase, TeamPlan, Vec3

STILL: Vec3 = (0.0, 0.0, 0.0)
HERE: Vec3 = (0.0, 100.0, 30.0)
NOW = 1000.0


class IntentRig(Watch):
    """Vehicle 1 flies for team red at (0, 100, 30)."""

    def __init__(self, moving: Vec3 = STILL) -> None:
        super().__init__(2)
        self.controller = IntentController("red", self.services, self.steering)
        self.flies(1, HERE, moving=moving)

    def plan(self, *intents: Intent, age_s: float = 0.0) -> list[tuple[int, str]]:
        """A plan made from a frame of `age_s` ago is carried out."""
        plan = TeamPlan(team="red", revision=1, seq=1, t_s=self.clock.now() - age_s, intents=intents)
        return self.controller.carry_out(plan)

    def course(self, *intents: Intent, age_s: float = 0.0) -> Course | None:
        self.plan(*intents, age_s=age_s)
        return self.flight(1).course


def goto(vehicle: int = 1, **more: Any) -> Intent:
    return Intent(vehicle, "goto", position_m=(50.0, 60.0, 30.0), **more)


def velocity(*velocity_m_s: float, valid_s: float = 1.0, **more: Any) -> Intent:
    return Intent(1, "velocity", velocity_m_s=velocity_m_s, valid_s=valid_s, **more)  # type: ignore[arg-type]


def orbit(radius_m: float = 30.0, speed_m_s: float | None = 5.0, **more: Any) -> Intent:
    return Intent(1, "orbit", position_m=(0.0, 40.0, 30.0), radius_m=radius_m, speed_m_s=speed_m_s, **more)


# ---------------------------------------------------------------- whose they are


def test_a_place_is_flown_to_under_the_name_of_its_slot() -> None:
    intents = IntentRig()
    intents.flight(1).waits = True
    assert intents.plan(goto(slot="3/4 of the northern tour", joined=True)) == []
    flight = intents.flight(1)
    assert flight.course == PositionTarget((50.0, 60.0, 30.0), 8.0)
    assert (flight.slot, flight.joined, flight.waits) == (clean("3/4 of the northern tour", 12), True, False)


def test_others_than_its_own_are_none_of_a_planners_business() -> None:
    intents = IntentRig()
    intents.flies(2, (50.0, 100.0, 40.0))
    intents.flight(2).team = "blue"
    intents.plan(goto(2), goto(7))
    assert intents.flight(2).course is None and intents.guard.vetoes == {"unknown vehicle": 2}
    assert "vehicle 2: planner names vehicle 2, not of its team" in list(intents.told())
    assert "vehicle 7: planner names vehicle 7, not of its team" in list(intents.told())


@pytest.mark.parametrize("phase", [Phase.HOLDING, Phase.RETURNING, Phase.BY_HAND, Phase.TAKEN_OUT, Phase.LANDING])
def test_who_does_something_else_by_now_is_let_alone(phase: Phase) -> None:
    """It was flying for its team in the frame the plan was made from: no mistake of the planner's."""
    intents = IntentRig()
    intents.flight(1).enter(phase, NOW)
    assert intents.plan(goto(), Intent(1, "hold", slot="x"), Intent(1, "return")) == []
    assert (intents.flight(1).course, intents.flight(1).slot, dict(intents.guard.vetoes)) == (None, "", {})


def test_one_that_is_not_there_gets_no_course() -> None:
    intents = IntentRig()
    del intents.fleet.vehicles[1]
    intents.plan(goto(), Intent(1, "hold"))
    assert intents.flight(1).course is None and intents.guard.vetoes == {}


def test_who_is_sent_home_is_told_with_the_reason_as_far_as_it_is_short() -> None:
    intents = IntentRig()
    assert intents.plan(Intent(1, "return", reason="battery low")) == [(1, "battery low")]
    assert intents.plan(Intent(1, "return", reason="\x1b[2J" + "x" * 300)) == [(1, clean("\x1b[2J" + "x" * 300, 100))]


def test_a_hold_is_said_once() -> None:
    intents = IntentRig()
    intents.plan(goto())
    intents.run().orders(1)
    hold = Intent(1, "hold", slot="waits", joined=True)
    intents.plan(hold)
    assert intents.run().orders(1) == ["to (0, 100, 30)"]
    flight = intents.flight(1)
    assert (flight.course, flight.slot, flight.joined, flight.waits) == (None, "waits", True, True)
    intents.commands.cancel(1)
    intents.plan(hold)
    assert intents.run().orders(1) == []
    intents.plan(Intent(1, "hold", joined=False))
    assert (flight.slot, flight.joined, flight.waits) == ("", False, False)


# ---------------------------------------------------------------- velocities


def test_a_velocity_is_flown_from_where_it_is_until_the_time_that_the_plan_means() -> None:
    course = IntentRig(moving=(1.0, 0.0, 0.0)).course(velocity(3.0, 4.0, 0.0, valid_s=2.0), age_s=0.3)
    assert course == Cruise(NOW, HERE, (1.0, 0.0, 0.0), (3.0, 4.0, 0.0), NOW - 0.3 + 2.0, 0.9 * 2.5)


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        (velocity(math.nan, 0.0, 0.0), "velocity without finite numbers"),
        (velocity(0.0, 0.0, math.inf), "velocity without finite numbers"),
        (Intent(1, "velocity"), "velocity without finite numbers"),
        (velocity(1.0, 0.0, 0.0, valid_s=0.0), "velocity valid for 0 s: more than 0, at most 30 s"),
        (velocity(1.0, 0.0, 0.0, valid_s=30.1), "velocity valid for 30.1 s: more than 0, at most 30 s"),
        (velocity(1.0, 0.0, 0.0, valid_s=math.nan), "velocity valid for nan s: more than 0, at most 30 s"),
        (velocity(0.0, 8.5, 0.0), "velocity of 8.5 m/s asked, 8 allowed"),
        (velocity(0.0, 8.0, 3.0), "velocity of 8.5 m/s asked, 8 allowed"),
        (Intent(1, "orbit"), "orbit without a centre"),
        (orbit(math.nan), "an orbit needs finite numbers"),
        (orbit(0.5), "an orbit needs a radius of 1 m and 0.1 m/s at least"),
        (Intent(1, "goto"), "goto without a finite position"),
        (goto(speed_m_s=0.05), "goto with 0.05 m/s: at least 0.1"),
    ],
)
def test_what_cannot_be_flown_is_refused_in_words_and_changes_nothing(asked: Intent, why: str) -> None:
    intents = IntentRig()
    intents.plan(goto(slot="before"))
    before = intents.flight(1).course
    intents.plan(asked)
    assert intents.flight(1).course is before and intents.flight(1).slot == "before"
    assert intents.guard.vetoes == {"kind": 1} and list(intents.told())[-1] == f"vehicle 1: {why}"


@pytest.mark.parametrize("asked", [velocity(0.0, 8.4, 0.0), velocity(1.0, 0.0, 0.0, valid_s=30.0)])
def test_what_is_allowed_up_to_its_edge_is_flown(asked: Intent) -> None:
    intents = IntentRig()
    assert isinstance(intents.course(asked), Cruise) and intents.guard.vetoes == {}


def late(by_m: float, after_s: float = 0.5) -> Cruise:
    """What becomes of a velocity, said again after a while, of a vehicle that is behind its reference."""
    intents = IntentRig(moving=(2.0, 0.0, 0.0))
    first = intents.course(velocity(2.0, 0.0, 0.0, valid_s=9.0))
    assert isinstance(first, Cruise)
    intents.clock.advance(after_s)
    x, y, z = first.at(intents.clock.now())[0]
    intents.place(1, (x - by_m, y, z), moving=(1.8, 0.0, 0.0))
    course = intents.course(velocity(2.0, 0.0, 0.0, valid_s=9.0))
    assert isinstance(course, Cruise) and course.begin_s == intents.clock.now()
    return course


def test_who_is_late_is_forgiven_in_part_so_that_nobody_catches_up_above_the_speed_asked() -> None:
    """Half of it after half a second, all of it after one."""
    assert late(1.0).from_m == pytest.approx((0.5, 100.0, 30.0))
    assert late(1.0, 1.0).from_m == pytest.approx((1.0, 100.0, 30.0))
    assert late(1.0, 3.0).from_m == pytest.approx((5.0, 100.0, 30.0))
    assert late(1.0).from_m_s == (2.0, 0.0, 0.0), "of the reference"


def test_who_is_far_from_its_reference_begins_where_it_is() -> None:
    assert late(4.9, 3.0).from_m_s == (2.0, 0.0, 0.0)
    assert (late(5.1, 3.0).from_m, late(5.1, 3.0).from_m_s) == (pytest.approx((0.9, 100.0, 30.0)), (1.8, 0.0, 0.0))


def test_a_position_that_is_old_is_moved_on_by_its_velocity_for_a_second_at_most() -> None:
    for age_s, way_m in ((0.4, 0.8), (3.0, 2.0)):
        intents = IntentRig(moving=(2.0, 0.0, 0.0))
        intents.flight(1).course = Cruise(NOW - 5.0, HERE, (2.0, 0.0, 0.0), (2.0, 0.0, 0.0), NOW + 9.0, 2.25)
        at = intents.flight(1).course.at(NOW)[0]
        intents.place(1, (at[0] - 1.0, *at[1:]), moving=(2.0, 0.0, 0.0))
        intents.vehicle(1).telemetry.position_s = NOW - age_s
        course = intents.course(velocity(2.0, 0.0, 0.0))
        assert isinstance(course, Cruise) and course.from_m[0] == pytest.approx(at[0] - 1.0 + way_m)


def test_out_of_a_veto_it_begins_where_it_is() -> None:
    intents = IntentRig(moving=(2.0, 0.0, 0.0))
    intents.course(velocity(4.0, 0.0, 0.0))
    intents.flight(1).vetoed = "area"
    intents.clock.advance(0.2)
    course = intents.course(velocity(4.0, 0.0, 0.0))
    assert isinstance(course, Cruise) and (course.from_m, course.from_m_s) == (HERE, (2.0, 0.0, 0.0))


def test_out_of_a_place_it_begins_where_it_is_and_out_of_a_track_on_the_track() -> None:
    intents = IntentRig(moving=(2.0, 0.0, 0.0))
    intents.course(goto())
    course = intents.course(velocity(4.0, 0.0, 0.0))
    assert isinstance(course, Cruise) and (course.from_m, course.from_m_s) == (HERE, (2.0, 0.0, 0.0))
    along = [(float(k), 101.0, 30.0) for k in range(4)]
    track = Intent(
        1, "trajectory", t0_s=NOW - 1.0, dt_s=1.0, positions_m=tuple(along), velocities_m_s=((1.0, 0.0, 0.0),) * 4
    )
    assert isinstance(intents.course(track), Trajectory)
    course = intents.course(velocity(4.0, 0.0, 0.0))
    assert isinstance(course, Cruise) and course.from_m == pytest.approx((1.0, 101.0, 30.0))
    assert course.from_m_s == pytest.approx((1.0, 0.0, 0.0))


@pytest.mark.parametrize("asked", [velocity(4.0, 0.0, 0.0), orbit()])
def test_one_whose_velocity_is_not_known_is_taken_as_standing(asked: Intent) -> None:
    intents = IntentRig()
    intents.vehicle(1).telemetry.fix = None
    course = intents.course(asked)
    assert isinstance(course, Cruise | Orbit) and (course.begin_s, course.from_m) == (NOW, HERE)
    assert not isinstance(course, Cruise) or course.from_m_s == STILL


# ---------------------------------------------------------------- orbits


def test_an_orbit_begins_where_and_when_it_comes_to_rest() -> None:
    course = IntentRig(moving=(5.0, 0.0, 0.0)).course(orbit(clockwise=False))
    assert isinstance(course, Orbit)
    assert (course.begin_s, course.from_m) == (NOW + 2.0, pytest.approx((5.0, 100.0, 30.0)))
    assert (course.centre_m, course.radius_m, course.speed_m_s, course.clockwise) == ((0, 40, 30), 30, 5, False)


@pytest.mark.parametrize(("asked", "flown"), [(None, 8.0), (20.0, 8.0), (3.0, 3.0)])
def test_an_orbit_is_no_faster_than_the_limit(asked: float | None, flown: float) -> None:
    course = IntentRig().course(orbit(radius_m=100.0, speed_m_s=asked))
    assert isinstance(course, Orbit) and course.speed_m_s == flown


def test_the_same_orbit_said_again_goes_on_and_another_one_begins() -> None:
    intents = IntentRig()
    first = intents.course(orbit())
    assert first is not None
    intents.clock.advance(5.0)
    intents.place(1, first.at(intents.clock.now())[0])
    assert intents.course(orbit()) is first
    other = intents.course(orbit(31.0))
    assert isinstance(other, Orbit) and other.begin_s == intents.clock.now() and other.radius_m == 31.0


@pytest.mark.parametrize("away_m", [0.0, 5.1])
def test_who_was_stopped_on_its_orbit_or_is_not_on_it_begins_anew(away_m: float) -> None:
    intents = IntentRig()
    first = intents.course(orbit())
    assert first is not None
    intents.clock.advance(5.0)
    x, y, z = first.at(intents.clock.now())[0]
    intents.place(1, (x + away_m, y, z))
    intents.flight(1).vetoed = "" if away_m else "area"
    anew = intents.course(orbit())
    assert anew is not first and isinstance(anew, Orbit) and anew.begin_s == intents.clock.now()
