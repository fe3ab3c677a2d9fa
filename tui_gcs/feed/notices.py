"""Notices to the operator: the newest is shown; bad news stays beside it for its time, until better news comes.

The journal has every notice anyway, but after another key was pressed a refused landing must still be on the screen,
not only there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from tui_gcs.core.protocol.alarms import AlarmLevel

NOTICE_S = 8.0
"""A notice is shown this long."""
MAX_BAD = 2
"""Bad notices that are shown in words; further ones are counted."""


class Severity(IntEnum):
    """How bad something is that a panel or a line shows (docs/terminal.md D7); it decides mark and colour."""

    NORMAL = 0
    GREY = 1
    """A vehicle that is not heard and has no alarm: it was not flying when last heard."""
    CAUTION = 2
    WARNING = 3


ALARM_SEVERITIES = {
    AlarmLevel.WARNING: Severity.WARNING,
    AlarmLevel.CAUTION: Severity.CAUTION,
    AlarmLevel.ADVISORY: Severity.NORMAL,
}
"""How a panel or a line that shows no alarms of its own shows one of each level."""


@dataclass(frozen=True)
class Notice:
    """One line for the operator; an empty text is no notice."""

    text: str
    level: Severity = Severity.NORMAL


@dataclass(frozen=True)
class _ShownNotice:
    notice: Notice
    about: str
    until_s: float


class NoticeBoard:
    """Decides which notices are on the line now. Times are seconds of one clock."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._shown: list[_ShownNotice] = []

    def add(self, notice: Notice, about: str = "") -> None:
        """Add a notice; older ones with the same `about` are out of date."""
        # Good news gives way to anything newer; a warning stays for its time, or until better news about the same.
        kept = [
            shown
            for shown in self._alive()
            if shown.notice.level is Severity.WARNING
            and shown.notice.text != notice.text
            and not (about and shown.about == about)
        ]
        self._shown = [*kept, _ShownNotice(notice, about, self._now_s() + NOTICE_S)]

    def line(self) -> Notice:
        """All that is shown now as one notice: bad news first, the newest of it before older."""
        alive = self._alive()[::-1]
        bad = [shown.notice for shown in alive if shown.notice.level is Severity.WARNING]
        if not bad:
            return alive[0].notice if alive else Notice("")
        words = [notice.text for notice in bad[:MAX_BAD]]
        if len(bad) > MAX_BAD:
            words.append(f"and {len(bad) - MAX_BAD} more like these: journal")
        words += [shown.notice.text for shown in alive[:1] if shown.notice.level is not Severity.WARNING]
        return Notice("  | ".join(words), Severity.WARNING)

    def _alive(self) -> list[_ShownNotice]:
        return [shown for shown in self._shown if self._now_s() < shown.until_s]
