"""`tui-gcs planner watch` in real processes: what is saved is what plans, within a second or two."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import tui_gcs
from tests.rigs.own_station import Watcher, station_in, until
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.main import command_line_parser
from tui_gcs.cli.planner import new as planner_new
from tui_gcs.cli.planner import watch as planner_watch
from tui_gcs.client.launcher import LaunchOptions, StationLaunchError, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m

pytestmark = pytest.mark.process


@pytest.fixture(scope="module")
def mine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return planner_new.write("mine", tmp_path_factory.mktemp("w"))


@pytest.fixture(scope="module")
def fleet(mine: Path) -> Iterator[Watcher]:
    arguments = command_line_parser().parse_args(["planner", "watch", str(mine)])
    with station_in(mine.parent, lambda: planner_watch.start(arguments)) as watcher:
        yield watcher


def test_both_teams_are_planned_by_the_file(fleet: Watcher) -> None:
    until(lambda: fleet.status is not None and fleet.status.heard == 8, 30, "8 vehicles heard")
    until(lambda: all("period_s" in team.metrics for team in fleet.status.teams), 30, "planners plan")
    assert {team.planner for team in fleet.status.teams} == {"mine"}


def test_what_is_saved_plans_on(fleet: Watcher, mine: Path) -> None:
    mine.write_text(mine.read_text().replace('{"period_s":', '{"mended": 7.0, "period_s":'))
    until(lambda: all("mended" in team.metrics for team in fleet.status.teams), 20, "the new version plans")
    assert fleet.told("mine.py was saved: loading it (")
    assert fleet.told("mine.py: new version flies (")


def test_an_edit_of_the_plan_is_foretold_by_the_version_that_was_saved(fleet: Watcher, mine: Path) -> None:
    """Not refused because the file is not what it was at the start: that is what watching is for."""
    now = fleet.ask(m.GetScenario()).scenario
    assert now is not None
    assert fleet.ask(m.Preview(base_revision=now.revision, toml=now.toml)).ok
    until(lambda: {each.state for each in previews(fleet)} <= {"done", "failed"}, 90, "all foretold")
    assert [each.text for each in previews(fleet) if each.state == "failed"] == []
    assert all("mended" in each.metrics for each in previews(fleet))


def previews(fleet: Watcher) -> list[m.PreviewResult]:
    found = fleet.ask(m.GetPreviews()).previews
    assert found
    return list(found.values())


def test_a_mistake_is_told_with_its_line_and_the_version_before_plans_on(fleet: Watcher, mine: Path) -> None:
    good = mine.read_text()
    mine.write_text(good.replace("        out = Output(", "        out = Output)("))
    until(lambda: fleet.told("; the version before flies on"), 20, "told")
    assert fleet.told("mine.py:") and fleet.told("unmatched ')'")
    seen = fleet.status.seq
    until(lambda: fleet.status.seq > seen + 4, 10, "time passes")
    assert all("mended" in team.metrics and team.worker == "running" for team in fleet.status.teams)
    mine.write_text(good)


def test_one_station_at_a_time_and_simulated_vehicles_only(fleet: Watcher, mine: Path) -> None:
    with pytest.raises(CommandError, match="a SIM station runs already"):
        planner_watch.start(command_line_parser().parse_args(["planner", "watch", str(mine)]))
    with pytest.raises(StationLaunchError, match="simulated vehicles only"):
        launch(RunKind.LIVE, "", "", [], LaunchOptions(watch=True))


def test_a_scenario_that_names_another_planner_of_a_file_is_flown_by_the_watched_one(
    mine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = tmp_path / "theirs.toml"
    shipped = Path(tui_gcs.__file__).parent / "scenarios/swarm-challenge.toml"
    scenario.write_text(shipped.read_text().replace('planner = "patrol"', 'planner = "of-a-colleague"'))
    launched: list[str] = []
    monkeypatch.setattr("tui_gcs.client.launcher.launch", lambda kind, path, toml, *_, **__: launched.append(toml))
    monkeypatch.setattr(planner_watch, "running", lambda kind: False)
    planner_watch.start(command_line_parser().parse_args(["planner", "watch", str(mine), str(scenario)]))
    (toml,) = launched
    assert toml.count('planner = "mine"') == 2 and "of-a-colleague" not in toml
    scenario.write_text("[[team]]\nplanner = 7\n")
    with pytest.raises(CommandError, match=r"theirs\.toml"):
        planner_watch.start(command_line_parser().parse_args(["planner", "watch", str(mine), str(scenario)]))


def test_what_a_planner_reacts_to_can_be_watched_too(mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    specs: list[dict[str, Any]] = []
    monkeypatch.setattr("tui_gcs.client.launcher.launch", lambda *given: specs.append(given[-1].sim_spec))
    monkeypatch.setattr(planner_watch, "running", lambda kind: False)
    more = "--intruders 3 --sensor range=50 --wind 2,-1 --autopilot px4"
    planner_watch.start(command_line_parser().parse_args(["planner", "watch", str(mine), *more.split()]))
    planner_watch.start(command_line_parser().parse_args(["planner", "watch", str(mine)]))
    with_more, plain = specs
    assert len(with_more["intruders"]) % 3 == 0 and with_more["sensor"]["range_m"] == 50.0
    assert list(with_more["wind_m_s"]) == [2.0, -1.0]
    assert {vehicle["autopilot"] for vehicle in with_more["vehicles"]} == {"px4"}
    assert not {"intruders", "sensor", "wind_m_s"} & set(plain)
