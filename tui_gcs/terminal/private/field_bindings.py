"""The bindings of a field, looked up before Textual would: the private part `DOMNode._bindings`."""

from textual import events
from textual.binding import Binding
from textual.widget import Widget


class FieldBindings:
    """The bindings that a widget declares itself.

    Private: `DOMNode._bindings.key_to_bindings`. Textual gives characters to the focused field at once, but looks for
    bindings only when the field did not want the key. On a slow line ^U would then be carried out after the characters
    typed behind it, and an arrow would reach the field after the next Tab.
    """

    def __init__(self, widget: Widget) -> None:
        self._widget = widget

    def of(self, key: str) -> Binding | None:
        """The binding of a key; None if the widget has none, or one with priority, which Textual looks up first."""
        found = self._widget._bindings.key_to_bindings.get(key, ())
        return next((binding for binding in found if not binding.priority), None)


async def run_own_binding(widget: Widget, event: events.Key) -> None:
    """Carry out now what the widget's own bindings have for a key; without one, leave the key to Textual."""
    if (binding := FieldBindings(widget).of(event.key)) is not None:
        event.stop()
        event.prevent_default()
        await widget.run_action(binding.action)
