"""The footer, the help and the alarm line name a key only where it does what they say."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.actions import APP_ACTIONS
from tui_gcs.actions.action import on_screen
from tui_gcs.actions.scopes import SCOPES
from tui_gcs.core.protocol.common import Resume, RunPhase
from tui_gcs.screens.common.help import HelpDialog


def help_lines(dialog: object) -> list[str]:
    assert isinstance(dialog, HelpDialog)
    return ["".join(text for text, _ in line) for line in dialog.all_lines()]


def headings(dialog: object) -> list[str]:
    """Return the groups of the help; lines of the same group begin with blanks."""
    return [line[:9].strip() for line in help_lines(dialog) if line[:9].strip()]


def asked_to_resume(c: Console) -> bool:
    return any(isinstance(request, Resume) for request in c.station.requests)


def holds(station: FakeStation) -> None:
    station.fly()
    station.run = RunPhase.HOLD


def test_a_key_that_a_screen_takes_stands_behind_the_way_to_the_fly_screen() -> None:
    shown = {action.id: action.shown for action in on_screen(APP_ACTIONS, SCOPES["plan"])}
    assert (shown["orders"], shown["acknowledge"]) == ("f c", "f a")
    assert (shown["resume"], shown["detach"]) == ("Enter", "q"), "these do the same on the plan screen"
    shown = {action.id: action.shown for action in on_screen(APP_ACTIONS, SCOPES["onboard"])}
    assert (shown["resume"], shown["orders"]) == ("f Enter", "c")
    assert {action.id: action.shown for action in on_screen(APP_ACTIONS, SCOPES["fly"])}["resume"] == "Enter"


@pytest.mark.parametrize("letter", ["p", "s", "o", "l", "t"])
async def test_no_footer_offers_enter_twice_while_vehicles_hold(letter: str) -> None:
    async with console(NARROW, holds) as c:
        assert "Enter resume" in c.line(-1)
        await c.press("S", letter)
        assert "f Enter resume" in c.line(-1)
        assert c.line(-1).replace("f Enter", "").count("Enter ") <= 1
        await c.press("enter")
        assert not asked_to_resume(c), "Enter belongs to the screen's own list"
        await c.press("f", "enter")
        assert asked_to_resume(c), "the keys that the footer named"


async def test_the_help_of_a_screen_begins_with_what_is_done_here() -> None:
    async with console(WIDE, holds) as c:
        await c.press("S", "p", "question_mark")
        groups = headings(c.app.screen)
        assert groups[:3] == ["Here", "Files", "Copy"]
        assert {"Fly", "Select", "Alarms", "Screens"} <= set(groups)
        assert any("f Enter  resume: in hold" in line for line in help_lines(c.app.screen))


def test_the_name_of_a_group_leaves_a_blank_before_the_key() -> None:
    long = {action.group for actions in SCOPES.values() for action in actions if len(action.group) > 8}
    assert long == set()


async def test_the_help_of_a_map_keeps_flight_and_map_apart() -> None:
    async with console(WIDE, holds) as c:
        await c.press("question_mark")
        groups = headings(c.app.screen)
        assert groups[0] == "Fly" and "Map" in groups and "Here" not in groups
