"""A field for a number, which refuses letters and reports it: a letter that is silently dropped changes the number."""

from textual.message import Message

from tui_gcs.widgets.forms.form import FormField

NO_LETTERS = r"[\W\d_]*"


class NumberField(FormField):
    """Takes digits and signs; whether they make a number is decided by the form."""

    class Refused(Message):
        """A letter was typed or pasted; the field is unchanged."""

    def __init__(self, field: str, *, placeholder: str = "") -> None:
        """`field` names what the field is about."""
        super().__init__(field, placeholder=placeholder)
        # A pattern of what stands in the field as a whole, so it must match the empty field, too.
        self.restrict = NO_LETTERS

    def restricted(self) -> None:
        """Post that a key or a paste was refused. See `Input.restricted`."""
        self.post_message(self.Refused())
