"""A field for a number: a letter that slips in is refused and told, so that none is left out unseen."""

from textual.message import Message

from tui_gcs.widgets.forms.form import FormField

NO_LETTERS = r"[\W\d_]*"


class NumberField(FormField):
    """Takes digits and signs; what they come to is judged elsewhere."""

    class Refused(Message):
        """What was typed or pasted has letters in it; the field is as it was."""

    def __init__(self, field: str, *, placeholder: str = "") -> None:
        """`field` is what the field is about (`FormField.field`)."""
        super().__init__(field, placeholder=placeholder)
        self.restrict = NO_LETTERS

    def restricted(self) -> None:
        """See `Input.restricted`: a key or a paste was not taken."""
        self.post_message(self.Refused())
