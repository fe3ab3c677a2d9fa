"""The keys of the links screen, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import LOOK_ACTIONS, ROW_ACTIONS, copy_actions

LINK_ACTIONS = (
    action("rate", "R", "rate", "what the link carries, bytes per second; the vehicles' messages follow", COMMAND, 7),
    action("add", "plus", "add", "another link, or one that was closed; among partners: a partner", COMMAND, 6),
    action(
        "add_partner", "F", "forward", "forward to another station: it hears the vehicles, or commands them", COMMAND, 6
    ),
    action("close", "delete C", "close", "the link or partner; asks", COMMAND, 6, shown="Del"),
    action("next_view", "tab", "view", "links, paths of vehicles, forwarding partners", VIEW, 9),
    action("worst", "w", "worst", "paths: the worst first, or by vehicle", VIEW, 7),
    *copy_actions(),
    *LOOK_ACTIONS,
    *ROW_ACTIONS,
    action("cancel", "escape", "", "forget the report of the last key", VIEW),
)
