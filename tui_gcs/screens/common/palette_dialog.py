"""The palette (`:`): any action by its name, and lines with arguments or own commands."""

from collections.abc import Sequence
from textwrap import wrap

from textual import events

from tui_gcs.actions.palette.entries import Entry
from tui_gcs.actions.palette.own_commands import OwnCommands
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

MAX_TYPED = 66
"""There is no room for more on the line."""
LINES_BESIDE = 2
"""Lines of the palette beside its entries and the text about the marked one: the line to type in, and the keys."""


class PaletteDialog(TextDialog[str | None]):
    """The operator types a part of an action's name, or a whole line with arguments, and presses Enter.

    The result is Textual's action string, or None if nothing was chosen.
    """

    title_text = "what to do"

    def __init__(self, entries: Sequence[Entry], glyphs: GlyphSet, own: OwnCommands | None = None) -> None:
        super().__init__(glyphs)
        self._entries = entries
        self._own = own or OwnCommands()
        self._typed = ""
        self._at = 0
        self._problem = ""

    @property
    def matching(self) -> list[Entry]:
        """The entries that match what was typed."""
        return self._own.matching(self._entries, self._typed)

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
        elif matching[self._at].whole_fleet and self._typed.casefold().strip() != matching[self._at].name.casefold():
            # Two letters that somebody typed for something else must not land a fleet: `:la` found LAND ALL.
            self._typed, self._at = matching[self._at].name, 0
            self._problem = f"{self._typed}: every vehicle, at once; Enter again does it"
        else:
            self.finish(matching[self._at].run)
            return
        self.redraw()

    def body(self) -> list[Line]:
        """Return what was typed, the matching entries, and why the marked one cannot be done."""
        matching = self.matching
        about, ink_about = self._about(matching[self._at] if matching else None)
        described = wrap(about, LINE_CELLS) or [""]
        room = max(1, min(len(self._entries), self.room - LINES_BESIDE - len(described)))
        first = max(0, self._at - room + 1)
        lines: list[Line] = [[(": ", Ink.BOLD), (f"{self._typed}_", Ink.BOLD)]]
        for index, entry in enumerate(matching[first : first + room], start=first):
            at = index == self._at
            ink = Ink.MUTED if entry.why_not else Ink.BOLD if at else Ink.TEXT
            mark = self.glyphs.selected if at else " "
            lines.append([(f"{mark} {entry.name:<16} {entry.key:<7} ", ink), (entry.help, ink)])
        lines += [[] for _ in range(room - len(matching))]
        lines += [[(text, ink_about)] for text in described]
        more = f", {self._at + 1} of {len(matching)}" if len(matching) > room else ""
        keys = f"   Enter = do it   arrows: choose{more}"
        return [*lines, [(" Esc = close ", Ink.SELECTED), (keys, Ink.MUTED)]]

    def _about(self, marked: Entry | None) -> tuple[str, Ink]:
        """Return all that the marked entry does, or why it cannot be done now."""
        if self._problem or marked is None:
            return self._problem or "nothing has such a name", Ink.CAUTION
        if not marked.why_not:
            return marked.help, Ink.BOLD if marked.help.startswith("=") else Ink.MUTED
        not_now = f"not now: {marked.why_not}"
        return f"{marked.help}   {not_now}" if marked.help.startswith("=") else not_now, Ink.CAUTION
