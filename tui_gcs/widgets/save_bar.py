"""Where to save to: one line that asks for a path."""

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import Input, Static

from tui_gcs.widgets.form import FormField


class SaveBar(Horizontal):
    """Hidden until asked for; Enter answers, Esc forgets."""

    DEFAULT_CSS = """
    SaveBar { height: 1; display: none; background: $surface; }
    SaveBar.-open { display: block; }
    SaveBar > Static { width: auto; padding: 0 1; text-style: bold; }
    """
    BINDINGS = [Binding("escape", "close", "cancel", show=False, priority=True)]

    class Answered(Message):
        """The operator typed a path."""

        def __init__(self, path: str) -> None:
            super().__init__()
            self.path = path

    class Retyped(Message):
        """The path is being changed."""

    class Closed(Message):
        """No path, no save."""

    def __init__(self) -> None:
        """Hidden."""
        self._field = PathField("path")
        super().__init__(Static("Save as", markup=False), self._field)

    @property
    def is_open(self) -> bool:
        """Whether a path is asked for."""
        return self.has_class("-open")

    def ask(self, suggestion: str) -> None:
        """Ask, with this to begin with."""
        self.add_class("-open")
        self._field.show(suggestion)
        self._field.cursor_position = len(suggestion)
        self._field.focus()

    def close(self) -> None:
        """Ask no more."""
        self.remove_class("-open")

    def action_close(self) -> None:
        """Esc."""
        self.close()
        self.post_message(self.Closed())

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        event.stop()
        self.post_message(self.Answered(event.value))

    @on(Input.Changed)
    def _changed(self, event: Input.Changed) -> None:
        event.stop()
        self.post_message(self.Retyped())


class PathField(FormField):
    """Enter answers instead of going on."""

    BINDINGS = [Binding("enter", "submit", "save", show=False)]
