"""The keys of the links screen, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, SELECT, VIEW, action

LINK_ACTIONS = (
    action("rate", "R", "rate", "what the link carries, bytes per second; the vehicles' messages follow", COMMAND, 7),
    action("add", "plus", "add", "another link, or one that was closed", COMMAND, 6),
    action("close", "delete C", "close", "the link; asks", COMMAND, 6, shown="Del"),
    action("next_view", "tab", "view", "links, paths of vehicles, forwarding partners", VIEW, 9),
    action("worst", "w", "worst", "paths: the worst first, or by vehicle", VIEW, 7),
    action("select_next", "n", "", "look at the next and previous vehicle", SELECT, shown="n/N", do="look(1)"),
    action("select_previous", "N", "", "", SELECT, do="look(-1)"),
    action("up", "up k", "", "the row above and below; PgUp, PgDn, Home, End too", VIEW, shown="arrows", do="step(-1)"),
    action("down", "down j", "", "", VIEW, do="step(1)"),
    action("page_up", "pageup", "", "", VIEW, do="page(-1)"),
    action("page_down", "pagedown", "", "", VIEW, do="page(1)"),
    action("first", "home", "", "", VIEW, do="end(-1)"),
    action("last", "end", "", "", VIEW, do="end(1)"),
    action("cancel", "escape", "", "forget the report of the last key", VIEW),
)
