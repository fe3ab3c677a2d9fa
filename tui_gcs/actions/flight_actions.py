"""The keys of the flights screen, for bindings, footer and help."""

from tui_gcs.actions.action import VIEW, action
from tui_gcs.actions.list_actions import ROW_ACTIONS, copy_actions

FILES = "Files"
"""Group of the help."""

FLIGHT_ACTIONS = (
    action("enter", "enter", "open", "what happened in the flight; there: replay or plots at an entry", VIEW, 10),
    action("replay", "R", "replay", "the flight on the fly screen; q comes back", FILES, 9),
    action(
        "plot",
        "g",
        "plots",
        "values over time, of the marked ones or the chosen one; q comes back",
        FILES,
        9,
    ),
    action("mark", "m", "", "mark it for the plots, which join the marked ones by time; again: take it off", FILES),
    action("export", "e", "export", "its tracks as .csv, .kml or .gpx", FILES, 8),
    action("delete", "delete", "delete", "the recording and its journal; asks", FILES, 6),
    action("open_file", "plus", "open file", "a .tlog, .bin or .ulg from anywhere", FILES, 7),
    action("filter", "slash", "find", "words of a flight, or of what happened in it", VIEW, 8),
    action("next_severity", "w", "", "of what happened: all, alarms, notices, warnings, critical", VIEW),
    *copy_actions("its path, or that of a rehearsal's report; an entry whole", weight=3),
    *ROW_ACTIONS,
    action("cancel", "escape", "", "back to the list; end the search", VIEW),
)
