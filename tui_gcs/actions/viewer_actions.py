"""The actions of the screens that only look: vehicles and journal."""

from tui_gcs.actions.action import SELECT, VIEW, ConsoleAction

VEHICLES_ACTIONS = (
    ConsoleAction("turn_view", ("tab",), "Tab", "view", "the fleet as cells or as a table", VIEW, 8),
    ConsoleAction("sort_next", ("greater_than_sign",), "< >", "sort", "the table by another column", VIEW, 4),
    ConsoleAction("sort_previous", ("less_than_sign",), "<", "", "", VIEW),
    ConsoleAction("sort_turn", ("asterisk",), "*", "", "the table the other way round", VIEW),
    ConsoleAction(
        "filter", ("slash",), "/", "filter", "only vehicles that fit: id, team, mode, armed, cause …", VIEW, 8
    ),
    ConsoleAction("select_next", ("n", "down", "j"), "n/N", "", "next and previous vehicle; arrows too", SELECT, 3),
    ConsoleAction("select_previous", ("N", "shift+n", "up", "k"), "N", "", "", SELECT),
    ConsoleAction("cancel", ("escape",), "Esc", "", "end the filter", SELECT),
)

JOURNAL_ACTIONS = (
    ConsoleAction("filter", ("slash",), "/", "words", "only lines with these words", VIEW, 9),
    ConsoleAction("next_class", ("t",), "t", "type", "only one class of events", VIEW, 8),
    ConsoleAction("next_severity", ("w",), "w", "severity", "all, notices, warnings, critical", VIEW, 8),
    ConsoleAction("of_selected", ("e",), "e", "selected only", "only the selected vehicles", VIEW, 5),
    ConsoleAction("up", ("up", "k"), "arrows", "", "older and newer lines; PgUp, PgDn, Home too", VIEW),
    ConsoleAction("down", ("down", "j"), "down", "", "", VIEW),
    ConsoleAction("page_up", ("pageup",), "PgUp", "", "", VIEW),
    ConsoleAction("page_down", ("pagedown",), "PgDn", "", "", VIEW),
    ConsoleAction("oldest", ("home",), "Home", "", "", VIEW),
    ConsoleAction("newest", ("end", "F", "shift+f"), "End", "follow", "the newest lines, as they come; F too", VIEW, 4),
    ConsoleAction("cancel", ("escape",), "Esc", "", "no filter", VIEW),
)
