"""The three lists of the links screen: links, paths of vehicles, forwarding partners."""

import math

from tui_gcs.core.protocol.link_report import PartnerRow, PathRow
from tui_gcs.feed.link_watch import OLD_S, WatchedLink
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import age_words
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import cut

LINK_CELLS, SIGNING_CELLS = 26, 12
MUCH_LOSS_PCT = 5.0
"""From this loss on a path is marked: set-points and acknowledgements are repeated noticeably often."""


class LinkList(RowsView[WatchedLink]):
    """A line for each link."""

    DEFAULT_CSS = framed("LinkList", "width: 1fr; height: 1fr;")
    EMPTY = "the station has no link"

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [
            (
                f"  {'LINK':<{LINK_CELLS}} {'VEH':>4} {'IN B/S':>7} {'OUT':>6} {'BUDGET':>8} {'MESSAGES':<13} RADIO",
                Ink.MUTED,
            )
        ]

    def row_line(self, row: WatchedLink, width: int, *, is_chosen: bool) -> Line:
        """Return a link as a line; one that does not work has a mark and the reason."""
        link = row.row
        limit = "no limit" if link.capacity_bytes_per_s is None else str(link.capacity_bytes_per_s)
        numbers = f"{link.vehicles:>4} {bytes_words(row.in_bytes_per_s):>7} {bytes_words(row.out_bytes_per_s):>6}"
        rest = link.error if not link.up else f"{cut(link.set_name or '-', 13)} {radio_words(row)}"
        text = f" {' ' if link.up else '!'}{cut(link.name, LINK_CELLS)} {numbers} {limit:>8} {rest}"
        return marked(text, width, is_chosen=is_chosen, is_bad=not link.up)


class PathList(RowsView[PathRow]):
    """A line for each path of each vehicle."""

    DEFAULT_CSS = framed("PathList", "width: 1fr; height: 1fr; display: none;")
    EMPTY = "no vehicle was heard yet"

    def header(self, width: int) -> Line:
        """Return the column titles."""
        numbers = f"{'LOSS %':>6} {'UP %':>5} {'RTT MS':>6} {'AGE':>5} {'DUP':>5}"
        return [(f"  {'VEH':>4} {'USE':<4} {numbers} {'SIGNING':<{SIGNING_CELLS}} LINK", Ink.MUTED)]

    def row_line(self, row: PathRow, width: int, *, is_chosen: bool) -> Line:
        """Return a path as a line; one that loses much, is silent or not accepted has a mark."""
        use = "yes" if row.in_use else "ok" if row.state == "used" else "NO"
        up = "--" if math.isnan(row.up_loss_pct) else f"{row.up_loss_pct:.1f}"
        rtt = "--" if math.isnan(row.rtt_s) else f"{1000 * row.rtt_s:.0f}"
        numbers = f"{row.loss_pct:>6.1f} {up:>5} {rtt:>6} {age_words(row.heard_age_s):>5} {row.duplicates:>5}"
        bad = is_bad(row)
        signing = cut(row.signing.removeprefix("signed, "), SIGNING_CELLS)
        text = f" {'!' if bad else ' '}{row.vehicle:>4} {use:<4} {numbers} {signing} {row.link}"
        return marked(text, width, is_chosen=is_chosen, is_bad=bad)


class PartnerList(RowsView[PartnerRow]):
    """A line for each forwarding partner."""

    DEFAULT_CSS = framed("PartnerList", "width: 1fr; height: 1fr; display: none;")
    EMPTY = "nothing is forwarded: + adds another station"

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"  {'ENDPOINT':<{LINK_CELLS}} {'COMMANDS':<9} {'REFUSED':>7} {'AGE':>5} PARTNER", Ink.MUTED)]

    def row_line(self, row: PartnerRow, width: int, *, is_chosen: bool) -> Line:
        """Return a partner as a line; one with refused frames has a mark."""
        refused = sum(row.refused.values())
        commands = "judged" if row.takes_commands else "none"
        who = f"{row.address} {' '.join(row.systems)}" if row.address else others_words(row)
        age = age_words(row.heard_age_s) if row.address else ""
        text = (
            f" {'!' if refused or not row.up else ' '}{cut(row.endpoint, LINK_CELLS)} {commands:<9} {refused:>7}"
            f" {age:>5} {row.error or who}"
        )
        return marked(text, width, is_chosen=is_chosen, is_bad=bool(refused) or not row.up)


def others_words(row: PartnerRow) -> str:
    """Return what a row without an address is about."""
    return "others, or gone" if row.refused or row.passed else "nobody yet"


def marked(text: str, width: int, *, is_chosen: bool, is_bad: bool) -> Line:
    """Return a row in the ink of its state."""
    if is_chosen:
        return [(cut(text, width), Ink.SELECTED_CAUTION if is_bad else Ink.SELECTED)]
    return [(text, Ink.CAUTION if is_bad else Ink.TEXT)]


def is_bad(path: PathRow) -> bool:
    """Return whether a path is silent, not accepted, or loses much."""
    return path.heard_age_s > OLD_S or path.state != "used" or max(path.loss_pct, path.up_loss_pct) >= MUCH_LOSS_PCT


def bytes_words(per_s: float) -> str:
    """Return bytes per second with few digits."""
    return "--" if math.isnan(per_s) else f"{per_s:.0f}" if per_s < 100_000 else f"{per_s / 1000:.0f}k"


def radio_words(link: WatchedLink) -> str:
    """Return the radio's report in few cells; "" without a radio."""
    radio = link.row.radio
    return "" if radio is None else f"{radio.rssi}/{radio.remote_rssi} buf {radio.txbuf_pct}%"
