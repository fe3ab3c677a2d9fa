"""The keys of the rehearsals screen, for bindings, footer and help."""

from tui_gcs.actions.action import VIEW, action
from tui_gcs.actions.list_actions import ROW_ACTIONS, copy_actions

REHEARSALS = "Rehearse"
"""Group of the help."""

REHEARSAL_ACTIONS = (
    action(
        "rehearse",
        "R",
        "rehearse",
        "the station's scenario on simulated vehicles, in the background; asks for options",
        REHEARSALS,
        10,
    ),
    action("end_rehearsal", "delete C", "cancel", "the one under way; asks", REHEARSALS, 7, shown="Del"),
    action("gates", "enter", "gates", "the result of each gate, the failed ones first", VIEW, 9),
    action("changes", "d", "changes", "lines of the scenario that differ from the rehearsed one", VIEW, 8),
    action("show_flights", "L", "flights", "recordings: replay, what happened, delete", VIEW, 5),
    *copy_actions("the path of its report; a gate or change whole", weight=6),
    *ROW_ACTIONS,
    action("cancel", "escape", "", "back to the list; forget the report of the last key", VIEW),
)
