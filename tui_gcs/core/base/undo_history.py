"""Undo and redo: what is edited is a value, every edit makes a new one, so undo is keeping the old ones."""

from dataclasses import dataclass
from typing import Generic, TypeVar

MAX_UNDO_STEPS = 500
D = TypeVar("D")
W = TypeVar("W")


@dataclass(frozen=True)
class UndoStep(Generic[D, W]):
    """One edit: what it was called, the draft that it was made from or led to, and where it is to be seen."""

    label: str
    draft: D
    where: W | None = None


class UndoHistory(Generic[D, W]):
    """The present draft, those before it and those that were taken back."""

    def __init__(self, draft: D) -> None:
        """Begin with this, as it is in its file."""
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
        """How many can be taken back."""
        return len(self._before)

    @property
    def subject(self) -> str:
        """What the last edit was about, as long as more of it belongs to the same step."""
        return self._subject

    def do(self, label: str, draft: D, subject: str = "", where: W | None = None) -> bool:
        """Take over an edit; False if it changes nothing. Edits of one `subject` in a row (typing) are one step.

        `where` is where the operator was before it.
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
        """What comes next is a step of its own."""
        self._subject = ""

    def retract(self) -> bool:
        """Take back what the open `subject` changed: half of a value is not meant. Whether there was something."""
        if not self._subject or not self._before:
            return False
        self.draft = self._before.pop().draft
        self._subject = ""
        return True

    def undo(self) -> UndoStep[D, W] | None:
        """Take back the last edit, and tell of it; None if there was none."""
        return self._go(self._before, self._after)

    def redo(self) -> UndoStep[D, W] | None:
        """Do again what was taken back, and tell of it; None if there was nothing."""
        return self._go(self._after, self._before)

    def saved(self) -> None:
        """This is in the file now."""
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
