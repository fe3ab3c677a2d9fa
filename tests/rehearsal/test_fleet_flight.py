"""A fleet in several teams, as `tui-gcs scenario new` writes it, flies with every gate green and shares its layers."""

from pathlib import Path

import msgspec
import pytest

from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.template import new_scenario
from tui_gcs.rehearsal.fault_schedule import losses
from tui_gcs.rehearsal.rehearse import rehearse


@pytest.mark.endurance
def test_24_in_three_teams_share_eight_layers_and_never_meet(tmp_path: Path) -> None:
    text = new_scenario("fleet", Origin(52.0, -0.6, 100.0), 24)
    scenario = parse(text)
    assert (len(scenario.teams), len({place.layer_m for place in scenario.places})) == (3, 8)
    result, problem = rehearse(scenario, text, tmp_path, lambda _share, _text: None)
    assert problem == "" and [check.name for check in result.checks if not check.ok] == []


@pytest.mark.long
def test_a_tenth_of_fifty_falls_silent_at_once_in_one_team_and_every_gate_holds(tmp_path: Path) -> None:
    """Five of a team of nine are lost in bends, which is the worst tenth of fifty; the other teams are far away."""
    whole = parse(text := new_scenario("fleet", Origin(52.0, -0.6, 100.0), 9))
    team = msgspec.structs.replace(whole.teams[0], parameters={"search": 0})
    results = msgspec.structs.replace(whole.results, measured_s=20.0)
    scenario = msgspec.structs.replace(whole, teams=(team,), results=results)
    faults = losses([f"{vehicle}@90" for vehicle in (1, 3, 5, 7, 9)])
    result, problem = rehearse(scenario, text, tmp_path, lambda _share, _text: None, faults=faults)
    assert problem == "" and [check.name for check in result.checks if not check.ok] == []
    first, *_, last = result.rounds
    assert (first.n, first.cut_short, last.n, last.cut_short) == (9, True, 4, False)
