"""The actions of the screens that only look: vehicles, journal and planner log."""

from tui_gcs.actions.action import SELECT, VIEW, action
from tui_gcs.actions.list_actions import ROW_ACTIONS, copy_actions

VEHICLES_ACTIONS = (
    action("turn_view", "tab", "view", "the fleet as cells or as a table", VIEW, 8),
    action("sort_next", "greater_than_sign", "sort", "the table by another column", VIEW, 4, shown="< >", do="sort(1)"),
    action("sort_previous", "less_than_sign", "", "", VIEW, do="sort(-1)"),
    action("sort_turn", "asterisk", "", "the table the other way round", VIEW, do="sort(0, True)"),
    action("filter", "slash", "filter", "only vehicles that fit: id, team, mode, armed, cause …", VIEW, 8),
    action(
        "select_next", "n down j", "", "next and previous vehicle; arrows too", SELECT, 3, shown="n/N", do="step(1)"
    ),
    action("select_previous", "N up k", "", "", SELECT, do="step(-1)"),
    *copy_actions("the vehicle looked at", "all vehicles shown"),
    action("cancel", "escape", "", "end the filter", SELECT),
)

JOURNAL_ACTIONS = (
    action("filter", "slash", "words", "only lines with these words", VIEW, 9),
    action("next_class", "t", "type", "only one class of events", VIEW, 8),
    action("next_severity", "w", "severity", "all, notices, warnings, critical", VIEW, 8),
    action("of_selected", "e", "selected only", "only the selected vehicles", VIEW, 5),
    action("up", "up k", "", "older and newer lines; PgUp, PgDn, Home too", VIEW, shown="arrows", do="scroll(1)"),
    action("down", "down j", "", "", VIEW, do="scroll(-1)"),
    action("page_up", "pageup", "", "", VIEW, do="page(1)"),
    action("page_down", "pagedown", "", "", VIEW, do="page(-1)"),
    action("oldest", "home", "", "", VIEW, do="end(1)"),
    action("newest", "end F", "follow", "the newest lines, as they come; F too", VIEW, 4, do="end(-1)"),
    *copy_actions("the lines in view", "all lines that fit, as far as they are read"),
    action("cancel", "escape", "", "no filter", VIEW),
)

PLANNER_LOG_ACTIONS = (
    action("filter", "slash", "words", "only lines with these words", VIEW, 9),
    action("next_team", "t", "team", "only the lines of one team", VIEW, 8),
    action("next_level", "w", "level", "all; without debug; warning, stderr and worse; error and worse", VIEW, 8),
    action("follow", "F", "follow", "the newest lines, as they come; End too", VIEW, 7),
    *copy_actions("the chosen line", "all lines that fit, as far as they are read"),
    *ROW_ACTIONS,
    action("cancel", "escape", "", "no filter; forget the report of the last key", VIEW),
)
