"""What `:` finds first: Enter does it, so a name of a screen must not find an order to the fleet."""

import pytest

from tui_gcs.actions.action import APP
from tui_gcs.actions.action_context import ActionContext
from tui_gcs.actions.palette.entries import OTHER_WORDS, entries_of, found, order_entries
from tui_gcs.actions.table import APP_ACTIONS, MENU_SCREENS

CONTEXT = ActionContext()
SCREENS = [(name.lower(), f"show {mode.replace('_', ' ')}") for _, mode, name, _ in MENU_SCREENS]
ENTRIES = [*order_entries(CONTEXT), *entries_of(APP_ACTIONS, APP, CONTEXT)]


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        *SCREENS,
        *((show.removeprefix("show "), show) for _, show in SCREENS),
        # "planners", which has a key of its own, begins with the same letters.
        *((name[:5], show) for name, show in SCREENS if name != "planner log"),
        ("planner l", "show planner log"),
        ("param", "show parameters"),
        ("log", "show onboard"),
        ("link", "show links"),
        ("preflight", "show checks"),
        ("pre-flight", "show checks"),
        ("quit", "detach"),
        ("exit", "detach"),
        ("map", "show fly"),
        ("help", "show help"),
        ("calibrate", "show setup"),
        ("mavlink", "show inspector"),
        ("adsb", "show traffic"),
        ("people", "show tasks"),
        *((name, f"show {name}") for name in ("fly", "plan", "vehicles", "journal", "alarms", "checks", "planners")),
    ],
)
def test_the_first_that_is_found_is_what_is_meant(typed: str, name: str) -> None:
    assert found(ENTRIES, typed)[0].name == name


def test_a_part_of_a_word_is_found_after_words_that_begin_so() -> None:
    names = [entry.name for entry in found(ENTRIES, "log")]
    assert names.index("show flights") < names.index("hold all"), "which works also from dialogs"


def test_a_whole_name_comes_first_also_when_it_can_do_nothing_now() -> None:
    first = found(ENTRIES, "return")[0]
    assert first.name == "return" and first.why_not, "no vehicle is selected: it must not become `return all`"


def test_an_action_is_found_by_what_other_stations_call_it() -> None:
    assert set(OTHER_WORDS) <= {action.id for action in APP_ACTIONS}
    assert "return all" in [entry.name for entry in found(ENTRIES, "rtl")]
