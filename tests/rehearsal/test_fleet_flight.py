"""A fleet in several teams, as `tui-gcs scenario new` writes it, flies with every gate green and shares its layers."""

from pathlib import Path

import pytest

from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.template import new_scenario
from tui_gcs.rehearsal.rehearse import rehearse


@pytest.mark.endurance
def test_24_in_three_teams_share_eight_layers_and_never_meet(tmp_path: Path) -> None:
    text = new_scenario("fleet", Origin(52.0, -0.6, 100.0), 24)
    scenario = parse(text)
    assert (len(scenario.teams), len({place.layer_m for place in scenario.places})) == (3, 8)
    result, problem = rehearse(scenario, text, tmp_path, lambda _share, _text: None)
    assert problem == "" and [check.name for check in result.checks if not check.ok] == []
