"""The order in which Tab goes through the fields of a form: as they are composed, even before they are laid out.

Textual orders focusable widgets by their position on the screen. A row that was hidden a moment ago has none yet: a Tab
after the key that shows it would skip it, and a number typed then would go to the list below, where it selects a
vehicle.
"""

from collections.abc import Iterator

from textual.binding import Binding, BindingType
from textual.widget import Widget

FIELD_BINDINGS: list[BindingType] = [
    Binding("up,shift+tab", "step_field(-1)", "previous field", show=False, priority=True),
    Binding("down,enter,tab", "step_field(1)", "next field", show=False, priority=True),
]


class OrderedFields(Widget):
    """A container in which Tab goes through the fields in the order in which they are composed."""


def step_field(field: Widget, by: int) -> None:
    """Move the cursor to the field after this one (1) or before it (-1); beyond the last field, to the next widget."""
    target = _neighbour(field, by)
    if target is not None:
        field.screen.set_focus(target)


def shown_fields(parent: Widget) -> Iterator[Widget]:
    """Yield the widgets below `parent` that can have the cursor, in composed order."""
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
        # Beyond its last field the form counts as one stop, whatever Textual's order of its fields is.
        others = [widget for widget in chain if widget is field or widget not in fields]
        chain = others if len(others) > 1 else fields
    if field not in chain:
        return chain[0] if chain else None
    return chain[(chain.index(field) + by) % len(chain)]
