"""Keys as the operator reads them, with those of the operator's own keymap."""

from collections.abc import Mapping

from textual.widget import Widget

from tui_gcs.actions import APP, APP_ACTIONS, FLY_ACTIONS
from tui_gcs.actions.action import keys_text
from tui_gcs.actions.keymap import with_keys

KEYS = {action.id: action.shown for action in (*APP_ACTIONS, *FLY_ACTIONS) if action.shown}
"""Key by action, for the words of alarms; `use_keys` changes it once, before anything is shown."""


def use_keys(keymap: Mapping[str, str]) -> None:
    """Take the keys of the operator's own keymap."""
    for scope, actions in ((APP, APP_ACTIONS), ("fly", FLY_ACTIONS)):
        KEYS.update({action.id: action.shown for action in with_keys(actions, scope, keymap) if action.shown})


def key_name(widget: Widget, action: str, otherwise: str, scope: str = APP) -> str:
    """The key of `action` in the console that contains `widget`; `otherwise` without a keymap for it."""
    keys = getattr(widget.app, "keymap", {}).get(f"{scope}.{action}")
    return keys_text(keys.split(",")) if keys else otherwise


def cut_mark(widget: Widget, action: str, otherwise: str, scope: str = APP) -> str:
    """What ends a line that is cut: the key of the action that shows it whole."""
    return f" … {key_name(widget, action, otherwise, scope)}"
