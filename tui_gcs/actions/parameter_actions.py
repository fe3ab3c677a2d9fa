"""The parameters screen's keys, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, SELECT, VIEW, action

FILES = "Files"

PARAMETER_ACTIONS = (
    action("edit", "enter e", "set", "the chosen parameter on the compared vehicles; asks", COMMAND, 9),
    action("copy", "y", "copy", "the value of the vehicle looked at to the others; asks", COMMAND, 6),
    action("copy_all", "Y", "", "all that is listed, of the vehicle looked at, to the others; asks", COMMAND),
    action("undo", "u", "undo", "take the last change back; asks", COMMAND, 6),
    action("fetch", "R", "read", "read all parameters of the compared vehicles from them", COMMAND, 7),
    action("filter", "slash", "find", "words of the name or the meaning", VIEW, 9),
    action("next_view", "tab", "view", "all, differing, changed from default, favourites", VIEW, 8),
    action("favourite", "asterisk", "", "mark the parameter as a favourite, or not", VIEW),
    action("next_group", "right_square_bracket", "group", "next and previous group of names", VIEW, 3, shown="[ ]"),
    action("previous_group", "left_square_bracket", "", "", VIEW),
    action("load", "i", "load", "a parameter file: shows what differs, then asks", FILES, 5),
    action("write", "W", "save", "the parameters of the vehicle looked at to a file", FILES, 5),
    action("select_next", "n", "", "look at the next and previous vehicle", SELECT, shown="n/N", do="look(1)"),
    action("select_previous", "N", "", "", SELECT, do="look(-1)"),
    action("up", "up k", "", "the row above and below; PgUp, PgDn, Home, End too", VIEW, shown="arrows", do="step(-1)"),
    action("down", "down j", "", "", VIEW, do="step(1)"),
    action("page_up", "pageup", "", "", VIEW, do="page(-1)"),
    action("page_down", "pagedown", "", "", VIEW, do="page(1)"),
    action("first", "home", "", "", VIEW, do="end(-1)"),
    action("last", "end", "", "", VIEW, do="end(1)"),
    action("cancel", "escape", "", "end the search", VIEW),
)
