"""What the second line says of commands: the newest of it; bad news stays beside it for its time, until better comes.

The journal has every notice anyway; but who has just pressed another key must not have to look there for a landing
that was refused.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

NOTICE_S = 8.0
"""So long a notice is shown."""
MOST_BAD = 2
"""More of it is counted only."""


class Severity(IntEnum):
    """How bad something is that a panel or a line shows (docs/terminal.md D7); it decides mark and colour."""

    NORMAL = 0
    GREY = 1
    """A vehicle that is not heard and has no alarm: it was not flying when last heard."""
    CAUTION = 2
    WARNING = 3


@dataclass(frozen=True)
class Notice:
    """One line for the operator; an empty text is no notice."""

    text: str
    level: Severity = Severity.NORMAL


@dataclass(frozen=True)
class _Told:
    notice: Notice
    about: str
    until_s: float


class Notices:
    """Which notices are on the line now. Times are seconds of one clock."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        """Nothing was told."""
        self._now_s = now_s
        self._told: list[_Told] = []

    def tell(self, notice: Notice, about: str = "") -> None:
        """One more. `about`: what it is about; older ones about the same are out of date."""
        kept = [
            told
            for told in self._alive()
            if told.notice.level is Severity.WARNING
            and told.notice.text != notice.text
            and not (about and told.about == about)
        ]
        self._told = [*kept, _Told(notice, about, self._now_s() + NOTICE_S)]

    def line(self) -> Notice:
        """Bad news first, the newest of it before older."""
        alive = self._alive()[::-1]
        bad = [told.notice for told in alive if told.notice.level is Severity.WARNING]
        if not bad:
            return alive[0].notice if alive else Notice("")
        words = [notice.text for notice in bad[:MOST_BAD]]
        if len(bad) > MOST_BAD:
            words.append(f"and {len(bad) - MOST_BAD} more like these: journal")
        words += [told.notice.text for told in alive[:1] if told.notice.level is not Severity.WARNING]
        return Notice("  | ".join(words), Severity.WARNING)

    def _alive(self) -> list[_Told]:
        return [told for told in self._told if self._now_s() < told.until_s]
