"""Orders to single vehicles: arm, take off, go there, circle, nudge, kill; what is refused, and in which words.

No simulator: a flight of each is in test_by_hand.
"""

import math
from collections import defaultdict
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.core.rigs.flight_rig import BRAKE, GUIDED, Watch
from tests.core.rigs.vehicles import set_fields
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.motion.cruise import Cruise
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol.common import Phase, Vec3
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.flight_requests import FlightRequests
from tui_gcs.core.requests.mission_comparison import MissionComparison
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.services.plans.plan_table import HeldPlan
from tui_gcs.core.uplink.jobs import JobState

NAN = math.nan


class OrderWatch(Watch):
    """A watch that answers requests; `lift` is why vehicles must not lift off."""

    def __init__(self, count: int = 2, lift: str = "", items: int = 0) -> None:
        super().__init__(count, landed_state=1, prearm_ok=True)
        readiness = SimpleNamespace(why_not_lift=lambda _: lift, too_close=lambda _: {2: "too close"})
        checklist = SimpleNamespace(lifted=lambda who, vehicle: None)
        services = SimpleNamespace(
            missions=SimpleNamespace(state=lambda _: SimpleNamespace(total=items, held=defaultdict(HeldPlan)))
        )
        self.follow_control = SimpleNamespace(
            begin=lambda vehicle, leader, offset: "" if leader == 2 else "no such leader"
        )
        parts = SimpleNamespace(picture=self, comms=self, flight=self, services=services)
        context = SimpleNamespace(parts=parts, readiness=readiness, checklist=checklist)
        comparison = SimpleNamespace(begin=lambda vehicle, starts, task, then: then("") or "")
        self.acts = FlightRequests(cast(RequestContext, context), cast(MissionComparison, comparison)).acts
        self.task = Task(1, 1, "", "console-1", 0.0)

    def do(self, request: Any, vehicle: int = 1) -> str:
        """Why vehicle 1 does not do it, or ""."""
        act = self.acts[type(request)]
        self.task = Task(1, vehicle, act.words(request), "console-1", self.clock.now())
        return act.begin(self.vehicle(vehicle), request, self.task)

    def ended(self) -> tuple[JobState, str]:
        return self.task.state, self.task.text


def aloft(phase: Phase = Phase.FLYING, **setting: Any) -> OrderWatch:
    """1 flies 100 m north of its home, on its layer."""
    watch = OrderWatch(**setting)
    watch.flies(1, (0.0, 100.0, 30.0), phase)
    return watch


# ---------------------------------------------------------------- on the ground


def test_arming_sets_the_mode_first_and_ends_when_it_shows() -> None:
    watch = OrderWatch()
    watch.vehicle(1).telemetry.custom_mode = BRAKE
    assert watch.do(f.Arm((1,))) == ""
    assert watch.run(0.3).orders(1) == ["GUIDED"]
    watch.vehicle(1).telemetry.custom_mode = GUIDED
    assert watch.run(0.3).orders(1) == ["arm"] and not watch.task.over
    watch.vehicle(1).telemetry.armed = True
    watch.run()
    assert watch.ended() == (JobState.DONE, "armed")
    assert watch.do(f.Arm((1,))) == "it is armed"


def test_what_must_not_lift_off_is_not_armed() -> None:
    for request in (f.Arm((1,)), f.TakeOff((1,), 20.0)):
        watch = OrderWatch(lift="battery low")
        assert watch.do(request) == "battery low" and watch.run(1.0).sent == []


def test_only_what_stands_on_the_ground_is_disarmed() -> None:
    watch = OrderWatch()
    assert watch.do(f.Disarm((1,))) == "it is not armed"
    watch.vehicle(1).telemetry.armed = True
    assert watch.do(f.Disarm((1,))) == "" and watch.run(0.3).orders(1) == ["disarm"]
    watch.vehicle(1).telemetry.armed = False
    watch.run()
    assert watch.ended() == (JobState.DONE, "disarmed")
    assert aloft().do(f.Disarm((1,))) == "it is in the air: land it first"


@pytest.mark.parametrize(
    ("vehicles", "reason", "why"),
    [
        ((1, 2), "fire", "the motors of one vehicle at a time"),
        ((), "fire", "the motors of one vehicle at a time"),
        ((1,), " ", "say why"),
    ],
)
def test_motors_are_stopped_of_one_vehicle_with_a_reason(vehicles: tuple[int, ...], reason: str, why: str) -> None:
    watch = aloft()
    assert watch.do(f.KillMotors(vehicles, reason)) == why and watch.orders(1) == []


def test_motors_are_stopped_at_once_and_that_is_not_said_again_later() -> None:
    watch = aloft()
    watch.executive.land((1,))
    watch.orders(1)
    assert watch.do(f.KillMotors((1,), "it burns")) == "" and watch.task.what == "KILL MOTORS: it burns"
    watch.run(1.5)
    assert watch.orders(1) == ["disarm now"], "the landing is not said on"
    watch.run(10.0)
    assert watch.ended() == (JobState.FAILED, "it is held: no answer")
    assert watch.orders(1)[:2] == ["disarm now", "to (0, 100, 30)"]
    assert OrderWatch().do(f.KillMotors((1,), "it burns")) == "it is not armed"


def leaves_its_mode(watch: OrderWatch) -> None:
    watch.vehicle(1).telemetry.custom_mode = 6


def is_not_heard(watch: OrderWatch) -> None:
    watch.silent.add(1)
    watch.run(3.0)


def is_outside(watch: OrderWatch) -> None:
    watch.place(1, (0.0, 390.0, 30.0), moving=(0.0, 8.0, 0.0))


@pytest.mark.parametrize("noticed", [leaves_its_mode, is_not_heard, is_outside])
def test_nothing_that_is_noticed_comes_between_an_operator_and_the_motors(
    noticed: Callable[[OrderWatch], None],
) -> None:
    """It leaves its mode, is lost or meets the guard's veto in the very second in which its motors are stopped."""
    watch = aloft()
    watch.do(f.GoTo((1,), ((0.0, 300.0, 30.0),)))
    watch.run(5.0)
    noticed(watch)
    watch.sent.clear()
    watch.do(f.KillMotors((1,), "flies away"))
    watch.run(2.5)
    assert [words for _, words in watch.sent] == ["disarm now"] * 3
    watch.silent.clear()
    watch.place(1, (0.0, 100.0, 5.0), armed=False)
    watch.run()
    assert watch.ended() == (JobState.DONE, "motors stopped") and watch.phases()[0] is Phase.GROUND
    assert "motors stopped, as an operator ordered" in list(watch.told())


@pytest.mark.parametrize("phase", [Phase.GROUND, Phase.TAKEN_OUT])
def test_who_was_not_ours_to_steer_is_not_held_where_its_motors_go_on(phase: Phase) -> None:
    watch = aloft()
    watch.flight(1).enter(phase, 0.0, "mode")
    watch.vehicle(1).telemetry.landed_state, watch.vehicle(1).telemetry.position_m = 1, (0.0, 0.0, 0.0)
    watch.do(f.KillMotors((1,), "it burns"))
    watch.run(12.0)
    assert watch.ended() == (JobState.FAILED, "no answer") and watch.orders(1) == ["disarm now"]
    assert watch.phases()[0] is phase


@pytest.mark.parametrize("alt_m", [2.4, 90.1, NAN, math.inf])
def test_nobody_takes_off_to_where_it_cannot_stay(alt_m: float) -> None:
    assert OrderWatch().do(f.TakeOff((1,), alt_m)) == f"{alt_m:g} m: 2.5 to 90 m are allowed"
    assert all(OrderWatch().do(f.TakeOff((1,), good)) == "" for good in (2.5, 90.0))


def test_a_take_off_arms_climbs_and_is_refused_beside_another_one() -> None:
    watch = OrderWatch()
    assert watch.do(f.TakeOff((2,), 20.0), vehicle=2) == "too close"
    assert watch.do(f.TakeOff((1,), 12.5)) == "" and watch.flight(1).manual_alt_m == 12.5
    assert watch.run(0.3).orders(1) == ["arm"]
    watch.vehicle(1).telemetry.armed = True
    assert watch.run(0.3).orders(1) == ["take off to 12.5"]
    watch.vehicle(1).telemetry.landed_state = 2
    watch.run()
    assert watch.ended() == (JobState.DONE, "climbs to 12.5 m") and watch.flight(1).phase is Phase.TAKEOFF


def test_one_that_is_in_no_team_does_not_take_off() -> None:
    watch = OrderWatch()
    del watch.flights.by_id[1]
    assert watch.do(f.TakeOff((1,), 20.0)) == "is in no team: no course is flown with it"
    assert watch.run(1.0).orders(1) == []


def test_a_take_off_that_fails_is_given_up_and_disarmed() -> None:
    watch = OrderWatch()
    watch.vehicle(1).telemetry.armed = True
    watch.do(f.TakeOff((1,), 12.0))
    watch.run().orders(1)
    watch.commands.on_ack(watch.vehicle(1), 22, 4)
    watch.run(1.0)
    assert watch.ended() == (JobState.FAILED, "refused: failed")
    assert "disarm" in watch.orders(1) and watch.flight(1).phase is Phase.HOLDING


def test_a_task_that_is_cancelled_is_not_said_any_more() -> None:
    watch = OrderWatch()
    watch.do(f.Arm((1,)))
    watch.run().orders(1)
    assert watch.task.cancel() == "" and watch.run(5.0).orders(1) == []


# ---------------------------------------------------------------- places


@pytest.mark.parametrize(
    ("point", "from_home", "target"),
    [
        ((10.0, 20.0, 40.0), False, (10.0, 20.0, 40.0)),
        ((NAN, NAN, 40.0), False, (0.0, 100.0, 40.0)),
        ((10.0, 20.0, NAN), False, (10.0, 20.0, 30.0)),
        ((10.0, 20.0, 40.0), True, (15.0, 27.0, 40.0)),
        ((NAN, NAN, 40.0), True, (0.0, 100.0, 40.0)),
        ((0.0, 0.0, 2.5), False, (0.0, 0.0, 2.5)),
    ],
)
def test_a_place_is_what_is_said_and_the_rest_as_it_is(point: Vec3, from_home: bool, target: Vec3) -> None:
    watch = aloft()
    watch.flight(1).home_m = (5.0, 7.0, 3.0)
    assert watch.do(f.GoTo((1,), (point,), from_home=from_home)) == ""
    assert watch.flight(1).course == PositionTarget(target, 8.0) and watch.phases()[0] is Phase.BY_HAND
    assert watch.ended() == (JobState.DONE, "on its way")


def test_each_goes_to_its_own_place() -> None:
    watch = aloft()
    watch.flies(2, (50.0, 100.0, 40.0))
    request = f.GoTo((2, 1), ((1.0, 2.0, 40.0), (3.0, 4.0, 30.0)), speed_m_s=4.0)
    assert watch.do(request, 1) == watch.do(request, 2) == ""
    assert watch.flight(1).course == PositionTarget((3.0, 4.0, 30.0), 4.0)
    assert watch.flight(2).course == PositionTarget((1.0, 2.0, 40.0), 4.0)
    assert watch.do(f.GoTo((1, 2), ((1.0, 2.0, 40.0),))) == "name a place for each vehicle"


@pytest.mark.parametrize(
    ("point", "speed_m_s", "why"),
    [
        ((0.0, 0.0, 2.4), NAN, "2.4 m is too low to hover: at least 2.5 m"),
        ((0.0, 0.0, -30.0), NAN, "-30.0 m is too low to hover: at least 2.5 m"),
        ((math.inf, 0.0, 30.0), NAN, "the place is not finite"),
        ((0.0, 0.0, 30.0), 8.1, "8.1 m/s: 0.1 to 8 are allowed"),
        ((0.0, 0.0, 30.0), 0.0, "0 m/s: 0.1 to 8 are allowed"),
        ((0.0, 0.0, 30.0), -1.0, "-1 m/s: 0.1 to 8 are allowed"),
    ],
)
def test_places_that_nobody_can_fly_to_are_refused(point: Vec3, speed_m_s: float, why: str) -> None:
    watch = aloft()
    assert watch.do(f.GoTo((1,), (point,), speed_m_s=speed_m_s)) == why
    assert watch.phases()[0] is Phase.FLYING and not watch.task.over


def test_without_a_home_no_place_is_counted_from_it() -> None:
    watch = aloft()
    watch.flight(1).home_m = None
    assert watch.do(f.GoTo((1,), ((0.0, 0.0, 30.0),), from_home=True)) == "its home is not known"


@pytest.mark.parametrize(
    "request_", [f.GoTo((1,), ((0.0, 50.0, 30.0),)), f.CircleFlight((1,), (0.0, 50.0, 30.0), 10.0)]
)
def test_who_cannot_be_flown_says_why(request_: Any) -> None:
    def why(**vehicle: Any) -> str:
        watch = aloft(vehicle.pop("phase", Phase.FLYING))
        set_fields(watch.vehicle(1), **vehicle)
        return watch.do(request_)

    assert why(type=1) == "only ArduCopter and PX4 multicopters can be flown so far"
    assert why(moved="heard from another address") == "heard from another address"
    assert why(position_s=900.0) == "its position is not known"
    assert why(armed=False) == "is not in the air: take off first"
    assert why(phase=Phase.TAKEOFF) == "not now: take-off"
    for phase in (Phase.HOLDING, Phase.RETURNING, Phase.LANDING, Phase.TAKEN_OUT, Phase.BY_HAND):
        assert why(phase=phase) == ""
    watch = aloft()
    del watch.flights.by_id[1]
    assert watch.do(request_) == "is in no team: no course is flown with it"


def test_who_is_taken_out_of_another_mode_is_engaged_and_its_orders_end() -> None:
    watch = aloft(Phase.LANDING)
    watch.executive.land((1,))
    watch.run().orders(1)
    watch.vehicle(1).telemetry.custom_mode = BRAKE
    watch.do(f.GoTo((1,), ((0.0, 50.0, 30.0),)))
    reported = watch.run(1.0).orders(1)
    assert reported[0] == "GUIDED" and "LAND" not in reported


def test_the_speed_on_the_way_is_limited_and_no_other_courses() -> None:
    watch = aloft()
    watch.do(f.GoTo((1,), ((0.0, 0.0, 30.0),)))
    assert watch.run(0.3).orders(1) == ["to (0, 0, 30)", "at most 8 m/s"]
    assert watch.do(f.LimitSpeed((1,), 3.0)) == ""
    assert watch.flight(1).course == PositionTarget((0.0, 0.0, 30.0), 3.0)
    assert "at most 3 m/s" in watch.run(0.3).orders(1)
    for speed_m_s in (0.0, 8.5, NAN):
        assert watch.do(f.LimitSpeed((1,), speed_m_s)) == f"{speed_m_s:g} m/s: 0.1 to 8 are allowed"
    watch.do(f.Nudge((1,), (0.0, 0.0, 0.0)))
    assert "at most 8 m/s" in watch.run(0.3).orders(1), "what is nudged is not slower than it is asked to be"
    assert watch.do(f.LimitSpeed((1,), 3.0)) == "is not on its way to a place"


def test_one_that_flies_its_mission_is_limited_by_its_own_word() -> None:
    watch = aloft(Phase.TAKEN_OUT)
    assert watch.do(f.LimitSpeed((1,), 3.0)) == "" and watch.run(0.3).orders(1) == ["at most 3 m/s"]
    watch.commands.on_ack(watch.vehicle(1), 178, 0)
    watch.run()
    assert watch.ended() == (JobState.DONE, "at most 3 m/s")
    for speed_m_s in (0.05, 8.5, NAN):
        assert watch.do(f.LimitSpeed((1,), speed_m_s)) == f"{speed_m_s:g} m/s: 0.1 to 8 are allowed"
    for speed_m_s in (0.1, 8.0):
        assert watch.do(f.LimitSpeed((1,), speed_m_s)) == ""


# ---------------------------------------------------------------- circles, nudges, followers


def test_a_circle_begins_where_it_comes_to_rest_and_no_faster_than_is_allowed() -> None:
    watch = aloft()
    watch.place(1, (0.0, 100.0, 30.0), moving=(5.0, 0.0, 0.0))
    assert watch.do(f.CircleFlight((1,), (0.0, 50.0, NAN), 40.0, speed_m_s=20.0, clockwise=False)) == ""
    course = watch.flight(1).course
    assert isinstance(course, Orbit)
    assert (course.centre_m, course.radius_m, course.speed_m_s) == ((0.0, 50.0, 30.0), 40.0, 8.0)
    assert (course.from_m, course.clockwise, course.begin_s) == (pytest.approx((5.0, 100.0, 30.0)), False, 1002.0)
    assert watch.do(f.CircleFlight((1,), (0.0, 50.0, 35.0), 40.0)) == "" and watch.flight(1).goal == (
        (0.0, 50.0, 35.0),
        40.0,
    )
    assert watch.do(f.CircleFlight((1,), (0.0, 50.0, 35.0), 0.5)).startswith("an orbit needs a radius of 1 m")


def nudged(*velocities: Vec3) -> OrderWatch:
    watch = aloft()
    for velocity in ((0.0, 0.0, 0.0), *velocities):
        assert watch.do(f.Nudge((1,), velocity)) == ""
    return watch


@pytest.mark.parametrize(
    ("asked", "flown"),
    [
        ((3.0, 4.0, 0.0), (3.0, 4.0, 0.0)),
        ((0.0, 80.0, 0.0), (0.0, 8.0, 0.0)),
        ((0.0, 0.0, 9.0), (0.0, 0.0, 3.0)),
        ((0.0, 0.0, -9.0), (0.0, 0.0, -1.5)),
    ],
)
def test_a_nudge_is_as_fast_as_asked_and_allowed_and_ends_by_itself(asked: Vec3, flown: Vec3) -> None:
    course = nudged(asked).flight(1).course
    assert course is not None and course.at(1000.0)[1] == (0.0, 0.0, 0.0)
    speed = math.hypot(*flown)
    ways = [velocity for t in range(300) if math.hypot(*(velocity := course.at(1000.0 + t / 100)[1])) > 0.01]
    directions = {tuple(round(part / math.hypot(*velocity), 3) + 0.0 for part in velocity) for velocity in ways}
    assert directions == {tuple(round(part / speed, 3) + 0.0 for part in flown)}
    assert max(math.hypot(*velocity) for velocity in ways) == pytest.approx(min(speed, 0.9 * 2.5), abs=0.05)
    assert course.at(1010.0)[1] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("asked", "flown"),
    [
        ((0.3, -0.4, 0.0), (0.3, -0.4, 0.0)),
        ((6.0, 8.0, 0.0), (4.8, 6.4, 0.0)),
        ((0.0, 80.0, 0.0), (0.0, 8.0, 0.0)),
        ((12.0, 0.0, 16.0), (4.8, 0.0, 3.0)),
        ((0.0, 6.0, -8.0), (0.0, 4.8, -1.5)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_a_nudge_leads_to_no_more_than_the_limits_in_its_direction(asked: Vec3, flown: Vec3) -> None:
    """A second is too short to get there: who keeps the key pressed does."""
    course = nudged(asked).flight(1).course
    assert isinstance(course, Cruise) and course.velocity_m_s == pytest.approx(flown)


def test_one_whose_velocity_is_not_known_is_flown_as_if_it_stood() -> None:
    watch = nudged()
    watch.flight(1).course = None
    watch.vehicle(1).telemetry.fix = None
    assert not any(map(math.isfinite, watch.vehicle(1).telemetry.velocity_m_s))
    assert watch.manual_control.nudge(watch.vehicle(1), f.Nudge((1,), (1.0, 0.0, 0.0))) == ""
    course = watch.flight(1).course
    assert isinstance(course, Cruise) and course.from_m_s == (0.0, 0.0, 0.0)
    assert watch.do(f.CircleFlight((1,), (0.0, 50.0, NAN), 40.0)) == "" and watch.flight(1).goal == (
        (0.0, 50.0, 30.0),
        40.0,
    )


def test_the_speed_on_the_way_may_be_the_least_and_the_most() -> None:
    watch = aloft()
    for speed_m_s in (0.1, 8.0):
        assert watch.do(f.GoTo((1,), ((0.0, 0.0, 30.0),), speed_m_s=speed_m_s)) == ""
        assert watch.do(f.LimitSpeed((1,), speed_m_s)) == ""
        assert watch.flight(1).course == PositionTarget((0.0, 0.0, 30.0), speed_m_s)


def test_only_a_nudge_of_zero_takes_a_vehicle_from_what_it_does() -> None:
    watch = aloft(Phase.HOLDING)
    assert watch.do(f.Nudge((1,), (1.0, 0.0, 0.0))) == "does something else meanwhile: begin the nudge anew"
    assert watch.do(f.Nudge((1,), (0.0, 0.0, 0.0))) == "" and watch.do(f.Nudge((1,), (1.0, 0.0, 0.0))) == ""
    watch.executive.hold((1,))
    assert watch.do(f.Nudge((1,), (1.0, 0.0, 0.0))) == "does something else meanwhile: begin the nudge anew"
    assert aloft().do(f.Nudge((1,), (NAN, 0.0, 0.0))) == "does something else meanwhile: begin the nudge anew"
    assert nudged().do(f.Nudge((1,), (NAN, 0.0, 0.0))) == "the velocity is not finite"


def test_the_next_nudge_goes_on_from_the_course_of_the_last_as_long_as_it_is_followed() -> None:
    watch = nudged((2.0, 0.0, 0.0))
    watch.clock.advance(0.5)
    before = watch.flight(1).course
    assert before is not None
    place, velocity = before.at(1000.5)
    watch.place(1, (place[0] - 3.0, *place[1:]))
    watch.do(f.Nudge((1,), (2.0, 0.0, 0.0)))
    now = watch.flight(1).course
    assert now is not None and now.at(1000.5) == (place, velocity)
    far = (place[0] - 6.0, *place[1:])
    watch.place(1, far)
    watch.do(f.Nudge((1,), (2.0, 0.0, 0.0)))
    now = watch.flight(1).course
    assert now is not None and now.at(1000.5) == (far, (0.0, 0.0, 0.0))


def test_several_followers_have_no_offset_in_common() -> None:
    watch = aloft()
    assert watch.do(f.Follow((1,), 2, (5.0, 5.0, NAN))) == "" and watch.ended()[1] == "follows vehicle 2"
    assert watch.do(f.Follow((1, 3), 2, (5.0, NAN, NAN))) == "several keep the places they have: no offset"
    assert watch.do(f.Follow((1, 3), 2)) == "" and watch.do(f.Follow((1,), 9)) == "no such leader"


# ---------------------------------------------------------------- the mission on board


def test_a_mission_is_begun_only_in_the_air_and_if_there_is_one() -> None:
    request = f.OnBoardMission((1,), "start")
    assert OrderWatch(items=5).do(request) == "is not in the air: take off first"
    assert aloft().do(request) == "holds no mission: upload one first"
    plane = aloft(items=5)
    plane.vehicle(1).type = 1
    assert plane.do(request) == "only ArduCopter and PX4 multicopters can be flown so far"
    assert plane.phases()[0] is Phase.FLYING and plane.run(1.0).orders(1) == []
    watch = aloft(items=5)
    watch.executive.hold((1,))
    watch.orders(1)
    assert watch.do(request) == "" and watch.run(0.5).orders(1) == ["AUTO"]
    assert watch.phases()[0] is Phase.TAKEN_OUT
    watch.vehicle(1).telemetry.custom_mode = 3
    watch.run()
    assert watch.ended() == (JobState.DONE, "flies its mission")


@pytest.mark.parametrize("act", ["start", "continue"])
def test_who_does_not_take_its_mission_is_held(act: Any) -> None:
    watch = aloft(items=5)
    watch.do(f.OnBoardMission((1,), act))
    watch.run().orders(1)
    watch.commands.on_ack(watch.vehicle(1), 176, 4)
    watch.run(1.0)
    assert watch.ended() == (JobState.FAILED, "it is held: refused: failed")
    assert watch.phases()[0] is Phase.HOLDING and watch.orders(1)[-1] == "to (0, 100, 30)"


def test_another_order_meanwhile_is_what_counts() -> None:
    watch = aloft(items=5)
    watch.do(f.OnBoardMission((1,), "start"))
    watch.run()
    watch.executive.land((1,))
    assert watch.ended() == (JobState.FAILED, "superseded") and watch.phases()[0] is Phase.LANDING


# ---------------------------------------------------------------- in words


@pytest.mark.parametrize(
    ("request_", "text"),
    [
        (f.TakeOff((1,), 12.5), "take off to 12.5 m"),
        (f.GoTo((1,), ((1.0, 2.0, 30.0),)), "go to (1, 2), 30 m above home"),
        (f.GoTo((1,), ((1.0, 2.0, NAN),), from_home=True), "go to (1, 2) from its home"),
        (f.GoTo((1, 2), ((NAN, NAN, 30.0), (NAN, 2.0, NAN))), "go to 30 m above home, where it is"),
        (f.CircleFlight((1,), (1.0, 2.0, NAN), 15.0), "orbit round (1, 2), radius 15 m"),
        (f.LimitSpeed((1,), 3.5), "speed 3.5 m/s"),
        (f.Nudge((1,), (1.0, 0.0, 0.0)), "nudge"),
        (f.Follow((1,), 2), "follow vehicle 2"),
        (f.OnBoardMission((1,), "continue"), "mission continue"),
        (f.Arm((1,)), "arm"),
        (f.Disarm((1,)), "disarm"),
        (f.KillMotors((1,), "fire"), "KILL MOTORS"),
    ],
)
def test_what_is_asked_in_words(request_: Any, text: str) -> None:
    assert OrderWatch().acts[type(request_)].words(request_) == text
