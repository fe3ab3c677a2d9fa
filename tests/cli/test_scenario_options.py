"""`rehearse --planner`, `--set` and `--vehicles`: other planners, parameters and fleets without an edited file."""

import argparse
from pathlib import Path

import pytest

from tests.core.rigs.rig import toml
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.check import scenario_lines
from tui_gcs.cli.flights.scenario_options import ScenarioChanges, shares
from tui_gcs.core.protocol.planning import Metric, PlannerInfo
from tui_gcs.core.scenario.model import Scenario

MINE = PlannerInfo("mine", "1", (), 5.0, file="/home/me/mine.py", metrics=(Metric("reward"),))


def made(changes: ScenarioChanges, text: str = "") -> Scenario:
    return changes.made(text or toml(), "mission.toml")[0]


def refused(changes: ScenarioChanges, text: str = "") -> str:
    with pytest.raises(CommandError) as caught:
        made(changes, text)
    return str(caught.value)


def test_a_planner_that_no_team_names_flies_all_teams_and_the_text_says_so() -> None:
    scenario, text = ScenarioChanges({"mine": MINE}).made(toml(), "mission.toml")
    assert {team.planner for team in scenario.teams} == {"mine"}
    assert all(team.parameters == {} for team in scenario.teams), "those of another planner mean nothing to this one"
    assert text.count('planner = "mine"') == len(scenario.teams)


def test_a_planner_that_a_team_names_flies_for_that_team() -> None:
    text = toml().replace('planner = "patrol"', 'planner = "mine"', 1)
    planners = [team.planner for team in made(ScenarioChanges({"mine": MINE}), text).teams]
    assert planners == ["mine", *("patrol" for _ in planners[1:])]


def test_a_known_planner_is_given_by_its_name() -> None:
    assert {team.planner for team in made(ScenarioChanges({}, ("guardian",))).teams} == {"guardian"}


def test_of_two_that_nobody_names_none_is_guessed() -> None:
    assert refused(ScenarioChanges({"mine": MINE}, ("guardian",))) == (
        "--planner: no team of this scenario names mine or guardian: give only one of them"
    )


def test_a_planner_runs_on_each_vehicle_where_that_is_asked_for() -> None:
    assert {team.instances for team in made(ScenarioChanges({}, instances="per_vehicle")).teams} == {"per_vehicle"}
    text = toml().replace('planner = "patrol"', 'planner = "mine"', 1)
    first, *others = made(ScenarioChanges({"mine": MINE}, instances="per_vehicle"), text).teams
    assert first.instances == "per_vehicle" and {team.instances for team in others} == {None}


def test_parameters_are_set_by_name_and_kept_in_their_kind() -> None:
    for team in made(ScenarioChanges({}, settings=("margin_m=2", "search=7", "direction=cw"))).teams:
        values = {name: team.parameters[name] for name in ("margin_m", "search", "direction")}
        assert values == {"margin_m": 2.0, "search": 7, "direction": "cw"}
    (team, *_) = made(ScenarioChanges({}, ("waypoints",), ("loop=no",))).teams
    assert team.parameters == {"loop": False}


@pytest.mark.parametrize(
    ("setting", "why"),
    [
        ("margin=2", "--set margin: no such parameter (did you mean margin_m?); patrol has speed_fraction, margin_m,"),
        ("margin_m", "--set margin_m: must be NAME=VALUE"),
        ("margin_m=wide", "--set margin_m=wide: margin_m must be float, not str (planner patrol)"),
        ("margin_m=99", "--set margin_m=99: margin_m must be at most 5 m (planner patrol)"),
        ("margin_m=nan", "--set margin_m=nan: margin_m must be a finite number (planner patrol)"),
        ("search=1.5", "--set search=1.5: search must be int, not str (planner patrol)"),
        ("direction=left", "--set direction=left: direction must be one of auto, cw, ccw (planner patrol)"),
        ("\x1b[2J=1", "--set ␛[2J: no such parameter"),
    ],
)
def test_a_wrong_setting_is_one_line_that_names_what_there_is(setting: str, why: str) -> None:
    said = refused(ScenarioChanges({}, settings=(setting,)))
    assert said.startswith(why)
    assert "\n" not in said


@pytest.mark.parametrize("count", [2, 3, 5, 8, 11])
def test_vehicles_are_shared_among_teams_and_each_has_a_place(count: int) -> None:
    scenario = made(ScenarioChanges({}, vehicles=count))
    assert scenario.vehicle_count == count
    assert len(scenario.places) >= count
    ids = [vehicle for team in scenario.teams for vehicle in team.vehicles]
    assert len(set(ids)) == len(ids)


def test_a_number_of_vehicles_that_cannot_be_is_refused() -> None:
    assert refused(ScenarioChanges({}, vehicles=0)).startswith("--vehicles 0: must be ")
    assert "no altitude layer left" in refused(ScenarioChanges({}, vehicles=200))


@pytest.mark.parametrize(
    ("count", "sizes", "shared"), [(8, [4, 4], [4, 4]), (7, [4, 4], [4, 3]), (10, [3, 1], [7, 3]), (2, [9, 1], [1, 1])]
)
def test_shares_are_whole_and_none_is_empty(count: int, sizes: list[int], shared: list[int]) -> None:
    assert shares(count, sizes) == shared


# ---------------------------------------------------------------- gates of metrics


def with_gates(lines: str) -> str:
    return toml() + f"\n[results.metrics]\n{lines}\n"


def test_a_gate_of_a_metric_that_nobody_declares_is_refused_with_its_line(tmp_path: Path) -> None:
    text = with_gates("rewrad_min = 3")
    line = text.splitlines().index("rewrad_min = 3") + 1
    said = refused(ScenarioChanges({"mine": MINE}), text)
    what = f"results.metrics.rewrad_min (line {line}): no planner of this scenario declares that metric;"
    assert said == f"mission.toml: {what} mine declares reward"
    file = tmp_path / "mission.toml"
    file.write_text(text)
    (error,) = [each for each in scenario_lines(file) if each.level == "ERROR"]
    assert error.text == f"{what} patrol declares predicted_worst_s, period_s"


def test_a_good_gate_is_taken(tmp_path: Path) -> None:
    assert made(ScenarioChanges({"mine": MINE}), with_gates("reward_min = 3")).results.metrics == {"reward_min": 3.0}
    file = tmp_path / "mission.toml"
    file.write_text(with_gates("period_s_max = 300"))
    assert [each for each in scenario_lines(file) if each.level == "ERROR"] == []


@pytest.mark.parametrize(
    ("gate", "why"),
    [
        (
            "reward = 3",
            "results.metrics.reward (line {}): is no gate of a metric; must be a metric's name with _min or",
        ),
        ('reward_min = "3"', "results.metrics.reward_min (line {}): '3' is text; must be a number"),
        ("reward_max = nan", "results.metrics.reward_max (line {}): nan is out of range"),
    ],
)
def test_the_form_of_a_gate_is_checked_when_it_is_read(gate: str, why: str) -> None:
    text = with_gates(gate)
    said = refused(ScenarioChanges({}), text)
    assert said.startswith("mission.toml: " + why.format(text.splitlines().index(gate) + 1))


def test_the_options_are_those_of_rehearse() -> None:
    from tui_gcs.cli.main import command_line_parser

    words = ["rehearse", "--planner", "mine.py", "--set", "a=1", "--set", "b=2", "--vehicles", "3"]
    found: argparse.Namespace = command_line_parser().parse_args(words)
    assert (found.planner, found.set, found.vehicles) == (["mine.py"], ["a=1", "b=2"], 3)
