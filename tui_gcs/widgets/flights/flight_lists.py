"""The list of recorded flights, what happened in one of them, and the panel below."""

import math
import time
from collections.abc import Sequence
from pathlib import Path

from tui_gcs.core.base.text import clean
from tui_gcs.core.judging.flight_timeline import FlightTimeline, TimelineEntry
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.records.flight_archive import RecordedFlight, utc_time
from tui_gcs.core.records.onboard_logs import EARLIEST_WALL_S
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.event_lines import severity_mark
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import UNKNOWN, clock, ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

IDS_CELLS, SOURCE_CELLS = 9, 11


class FlightList(RowsView[RecordedFlight]):
    """A line for each recording; one with a grave alarm or a failed rehearsal has a mark."""

    DEFAULT_CSS = framed("FlightList", "width: 1fr; height: 1fr;")

    def __init__(self, **options: object) -> None:
        """Begin without recordings."""
        super().__init__(**options)
        self.marked: frozenset[Path] = frozenset()
        """Recordings that the plots are for."""

    def header(self, width: int) -> Line:
        """Return the column titles."""
        head = f"  {'WHEN (UTC)':<16} {'OF':<{SOURCE_CELLS}} {'LENGTH':>7} {'SIZE':>6} {'VEHICLES':<{IDS_CELLS}}"
        return [(f"{head} SCENARIO RESULT ALARM", Ink.MUTED)]

    def row_line(self, row: RecordedFlight, width: int, *, is_chosen: bool) -> Line:
        """Return a recording as a line."""
        mark = severity_mark(row.worst_severity)[0] if row.worst_alarm else " "
        mark = "!" if row.result.startswith("FAILED") else mark
        chosen = "*" if row.path in self.marked else " "
        text = (
            f"{chosen}{mark}{utc_time(when_s(row)):<16} {cut(row.source, SOURCE_CELLS):<{SOURCE_CELLS}}"
            f" {length_words(row.length_s):>7} {size_words(row.size_bytes):>6}"
            f" {cut(ids(row.vehicles) or UNKNOWN, IDS_CELLS):<{IDS_CELLS}} {remark(row)}"
        )
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED if mark == " " else Ink.SELECTED_CAUTION)]
        usual = Ink.BOLD if row.path in self.marked else Ink.TEXT
        return [(cut(text, width), usual if mark == " " else Ink.CAUTION)]


class TimelineList(RowsView[TimelineEntry]):
    """A line for each thing that happened, with the time since the beginning."""

    DEFAULT_CSS = framed("TimelineList", "width: 1fr; height: 1fr; display: none;")
    first_wall_s = 0.0

    def row_line(self, row: TimelineEntry, width: int, *, is_chosen: bool) -> Line:
        """Return an entry as a line."""
        mark, ink = severity_mark(row.severity)
        at = clock(row.wall_s - self.first_wall_s).removeprefix("T+")
        text = cut(f"{mark}{at:>8}  {cut(row.source, 13):<13} {row.text}", width)
        if is_chosen:
            return [(text, Ink.SELECTED if row.severity > WARNING else Ink.SELECTED_CAUTION)]
        return [(text, ink)]


class FlightPanel(LinesView):
    """The chosen recording whole, and what became of the last key."""

    DEFAULT_CSS = framed("FlightPanel", "height: 8;")

    _flight: RecordedFlight | None = None
    _timeline: FlightTimeline | None = None
    _outcome: Sequence[Run] = ()
    _entry: TimelineEntry | None = None

    def show(
        self,
        flight: RecordedFlight | None,
        timeline: FlightTimeline | None,
        outcome: Sequence[Run],
        entry: TimelineEntry | None = None,
    ) -> None:
        """Show this recording; with its `timeline` the chosen entry whole and the summary.

        `outcome` are lines about the last key.
        """
        self._flight, self._timeline, self._outcome, self._entry = flight, timeline, outcome, entry
        set_title(self, clean(flight.path.name, 60) if flight is not None else "no flight")
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        outcome: list[Line] = [[(part, ink)] for text, ink in self._outcome for part in wrapped(text, width)]
        body: list[Line] = []
        if self._timeline is not None:
            whole = entry_words(self._entry) if self._entry is not None else ""
            body = [[(part, Ink.BOLD)] for part in wrapped(whole, width)] if whole else []
            body += [[(cut(clean(line, 400), width), Ink.TEXT)] for line in self._timeline.summary]
        elif self._flight is not None:
            body = [[(part, ink)] for text, ink in flight_texts(self._flight) for part in wrapped(text, width)]
        return [*body[: max(0, height - len(outcome))], *outcome]


def entry_words(entry: TimelineEntry) -> str:
    """Return an entry whole, with the time of day, which plots and replay show; none where a log has no such time."""
    is_known = entry.wall_s >= EARLIEST_WALL_S
    at = f"{time.strftime('%H:%M:%S', time.gmtime(entry.wall_s))} UTC  " if is_known else ""
    return f"{at}{clean(entry.source, 60)}: {clean(entry.text, 400)}"


def flight_texts(flight: RecordedFlight) -> list[Run]:
    """Return what is known of a recording without reading it."""
    texts: list[Run] = [(clean(str(flight.path), 400), Ink.BOLD)]
    began = f", began {utc_time(flight.began_wall_s)} UTC" if math.isfinite(flight.began_wall_s) else ""
    texts.append((f"{flight.what}, {flight.source}{began}, {flight.size_bytes} bytes", Ink.TEXT))
    if flight.result:
        texts.append((f"rehearsal {flight.result}", Ink.CAUTION if flight.result.startswith("FAILED") else Ink.TEXT))
    if flight.worst_alarm:
        texts.append((f"worst alarm: {flight.worst_alarm}", Ink.CAUTION))
    if flight.report:
        texts.append((f"report: {clean(flight.report, 300)}", Ink.TEXT))
    return texts


def when_s(flight: RecordedFlight) -> float:
    """When a recording was made: a rehearsal has a simulated clock, so the time of its file counts."""
    is_of_a_day = flight.source in ("LIVE", "SIM", "file") or flight.is_vehicle_log
    return flight.began_wall_s if is_of_a_day and math.isfinite(flight.began_wall_s) else flight.changed_wall_s


def remark(flight: RecordedFlight) -> str:
    """Scenario, result and worst alarm in one line."""
    return "   ".join(clean(part, 120) for part in (flight.scenario, flight.result, flight.worst_alarm) if part)


def length_words(length_s: float) -> str:
    """A length as `12:05` or `1:02:05`; `--` if it is not known."""
    return clock(length_s).removeprefix("T+") if math.isfinite(length_s) else UNKNOWN


def size_words(size_bytes: float) -> str:
    """A size in kB or MB of at most six cells."""
    if size_bytes < 999_500:
        return f"{size_bytes / 1e3:.0f} kB"
    return f"{size_bytes / 1e6:.1f} MB" if size_bytes < 9_950_000 else f"{size_bytes / 1e6:.0f} MB"
