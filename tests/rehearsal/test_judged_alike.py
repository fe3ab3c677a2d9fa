"""Rehearsal and planner check fly the same flight and judge it alike, for every kind of planner."""

from pathlib import Path

import msgspec
import pytest

from tui_gcs.cli.common import read_scenario
from tui_gcs.cli.planner.check_flights import flown_scenario, shipped
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.scenario.model import Scenario, ScenarioTask
from tui_gcs.planner.check.subject import checked_planner
from tui_gcs.rehearsal.rehearse import rehearse

pytestmark = pytest.mark.endurance

OWN = """
from tui_gcs.planner.api import Intent, Metric, Output, Planner, polygon_of

class Mine(Planner):
    name = "mine"
    metrics = (Metric("reward", gate=2.0), Metric("never", gate=1.0))
    def step(self, ctx):
        place = polygon_of(self.task.zone.shape).representative_point()
        ids, layers = ctx.fleet.id[ctx.fleet.active], ctx.fleet.layer_m[ctx.fleet.active]
        intents = [Intent(i, "goto", position_m=(place.x, place.y, z)) for i, z in zip(ids, layers)]
        return Output(intents, metrics={"reward": 3.0})
"""


def rehearsed(scenario: Scenario, folder: Path, **options: object) -> FlightResult:
    result, problem = rehearse(scenario, "", folder, lambda share, text: None, **options)  # type: ignore[arg-type]
    assert problem == ""
    return result


@pytest.mark.parametrize("name", ["guardian", "patrol", "survey", "waypoints", "mine"])
def test_a_rehearsal_and_the_check_of_a_planner_agree(name: str, tmp_path: Path) -> None:
    what = name
    if name == "mine":
        (tmp_path / "mine.py").write_text(OWN)
        what = str(tmp_path / "mine.py")
    subject = checked_planner(what, 3, True, lambda: None)
    result = rehearsed(flown_scenario(subject), tmp_path, files=subject.files)
    told = [f for f in shipped(subject) if f.verdict != "note"]
    assert [(f.value.partition(":")[0].split(" (")[0], f.verdict) for f in told] == [
        (check.name.partition(":")[0], "ok" if check.ok else "FAIL") for check in result.checks
    ]
    if name == "mine":
        assert [c.name for c in result.checks if not c.ok] == [f"round 1 {t}: never" for t in ("defend", "attack")]


def one_team(planner: str, *tasks: ScenarioTask) -> Scenario:
    """Three vehicles in the first round of the shipped scenario."""
    whole, _, _ = read_scenario(None)
    team = msgspec.structs.replace(whole.teams[0], planner=planner, vehicles=(1, 2, 3), count=0, parameters={})
    return msgspec.structs.replace(whole, teams=(team,), rounds=whole.rounds[:1], places=whole.places[:3], tasks=tasks)


def test_a_survey_sees_the_zone_within_its_gate(tmp_path: Path) -> None:
    result = rehearsed(one_team("survey"), tmp_path)
    assert [check for check in result.checks if not check.ok] == []
    (r,) = result.rounds
    assert r.covered_s is not None and r.cover_bound_s is not None
    assert r.cover_bound_s < r.covered_s < 3.0 * r.cover_bound_s


def test_a_search_visits_its_tasks_and_each_is_on_record(tmp_path: Path) -> None:
    zone = read_scenario(None)[0].rounds[0].zones[0].shape
    x, y = zone.centre_m  # type: ignore[union-attr]  # of the shipped scenario's first zone, a circle
    tasks = (
        ScenarioTask("well", (x, y), 3.0),
        ScenarioTask("gate", (x + 40.0, y), deadline_s=200.0),
        ScenarioTask("gone", (x, y + 40.0), deadline_s=0.5),
    )
    result = rehearsed(one_team("search", *tasks), tmp_path)
    assert [(c.name, c.why) for c in result.checks if not c.ok] == [("defend: tasks done in time", "2 of 3")]
    assert {(e.kind, e.subject) for e in result.records} == {
        ("task done", "well"),
        ("task done", "gate"),
        ("task missed", "gone"),
    }
    assert all(e.vehicle in (1, 2, 3) for e in result.records if e.kind == "task done")
