"""Keys that were typed while the console was busy go where they were meant to go, in order: never to commands."""

from pathlib import Path

import pytest
from textual.events import Key, Paste

from tests.screens.rigs.mission_station import MissionConsole, mission_console
from tests.screens.rigs.plan_station import KEYS, PlanConsole, plan_console
from tui_gcs.core.geometry.zones import Circle
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.screens.missions.missions_screen import MissionsScreen
from tui_gcs.screens.missions.upload_dialog import UploadDialog

NAMED = {"tab", "shift+tab", "enter", "escape", "ctrl+u", "ctrl+o", "ctrl+s", "right", "plus"}
ANEW = ("tab", "ctrl+u")
"""To the next field, and empty it."""


async def at_once(c: PlanConsole | MissionConsole, *keys: str) -> None:
    """All of it is there before the console looks at the first of them; words are letter by letter."""
    names = {name: character for character, name in KEYS.items()}
    for key in keys:
        for one in [key] if len(key) == 1 or key in NAMED or key in names else key:
            c.app.post_message(Key(KEYS.get(one, one), names.get(one, one if len(one) == 1 else None)))
    for _ in range(400):
        await c.pilot.pause()
        if c.app.keys.is_idle:
            break
    await c.settle()
    assert c.app.keys.is_idle


NAMED = {
    "tab",
    "shift+tab",
    "enter",
    "escape",
    "ctrl+u",
    "ctrl+o",
    "ctrl+s",
    "ctrl+g",
    "ctrl+z",
    "right",
    "plus",
    "down",
}


async def test_a_new_zone_takes_its_name_and_radius_and_nothing_is_applied() -> None:
    async with plan_console() as c:
        await at_once(
            c, "plus", "ctrl+u", "a quad", "tab", "tab", "tab", "tab", "tab", "ctrl+u", "40", "escape", "c", "0"
        )
        assert c.map_zone("a quad") == Circle((300.0, 200.0), 40.0)
        assert c.station.commands() == [] and c.plan.model.round_index == 0
        assert c.plan.model.scenario is not None
        assert all("a quad" in [zone.name for zone in each.zones] for each in c.plan.model.scenario.rounds)


async def test_the_settings_take_what_is_typed_behind_their_key() -> None:
    async with plan_console() as c:
        await at_once(c, "g", "ctrl+u", "quad 12", "tab", "ctrl+u", "7", "escape", "2", "g", *["tab"] * 7)
        scenario = c.plan.model.scenario
        assert scenario is not None and (scenario.name, scenario.seed) == ("quad 12", 7)
        assert c.plan.model.round_index == 1 and getattr(c.app.focused, "field", "") == "round_name"
        assert c.station.commands() == [] and c.app.is_running


async def test_the_team_form_and_the_question_for_an_idleness_do_so_too() -> None:
    async with plan_console((80, 24)) as c:
        await at_once(c, "t", "tab", "ctrl+u", "quads", "escape", "i", "ctrl+u", "12", "enter")
        assert c.plan.model.team("quads") is not None
        assert c.plan.preview.idleness_s == 12.0 and c.plan.model.round_index == 0


async def test_a_path_goes_into_its_line_also_when_it_was_pasted(tmp_path: Path) -> None:
    async with plan_console() as c:
        await at_once(c, "ctrl+o", "a q.kml", "enter")
        assert "a q.kml" in c.said() and "no such file" in c.said().lower()
        c.app.post_message(Key("ctrl+o", None))
        c.app.post_message(Paste(str(tmp_path / "x.kml")))
        await at_once(c, "enter")
        assert "x.kml: no such file" in c.said().lower()


async def test_what_was_typed_is_saved_by_the_key_behind_it(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    async with plan_console() as c:
        await at_once(c, "g", *["tab"] * 2, "ctrl+u", "12", "ctrl+s")
        await at_once(c, "ctrl+u", *str(file), "enter")
        assert "footprint_radius_m = 12.0" in file.read_text()


async def test_forms_of_the_missions_screen_take_their_numbers() -> None:
    async with mission_console() as c:
        await at_once(
            c, "plus", "tab", "tab", "ctrl+u", "100", "tab", "ctrl+u", "220", "escape", "b", "ctrl+u", "6", "escape"
        )
        editor = c.missions.editor
        assert editor.forecast.performance.speed_m_s == 6.0
        assert editor.item is not None and editor.place_m(editor.item) == pytest.approx((100.0, 220.0), abs=0.1)
        await at_once(c, "g", "right", "tab", "tab", "ctrl+u", "2", "escape", "t")
        assert editor.kind is PlanKind.FENCE and editor.vehicle == 1


async def test_a_dialog_has_the_keys_that_are_typed_behind_its_own() -> None:
    async with mission_console() as c:
        await at_once(c, "plus", "U", "n", "n", "1", "escape")
        assert not isinstance(c.app.screen, UploadDialog)
        assert c.missions.editor.vehicle == 1, "neither n nor 1 went past the dialog"
        assert c.mission_station.uploads() == []


async def test_keys_go_to_the_screen_that_was_opened_by_the_one_before() -> None:
    async with plan_console() as c:
        await at_once(c, "m", "plus", "tab", "tab", "ctrl+u", "55")
        screen = c.app.screen
        assert isinstance(screen, MissionsScreen) and screen.editor.item is not None
        place = screen.editor.place_m(screen.editor.item)
        assert place is not None and place[0] == pytest.approx(55.0, abs=0.1)


async def test_a_key_that_never_comes_back_holds_up_the_others_for_a_second_at_most() -> None:
    async with plan_console() as c:
        await c.press("plus")
        field = c.app.focused
        assert field is not None
        c.app.post_message(Key("a", "a"))
        field.remove()
        await at_once(c, "escape", "2")
        assert c.plan.model.round_index == 1
