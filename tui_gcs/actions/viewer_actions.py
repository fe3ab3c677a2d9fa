"""The actions of the screens that only look: vehicles and journal."""

from tui_gcs.actions.action import SELECT, VIEW, Action

VEHICLES_ACTIONS = (
    Action("turn_view", ("tab",), "Tab", "view", "the fleet as cells or as a table", VIEW, 8),
    Action("sort_next", ("greater_than_sign",), "< >", "sort", "the table by another column", VIEW, 4),
    Action("sort_previous", ("less_than_sign",), "<", "", "", VIEW),
    Action("sort_turn", ("asterisk",), "*", "", "the table the other way round", VIEW),
    Action("filter", ("slash",), "/", "filter", "only vehicles that fit: id, team, mode, armed, cause …", VIEW, 8),
    Action("select_next", ("n", "down", "j"), "n/N", "", "next and previous vehicle; arrows too", SELECT, 3),
    Action("select_previous", ("N", "shift+n", "up", "k"), "N", "", "", SELECT),
    Action("cancel", ("escape",), "Esc", "", "end the filter", SELECT),
)

JOURNAL_ACTIONS = (
    Action("filter", ("slash",), "/", "words", "only lines with these words", VIEW, 9),
    Action("next_class", ("t",), "t", "type", "only one class of events", VIEW, 8),
    Action("next_severity", ("w",), "w", "severity", "all, notices, warnings, critical", VIEW, 8),
    Action("of_selected", ("e",), "e", "selected only", "only the selected vehicles", VIEW, 5),
    Action("up", ("up", "k"), "arrows", "", "older and newer lines; PgUp, PgDn, Home too", VIEW),
    Action("down", ("down", "j"), "down", "", "", VIEW),
    Action("page_up", ("pageup",), "PgUp", "", "", VIEW),
    Action("page_down", ("pagedown",), "PgDn", "", "", VIEW),
    Action("oldest", ("home",), "Home", "", "", VIEW),
    Action("newest", ("end", "F", "shift+f"), "End", "follow", "the newest lines, as they come; F too", VIEW, 4),
    Action("cancel", ("escape",), "Esc", "", "no filter", VIEW),
)
