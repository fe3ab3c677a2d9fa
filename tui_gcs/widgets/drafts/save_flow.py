"""Saving the working copy, one key press after the other: to its own file, or to a path that is asked for.

Nobody's file is replaced on the first press: not another file that exists, and not one's own that was changed since.
"""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol

from tui_gcs.widgets.drafts.file_writer import SaveError, destination, read_existing, suggested, why_not_own, write


class SaveNext(Enum):
    """What the screen does next."""

    DONE = "done"
    ASK_PATH = "ask for a path"
    CONFIRM = "press again"
    FAILED = "failed"


@dataclass(frozen=True)
class SaveStep:
    """The outcome of one press, and a line for the operator."""

    what: SaveNext
    text: str
    suggestion: str = ""


class WorkingCopy(Protocol):
    """Something with a text that belongs into a file."""

    path: str
    """Where it came from, or was saved to; "" if it has no file yet."""

    @property
    def text(self) -> str:
        """What is saved."""
        ...

    def knows_text(self, text: str) -> bool:
        """Whether a file's content is one this copy was made from or saved as: then it may be replaced."""
        ...

    def saved(self, path: Path, text: str) -> None:
        """`text` is in the file `path` now."""
        ...


class SaveFlow:
    """Plain: knows the working copy and the file system, no widgets."""

    def __init__(self, model: WorkingCopy, name: str = "scenario.toml") -> None:
        """For this working copy; `name` is offered where it has none."""
        self._model = model
        self._name = name
        self._confirm: Path | None = None

    @property
    def asks(self) -> bool:
        """Whether the next press overwrites."""
        return self._confirm is not None

    def forget(self) -> None:
        """Something else was done or typed: the next press is a first press again."""
        self._confirm = None

    def save(self) -> SaveStep:
        """To the scenario's own file, if it is the operator's."""
        reason = why_not_own(self._model.path)
        if reason:
            self._confirm = None
            return SaveStep(SaveNext.ASK_PATH, f"{reason}: save as?", suggested(self._model.path or self._name))
        return self._save(Path(self._model.path).expanduser(), own=True)

    def save_as(self, typed: str) -> SaveStep:
        """To the path an operator typed."""
        try:
            path = destination(typed)
        except SaveError as error:
            self._confirm = None
            return SaveStep(SaveNext.FAILED, f"not saved: {error}")
        return self._save(path, own=False)

    def _save(self, path: Path, *, own: bool) -> SaveStep:
        text = self._model.text
        there = read_existing(path)
        mine = own and there is not None and self._model.knows_text(there)
        if there is not None and there != text and not mine and self._confirm != path:
            self._confirm = path
            why = "was changed by someone else" if own else "exists already"
            return SaveStep(SaveNext.CONFIRM, f"{path} {why}: again overwrites it, Esc does not")
        self._confirm = None
        try:
            write(path, text)
        except SaveError as error:
            return SaveStep(SaveNext.FAILED, f"not saved: {error}")
        self._model.saved(path, text)
        return SaveStep(SaveNext.DONE, f"saved to {path}")
