"""The list of logs on vehicles: one line for each, with the progress or the end of its download."""

import math

from tui_gcs.core.protocol.services import LogRow, TaskInfo
from tui_gcs.core.records.flight_archive import utc_time
from tui_gcs.feed.task_requests import TaskOutcome
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import cut
from tui_gcs.widgets.flights.flight_lists import size_words

CANCELLED = "cancelled"
"""How the station reports the end of a task that an operator cancelled."""
LogLine = tuple[int, LogRow, bool, TaskInfo | None, TaskOutcome | None]
"""Vehicle, log, whether it is marked, the download under way, and the end of the last one."""


class VehicleLogList(RowsView[LogLine]):
    """A line for each log; a failed download has a mark."""

    DEFAULT_CSS = framed("VehicleLogList", "width: 1fr; height: 1fr;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        return [(f"    {'VEH':>4} {'LOG':>5} {'WHEN (UTC)':<16} {'SIZE':>7} DOWNLOAD", Ink.MUTED)]

    def row_line(self, row: LogLine, width: int, *, is_chosen: bool) -> Line:
        """Return a log as a line."""
        vehicle, log, marked, task, outcome = row
        failed = outcome is not None and not outcome.ok
        text = (
            f" {'!' if failed else ' '}{'*' if marked else ' '}{vehicle:>5} {log.id:>5}"
            f" {utc_time(log.time_utc or math.nan):<16} {size_words(log.size):>7}"
            f" {download_words(vehicle, task, outcome)}"
        )
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED_CAUTION if failed else Ink.SELECTED)]
        return [(cut(text, width), Ink.CAUTION if failed else Ink.BOLD if marked else Ink.TEXT)]

    def record(self, row: LogLine) -> Record:
        """Return vehicle, number, time, size and download of a log."""
        vehicle, log, _, task, outcome = row
        when = utc_time(log.time_utc or math.nan)
        download = download_words(vehicle, task, outcome)
        return {"vehicle": vehicle, "log": log.id, "time_utc": when, "size_bytes": log.size, "download": download}


def download_words(vehicle: int, task: TaskInfo | None, outcome: TaskOutcome | None) -> str:
    """How a download of a log of `vehicle` stands, or how the last one ended."""
    if task is not None:
        if task.state == "queued":
            # The row begins with the vehicle's number: repeated, it would cut off what the download waits for.
            first = task.text.removeprefix(f"vehicle {vehicle}: ")
            return f"waits for {first}" if first else "waits"
        share = f" {100 * task.done // task.total} %" if task.total > 0 else ""
        return f"{task.state}{share}  {task.text}".rstrip()
    if outcome is None:
        return ""
    if not outcome.ok:
        return outcome.text if outcome.text == CANCELLED else f"FAILED: {outcome.text}"
    return f"done: {outcome.result.path}" if outcome.result is not None and outcome.result.path else "done"
