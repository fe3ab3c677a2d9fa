"""One line that asks for a file: to open, or to write one vehicle's plan into."""

from pathlib import Path

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal
from textual.message import Message
from textual.widgets import Input, Static

from tui_gcs.widgets.save_bar import PathField


class OpenBar(Horizontal):
    """Hidden until it is asked for; then Enter answers and Esc forgets."""

    DEFAULT_CSS = """
    OpenBar { height: 1; display: none; background: $surface; }
    OpenBar.-open { display: block; }
    OpenBar > Static { width: auto; padding: 0 1; text-style: bold; }
    """
    BINDINGS = [Binding("escape", "close", "cancel", show=False, priority=True)]

    class Named(Message):
        """This file, to be written or read; None: none."""

        def __init__(self, path: Path | None, *, write: bool) -> None:
            super().__init__()
            self.path = path
            self.write = write

    def __init__(self) -> None:
        """Hidden."""
        self._field = PathField("path")
        self._label = Static("Open", markup=False)
        self._writes = False
        super().__init__(self._label, self._field)

    def ask(self, *, write: bool = False, suggestion: str = "") -> None:
        """Which one?"""
        self._writes = write
        self._label.update("Write" if write else "Open")
        self._field.show(suggestion)
        self.add_class("-open")
        self._field.focus()

    def action_close(self) -> None:
        """Esc."""
        self._leave(None)

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        event.stop()
        typed = event.value.strip()
        try:
            self._leave(Path(typed).expanduser() if typed and "\0" not in typed else None)
        except RuntimeError:  # no such user's home
            self._leave(Path(typed))

    def _leave(self, path: Path | None) -> None:
        self.remove_class("-open")
        self.post_message(self.Named(path, write=self._writes))
