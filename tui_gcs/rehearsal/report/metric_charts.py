"""The planners' metrics over time as curves, and single events of a flight as a table."""

import math
from html import escape

from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.metric_log import MetricSeries
from tui_gcs.core.protocol.metric_names import metric_words
from tui_gcs.rehearsal.report.html_table import number, table
from tui_gcs.rehearsal.report.svg import COLOURS, ChartLine, chart

MAX_CHARTS = 24
"""Charts of one round; a file of metrics (`--metrics`) has them all."""


def metric_charts(round_: str, result: FlightResult) -> str:
    """Return a curve for each metric that changed in a round, one line a team, and a table of all of them."""
    found = [s for s in result.metrics if s.round == round_ or s.round.startswith(f"{round_} ")]
    if not found:
        return ""
    rows = [
        (escape(f"{s.round} {s.team}"), escape(s.name), *map(number, (s.last, s.mean, s.low, s.high))) for s in found
    ]
    head = ("", "metric", "last", "mean", "least", "most")
    charts, by_name = [], dict[str, list[MetricSeries]]()
    for series in found:
        if series.low is not None and series.low != series.high:
            by_name.setdefault(series.name, []).append(series)
    for name, several in list(by_name.items())[:MAX_CHARTS]:
        lines = [
            ChartLine(s.team, s.times_s, [math.nan if v is None else v for v in s.values], COLOURS[i % len(COLOURS)])
            for i, s in enumerate(several)
        ]
        unit = next((s.unit for s in several if s.unit), "")
        title = escape(metric_words(name, math.nan).removesuffix(" --"))
        charts.append(f"<figure>{chart(name, lines, unit=unit, marks=[])}<figcaption>{title}</figcaption></figure>")
    pictures = f'<div class="two">{"".join(charts)}</div>' if charts else ""
    return f"<h3>Metrics of the planners over time</h3>{pictures}{table(head, rows, numbers=2)}"


def single_events(result: FlightResult) -> str:
    """Return the table of what happened one by one: intruders met, tasks done; nothing without any."""
    if not result.records:
        return ""
    rows = [
        (f"{e.t_s:.1f}", escape(e.round), escape(e.kind), escape(e.subject), str(e.vehicle or ""), escape(e.text))
        for e in result.records
    ]
    return "<h2>One by one</h2>" + table(("T s", "round", "what", "which", "vehicle", ""), rows)
