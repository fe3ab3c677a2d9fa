"""The setup screen's keys, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import LOOK_ACTIONS, ROW_ACTIONS, copy_actions

SETUP_ACTIONS = (
    action("edit", "enter e", "set", "set, choose, calibrate or test the chosen line; asks", COMMAND, 9),
    action("confirm", "d", "done", "the prompt was followed, on all selected vehicles that show it", COMMAND, 9),
    action("end_led", "delete C", "cancel", "calibrations (asks) and motor tests (at once)", COMMAND, 8, shown="Del"),
    action("undo", "u", "undo", "take back: the gain, the transmitter, the last parameter", COMMAND, 6),
    action("undo_all", "U", "", "take all changes of gains back; asks", COMMAND),
    action("fetch", "R", "read", "read the section from the vehicles; all sections from the list of them", COMMAND, 7),
    action("next_view", "tab", "sections", "sections; lines of the section", VIEW, 8),
    action("to_sections", "left h", "", "the list of sections, the lines of the section", VIEW, shown="left right"),
    action("to_fields", "right l", "", "", VIEW),
    *copy_actions(),
    *LOOK_ACTIONS,
    *ROW_ACTIONS,
    action("cancel", "escape", "", "forget the report of the last key", VIEW),
)
