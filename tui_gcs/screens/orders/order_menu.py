"""The menu of orders for the selected vehicles."""

from textwrap import wrap

from textual import events

from tui_gcs.actions.orders import ORDERS, VehicleOrder, why_not_order
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.screens.orders.vehicle_words import rows_of
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, cut

REFRESH_S = 0.25
LINES_BESIDE, MAX_DETAIL_LINES = 3, 3
"""Lines of the menu beside the orders: a gap, the description, the keys; and the most lines of the description."""
HINT = "   a letter chooses; arrows tell more; grey: not now"
STUCK = "   an arrow, then choose again; what follows is not taken"


class OrderMenu(TextDialog[str | None]):
    """A letter chooses an order; one that makes no sense now is grey, with its reason. The result is the order's id.

    An order that is only doubtful (for a camera that does not show up) is grey, too, and its letter is refused; an
    operator can still mark it by arrows and press Enter.
    """

    def __init__(self, feed: Feed, glyphs: GlyphSet) -> None:
        super().__init__(glyphs)
        self._feed = feed
        self._problem = ""
        self._stuck = False
        self._at: int | None = None
        """Index of the marked order."""
        self.title_text = f"vehicle{'s' * (len(feed.selection.ids) > 1)} {ids(feed.selection.ids)}: what to do?"

    def on_mount(self) -> None:
        """Refresh the menu while it is open: orders may become possible."""
        super().on_mount()
        self.set_interval(REFRESH_S, self.redraw)

    def on_key(self, event: events.Key) -> None:
        """Choose an order by its letter, or mark one by arrows and take it by Enter."""
        event.stop()
        if event.key == "escape":
            self.finish(None)
            return
        if event.key in ("down", "up", "left", "right"):
            self._problem, self._stuck = "", False
            self._mark(event.key)
            return
        if self._stuck:
            return
        marked = event.key == "enter" and self._at is not None
        if marked and self._at is not None:
            order: VehicleOrder | None = ORDERS[self._at]
        else:
            order = next((order for order in ORDERS if order.key == event.character), None)
        if order is None:
            self._problem = "no order has that letter"
        elif why := self._why_not(order, doubtful=marked):
            self._problem = f"{order.name}: {why}"
            if not self._why_not(order, doubtful=True):
                self._problem += "; arrows and Enter ask for it all the same"
        else:
            self.finish(order.id)
            return
        # The letters behind one that was not taken were meant for its question, not for this menu.
        self._stuck = True
        self.redraw()

    def _mark(self, key: str) -> None:
        by = {"down": 1, "up": -1, "right": self._lines(), "left": -self._lines()}[key]
        self._at = 0 if self._at is None else max(0, min(self._at + by, len(ORDERS) - 1))
        self.redraw()

    def _lines(self) -> int:
        """Return the number of lines of orders: one column where the terminal is high enough, else two."""
        return len(ORDERS) if len(ORDERS) <= self.room - LINES_BESIDE else (len(ORDERS) + 1) // 2

    def _why_not(self, order: VehicleOrder, *, doubtful: bool = False) -> str:
        return why_not_order(order, self._feed.selection.ids, rows_of(self._feed), doubtful=doubtful)

    def _description(self, order: VehicleOrder) -> str:
        """Describe the marked order, and why it is refused or doubtful."""
        why = self._why_not(order)
        anyway = (
            f"; Enter asks for it all the same: {order.does}" if why and not self._why_not(order, doubtful=True) else ""
        )
        return f"{order.name}: {why or order.does}{anyway}"

    def body(self) -> list[Line]:
        """Return the orders, the description of the marked one or why the last letter was refused, and the keys."""
        count = self._lines()
        columns = [range(first, min(first + count, len(ORDERS))) for first in range(0, len(ORDERS), count)]
        width = LINE_CELLS // len(columns)
        lines: list[Line] = [
            [self._cell(column[y], width) for column in columns if y < len(column)] for y in range(count)
        ]
        text, ink = self._problem, Ink.CAUTION
        if not text and self._at is not None:
            text, ink = self._description(ORDERS[self._at]), Ink.TEXT
        return [
            *lines,
            [],
            *([(line, ink)] for line in wrap(text, LINE_CELLS)[:MAX_DETAIL_LINES] or [""]),
            [(" Esc = nothing ", Ink.SELECTED), (STUCK, Ink.BOLD) if self._stuck else (HINT, Ink.MUTED)],
        ]

    def _cell(self, at: int, width: int) -> Run:
        order = ORDERS[at]
        why = self._why_not(order)
        head, does = f"{order.key}  {order.name:<12}", f"({why})" if why else order.does
        # The short text only where the long one does not fit: a reason is never shortened.
        if order.brief and not why and len(head) + len(does) >= width:
            does = order.brief
        text = head + does
        ink = Ink.SELECTED if at == self._at else Ink.MUTED if why else Ink.BOLD
        return cut(text, width - 1) + " ", ink
