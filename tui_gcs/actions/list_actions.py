"""The keys that every screen with a list of rows has (`screens/common/list_screen.py`)."""

from tui_gcs.actions.action import SELECT, VIEW, ConsoleAction, action

COPY = "Copy"
"""Group of the help."""

# Without keys: the next digit may arrive before Textual has run a binding, see `SelectionEntry`.
DIGITS_ACTION = action("digit", "", "", "3-7,9 and Enter: select those", SELECT, shown="1..9")
LOOK_ACTIONS = (
    DIGITS_ACTION,
    action("select_next", "n", "", "look at the next and previous vehicle", SELECT, shown="n/N", do="look(1)"),
    action("select_previous", "N", "", "", SELECT, do="look(-1)"),
)
ROW_ACTIONS = (
    action("up", "up k", "", "the row above and below; PgUp, PgDn, Home, End too", VIEW, shown="arrows", do="step(-1)"),
    action("down", "down j", "", "", VIEW, do="step(1)"),
    action("page_up", "pageup", "", "", VIEW, do="page(-1)"),
    action("page_down", "pagedown", "", "", VIEW, do="page(1)"),
    action("first", "home", "", "", VIEW, do="end(-1)"),
    action("last", "end", "", "", VIEW, do="end(1)"),
)


def copy_actions(
    row: str = "the chosen row", rows: str = "all listed rows", *, weight: int = 1
) -> tuple[ConsoleAction, ...]:
    """Return the two actions that copy by OSC 52; `row` and `rows` say what each copies on this screen."""
    return (
        action("copy_row", "y", "copy", f"{row}, to the terminal's clipboard (OSC 52)", COPY, weight),
        action("copy_rows", "Y", "", f"copy {rows} with all values: a table for a spreadsheet", COPY),
    )
