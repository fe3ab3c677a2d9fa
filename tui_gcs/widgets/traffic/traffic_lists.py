"""The lists of the traffic screen, and the panel of the chosen row."""

import math
from collections.abc import Sequence

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.points import PointOfInterest
from tui_gcs.feed.traffic.contacts import Contact
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import number
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

NAME_CELLS, KIND_CELLS, POINT_CELLS = 12, 9, 20


class ContactList(RowsView[Contact]):
    """A line for each contact; one that is near, or will be, has a mark."""

    DEFAULT_CSS = framed("ContactList", "width: 1fr; height: 1fr;")
    EMPTY = "nothing is detected or received beside the fleet; R: have selected vehicles report ADS-B"

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [
            (f"  {'WHAT':<12} {'BY':<9} {'VEH':>4} {'DIST':>7} {'BRG':>4} {'ABOVE':>6} {'AGE':>4}  CLOSEST", Ink.MUTED)
        ]

    def row_line(self, row: Contact, width: int, *, is_chosen: bool) -> Line:
        """Return a contact as a line."""
        seen = row.seen
        mark = "^" if row.is_near else " "
        bearing = f"{row.bearing_deg:03.0f}" if row.bearing_deg == row.bearing_deg else "--"
        text = (
            f" {mark}{cut(seen.name, NAME_CELLS)} {cut(seen.kind, KIND_CELLS)} {row.nearest or '--':>4}"
            f" {distance_words(row.distance_m):>7} {bearing:>4} {height_words(row.above_m):>6}"
            f" {number(seen.age_s):>4}  {approach_words(row)}{'' if seen.is_real else '  simulated'}"
        )
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED_CAUTION if row.is_near else Ink.SELECTED)]
        return [(text, Ink.CAUTION if row.is_near else Ink.TEXT if seen.is_real else Ink.MUTED)]


class PointList(RowsView[PointOfInterest]):
    """A line for each point of interest, the open ones first."""

    DEFAULT_CSS = framed("PointList", "width: 1fr; height: 1fr; display: none;")
    EMPTY = "no task for planners yet: + adds one at the map's cursor, a place or a vehicle"

    now_s = math.nan
    """Station time."""

    def header(self, width: int) -> Line:
        """Return the column titles."""
        titles = f"{'TASK':<{POINT_CELLS}} {'STATE':<9} {'LEFT':>6} {'PRIO':>5} {'EAST':>7} {'NORTH':>7}  TEAM"
        return [(f"  {titles}", Ink.MUTED)]

    def row_line(self, row: PointOfInterest, width: int, *, is_chosen: bool) -> Line:
        """Return a point as a line."""
        is_open = row.state == "open"
        left = number(row.due_s - self.now_s) if is_open and math.isfinite(row.due_s) else ""
        by = f"  by v{row.vehicle}" if row.vehicle else ""
        text = (
            f"  {cut(clean(row.name), POINT_CELLS)} {row.state:<9} {left:>6} {row.priority:>5g}"
            f" {row.place_m[0]:>7.0f} {row.place_m[1]:>7.0f}  {clean(row.team) or 'any'}{by}"
        )
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED)]
        return [(text, Ink.TEXT if is_open else Ink.CAUTION if row.state == "missed" else Ink.MUTED)]


class TrafficPanel(LinesView):
    """The chosen row whole, and what became of the last key."""

    DEFAULT_CSS = framed("TrafficPanel", "height: 7;")

    _row: Contact | PointOfInterest | None = None
    _outcome: Sequence[Run] = ()

    def show(self, row: Contact | PointOfInterest | None, outcome: Sequence[Run]) -> None:
        """Show this row, and the lines of the last key."""
        self._row, self._outcome = row, outcome
        name = row.seen.name if isinstance(row, Contact) else clean(row.name) if row is not None else "nothing"
        set_title(self, name)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        outcome: list[Line] = [[(part, ink)] for text, ink in self._outcome for part in wrapped(text, width)]
        row = self._row
        texts = contact_texts(row) if isinstance(row, Contact) else point_texts(row) if row is not None else []
        body: list[Line] = [[(part, ink)] for text, ink in texts for part in wrapped(text, width)]
        return [*body[: max(0, height - len(outcome))], *outcome]


def contact_texts(contact: Contact) -> list[Run]:
    """Return what is known of a contact, in sentences."""
    seen = contact.seen
    speed = math.hypot(*seen.velocity_m_s)
    moves = f", {speed:.0f} m/s" if speed == speed else ", speed not known"
    whose = f"seen by {vehicles_words(seen.seen_by)}" if seen.seen_by else "not seen now"
    texts: list[Run] = [(f"{seen.kind} {seen.name}: {whose}, {seen.age_s:.0f} s ago{moves}", Ink.BOLD)]
    if contact.nearest:
        height = f", {height_words(contact.above_m)} m to its height" if contact.above_m == contact.above_m else ""
        where = (
            f"{distance_words(contact.distance_m)} m at {contact.bearing_deg:03.0f} deg from vehicle {contact.nearest}"
        )
        texts.append((f"{where}{height or ', height not compared'}", Ink.TEXT))
    if contact.approach_of:
        texts.append((f"closest, if all fly straight on: {approach_words(contact)}", Ink.TEXT))
    return texts + ([(seen.note, Ink.MUTED)] if seen.note else [])


STATES = {
    "open": "open: a planner that takes tasks sends a vehicle there",
    "missed": "missed: no vehicle was there in time",
    "cancelled": "cancelled by an operator",
}


def point_texts(point: PointOfInterest) -> list[Run]:
    """Return what a task for planners is, and what has become of it."""
    east_m, north_m = point.place_m
    whose = f"for team {clean(point.team)}" if point.team else "for any team"
    done = f"done by vehicle {point.vehicle}: it was seen from there"
    return [
        (STATES.get(point.state, done), Ink.BOLD if point.state == "open" else Ink.TEXT),
        (f"{east_m:.0f} m east, {north_m:.0f} m north of the origin; priority {point.priority:g}; {whose}", Ink.TEXT),
    ]


def distance_words(metres: float) -> str:
    """Return metres in at most seven cells."""
    return number(metres) if not metres >= 1e7 else "far"


def height_words(metres: float) -> str:
    """Return a difference of heights with its sign."""
    return f"{metres:+.0f}" if metres == metres else "--"


def approach_words(contact: Contact) -> str:
    """Return the closest approach: distance, time and vehicle."""
    if not contact.approach_of:
        return "--"
    when = f"in {contact.approach_s:.0f} s" if contact.approach_s >= 1.0 else "now"
    return f"{distance_words(contact.approach_m)} m {when} (v{contact.approach_of})"
