"""Fields of a form come one after the other as they are written in it, also before they are laid out.

Textual sorts what can have the cursor by where it stands on the screen. A row that was hidden a moment ago stands
nowhere yet: a Tab behind the key that shows it would go past it, and a number typed there to the list below, where it
chooses a vehicle.
"""

from collections.abc import Iterator

from textual.binding import Binding, BindingType
from textual.widget import Widget

FIELD_BINDINGS: list[BindingType] = [
    Binding("up,shift+tab", "step_field(-1)", "previous field", show=False, priority=True),
    Binding("down,enter,tab", "step_field(1)", "next field", show=False, priority=True),
]


class OrderedFields(Widget):
    """What holds fields that are gone through as they are written."""


def step_field(field: Widget, by: int) -> None:
    """To the field behind this one (1) or before it (-1); beyond the last, to what follows on the screen."""
    target = _neighbour(field, by)
    if target is not None:
        field.screen.set_focus(target)


def shown_fields(parent: Widget) -> Iterator[Widget]:
    """What can have the cursor below `parent`, as written."""
    for child in parent.children:
        if child.display:
            if child.focusable:
                yield child
            yield from shown_fields(child)


def _neighbour(field: Widget, by: int) -> Widget | None:
    chain = field.screen.focus_chain
    form = next((above for above in field.ancestors if isinstance(above, OrderedFields)), None)
    fields = list(shown_fields(form)) if form is not None else []
    if field in fields:
        place = fields.index(field) + by
        if 0 <= place < len(fields):
            return fields[place]
        others = [widget for widget in chain if widget is field or widget not in fields]
        chain = others if len(others) > 1 else fields
    if field not in chain:
        return chain[0] if chain else None
    return chain[(chain.index(field) + by) % len(chain)]
