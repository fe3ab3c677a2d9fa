"""A question in one line at the bottom of a screen, with a field for the answer."""

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import Input, Static

from tui_gcs.widgets.forms.form import FormField


class PromptField(FormField):
    """The field of the answer: Enter submits it instead of going to the next field."""

    BINDINGS = [Binding("enter", "submit", "take", show=False)]


class PromptBar(Horizontal):
    """Hidden until `ask`; then Enter answers and Esc cancels. Its id names the question in `on(…, "#id")`."""

    DEFAULT_CSS = """
    PromptBar { height: 1; display: none; background: $surface; }
    PromptBar.-open { display: block; }
    PromptBar > Static { width: auto; padding: 0 1; text-style: bold; }
    PromptBar > #hint { color: $text-muted; text-style: none; }
    """
    BINDINGS = [Binding("escape", "cancel", "cancel", show=False, priority=True)]

    class Answered(Message):
        """The prompt was closed with this text; None if the operator cancelled."""

        def __init__(self, prompt: "PromptBar", text: str | None) -> None:
            super().__init__()
            self.prompt, self.text = prompt, text

        @property
        def control(self) -> "PromptBar":
            """The prompt, for the selector of `on`."""
            return self.prompt

    def __init__(self, id: str | None = None) -> None:  # noqa: A002
        self._field = PromptField("path")
        self._label = Static("", markup=False)
        super().__init__(self._label, self._field, Static("Enter takes, Esc leaves", id="hint"), id=id)
        # Textual gives a screen that is shown again its first field: a hidden one would take every key unseen.
        self._field.can_focus = False

    @property
    def is_open(self) -> bool:
        """Whether the question is shown."""
        return self.has_class("-open")

    def ask(self, label: str, suggestion: str = "") -> None:
        """Show the question with a suggested answer and put the cursor into the field."""
        self._label.update(label)
        self._field.show(suggestion)
        self.add_class("-open")
        self._field.can_focus = True
        self._field.focus()

    def close(self) -> None:
        """Hide the question and its field."""
        self.remove_class("-open")
        self._field.can_focus = False

    def submit(self, text: str) -> None:
        """Take the answer: close and post it. A subclass may refuse it and stay open."""
        self.close()
        self.post_message(self.Answered(self, text))

    def action_cancel(self) -> None:
        """Close without an answer, on Esc."""
        self.close()
        self.post_message(self.Answered(self, None))

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        event.stop()
        self.submit(event.value)
