"""The keys of the screen of tasks and people, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import ROW_ACTIONS, copy_actions

TASK_ACTIONS = (
    action("end_task", "delete C", "cancel", "the chosen task, also another console's; asks", COMMAND, 8, shown="Del"),
    action("hand_over", "O", "hand over", "control to the chosen console; asks", COMMAND, 7),
    action("take_control", "G", "take control", "without commanding anything; asks", COMMAND, 6),
    action("next_view", "tab", "view", "tasks; people and programs that are connected", VIEW, 9),
    action("only_running", "e", "running", "only tasks under way, or all that are remembered", VIEW, 7),
    *copy_actions(),
    *ROW_ACTIONS,
    action("cancel", "escape", "", "forget the report of the last key", VIEW),
)
