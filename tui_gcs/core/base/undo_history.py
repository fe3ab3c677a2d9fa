"""Undo and redo for values: every edit makes a new value, so undo keeps the old ones."""

from dataclasses import dataclass
from typing import Generic, TypeVar

MAX_UNDO_STEPS = 500
"""Older edits cannot be undone."""
D = TypeVar("D")
W = TypeVar("W")


@dataclass(frozen=True)
class UndoStep(Generic[D, W]):
    """One edit: its label, the draft before it (or after it, for redo), and where it is shown."""

    label: str
    draft: D
    where: W | None = None


class UndoHistory(Generic[D, W]):
    """The present draft, those before it and those that were undone."""

    def __init__(self, draft: D) -> None:
        """Begin with this draft, as it is in its file."""
        self.draft = draft
        self._saved = self.draft
        self._before: list[UndoStep[D, W]] = []
        self._after: list[UndoStep[D, W]] = []
        self._subject = ""

    @property
    def unsaved(self) -> bool:
        """Whether the draft differs from what was saved."""
        return self.draft is not self._saved and self.draft != self._saved

    @property
    def edits(self) -> int:
        """How many edits can be undone."""
        return len(self._before)

    @property
    def subject(self) -> str:
        """The subject of the last edit, while further edits of it belong to the same step."""
        return self._subject

    def do(self, label: str, draft: D, subject: str = "", where: W | None = None) -> bool:
        """Take over an edit; False if it changes nothing.

        Edits of one `subject` in a row (typing) are one step. `where` is where the operator was before the edit.
        """
        if draft == self.draft:
            return False
        if not subject or subject != self._subject:
            self._before.append(UndoStep(label, self.draft, where))
            del self._before[:-MAX_UNDO_STEPS]
        self._subject = subject
        self._after.clear()
        self.draft = draft
        return True

    def end_subject(self) -> None:
        """Make the next edit a step of its own."""
        self._subject = ""

    def retract(self) -> bool:
        """Undo what the open `subject` changed, since half a value is not meant; return whether there was something."""
        if not self._subject or not self._before:
            return False
        self.draft = self._before.pop().draft
        self._subject = ""
        return True

    def undo(self) -> UndoStep[D, W] | None:
        """Undo the last edit and return it; None if there is none."""
        return self._go(self._before, self._after)

    def redo(self) -> UndoStep[D, W] | None:
        """Redo the edit that was undone last and return it; None if there is none."""
        return self._go(self._after, self._before)

    def saved(self) -> None:
        """Note that the present draft is in the file."""
        self._saved = self.draft
        self.end_subject()

    def _go(self, source: list[UndoStep[D, W]], target: list[UndoStep[D, W]]) -> UndoStep[D, W] | None:
        self._subject = ""
        if not source:
            return None
        step = source.pop()
        target.append(UndoStep(step.label, self.draft, step.where))
        self.draft = step.draft
        return step
