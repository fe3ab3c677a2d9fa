"""Help and palette: all actions, what each does, and why a greyed one can do nothing now."""

from collections.abc import Sequence
from textwrap import wrap

from textual import events

from tui_gcs.actions import ActionContext, ConsoleAction, refusal
from tui_gcs.actions.action import ALARMS, COMMAND, SCREENS, SELECT, VIEW
from tui_gcs.actions.entries import Entry, found
from tui_gcs.screens.common.text_dialog import LINE_CELLS, ScrolledDialog, TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

EVERYWHERE = (COMMAND, SELECT, ALARMS, SCREENS, VIEW)
"""Groups that most screens have, in the order in which a new operator needs them."""
MAX_TYPED = 40
KEY_CELLS = 18
"""Cells for the group and the key, before the text of an action."""
LINES_BESIDE = 3
"""Lines of the palette beside its entries: the line to type in, the reason, the keys."""


class HelpDialog(ScrolledDialog):
    """All keys of a screen, from the action tables."""

    LEAVE_KEYS = (*ScrolledDialog.LEAVE_KEYS, "question_mark")
    title_text = "keys"

    def __init__(self, actions: Sequence[ConsoleAction], situation: ActionContext, glyphs: GlyphSet) -> None:
        """List `actions` by group, as they are in `situation`."""
        super().__init__(glyphs)
        self._actions = actions
        self._situation = situation

    def all_lines(self) -> list[Line]:
        """Return the actions by group, those of this screen first; those that can do nothing now are grey, with why."""
        lines: list[Line] = []
        groups = dict.fromkeys(action.group for action in self._actions)
        # Groups of this screen alone are not in EVERYWHERE: -1 puts them first.
        for group in sorted(groups, key=lambda group: EVERYWHERE.index(group) if group in EVERYWHERE else -1):
            described = [action for action in self._actions if action.group == group and action.help]
            for index, action in enumerate(described):
                name = (f"{group if index == 0 else '':<9}", Ink.ADVISORY)
                why = refusal(action, self._situation)
                inks = (Ink.MUTED, Ink.MUTED) if why else (Ink.BOLD, Ink.TEXT)
                first, *more = wrap(action.help, LINE_CELLS - KEY_CELLS)
                lines.append([name, (f"{action.shown:<8} ", inks[0]), (first, inks[1])])
                lines += [[(" " * KEY_CELLS + text, inks[1])] for text in more]
                if why:
                    lines += [
                        [(" " * KEY_CELLS + text, Ink.CAUTION)]
                        for text in wrap(f"not now: {why}", LINE_CELLS - KEY_CELLS)
                    ]
        return [*lines, *legend(self.glyphs)]


def legend(glyphs: GlyphSet) -> list[Line]:
    """Return what the signs and abbreviations on the screens mean."""
    meanings = (
        (
            f"{glyphs.headings[0]} {glyphs.armed_on_ground} {glyphs.disarmed} {glyphs.lost}",
            "in the air, its nose forward; armed on the ground; disarmed; not heard",
        ),
        (f"{glyphs.place} {glyphs.marker}", "on the map: a take-off place; where a vehicle is sent"),
        ("^ ! x i", "caution; warning; not heard; to be known"),
        ("OVER", "an alarm that is over and was not acknowledged"),
        ("8/8", "vehicles heard, of all that are known"),
        ("ctl", "who gave the last order, from this console or another"),
        ("ALT", "metres above its own take-off place"),
        ("slot off", "its place in the team; metres from where it should be now"),
        (
            "26s 1.3x",
            "of a zone: the longest that a place was not seen, in the last minute; as a multiple of the best possible",
        ),
        ("cov 4/4", "percent of the zone seen since the round began; vehicles on their slots"),
        ("sep out", "nearest two in the air; farthest outside the operating area"),
        ("veto", "set-points that the guard did not let through: the vehicle brakes and holds"),
    )
    lines: list[Line] = []
    for sign, meaning in meanings:
        first, *more = wrap(meaning, LINE_CELLS - KEY_CELLS)
        lines.append([(f"{'' if lines else 'Signs':<9}", Ink.ADVISORY), (f"{sign:<8} ", Ink.BOLD), (first, Ink.TEXT)])
        lines += [[(" " * KEY_CELLS + text, Ink.TEXT)] for text in more]
    return lines


class PaletteDialog(TextDialog[str | None]):
    """The operator types a part of an action's name and presses Enter.

    The result is Textual's action string, or None if nothing was chosen.
    """

    title_text = "what to do"

    def __init__(self, entries: Sequence[Entry], glyphs: GlyphSet) -> None:
        super().__init__(glyphs)
        self._entries = entries
        self._typed = ""
        self._at = 0
        self._problem = ""

    @property
    def matching(self) -> list[Entry]:
        """The entries that match what was typed."""
        return found(self._entries, self._typed)

    def on_key(self, event: events.Key) -> None:
        """Filter by letters, choose by arrows and Enter, leave by Esc."""
        event.stop()
        self._problem = ""
        if event.key == "escape":
            self.finish(None)
            return
        if event.key == "enter":
            self._choose()
            return
        if event.key in ("down", "up", "tab", "shift+tab"):
            self._at = max(0, min(self._at + (1 if event.key in ("down", "tab") else -1), len(self.matching) - 1))
        elif event.key == "backspace":
            self._typed, self._at = self._typed[:-1], 0
        elif event.character is not None and event.character.isprintable():
            self._typed, self._at = (self._typed + event.character)[:MAX_TYPED], 0
        self.redraw()

    def _choose(self) -> None:
        matching = self.matching
        if not matching:
            self._problem = "nothing has such a name"
        elif why := matching[self._at].why_not:
            self._problem = f"not now: {why}"
        else:
            self.finish(matching[self._at].run)
            return
        self.redraw()

    def body(self) -> list[Line]:
        """Return what was typed, the matching entries, and why the marked one cannot be done."""
        matching = self.matching
        room = max(1, min(len(self._entries), self.room - LINES_BESIDE))
        first = max(0, self._at - room + 1)
        lines: list[Line] = [[(": ", Ink.BOLD), (f"{self._typed}_", Ink.BOLD)]]
        for index, entry in enumerate(matching[first : first + room], start=first):
            at = index == self._at
            ink = Ink.MUTED if entry.why_not else Ink.BOLD if at else Ink.TEXT
            mark = self.glyphs.selected if at else " "
            lines.append([(f"{mark} {entry.name:<16} {entry.key:<7} ", ink), (entry.help, ink)])
        lines += [[] for _ in range(room - len(matching))]
        marked = matching[self._at] if matching else None
        if self._problem or marked is None:
            lines.append([(self._problem or "nothing has such a name", Ink.CAUTION)])
        elif marked.why_not:
            lines.append([(f"not now: {marked.why_not}", Ink.CAUTION)])
        else:
            lines.append([(marked.help, Ink.MUTED)])  # all of it
        more = f", {self._at + 1} of {len(matching)}" if len(matching) > room else ""
        keys = f"   Enter = do it   arrows: choose{more}"
        return [*lines, [(" Esc = close ", Ink.SELECTED), (keys, Ink.MUTED)]]
