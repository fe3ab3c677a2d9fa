"""One line that asks for a file: to open, or to write one vehicle's plan into."""

from pathlib import Path

from textual.message import Message

from tui_gcs.widgets.forms.prompt_bar import PathBar


class OpenBar(PathBar):
    """Says which file was named."""

    class Named(Message):
        """This file, to be written or read; None: none."""

        def __init__(self, path: Path | None, *, write: bool) -> None:
            super().__init__()
            self.path = path
            self.write = write

    _writes = False

    def ask(self, *, write: bool = False, suggestion: str = "") -> None:
        """Which one?"""
        self._writes = write
        self.open("Write" if write else "Open", suggestion)

    def answered(self, typed: str) -> None:
        """This one, or none."""
        typed = typed.strip()
        try:
            self._leave(Path(typed).expanduser() if typed and "\0" not in typed else None)
        except RuntimeError:  # no such user's home
            self._leave(Path(typed))

    def action_cancel(self) -> None:
        """None."""
        self._leave(None)

    def _leave(self, path: Path | None) -> None:
        self.close()
        self.post_message(self.Named(path, write=self._writes))
