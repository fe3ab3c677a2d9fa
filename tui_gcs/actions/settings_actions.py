"""The keys of the settings screen, for bindings, footer and help."""

from tui_gcs.actions.action import VIEW, action
from tui_gcs.actions.list_actions import ROW_ACTIONS, copy_actions

SETTINGS_ACTIONS = (
    action("change", "enter", "change", "the chosen setting in config.toml: the next value, or type one", VIEW, 9),
    action("remove", "delete C", "default", "remove it from config.toml: its default counts", VIEW, 7, shown="Del"),
    *copy_actions("the chosen setting", "all settings"),
    *ROW_ACTIONS,
    action("cancel", "escape", "", "forget the report of the last key", VIEW),
)
