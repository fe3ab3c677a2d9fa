"""Lines after `:`: own commands, arguments, steps, and every mistake by one line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.actions.action import APP
from tui_gcs.actions.action_context import ActionContext
from tui_gcs.actions.palette.entries import Entry, entries_of, found, order_entries
from tui_gcs.actions.palette.own_commands import MAX_COMMANDS, NAMES, CommandLineError, OwnCommands
from tui_gcs.actions.table import APP_ACTIONS, MENU_SCREENS

CONTEXT = ActionContext()
ENTRIES = [*order_entries(CONTEXT), *entries_of(APP_ACTIONS, APP, CONTEXT)]
OWN = OwnCommands({"low": "select t1; altitude", "lower": "low 5", "back": "show fly; select all; return"})


def texts(line: str, own: OwnCommands = OWN) -> list[str]:
    return [step.text for step in own.steps(line)]


def first(typed: str) -> Entry:
    return OWN.matching(ENTRIES, typed)[0]


@pytest.mark.parametrize(
    ("line", "steps"),
    [
        ("low", ["select t1", "altitude"]),
        ("low 20", ["select t1", "altitude 20"]),
        ("LOW 20", ["select t1", "altitude 20"]),
        ("lower", ["select t1", "altitude 5"]),
        ("back", ["show fly", "select all", "return"]),
        ("plan; fit", ["show plan", "fit"]),
        ("go to 450 200 30, 5", ["go to 450 200 30, 5"]),
        ("select 3; low 20", ["select 3", "select t1", "altitude 20"]),
        ("Hold All", ["hold all"]),
    ],
)
def test_a_line_becomes_its_steps(line: str, steps: list[str]) -> None:
    assert texts(line) == steps


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("", "a step is empty"),
        ("hold;", "'hold' must be|a step is empty"),
        ("far away", "'far away' is not the name of an action, an order or a screen"),
        ("hold 3", "'hold' takes nothing behind it, not '3'"),
        ("back 3", "'return' takes nothing behind it"),
        ("hold; return", "'hold' must be the last step"),
        ("show alarms; hold", "'show alarms' must be the last step"),
        ("select; hold", "'select' must be the last step"),
        ("; ".join(["select 1"] * 9), "has more than 8 steps"),
    ],
)
def test_a_line_that_cannot_be_carried_out_says_why(line: str, problem: str) -> None:
    with pytest.raises(CommandLineError, match=problem):
        OWN.steps(line)


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        ({"hold": "return"}, "'hold': there is such a command already"),
        ({"all": "select all"}, "'all': there is such a command already"),
        ({"ret": "show plan"}, "'ret': finds 'return' already"),
        ({"h": "show plan"}, "'h': finds 'ha"),
        ({"param": "show plan"}, "'param': finds 'parameters' already"),
        ({"log": "show plan"}, "'log': there is such a command already"),
        ({"Low": "show plan"}, "'Low': a name has small letters"),
        ({"two words": "show plan"}, "'two words': a name has small letters"),
        ({"x1": "  "}, "'x1': has no words"),
        ({"x1": "show\nplan"}, "'x1': its words must be one line"),
        ({"x1": "show \x1b[2Jplan"}, "'x1': its words must be one line"),
        ({"x1": "x2", "x2": "x3 1", "x3": "select 1; x1"}, "'x1': goes in a circle: x1 -> x2 -> x3 -> x1"),
        ({"x1": "select 1; nonsense"}, "'x1': 'nonsense' is not the name"),
        ({"x1": "hold; return"}, "'x1': 'hold' must be the last step"),
        ({f"x{n}": "show plan" for n in range(MAX_COMMANDS + 1)}, "101 commands; at most 100"),
        ({"x0": "select 1; x1", **{f"x{n}": f"x{n + 1}; x{n + 1}" for n in range(1, 60)}, "x60": "hold"}, "'x0': "),
    ],
)
def test_a_table_with_a_mistake_is_refused_by_one_line_with_the_name(table: dict[str, str], problem: str) -> None:
    with pytest.raises(CommandLineError) as error:
        OwnCommands(table)
    assert str(error.value).startswith(problem) and "\n" not in str(error.value)


def test_every_name_and_screen_is_found_as_without_own_commands() -> None:
    screens = [word for _, mode, name, _ in MENU_SCREENS for word in (mode, mode[:5], name.lower())]
    for typed in (*NAMES, *screens, "ret", "param", "log", "link"):
        matching = found(ENTRIES, typed)
        assert OWN.matching(ENTRIES, typed)[: len(matching)] == matching


def test_an_own_command_shows_its_steps() -> None:
    assert (first("low").name, first("low").help) == ("low", "= select t1; altitude")
    assert first("low 20").help == "= select t1; altitude 20"
    assert first("low 20").run == "app.command_line('low 20')"
    assert first("back 3").why_not == "'return' takes nothing behind it, not '3'"
    assert {entry.name for entry in OWN.matching(ENTRIES, "")} >= {"low", "lower", "back"}


def test_arguments_never_push_back_a_name_that_is_being_typed() -> None:
    """`select ne` is on the way to `select next`, on a screen that has it."""
    next_one = Entry("select next", "n", "the next vehicle", "screen.step(1)")
    assert OWN.matching([*ENTRIES, next_one], "select ne")[0] == next_one
    assert OWN.matching(ENTRIES, "select ne")[0].help == "= select ne"


def test_a_step_of_another_screen_can_do_nothing_here() -> None:
    own = OwnCommands({"x1": "add zone", "x2": "show plan; add zone"})
    assert own.matching(ENTRIES, "x1")[0].why_not == "this screen has no such action"
    assert own.matching(ENTRIES, "x2")[0].why_not == ""


@given(st.text(max_size=40), st.dictionaries(st.text(max_size=5), st.text(max_size=20), max_size=4))
def test_any_line_and_table_is_taken_or_refused(line: str, table: dict[str, str]) -> None:
    try:
        own = OwnCommands(table)
    except CommandLineError as error:
        assert str(error)
        own = OWN
    for entry in own.matching(ENTRIES, line):
        assert entry.name
