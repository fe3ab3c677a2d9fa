"""Checks before a start as lines of text: for the list and for the start dialog."""

from collections.abc import Sequence
from textwrap import wrap

from tui_gcs.core.protocol.preflight import Check, CheckState, count_words, well
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink

QUIET = frozenset({CheckState.OK, CheckState.NOT_NEEDED})
"""States of checks that are listed by name only."""
TAGS = {
    CheckState.FAIL: "! FAIL",
    CheckState.UNKNOWN: "? ????",
    CheckState.WARN: "^ WARN",
    CheckState.ACKNOWLEDGED: "* seen",
    CheckState.TICKED: "+ tick",
}
"""A shape and a word for each state that has a line of its own."""
INKS = {
    CheckState.FAIL: Ink.WARNING,
    CheckState.UNKNOWN: Ink.WARNING,
    CheckState.WARN: Ink.CAUTION,
    CheckState.ACKNOWLEDGED: Ink.ADVISORY,
    CheckState.TICKED: Ink.TEXT,
}
NAME_CELLS, VEHICLES_CELLS = 13, 7


def loud(checks: Sequence[Check]) -> tuple[Check, ...]:
    """Checks that get a line of their own."""
    return tuple(check for check in checks if check.state not in QUIET)


def check_line(check: Check, cells: int, mark: str = "") -> Line:
    """One check in one line; what does not fit is cut with an ellipsis."""
    vehicles = ids(check.vehicles)
    vehicles = vehicles if len(vehicles) <= VEHICLES_CELLS else f"{len(check.vehicles)} veh."
    text = f"{mark}{TAGS[check.state]} {check.name:<{NAME_CELLS}} {vehicles:<{VEHICLES_CELLS}} {check.text}"
    return [(text if len(text) <= cells else f"{text[: cells - 1]}…", INKS[check.state])]


def quiet_lines(checks: Sequence[Check], cells: int) -> list[Line]:
    """Checks that passed or are not needed, by name."""
    lines: list[Line] = []
    for state in (CheckState.OK, CheckState.NOT_NEEDED):
        if names := well(checks, state):
            text = f"{state}: {', '.join(names)}"
            lines += [[(line, Ink.MUTED)] for line in wrap(text, cells, subsequent_indent="  ")]
    return lines


def detail_lines(check: Check, cells: int) -> list[Line]:
    """Everything about one check: its subject, its result, what to do."""
    lines: list[Line] = [[(line, Ink.TEXT)] for line in wrap(check.words(), cells, subsequent_indent="  ")]
    todo = wrap(f"-> {check.todo}", cells, subsequent_indent="   ") if check.todo else []
    return [*lines, *([(line, Ink.BOLD)] for line in todo)]


def count_line(checks: Sequence[Check], more: str = "") -> Line:
    """The number of checks in each state; `more` names the key that shows them."""
    worst = checks[0].state if checks else CheckState.OK
    return [(f"checks: {count_words(checks)}{more}", INKS.get(worst, Ink.MUTED))]
