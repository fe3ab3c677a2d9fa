"""The zones of the edited round, the operating area first; up and down choose the one in the form."""

from collections.abc import Sequence

from rich.cells import cell_len
from textual import events
from textual.message import Message

from tui_gcs.core.geometry.zones import Role
from tui_gcs.core.scenario.model import Round
from tui_gcs.widgets.basics.border_titles import show_beyond
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.plan.shape_edit import described

ROLE_INKS = {Role.DEFEND: Ink.DEFEND, Role.ATTACK: Ink.ATTACK, Role.NO_FLY: Ink.NO_FLY}
AREA_ROW = 0
NAME_CELLS = 10


class ZoneList(LinesView, can_focus=True):
    """Role, name and shape, one line each; row 0 is the operating area."""

    DEFAULT_CSS = "ZoneList { height: 1fr; min-height: 1; }"

    class Selected(Message):
        """The operator chose another row."""

        def __init__(self, row: int) -> None:
            super().__init__()
            self.row = row

    _round: Round | None = None
    _row = AREA_ROW
    _top = 0

    def show(self, current: Round | None, row: int) -> None:
        """Show the zones of this round, with this row chosen."""
        self._round, self._row = current, row
        self.update_lines()

    def action_move(self, by: int) -> None:
        """Choose the row `by` rows below."""
        rows = 1 + len(self._round.zones) if self._round is not None else 1
        row = min(max(self._row + by, 0), rows - 1)
        if row != self._row:
            self.post_message(self.Selected(row))

    def on_click(self, event: events.Click) -> None:
        """Choose the row under the pointer."""
        row = self._top + event.y
        if self._round is not None and row <= len(self._round.zones):
            self.post_message(self.Selected(row))

    def watch_has_focus(self, has_focus: bool) -> None:
        """Draw the chosen line as focused, or not."""
        super().watch_has_focus(has_focus)
        self.update_lines()

    def lines(self, width: int, height: int) -> Sequence[Line]:
        """Return the rows in view, scrolled so that the chosen one is among them."""
        if self._round is None:
            return [[("waiting for the station's scenario", Ink.MUTED)]]
        rows = [self._line(AREA_ROW, "area", "", described(self._round.area.shape, self.glyphs.times), Ink.AREA, width)]
        for number, zone in enumerate(self._round.zones, 1):
            shape = described(zone.shape, self.glyphs.times)
            rows.append(self._line(number, zone.role.value, zone.name, shape, ROLE_INKS[zone.role], width))
        visible = max(height, 1)
        self._top = min(self._top, self._row)
        self._top = max(self._top, self._row - visible + 1, 0)
        shown = rows[self._top : self._top + visible]
        show_beyond(self.parent, self._top, len(rows) - self._top - len(shown), "arrows")
        return shown

    def _line(self, row: int, role: str, name: str, shape: str, ink: Ink, width: int) -> Line:
        chosen = row == self._row
        cells = max(NAME_CELLS, width - 34)
        name = name if len(name) <= cells else name[: cells - 1] + "."
        # On a narrow terminal the figures matter more than the whole word.
        if cell_len(shape) > width - 9 - cells:
            shape = shape.replace("rectangle ", "rect ").replace(" corners", "")
        mark = self.glyphs.selected if chosen else " "
        style = Ink.SELECTED if chosen and self.has_focus else Ink.BOLD if chosen else Ink.TEXT
        return [
            (f"{mark}{role:<6} ", Ink.SELECTED if chosen and self.has_focus else ink),
            (f"{name:<{cells}} {shape}", style),
        ]
