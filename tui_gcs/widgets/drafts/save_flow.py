"""Saving a working copy, one key press after the other: to its own file, or to a path that the operator types.

No file is overwritten at the first press: neither another existing file, nor the own one if it was changed since.
"""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol

from tui_gcs.widgets.drafts.file_writer import SaveError, destination, read_existing, suggested, why_not_own, write


class SaveNext(Enum):
    """What the screen does after a step."""

    DONE = "done"
    ASK_PATH = "ask for a path"
    CONFIRM = "press again"
    FAILED = "failed"


@dataclass(frozen=True)
class SaveStep:
    """The outcome of one press, with a line for the operator."""

    what: SaveNext
    text: str
    suggestion: str = ""


class WorkingCopy(Protocol):
    """An edited text that belongs into a file: a scenario, or the missions of all vehicles."""

    path: str
    """The file that it was loaded from or saved to; "" if it has none yet."""

    @property
    def text(self) -> str:
        """The text that is saved."""
        ...

    def knows_text(self, text: str) -> bool:
        """Return whether a file with this content may be replaced: the copy was made from it or saved as it."""
        ...

    def saved(self, path: Path, text: str) -> None:
        """Note that the file `path` holds `text` now."""
        ...


class SaveFlow:
    """Decides what each press of the save key does. Independent of widgets."""

    def __init__(self, model: WorkingCopy, name: str = "scenario.toml") -> None:
        """Save `model`; `name` is suggested while it has no file."""
        self._model = model
        self._name = name
        self._confirm: Path | None = None

    @property
    def is_confirming(self) -> bool:
        """Whether the next press would overwrite a file."""
        return self._confirm is not None

    def forget(self) -> None:
        """Make the next press a first press again: something else was done or typed."""
        self._confirm = None

    def save(self) -> SaveStep:
        """Save to the copy's own file if it can be written, else ask for a path."""
        reason = why_not_own(self._model.path)
        if reason:
            self._confirm = None
            return SaveStep(SaveNext.ASK_PATH, f"{reason}: save as?", suggested(self._model.path or self._name))
        return self._save(Path(self._model.path).expanduser(), own=True)

    def save_as(self, typed: str) -> SaveStep:
        """Save to the path that the operator typed."""
        try:
            path = destination(typed)
        except SaveError as error:
            self._confirm = None
            return SaveStep(SaveNext.FAILED, f"not saved: {error}")
        return self._save(path, own=False)

    def _save(self, path: Path, *, own: bool) -> SaveStep:
        text = self._model.text
        there = read_existing(path)
        # The own file may be replaced only if it still holds what was read or saved here.
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
