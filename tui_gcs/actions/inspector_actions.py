"""The inspector's keys, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import LOOK_ACTIONS, ROW_ACTIONS, copy_actions

INSPECTOR_ACTIONS = (
    action("rate", "R", "rate", "ask the vehicle for this message at a rate; asks", COMMAND, 8),
    action("filter", "slash", "find", "words of vehicle (v3), component (c1), message, link", VIEW, 9),
    action("freeze", "z", "freeze", "stop the picture, and let it go on", VIEW, 7),
    action("next_view", "tab", "view", "messages; what was dropped and why", VIEW, 8),
    action("as_bytes", "x", "hex", "the newest frame as bytes, or as fields", VIEW, 5),
    action("enlarge", "enter", "", "the fields alone, as large as the screen, and back", VIEW),
    action("scroll_down", "right_square_bracket", "", "more fields", VIEW, shown="[ ]", do="scroll(3)"),
    action("scroll_up", "left_square_bracket", "", "", VIEW, do="scroll(-3)"),
    *copy_actions("what is shown of the message", weight=6),
    *LOOK_ACTIONS,
    *ROW_ACTIONS,
    action("cancel", "escape", "", "end the search", VIEW),
)
