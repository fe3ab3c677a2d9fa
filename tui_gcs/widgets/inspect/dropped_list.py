"""The list of what was received and not used, with the reasons."""

from tui_gcs.feed.message_inspection import DroppedCount
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import cut, wrapped
from tui_gcs.widgets.inspect.message_list import rate_words

REASON_CELLS = 40
WHOLE_LINES, MIN_LINES = 3, 8


class DroppedList(RowsView[DroppedCount]):
    """A line for each reason and sender; what grows is marked."""

    DEFAULT_CSS = framed("DroppedList", "width: 1fr; height: 1fr; display: none;")
    EMPTY = "nothing was dropped"

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`; below the rows the chosen one stands whole."""
        chosen = self.chosen_row
        if chosen is None or height <= MIN_LINES:
            return super().lines(width, height)
        room = height - WHOLE_LINES
        rows = super().lines(width, room)
        whole = wrapped(f"{chosen.count} {chosen.reason}, from {where_words(chosen)}", width, WHOLE_LINES)
        return [*rows, *([[]] * (room - len(rows))), *([(part, Ink.BOLD)] for part in whole)]

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"  {'COUNT':>9} {'PER S':>6} {'REASON':<{REASON_CELLS}} WHERE", Ink.MUTED)]

    def row_line(self, row: DroppedCount, width: int, *, is_chosen: bool) -> Line:
        """Return a reason as a line."""
        grows = row.per_s > 0
        numbers = f" {'!' if grows else ' '}{row.count:>9} {rate_words(row.per_s):>6}"
        text = f"{numbers} {cut(row.reason, REASON_CELLS)} {where_words(row)}"
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED_CAUTION if grows else Ink.SELECTED)]
        return [(text, Ink.CAUTION if grows else Ink.TEXT)]


def where_words(row: DroppedCount) -> str:
    """Return the sender, and the messages that it concerns."""
    return f"{row.where} ({row.names})" if row.names else row.where
