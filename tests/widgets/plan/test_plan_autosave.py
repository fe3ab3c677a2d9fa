"""Edits that nobody else has are there after a crash, and tell what they were made from."""

from pathlib import Path

import pytest

import tui_gcs
from tui_gcs.core.geometry.zones import Circle, Role, Zone
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.load import parse, read_text
from tui_gcs.widgets.plan.plan_autosave import PlanAutosave
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor
from tui_gcs.widgets.plan.scenario_edits import ZoneEdits

TEXT = read_text(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")
SMALLER = Zone("home", Role.DEFEND, Circle((150.0, 200.0), 60.0))


def flown(text: str = TEXT, path: str = "/home/me/mine.toml") -> ScenarioChanged:
    return ScenarioChanged(revision=1, path=path, toml=text, scenario=parse(text))


def begun(folder: Path, change: ScenarioChanged) -> tuple[ScenarioEditor, PlanAutosave, str]:
    model = ScenarioEditor()
    model.station_changed(change)
    autosave = PlanAutosave(model, folder)
    return model, autosave, autosave.recover(change)


@pytest.fixture
def left(tmp_path: Path) -> Path:
    """What a crash leaves after the defended circle was made smaller."""
    tmp_path.chmod(0o700)
    model, autosave, said = begun(tmp_path, flown())
    assert said == ""
    ZoneEdits(model).set_zone("home", SMALLER)
    autosave.keep()
    autosave.close()
    return tmp_path


def test_edits_come_back_and_can_be_dropped(left: Path) -> None:
    model, _, said = begun(left, flown())
    assert said.startswith("recovered") and model.zone("home") == SMALLER and model.changes == 1
    assert model.undo() == "what was recovered" and model.text == TEXT


def test_edits_of_an_outdated_scenario_are_not_applied_before_the_operator_decides(left: Path) -> None:
    now = flown(TEXT.replace("speed_m_s = 8.0", "speed_m_s = 6.0"))
    model, _, _ = begun(left, now)
    model.station_changed(now)
    assert model.zone("home") == SMALLER and model.newer == now
    model.keep()
    assert model.newer is None and model.base_revision == 1


def test_saved_or_applied_edits_are_not_kept(left: Path) -> None:
    model, autosave, _ = begun(left, flown())
    model.applied(model.text, 2)
    assert autosave.is_behind
    autosave.keep()
    autosave.close()
    assert begun(left, flown())[2] == ""


def test_edits_of_another_scenario_and_nonsense_are_set_aside(left: Path) -> None:
    model, autosave, said = begun(left, flown(path="/home/me/other.toml"))
    assert "a crash left edits of /home/me/mine.toml: they are in" in said and model.changes == 0
    autosave.close()
    (left / "plan-autosave-1.json").write_text("{")
    assert "cannot be read" in begun(left, flown())[2]
