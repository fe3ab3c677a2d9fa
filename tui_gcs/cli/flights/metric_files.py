"""Metrics and single events of a flight as CSV files, for spreadsheets and notebooks."""

from pathlib import Path

from tui_gcs.cli.result_table import written
from tui_gcs.core.formats.csv_table import csv_lines
from tui_gcs.core.judging.flight_result import FlightResult

METRIC_COLUMNS = ("round", "team", "metric", "unit", "t_s", "value")
EVENT_COLUMNS = ("t_s", "round", "kind", "subject", "vehicle", "text")


def write(path: str, result: FlightResult) -> bool:
    """Write both files, and return whether that succeeded; a failure is one line on stderr."""
    return written(path, metrics_csv(result).encode()) and written(str(events_path(path)), events_csv(result).encode())


def events_path(path: str) -> Path:
    """Return where single events are written: beside the metrics."""
    file = Path(path)
    return file.with_name(f"{file.stem}-events{file.suffix}")


def metrics_csv(result: FlightResult) -> str:
    """Return one line for each sample, seconds since its round began; no value where it was unknown."""
    rows = [
        (s.round, s.team, s.name, s.unit, t_s, "" if value is None else value)
        for s in result.metrics
        for t_s, value in zip(s.times_s, s.values, strict=True)
    ]
    return "".join(csv_lines(METRIC_COLUMNS, rows))


def events_csv(result: FlightResult) -> str:
    """Return one line for each event, seconds since the start of the flight."""
    rows = ((e.t_s, e.round, e.kind, e.subject, e.vehicle or "", e.text) for e in result.records)
    return "".join(csv_lines(EVENT_COLUMNS, rows))
