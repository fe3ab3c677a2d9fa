"""Keys as a panel names them where something is cut: by the operator's own keymap."""

from textual.widget import Widget

from tui_gcs.actions import APP
from tui_gcs.actions.keymap import human


def key_name(widget: Widget, action: str, otherwise: str, scope: str = APP) -> str:
    """The key of `action` in the console that `widget` is in; `otherwise` as it is delivered."""
    keys = getattr(widget.app, "keymap", {}).get(f"{scope}.{action}")
    return "/".join(map(human, keys.split(","))) if keys else otherwise


def cut_mark(widget: Widget, action: str, otherwise: str, scope: str = APP) -> str:
    """What stands at the end of a line that is cut: the key that shows it whole."""
    return f" … {key_name(widget, action, otherwise, scope)}"
