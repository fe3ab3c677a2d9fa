"""The keys of the screen of logs on vehicles, for bindings, footer and help."""

from tui_gcs.actions.action import COMMAND, VIEW, action
from tui_gcs.actions.list_actions import DIGITS_ACTION, ROW_ACTIONS, copy_actions

VEHICLE_LOG_ACTIONS = (
    action("list_logs", "u", "ask", "the selected vehicles, or all, which logs they hold", COMMAND, 10),
    action("download", "enter", "download", "the marked logs, or the chosen one; several vehicles at once", COMMAND, 9),
    action("mark", "m", "mark", "the chosen log, and take the mark off", VIEW, 8),
    action("mark_newest", "w", "newest", "mark the newest log of each vehicle", VIEW, 7),
    action("end_downloads", "delete C", "cancel", "the download of the chosen log; what came is kept", COMMAND, 6),
    action("show_files", "tab", "flights", "the flights screen, which has what was downloaded", VIEW, 5),
    *copy_actions(),
    DIGITS_ACTION,
    *ROW_ACTIONS,
    action("cancel", "escape", "", "take all marks off, and forget the report", VIEW),
)
