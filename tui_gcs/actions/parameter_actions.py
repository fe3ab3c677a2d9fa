"""The parameters screen's keys, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import LOOK_ACTIONS, ROW_ACTIONS, copy_actions

FILES = "Files"

PARAMETER_ACTIONS = (
    action("edit", "enter e", "set", "the chosen parameter on the compared vehicles; asks", COMMAND, 9),
    action("copy", "V", "to others", "the value of the vehicle looked at to the others; asks", COMMAND, 6),
    action("copy_all", "E", "", "copy all that is listed from the vehicle looked at to the others; asks", COMMAND),
    action("undo", "u", "undo", "take the last change back; asks", COMMAND, 6),
    action("fetch", "R", "read", "read all parameters of the compared vehicles from them", COMMAND, 7),
    action("filter", "slash", "find", "words of the name or the meaning", VIEW, 9),
    action("next_view", "tab", "view", "all, differing, changed from default, favourites", VIEW, 8),
    action("favourite", "asterisk", "", "mark the parameter as a favourite, or not", VIEW),
    action("next_group", "right_square_bracket", "group", "next and previous group of names", VIEW, 3, shown="[ ]"),
    action("previous_group", "left_square_bracket", "", "", VIEW),
    action("load", "i", "load", "a parameter file: shows what differs, then asks", FILES, 5),
    action("write", "W", "save", "the parameters of the vehicle looked at to a file", FILES, 5),
    *copy_actions(),
    *LOOK_ACTIONS,
    *ROW_ACTIONS,
    action("cancel", "escape", "", "end the search", VIEW),
)
