"""The traffic screen's keys, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import DIGITS_ACTION, ROW_ACTIONS, copy_actions

TRAFFIC_ACTIONS = (
    action("add_point", "plus", "task", "a point for planners to visit: cursor, 450 200, v3, zone NAME", COMMAND, 8),
    action("end_point", "delete C", "cancel", "the chosen task of planners; asks", COMMAND, 7, shown="Del"),
    action("hear", "R", "hear", "have the selected vehicles report what their ADS-B receivers hear", COMMAND, 5),
    action("next_view", "tab", "tasks", "contacts beside the fleet; tasks for planners", VIEW, 9),
    *copy_actions(),
    DIGITS_ACTION,
    *ROW_ACTIONS,
    action("cancel", "escape", "", "forget the report of the last key", VIEW),
)
