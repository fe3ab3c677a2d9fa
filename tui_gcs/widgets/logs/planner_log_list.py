"""The lines of the planner log, and the chosen one in whole."""

import time
from collections.abc import Sequence

from tui_gcs.core.protocol.planner_log import PlannerLogLevel, PlannerLogLine
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

TEAM_CELLS, PLANNER_CELLS, LEVEL_CELLS = 10, 12, 8
WIDE_CELLS = 100
"""From this width on a line has its planner and its day."""
INKS = {
    PlannerLogLevel.CRITICAL: Ink.WARNING,
    PlannerLogLevel.ERROR: Ink.WARNING,
    PlannerLogLevel.WARNING: Ink.CAUTION,
    PlannerLogLevel.STDERR: Ink.CAUTION,
    PlannerLogLevel.STATION: Ink.BOLD,
    PlannerLogLevel.EVENT: Ink.BOLD,
    PlannerLogLevel.DEBUG: Ink.MUTED,
}


class PlannerLogList(RowsView[PlannerLogLine]):
    """A line for each line of the log, the newest at the bottom."""

    DEFAULT_CSS = framed("PlannerLogList", "width: 1fr; height: 1fr;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        time_cells, planner = (14, f"{'PLANNER':<{PLANNER_CELLS}} ") if width >= WIDE_CELLS else (8, "")
        return [
            (f" {'UTC':<{time_cells}} {'TEAM':<{TEAM_CELLS}} {planner}{'LEVEL':<{LEVEL_CELLS}} TEXT", Ink.MUTED),
        ]

    def row_line(self, row: PlannerLogLine, width: int, *, is_chosen: bool) -> Line:
        """Return a line of the log as far as there is room."""
        is_wide = width >= WIDE_CELLS
        planner = f"{cut(row.planner, PLANNER_CELLS)} " if is_wide else ""
        when = time_words(row.wall_s, "%m-%d %H:%M:%S" if is_wide else "%H:%M:%S")
        head = f" {when} {cut(row.team, TEAM_CELLS)} {planner}"
        text = f"{row.level:<{LEVEL_CELLS}} {row.text}"
        if is_chosen:
            return [(cut(head + text, width), Ink.SELECTED)]
        return [(head, Ink.MUTED), (text, INKS.get(row.level, Ink.TEXT))]

    def record(self, row: PlannerLogLine) -> Record:
        """Return the values of a line by their titles, for the clipboard."""
        when = time_words(row.wall_s, "%Y-%m-%dT%H:%M:%SZ")
        return {"utc": when, "team": row.team, "planner": row.planner, "level": row.level, "text": row.text}


class PlannerLogPanel(LinesView):
    """The chosen line in whole, and where the log is on disk or what became of the last key."""

    DEFAULT_CSS = framed("PlannerLogPanel", "height: 6;")

    _row: PlannerLogLine | None = None
    _report: Sequence[Run] = ()

    def show(self, row: PlannerLogLine | None, report: Sequence[Run]) -> None:
        """Show this line, and the lines of the last key."""
        self._row, self._report = row, report
        title = "line"
        if row is not None:
            title = f"{time_words(row.wall_s, '%Y-%m-%d %H:%M:%S')} UTC   {row.team}   {row.planner}   {row.level}"
        set_title(self, title)
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        report: list[Line] = [[(part, ink)] for text, ink in self._report for part in wrapped(text, width, 2)]
        room = max(0, height - len(report))
        text = wrapped(self._row.text, width, max(1, room)) if self._row is not None else []
        ink = INKS.get(self._row.level, Ink.TEXT) if self._row is not None else Ink.TEXT
        return [*([(part, ink)] for part in text[:room]), *report]


def time_words(wall_s: float, form: str) -> str:
    """Return a UTC time in this form of `strftime`; dashes for one that no calendar has."""
    try:
        return time.strftime(form, time.gmtime(wall_s))
    except (OverflowError, ValueError, OSError):
        return "--:--:--"
