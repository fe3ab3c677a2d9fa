"""One line that asks for a path."""

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal
from textual.widgets import Input, Static

from tui_gcs.widgets.forms.form import FormField


class PathField(FormField):
    """Enter answers instead of going on."""

    BINDINGS = [Binding("enter", "submit", "take", show=False)]


class PathBar(Horizontal):
    """Hidden until a path is needed; then Enter answers and Esc forgets."""

    DEFAULT_CSS = """
    PathBar { height: 1; display: none; background: $surface; }
    PathBar.-open { display: block; }
    PathBar > Static { width: auto; padding: 0 1; text-style: bold; }
    """
    BINDINGS = [Binding("escape", "cancel", "cancel", show=False, priority=True)]

    def __init__(self) -> None:
        """Hidden."""
        self._field = PathField("path")
        self._label = Static("", markup=False)
        super().__init__(self._label, self._field)

    @property
    def is_open(self) -> bool:
        """Whether a path is asked for."""
        return self.has_class("-open")

    def open(self, label: str, suggestion: str = "") -> None:
        """Which one?"""
        self._label.update(label)
        self._field.show(suggestion)
        self.add_class("-open")
        self._field.focus()

    def close(self) -> None:
        """Nothing more is asked."""
        self.remove_class("-open")

    def answered(self, typed: str) -> None:
        """Enter."""
        raise NotImplementedError

    def action_cancel(self) -> None:
        """Esc."""
        raise NotImplementedError

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        event.stop()
        self.answered(event.value)
