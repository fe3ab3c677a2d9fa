"""The keys of the plots, live and of flights, for bindings, footer and help."""

from tui_gcs.actions.action import VIEW, action

PANES = "Panes"
COPY = "Copy"

PLOT_ACTIONS = (
    action("find", "slash", "add", "a value: words, unit; v3 or v1-4 for other vehicles; again: remove it", PANES, 10),
    action("add_pane", "plus", "pane", "an empty pane below the chosen one", PANES, 5),
    action("remove_pane", "delete C", "", "remove the chosen pane", PANES, shown="Del"),
    action("pane_up", "up k", "", "choose the pane above and below", PANES, shown="up/down", do="choose(-1)"),
    action("pane_down", "down j", "", "", PANES, do="choose(1)"),
    action("enlarge", "enter", "enlarge", "the chosen pane alone, and back", PANES, 3),
    action("save_view", "W", "save", "all panes as a view under a name", PANES, 5),
    action("load_view", "i", "views", "the saved views: show or remove one", PANES, 6),
    action(
        "shorter",
        "left_square_bracket",
        "window",
        "a shorter and a longer window",
        VIEW,
        7,
        shown="[ ]",
        do="window(-1)",
    ),
    action("longer", "right_square_bracket", "", "", VIEW, do="window(1)"),
    action("freeze", "z", "freeze", "stop the picture, and let it go on", VIEW, 8),
    action(
        "left",
        "left h",
        "cursor",
        "move the cursor: the values at its time",
        VIEW,
        6,
        shown="left/right",
        do="move(-1)",
    ),
    action("right", "right l", "", "", VIEW, do="move(1)"),
    action("cursor", "x", "", "show the cursor, or hide it", VIEW),
    action(
        "older", "pageup", "", "half a window back and on; the picture is frozen", VIEW, shown="PgUp/Dn", do="page(-1)"
    ),
    action("newer", "pagedown", "", "", VIEW, do="page(1)"),
    action("newest", "end F", "", "the newest values, as they come; F too", VIEW),
    action("dots", "D", "", "draw in braille, blocks or letters", VIEW),
    action("copy", "y", "copy", "the numbers beside the curves, to the terminal's clipboard (OSC 52)", COPY, 4),
    action("cancel", "escape", "", "hide the cursor; forget the report of the last key", VIEW),
)
