"""The search for a value: words are typed, Enter adds what is marked to the panes or removes it."""

from collections.abc import Callable, Iterable

from textual import events

from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.feed.plots.plotted_values import PlotValue, ValueName, matching, split_vehicles
from tui_gcs.screens.common.text_dialog import TextDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import cut

MAX_TYPED = 60
NAME_CELLS, UNIT_CELLS = 38, 6
LINES_BESIDE = 3
MAX_VEHICLE_CELLS = 20


class ValuePicker(TextDialog[None]):
    """Lists values that have the typed words; it stays open, so that several can be chosen."""

    title_text = "plot a value"

    def __init__(
        self,
        names: Iterable[ValueName],
        vehicles: tuple[int, ...],
        toggle: Callable[[tuple[PlotValue, ...]], str],
        shown: Callable[[], Iterable[PlotValue]],
        glyphs: GlyphSet,
    ) -> None:
        """List `names`; `toggle` adds values to the panes or removes them, and returns a line about it."""
        super().__init__(glyphs)
        self._names = list(names)
        self._vehicles = vehicles
        self._toggle = toggle
        self._shown = shown
        self._typed = ""
        self._at = 0
        self._report = ""
        self.is_complete = False

    def add_names(self, names: Iterable[ValueName]) -> None:
        """List more; what was typed and marked stays."""
        self._names += names
        self.is_complete = True
        if self.is_attached:
            self.redraw()

    @property
    def _found(self) -> list[ValueName]:
        return matching(self._names, split_vehicles(self._typed)[1])

    @property
    def _meant(self) -> tuple[int, ...]:
        return split_vehicles(self._typed)[0] or self._vehicles

    def on_key(self, event: events.Key) -> None:
        """Filter by letters, choose by arrows, add by Enter, leave by Esc."""
        event.stop()
        self._report = ""
        if event.key == "escape":
            self.finish(None)
            return
        if event.key == "enter":
            found = self._found
            self._report = self._toggle(found[self._at].of(self._meant)) if found else "nothing has these words"
        elif event.key in ("down", "up", "pagedown", "pageup"):
            by = 10 if event.key.startswith("page") else 1
            self._at = max(0, min(self._at + (-by if "up" in event.key else by), len(self._found) - 1))
        elif event.key == "backspace":
            self._typed, self._at = self._typed[:-1], 0
        elif event.character is not None and event.character.isprintable():
            self._typed, self._at = (self._typed + event.character)[:MAX_TYPED], 0
        self.redraw()

    def body(self) -> list[Line]:
        """Return what was typed, the values that fit, and what became of the last key."""
        found, meant = self._found, self._meant
        shown = {(value.kind, value.name) for value in self._shown()}
        room = max(1, min(24, self.room - LINES_BESIDE))
        first = max(0, self._at - room + 1)
        whose = vehicles_words(meant) if meant else "no vehicles yet"
        other = "" if split_vehicles(self._typed)[0] else "   (v3 or v1-4 before the words: others)"
        whose = f"   {whose if len(whose) <= MAX_VEHICLE_CELLS else f'{len(meant)} vehicles'}{other}"
        lines: list[Line] = [[("/ ", Ink.BOLD), (f"{self._typed}_", Ink.BOLD), (whose, Ink.MUTED)]]
        for index, name in enumerate(found[first : first + room], start=first):
            at = index == self._at
            mark = self.glyphs.selected if at else " "
            is_shown = self.glyphs.bullet if (name.kind, name.name) in shown else " "
            label = f"{name.subject} {name.name}".strip()
            text = name.text or name.kind.value
            row = f"{mark}{is_shown} {cut(label, NAME_CELLS)} {cut(name.unit, UNIT_CELLS)} {text}"
            lines.append([(row, Ink.BOLD if at else Ink.TEXT)])
        lines += [[] for _ in range(room - len(found[first : first + room]))]
        if self._report:
            lines.append([(self._report, Ink.CAUTION)])
        else:
            more = "" if self.is_complete else "; messages and parameters are being read"
            lines.append([(f"{len(found)} values have these words{more}", Ink.MUTED)])
        return [*lines, [(" Esc = close ", Ink.SELECTED), ("   Enter = add, or remove   arrows: choose", Ink.MUTED)]]
