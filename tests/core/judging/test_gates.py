"""What a flight is judged by: what its planner is for, and the metrics that it declares."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.core.judging.test_referee import FAR, IDS, frame, status
from tests.core.rigs.rig import scenario
from tui_gcs.core.judging.incursions import Incursions
from tui_gcs.core.judging.metric_log import MAX_SAMPLES, MetricLog, gate_problems
from tui_gcs.core.judging.referee import Referee
from tui_gcs.core.judging.result_check import ResultCheck
from tui_gcs.core.judging.zone_measure import cover_bound_s
from tui_gcs.core.protocol.common import PlannerInfo, StationStatus
from tui_gcs.core.protocol.planning import JudgedBy, Metric
from tui_gcs.core.scenario.model import Scenario


def info(judged_by: JudgedBy = "metrics", *metrics: Metric) -> PlannerInfo:
    """What the team's planner, which is called patrol in the tests' scenario, declares."""
    return PlannerInfo("patrol", "1", (), 5.0, metrics=metrics, judged_by=judged_by)


def with_gates(**gates: float) -> Scenario:
    whole = scenario(2)
    return msgspec.structs.replace(whole, results=msgspec.structs.replace(whole.results, metrics=gates))


def flown(mission: Scenario, declared: PlannerInfo | None, *values: float) -> Referee:
    """A round in which the planner publishes these values of `reward`, one a second."""
    judge = Referee(mission, {"patrol": declared} if declared is not None else {})
    judge.started = IDS
    judge.begin_round(mission.rounds[0], 0.0)
    for t, value in enumerate(values, 1):
        judge.on_status(publishing(float(t), reward=value))
        judge.on_frame(frame(float(t), [(100.0, 200.0, 27.0), FAR]))
    return judge


def publishing(t_s: float, on_slot: int = 0, **metrics: float) -> StationStatus:
    team = msgspec.structs.replace(status(on_slot).teams[0], metrics=metrics)
    return msgspec.structs.replace(status(on_slot), t_s=t_s, mission_time_s=t_s, teams=(team,))


def checks_of_round(judge: Referee) -> list[ResultCheck]:
    return [check for check in judge.result().checks if check.name.startswith("round 1")]


# ---------------------------------------------------------------- kinds


def test_a_planner_of_ones_own_is_not_judged_by_coverage_or_slots() -> None:
    judge = flown(scenario(2), info("metrics"), 1.0)
    assert checks_of_round(judge) == []
    (r,) = judge.result().rounds
    assert (r.judged_by, r.ratio, r.worst_idleness_s, r.n) == ("metrics", None, None, 2)


def test_a_planner_that_nobody_knows_fails_however_well_it_flies() -> None:
    (check,) = checks_of_round(flown(scenario(2), None, 1.0))
    assert (check.ok, check.why) == (False, "what planner patrol is judged by is not known")


def test_what_a_survey_saw_before_a_loss_stays_seen() -> None:
    """The station's planner did not fly there again, so 2 of 5911 cells were never seen and the survey failed."""
    judge = flown(scenario(2), info("coverage"), 1.0)
    xy = [(float(x), float(y)) for x in range(70, 240, 15) for y in range(120, 290, 15)]
    half = len(xy) // 2
    for t, place in enumerate(xy[:half], 2):
        judge.on_frame(frame(float(t), [(*place, 27.0), FAR]))
    judge.lose(2, float(half + 2))
    for t, place in enumerate(xy[half:], half + 3):
        judge.on_frame(frame(float(t), [(*place, 27.0)]))
    first, second = judge.result().rounds
    assert first.cut_short and 0.3 < first.coverage < 0.7, "its figures are those of its end"
    assert second.coverage == 1.0 and second.covered_s is not None and second.covered_s < 80.0
    assert second.cover_bound_s is not None
    alone_s = (math.pi * 80.0**2 * (1.0 - first.coverage) - math.pi * 15.0**2) / (2 * 15.0 * 8.0)
    assert second.cover_bound_s == pytest.approx(alone_s, abs=0.2), "of what was left, by the one that was left"
    assert all(check.name.startswith("round 1 (2 lost)") for check in checks_of_round(judge))


def test_a_survey_is_judged_by_the_time_until_all_was_seen() -> None:
    judge = flown(scenario(2), info("coverage"), 1.0)
    assert [(c.name, c.ok) for c in checks_of_round(judge)] == [
        ("round 1 home: coverage", False),
        ("round 1 home: seen whole after, x bound", False),
    ]
    xy = [(float(x), float(y)) for x in range(70, 240, 15) for y in range(120, 290, 15)]
    for t, place in enumerate(xy, 2):
        judge.on_frame(frame(float(t), [(*place, 27.0), FAR]))
    (r,) = judge.result().rounds
    way_s = (70.0 - 15.0) / 8.0  # of the one that waits 70 m beside the zone
    least_s = (math.pi * 80.0**2 / 2 - math.pi * 15.0**2) / (2 * 15.0 * 8.0) + way_s / 2.0
    assert r.covered_s == 128.8 and r.cover_bound_s == pytest.approx(least_s, rel=1e-3)
    assert judge.present()[0].done, "there is no more to see"
    assert [(c.ok, c.value) for c in checks_of_round(judge)] == [(True, 1.0), (False, 3.04)], "129 s of 42.4 s"


def test_the_least_time_to_see_a_zone_once() -> None:
    assert cover_bound_s(240.0 * 100.0 + math.pi * 225.0, [0.0], 8.0, 15.0) == pytest.approx(100.0)
    assert cover_bound_s(240.0 * 100.0 + math.pi * 225.0, [20.0], 8.0, 15.0) == pytest.approx(120.0)
    assert cover_bound_s(100.0, [0.0] * 4, 8.0, 15.0) == 0.0, "what is under the first footprint takes no time"
    assert cover_bound_s(100.0, [0.0, 500.0], 8.0, 15.0) == 0.0, "one is there, the other comes too late to matter"
    assert cover_bound_s(100.0, [], 8.0, 15.0) == math.inf


@given(
    st.floats(1.0, 1e6),
    st.lists(st.floats(0.0, 1000.0), min_size=1, max_size=8),
    st.floats(1.0, 20.0),
    st.floats(2.0, 50.0),
)
def test_no_sharing_of_the_area_beats_the_least_time(
    area_m2: float, ways_s: list[float], speed_m_s: float, radius_m: float
) -> None:
    bound_s = cover_bound_s(area_m2, ways_s, speed_m_s, radius_m)
    seen_m2 = sum(
        math.pi * radius_m**2 + 2.0 * radius_m * speed_m_s * (bound_s - way_s) for way_s in ways_s if way_s <= bound_s
    )
    assert seen_m2 >= area_m2 * (1.0 - 1e-9), "all that can be swept until then suffices"
    before_s = bound_s * 0.99 - 1e-6
    seen_m2 = sum(
        math.pi * radius_m**2 + 2.0 * radius_m * speed_m_s * (before_s - way_s) for way_s in ways_s if way_s <= before_s
    )
    assert seen_m2 <= area_m2, "and a little earlier it does not"


@pytest.mark.parametrize(("met", "ok"), [((True, True, True, True), True), ((False,) * 4, False)])
def test_a_guardian_that_meets_nobody_does_not_pass(met: tuple[bool, ...], ok: bool) -> None:
    judge = flown(scenario(2), info("intruders"), 1.0)
    judge.incursions = Incursions(scenario(2))
    judge.incursions.on_status(publishing(1.0))
    west, inside = (20.0, 200.0), (80.0, 200.0)
    judge.incursions.see([west] * 4, [True] * 4, [False] * 4)
    judge.incursions.see([inside] * 4, [True] * 4, met, {1: (25.0, 200.0), 2: (400.0, 0.0)})
    (check,) = [c for c in judge.result().checks if c.name == "home: intruders met"]
    assert (check.ok, check.value, check.limit) == (ok, float(ok), 0.75)
    assert check.why == f"{sum(met)} of 4"
    assert checks_of_round(judge) == [], "who chases intruders is on no slot"
    record = judge.result().records[0]
    assert (record.kind, record.subject, record.vehicle) == (
        ("intruder met", "1", 1) if ok else ("intruder in the zone", "1", None)
    )
    assert "vehicle 1 was 55 m away" in record.text


@pytest.mark.parametrize("sensors", [True, False])
def test_a_guardian_without_intruders_is_judged_by_whether_it_was_there(sensors: bool) -> None:
    judge = flown(scenario(2), info("intruders"), 1.0)
    judge.incursions = Incursions(scenario(2)) if sensors else None
    (check,) = checks_of_round(judge)
    assert (check.name, check.ok) == ("round 1 home: all on slot, s", False)
    judge.on_status(publishing(2.0, on_slot=2))
    (check,) = checks_of_round(judge)
    assert check.ok


# ---------------------------------------------------------------- metrics


@pytest.mark.parametrize(
    ("metric", "values", "value", "ok"),
    [
        (Metric("reward", gate=2.0), (5.0, 1.0, 3.0), 3.0, True),
        (Metric("reward", gate=2.0, of="worst"), (5.0, 1.0, 3.0), 1.0, False),
        (Metric("reward", better="lower", gate=2.0, of="worst"), (1.0, 5.0, 1.0), 5.0, False),
        (Metric("reward", gate=3.0, of="mean"), (5.0, 1.0, math.nan, 3.0), 3.0, True),
        (Metric("reward", gate=2.0), (5.0, math.nan), None, False),
        (Metric("reward", gate=2.0), (), None, False),
    ],
)
def test_a_planners_own_gate(metric: Metric, values: tuple[float, ...], value: float | None, ok: bool) -> None:
    (check,) = checks_of_round(flown(scenario(2), info("metrics", metric), *values))
    assert (check.value, check.ok) == (value, ok)


def test_the_scenarios_gates_take_the_place_of_the_planners() -> None:
    judge = flown(with_gates(reward_min=2.0, reward_max=4.0), info("metrics", Metric("reward", gate=100.0)), 3.0)
    assert [(c.limit, c.ok) for c in checks_of_round(judge)] == [(2.0, True), (4.0, True)]


def test_a_metric_without_a_gate_is_kept_and_not_judged() -> None:
    judge = flown(scenario(2), info("metrics", Metric("reward", "points")), 1.0, 2.0, math.nan)
    assert checks_of_round(judge) == []
    (series,) = judge.result().metrics
    assert (series.round, series.team, series.name, series.unit) == ("round 1", "defend", "reward", "points")
    assert (series.times_s, series.values) == ([1.0, 2.0, 3.0], [1.0, 2.0, None])
    assert (series.last, series.mean, series.low, series.high) == (None, 1.5, 1.0, 2.0)


def test_a_gate_of_a_metric_that_nobody_declares_is_a_mistake_and_fails() -> None:
    mission = with_gates(rewrad_min=1.0)
    declared = info("metrics", Metric("reward"))
    what = "no planner of this scenario declares that metric; patrol declares reward"
    assert gate_problems(mission, {"patrol": declared}) == [("rewrad_min", what)]
    assert gate_problems(mission, {}) == [], "an unknown planner may declare it"
    judge = flown(mission, declared, 3.0)
    assert [(c.ok, c.why) for c in judge.result().checks if c.name == "results.metrics.rewrad_min"] == [(False, what)]


def test_a_long_flight_is_thinned_out_and_its_statistics_are_whole() -> None:
    log = MetricLog()
    log.begin("round 1", "defend", 0.0)
    for t in range(3 * MAX_SAMPLES):
        log.on_status(publishing(float(t), reward=1000.0 if t == 2001 else 1.0), {"defend": "round 1"})
    (series,) = log.series({}, scenario(2))
    assert MAX_SAMPLES / 2 <= len(series.times_s) <= MAX_SAMPLES
    assert series.high == 1000.0 and series.times_s[0] == 0.0
