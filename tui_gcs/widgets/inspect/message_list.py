"""The list of messages: senders, how often, when last, how large."""

import math

from tui_gcs.core.protocol.inspection import MessageRow
from tui_gcs.feed.message_inspection import InspectedMessage
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import age_words
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import cut

NAME_CELLS = 28
WIDE_CELLS = 90
"""From this width on the link has room; elsewhere it stands beside the fields."""
OLD_S = 5.0
"""A message that has not come for this long is drawn grey."""


class MessageList(RowsView[InspectedMessage]):
    """A line for each kind of message of each component."""

    DEFAULT_CSS = framed("MessageList", "width: 1fr; height: 1fr;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        link = "  LINK" if width >= WIDE_CELLS else ""
        return [
            (f"  {'VEH':>4} {'COMP':>4} {'MESSAGE':<{NAME_CELLS}} {'HZ':>5} {'AGE':>5} {'BYTES':>5}{link}", Ink.MUTED)
        ]

    def row_line(self, row: InspectedMessage, width: int, *, is_chosen: bool) -> Line:
        """Return a message as a line; one whose frames do not count has a mark, not only a colour."""
        mark = " " if row.row.used else "!"
        text = (
            f" {mark}{sender(row.row):>4} {row.row.key.component:>4} {cut(row.row.name, NAME_CELLS)}"
            f" {rate_words(row.rate_hz):>5} {age_words(row.row.age_s):>5} {row.row.size:>5}"
        )
        if width >= WIDE_CELLS:
            text += f"  {row.row.key.link}"
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED if row.row.used else Ink.SELECTED_CAUTION)]
        if not row.row.used:
            return [(text, Ink.CAUTION)]
        return [(text, Ink.MUTED if row.row.age_s > OLD_S else Ink.TEXT)]


def sender(row: MessageRow) -> str:
    """Return the vehicle's number; of a system that is no vehicle its system id with a question mark."""
    return str(row.vehicle) if row.vehicle else f"?{row.key.system}"


def rate_words(hz: float) -> str:
    """Return a rate with few digits, so that it does not change with every look."""
    if math.isnan(hz):
        return "--"
    return f"{hz:.0f}" if hz >= 9.5 else f"{hz:.1f}" if hz > 0 else "0"
