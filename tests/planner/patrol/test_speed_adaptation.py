"""Tours are flown slower where vehicles cannot keep up, and faster again when they can."""

import copy
import math
from dataclasses import dataclass
from functools import cache

import msgspec
import numpy as np
import pytest

from tests.planner.patrol.test_patrol import limits_kept
from tests.planner.rigs.flights import SMALL, Fleet, fleet, fly, host_of, task_of, zone_of
from tui_gcs.core.geometry.zones import Circle, Rectangle
from tui_gcs.core.protocol.common import Intent, TeamPlan
from tui_gcs.planner.patrol.patrol import Patrol
from tui_gcs.planner.patrol.speed_adaptation import (
    FIRST_TRY_S,
    MAX_TRY_S,
    MIN_SHARE,
    OFF_COURSE_M,
    OFF_COURSE_S,
    SETTLES_S,
    SLOWER,
    TRY_S,
    SpeedAdaptation,
    from_inherited,
)
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.plan_forecast import forecast
from tui_gcs.planner.runtime.snapshot_cache import PlannerSnapshot, pack_learnt

pytestmark = [pytest.mark.usefixtures("designed_once"), pytest.mark.xdist_group("windy patrol")]

STEP_S = 0.2


def judged(tempo: SpeedAdaptation, begin_s: float, until_s: float, off_m: float) -> float:
    """Steps of a planner whose worst vehicle is `off_m` off; when they end."""
    t_s = begin_s
    while t_s < until_s:
        gap_s = tempo.judge(t_s, off_m)
        tempo.advance(gap_s)
        t_s += STEP_S
    return t_s


def test_vehicles_on_course_are_not_slowed() -> None:
    tempo = SpeedAdaptation()
    judged(tempo, 0.0, 3600.0, OFF_COURSE_M - 0.1)
    assert (tempo.share, tempo.wanted) == (1.0, 1.0)


def test_a_gust_now_and_then_is_forgiven() -> None:
    tempo, t_s = SpeedAdaptation(), 0.0
    for _ in range(20):
        t_s = judged(tempo, t_s, t_s + 1.0, 6.0)
        t_s = judged(tempo, t_s, t_s + 59.0, 0.5)
    assert tempo.wanted == 1.0


def test_a_vehicle_off_course_slows_the_tour_step_by_step_and_smoothly() -> None:
    tempo, shares = SpeedAdaptation(), [1.0]
    for k in range(round(25.0 / STEP_S)):
        tempo.advance(tempo.judge(k * STEP_S, 6.0))
        shares.append(tempo.share)
    assert tempo.wanted == pytest.approx(SLOWER**3), "a step, then time to settle"
    assert -np.diff(shares).min() <= 0.1 * STEP_S + 1e-9
    judged(tempo, 25.0, 300.0, 6.0)
    assert tempo.share == MIN_SHARE


def test_after_a_pause_vehicles_catch_up_before_they_are_judged() -> None:
    """Flown: a station that had stood still for 9 s slowed its patrol in calm air."""
    tempo = SpeedAdaptation()
    t_s = judged(tempo, 0.0, 10.0, 0.0)
    t_s = judged(tempo, t_s + 9.0, t_s + 9.0 + SETTLES_S, 6.0)
    assert tempo.wanted == 1.0
    judged(tempo, t_s, t_s + OFF_COURSE_S + 1.0, 6.0)
    assert tempo.wanted == SLOWER, "it is beside its way all the same"


def test_without_vehicles_on_slots_nothing_is_judged() -> None:
    tempo = SpeedAdaptation()
    judged(tempo, 0.0, 600.0, math.nan)
    assert tempo.wanted == 1.0


def test_faster_is_tried_soon_and_after_a_failure_later_each_time() -> None:
    """As in a steady wind: at full speed the vehicles are beside their slots, a step slower they are not."""
    tempo = SpeedAdaptation()
    t_s = judged(tempo, 0.0, 4.0, 6.0)
    assert tempo.wanted == SLOWER
    t_s = judged(tempo, t_s, t_s + SETTLES_S + FIRST_TRY_S - 5.0, 0.5)
    assert tempo.wanted == SLOWER
    for wait_s in (FIRST_TRY_S, TRY_S, 2 * TRY_S, 4 * TRY_S, MAX_TRY_S, MAX_TRY_S):
        assert tempo.try_s == wait_s
        t_s = judged(tempo, t_s, t_s + SETTLES_S + wait_s, 0.5)
        assert tempo.wanted == 1.0
        t_s = judged(tempo, t_s, t_s + SETTLES_S + 4.0, 6.0)
        assert tempo.wanted == SLOWER


def test_the_full_speed_is_back_within_forty_seconds_when_the_cause_is_gone() -> None:
    """Seen in still air: one vehicle was beside its way for three seconds, and the patrol stayed slow for a round."""
    tempo = SpeedAdaptation()
    t_s = judged(tempo, 0.0, 4.0, 3.0)
    assert tempo.wanted == SLOWER
    t_s = judged(tempo, t_s, t_s + 40.0, 0.2)
    assert tempo.wanted == tempo.share == 1.0


def test_a_faster_step_that_lasted_is_no_failure_later() -> None:
    tempo = SpeedAdaptation()
    t_s = 0.0
    for _ in range(3):
        t_s = judged(tempo, t_s, t_s + SETTLES_S + 4.0, 6.0)
        assert tempo.wanted == SLOWER and tempo.try_s == FIRST_TRY_S, "another gust, as long after the last one"
        t_s = judged(tempo, t_s, t_s + 40.0 + TRY_S + SETTLES_S, 0.2)
        assert tempo.wanted == 1.0 and not tempo.tried


def test_after_failures_a_tempo_that_lasts_begins_anew() -> None:
    """The wind has calmed down: after that it is searched for as if nothing had failed."""
    tempo = SpeedAdaptation(SLOWER, SLOWER, try_s=4 * TRY_S)
    judged(tempo, 0.0, 4 * TRY_S + TRY_S + 3 * SETTLES_S, 0.2)
    assert (tempo.wanted, tempo.try_s) == (1.0, FIRST_TRY_S)


def test_faster_is_tried_at_once_when_the_vehicle_that_slowed_it_has_left() -> None:
    tempo = SpeedAdaptation()
    t_s = judged(tempo, 0.0, 4.0, 6.0)
    tempo.blame(1.0, 7, {6, 7})
    assert tempo.wanted == SLOWER and tempo.slowed_by == 7
    t_s = judged(tempo, t_s, t_s + SETTLES_S + 5.0, 0.0)
    tempo.blame(SLOWER, 6, {6, 7})
    assert tempo.wanted == SLOWER, "the vehicle is still there: it may be the wind"
    tempo.blame(SLOWER, 6, {6})
    judged(tempo, t_s, t_s + 1.0, 0.0)
    assert tempo.wanted == 1.0


@dataclass
class Windy(Fleet):
    """Vehicles that are carried to the east as they fly faster: 5 m at 8 m/s, by the square of their speed."""

    carried_m: float = 5.0

    def follow(self, plan: TeamPlan, dt_s: float) -> None:
        before = self.position_m.copy()
        super().follow(plan, dt_s)
        for intent in plan.intents:
            times = intent.t0_s + intent.dt_s * np.arange(len(intent.positions_m))
            speed = math.hypot(*(np.interp(self.t_s, times, axis) for axis in np.array(intent.velocities_m_s).T))
            self.position_m[self.ids.index(intent.vehicle), 0] += self.carried_m * (speed / 8.0) ** 2
        self.velocity_m_s = (self.position_m - before) / dt_s


def windy_patrol() -> tuple[PlannerHost, Windy]:
    plain = fleet(4)
    return host_of(task_of(zone_of(SMALL))), Windy(plain.ids, plain.position_m, plain.velocity_m_s)


@dataclass
class SlowedPatrol:
    """A patrol that has been flown in too much wind for four minutes, and all that it planned in them."""

    host: PlannerHost
    vehicles: Windy
    plans: list[TeamPlan]
    off_m: list[float]
    """Of each plan: how far the worst vehicle is beside its slot."""


def slowed_patrol() -> SlowedPatrol:
    """It is flown once; each test goes on with a copy."""
    return copy.deepcopy(_slowed_patrol())


@cache
def _slowed_patrol() -> SlowedPatrol:
    flown = SlowedPatrol(*windy_patrol(), [], [])

    def watch(plan: TeamPlan) -> None:
        limits_kept(plan)
        flown.plans.append(plan)
        wanted = {intent.vehicle: np.array(intent.positions_m[0][:2]) for intent in plan.intents}
        errors = [wanted[v] - flown.vehicles.position_m[i, :2] for i, v in enumerate(flown.vehicles.ids)]
        flown.off_m.append(max(float(np.hypot(*error)) for error in errors))

    fly(flown.host, flown.vehicles, 240.0, watch)
    return flown


@pytest.mark.long
def test_a_patrol_in_too_much_wind_is_flown_slower_until_its_vehicles_are_on_their_way() -> None:
    flown = slowed_patrol()
    host, vehicles, off_m = flown.host, flown.vehicles, flown.off_m
    notes = [note for plan in flown.plans for note in plan.notes]
    early = next(plan for plan in flown.plans if plan.t_s > 4.5)
    predicted_s, period_s = early.metrics["predicted_worst_s"], early.metrics["period_s"]
    plan = flown.plans[-1]
    share = plan.metrics["tempo_pct"] / 100.0
    assert 0.5 < share < 0.8
    assert max(off_m) > 4.0
    assert max(off_m[-200:]) < 3.0, "and no more than 1.7 m of that beside its way"
    assert all(intent.joined for intent in plan.intents)
    assert plan.metrics["period_s"] > period_s, "and that is what is promised"
    assert plan.metrics["predicted_worst_s"] > predicted_s
    assert notes[0] == "tour flown at 85 % of its speed: vehicles are beside their slots: wind, load?"
    vehicles.carried_m = 0.0

    def watch(plan: TeamPlan) -> None:
        limits_kept(plan)
        notes.extend(plan.notes)

    while notes[-1] != "tour flown at 100 % of its speed: they keep up: faster again":
        assert vehicles.t_s < 1500.0
        fly(host, vehicles, vehicles.t_s + 10.0, watch)
    plan = fly(host, vehicles, vehicles.t_s + 30.0, watch)
    assert "tempo_pct" not in plan.metrics


@pytest.mark.long
def test_it_is_slowed_smoothly_though_one_vehicle_is_never_on_its_slot() -> None:
    """Real ones in 6 m/s of wind lost their slots again and again, and the guard vetoed a step of speed of 1 m/s."""
    host, vehicles = windy_patrol()
    vehicles.carried_m = 14.0
    before: dict[int, Intent] = {}
    jumps_m_s: list[float] = []

    def watch(plan: TeamPlan) -> None:
        limits_kept(plan)
        for intent in plan.intents:
            old = before.get(intent.vehicle)
            if old is not None and old.joined and intent.joined:
                times = old.t0_s + old.dt_s * np.arange(len(old.positions_m))
                expected = [np.interp(plan.t_s, times, axis) for axis in np.array(old.velocities_m_s).T]
                jumps_m_s.append(float(np.hypot(*(np.array(intent.velocities_m_s[0]) - expected)[:2])))
            before[intent.vehicle] = intent

    plan = fly(host, vehicles, 400.0, watch)
    assert plan.metrics["tempo_pct"] <= 62.0
    assert max(jumps_m_s) <= 2.5 * 0.2


@pytest.mark.long
def test_slots_are_equally_spaced_in_time_at_any_tempo() -> None:
    flown = slowed_patrol()
    host, vehicles, plan = flown.host, flown.vehicles, flown.plans[-1]
    vehicles.carried_m = 0.0
    places = {intent.slot: np.array(intent.positions_m[0][:2]) for intent in plan.intents}
    later = fly(host, vehicles, vehicles.t_s + plan.metrics["period_s"] / 4.0)
    then = {intent.slot: np.array(intent.positions_m[0][:2]) for intent in later.intents}
    for k in range(4):
        assert math.dist(then[f"{k + 1}/4"], places[f"{(k + 1) % 4 + 1}/4"]) <= 8.0 * 0.3


@pytest.mark.long
def test_a_guardians_ring_is_flown_slower_too_and_its_vehicles_keep_their_distances() -> None:
    plain = fleet(4, places=((350.0, 200.0), (250.0, 300.0), (150.0, 200.0), (250.0, 100.0)))
    host = host_of(task_of(zone_of(Circle((250.0, 200.0), 80.0)), planner="guardian"))
    vehicles = Windy(plain.ids, plain.position_m, plain.velocity_m_s)
    notes: list[str] = []

    def watch(plan: TeamPlan) -> None:
        limits_kept(plan)
        notes.extend(plan.notes)

    plan = fly(host, vehicles, 200.0, watch)
    share = plan.metrics["tempo_pct"] / 100.0
    assert 0.5 <= share < 0.8
    assert notes[0] == "tour flown at 85 % of its speed: vehicles are beside their slots: wind, load?"
    assert plan.metrics["joined"] == 4.0
    speeds = [math.hypot(*intent.velocities_m_s[0][:2]) for intent in plan.intents]
    assert max(speeds) <= 8.0 * 0.98 * share + 1e-6
    places = np.array([intent.positions_m[0][:2] for intent in plan.intents])
    bearings = np.sort(np.arctan2(*(places - (250.0, 200.0)).T))
    gaps = np.diff(bearings, append=bearings[0] + 2.0 * math.pi)
    assert np.degrees(gaps) == pytest.approx([90.0] * 4, abs=5.0)
    host.set_task(msgspec.structs.replace(host._present().task, revision=8, footprint_radius_m=14.0))
    assert fly(host, vehicles, 201.0).metrics["tempo_pct"] == plan.metrics["tempo_pct"]


@pytest.mark.long
def test_the_next_round_begins_at_the_tempo_of_the_last() -> None:
    flown = slowed_patrol()
    host, vehicles = flown.host, flown.vehicles
    share = flown.plans[-1].metrics["tempo_pct"]
    host.set_task(msgspec.structs.replace(task_of(zone_of(Rectangle((160.0, 210.0), 90.0, 70.0))), revision=8))
    plan = fly(host, vehicles, 241.0)
    assert plan.revision == 8
    assert plan.metrics["tempo_pct"] == share


@pytest.mark.long
def test_a_preview_promises_what_the_tempo_of_the_present_flight_allows() -> None:
    flown = slowed_patrol()
    host, vehicles, plan = flown.host, flown.vehicles, flown.plans[-1]
    share = plan.metrics["tempo_pct"] / 100.0
    task = task_of(zone_of(Rectangle((160.0, 210.0), 90.0, 70.0)))
    calm = forecast(task, vehicles.frame(), {})
    windy = forecast(task, vehicles.frame(), {}, snapshot=host.snapshot())
    assert windy.plan.metrics["tempo_pct"] == plan.metrics["tempo_pct"]
    assert windy.worst_s == pytest.approx(calm.worst_s / share)


@pytest.mark.long
def test_a_worker_of_a_station_that_was_killed_begins_at_the_tempo_of_the_one_before() -> None:
    """It stood still, and slowed anew: vehicles were 6 to 8 m beside their way for a minute."""
    flown = slowed_patrol()
    vehicles = flown.vehicles
    learnt = [b"", *(plan.learnt for plan in flown.plans if plan.learnt is not None)]
    share = flown.plans[-1].metrics["tempo_pct"]
    assert len(set(learnt)) <= 40 and max(map(len, learnt)) < 300, "it is written down with each change"
    other = PlannerHost("red")
    task = msgspec.structs.replace(task_of(zone_of(SMALL)), revision=3, off_course_m=1.0)
    other.set_task(task, learnt[-1])
    plan = other.step(vehicles.frame())
    assert (plan.notes, plan.metrics["tempo_pct"], plan.learnt) == ((), share, learnt[-1])


def test_nothing_is_handed_on_in_calm_air() -> None:
    tempo = SpeedAdaptation()
    judged(tempo, 0.0, 900.0, 0.0)
    assert tempo.handed_on() == b""


WHOLE = msgspec.msgpack.decode(SpeedAdaptation(0.6, 0.6, good_s=30.0, try_s=TRY_S).handed_on())
"""What a planner hands on that has learnt to fly at 0.6 of its speed."""


@pytest.mark.parametrize(
    "wrong",
    [
        {"wanted": 3.0, "share": 3.0},
        *({"wanted": 0.0}, {"wanted": math.nan}, {"wanted": "slow"}, {"share": 8.0}, {"good_s": -1.0}),
        *({"try_s": math.inf}, {"try_s": 0.0}, {"stepped_s": 1e9}, {"tried": 2}),
    ],
)
def test_invalid_inherited_bytes_are_refused(wrong: dict[str, object]) -> None:
    assert from_inherited(msgspec.msgpack.encode(WHOLE)).wanted == 0.6
    with pytest.raises(ValueError):
        from_inherited(msgspec.msgpack.encode(WHOLE | wrong))


def test_a_patrol_that_inherits_invalid_bytes_begins_anew() -> None:
    kept = msgspec.msgpack.decode(pack_learnt(learner(msgspec.msgpack.encode(WHOLE))), type=PlannerSnapshot)
    damaged = msgspec.structs.replace(kept, learnt=msgspec.msgpack.encode(WHOLE | {"wanted": math.nan}))
    host = PlannerHost("red")
    host.set_task(task_of(zone_of(SMALL)), msgspec.msgpack.encode(damaged))
    plan = host.step(fleet(4).frame())
    assert plan.error == "" and len(plan.intents) == 4 and "tempo_pct" not in plan.metrics
    assert plan.notes[0].startswith("begins anew: what was learnt is of no use: ")


def learner(learnt: bytes) -> Patrol:
    """A patrol that has learnt this."""
    patrol = Patrol()
    patrol.learnt = lambda: learnt  # type: ignore[method-assign]
    return patrol


@pytest.mark.long
def test_a_restarted_worker_goes_on_at_the_same_tempo() -> None:
    flown = slowed_patrol()
    host, vehicles = flown.host, flown.vehicles
    while not (plan := host.step(vehicles.frame())).snapshot:
        vehicles.follow(plan, STEP_S)
    other = PlannerHost("red")
    other.set_task(task_of(zone_of(SMALL)), plan.snapshot)
    vehicles.follow(plan, STEP_S)
    frame = vehicles.frame()
    mine, its = host.step(frame), other.step(frame)
    assert its.notes == ()
    assert its.intents == mine.intents
    assert its.metrics == mine.metrics
