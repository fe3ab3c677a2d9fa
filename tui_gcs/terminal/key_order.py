"""Keys in the order in which they are typed, also when the console is behind: over a slow line, on a busy machine.

Textual gives characters to the field that has the cursor at once, and looks for bindings only when the field did not
want a key: then ^U would come after what was typed behind it, and an arrow to the field after the next Tab. So a field
does what its own bindings say by itself (`own_binding`), and keys that leave it are `priority` bindings: they are
looked for first.
"""

from textual import events
from textual.widget import Widget


async def own_binding(widget: Widget, event: events.Key) -> None:
    """Do now what the widget's own bindings say of a key; nothing if they do not know it."""
    for binding in widget._bindings.key_to_bindings.get(event.key, ()):
        if not binding.priority:
            event.stop()
            event.prevent_default()
            await widget.run_action(binding.action)
            return
