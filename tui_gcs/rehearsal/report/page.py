"""The report of a flight: gates, pictures, numbers and events in one HTML file."""

import math
from collections.abc import Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from tui_gcs.core.geometry.zones import bounds, outline_m
from tui_gcs.core.judging.flight_result import FlightResult, RoundResult
from tui_gcs.core.judging.result_check import ResultCheck
from tui_gcs.core.protocol.common import JournalEvent
from tui_gcs.core.protocol.metric_names import all_words, seen_pct
from tui_gcs.rehearsal.report.flight_recording import FlightRecord, RoundRecord, ZoneRecord
from tui_gcs.rehearsal.report.html_table import number, table
from tui_gcs.rehearsal.report.maps import flown_map, mission_figure
from tui_gcs.rehearsal.report.metric_charts import metric_charts, single_events
from tui_gcs.rehearsal.report.svg import COLOURS, NEVER, SCALE, ChartLine, SvgMap, chart, legend

CSS = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #1c2126; }
h1 { font-size: 1.6rem; margin-bottom: 0; }
h2 { font-size: 1.2rem; margin-top: 2.2rem; border-bottom: 1px solid #ccd2d8; }
h3 { font-size: 1rem; margin: 1.4rem 0 .3rem; } .sub { color: #5a646e; margin-top: .2rem; }
table { border-collapse: collapse; width: 100%; font-size: 14px; } th, td { text-align: left; padding: .2rem .6rem; }
th { border-bottom: 2px solid #1c2126; } td { border-bottom: 1px solid #e4e8ec; } td.n, th.n { text-align: right; }
.ok { color: #00704a; font-weight: 600; } .bad { color: #b00020; font-weight: 700; }
.verdict { font-size: 1.15rem; padding: .6rem 1rem; border-radius: 6px; margin: 1rem 0; }
.verdict.ok { background: #e3f4ec; } .verdict.bad { background: #fde7ea; }
svg { width: 100%; height: auto; background: #fbfcfd; border: 1px solid #e0e5ea; }
svg text { font-size: 12px; fill: #3a444e; } svg .grid { stroke: #e4e8ec; }
svg .mark { stroke: #b00020; stroke-dasharray: 3 3; } svg .note { fill: #b00020; font-size: 11px; }
.legend span { margin-right: 1.1rem; white-space: nowrap; }
.legend i { display: inline-block; width: .9rem; height: .9rem; margin-right: .35rem; vertical-align: -2px; }
.two { display: grid; grid-template-columns: 1fr 1fr; gap: 1rem; }
.rounds { display: grid; grid-template-columns: repeat(auto-fit, minmax(17rem, 1fr)); gap: 1rem; }
figure { margin: 0; } figcaption { font-size: 14px; color: #3a444e; }
@media (max-width: 46rem) { .two { grid-template-columns: 1fr; } }
"""


def page(
    record: FlightRecord,
    result: FlightResult,
    problem: str,
    *,
    conditions: Sequence[tuple[str, str]],
    happened: Sequence[tuple[float, str]],
) -> str:
    """Return the report. `conditions` are (name, value) of how it was flown, `happened` (mission time, fault)."""
    failed = [check for check in result.checks if not check.ok]
    good = not failed and not problem
    verdict = "Every gate holds." if good else f"{len(failed)} of {len(result.checks)} gates do not hold."
    if problem:
        verdict += f" The flight ended early: {problem}."
    body = [
        f"<h1>{escape(result.scenario)}</h1>",
        f'<p class="sub">Rehearsal on simulated vehicles, seed {result.seed}. tui-gcs {escape(_version())}.</p>',
        f'<p class="verdict {"ok" if good else "bad"}">{escape(verdict)}</p>',
        f'<p class="verdict bad">{escape(result.incomplete)}</p>' if result.incomplete else "",
        _conditions(conditions, happened),
        "<h2>The mission</h2>",
        mission_figure(record),
        "<h2>Gates</h2>",
        _checks(sorted(result.checks, key=lambda check: check.ok)),
        *(_round(record, one, result, happened) for one in record.rounds),
        _intruders(result),
        single_events(result),
        "<h2>Separation</h2>",
        _separation(record, happened),
        "<h2>Events</h2>",
        _events(record.events, record.begin_s, record.events_left_out),
    ]
    title = escape(f"{result.scenario}: rehearsal")
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{CSS}</style></head>'
        f"<body>{''.join(body)}</body></html>\n"
    )


def _version() -> str:
    try:
        return version("tui-gcs")
    except PackageNotFoundError:
        return "not installed"


def _conditions(conditions: Sequence[tuple[str, str]], happened: Sequence[tuple[float, str]]) -> str:
    rows = [(name, value) for name, value in conditions if value]
    rows += [(f"T+{t_s:.0f} s", what) for t_s, what in happened]
    return table(("flown with", ""), [(escape(a), escape(b)) for a, b in rows]) if rows else ""


def _checks(checks: Sequence[ResultCheck]) -> str:
    rows = []
    for check in checks:
        mark = '<span class="ok">holds</span>' if check.ok else '<span class="bad">FAILS</span>'
        name = escape(check.name) + (f'<br><span class="sub">{escape(check.why)}</span>' if check.why else "")
        rows.append((mark, name, number(check.value), number(check.limit)))
    return table(("", "what", "value", "limit"), rows, numbers=2)


def _round(record: FlightRecord, one: RoundRecord, result: FlightResult, happened: Sequence[tuple[float, str]]) -> str:
    rounds = [r for r in result.rounds if r.round == one.round.name or r.round.startswith(f"{one.round.name} ")]
    last_s = max((t for zone in one.zones for t in zone.times_s), default=0.0)
    begin_s = one.begin_s - record.begin_s
    marks = [(t, what) for t, what in happened if begin_s <= t <= last_s]
    lines = []
    for index, zone in enumerate(one.zones):
        colour = COLOURS[index % len(COLOURS)]
        name = zone.zone.name
        lines.append(ChartLine(f"{name}: longest unseen", zone.times_s, zone.worst_now_s, colour))
        lines.append(ChartLine(f"{name}: average", zone.times_s, zone.average_now_s, colour, dashed=True))
    return "".join(
        [
            f"<h2>{escape(one.round.name)}</h2>",
            _measured(rounds),
            _counted(one),
            "<h3>Tours and flown paths</h3>",
            str(flown_map(record.scenario, one)),
            legend([(f"vehicle {v}", COLOURS[i % len(COLOURS)]) for i, v in enumerate(sorted(one.paths_m))]),
            "<h3>Idleness over time</h3>",
            chart("idleness over time", lines, unit="s", marks=marks),
            "<h3>The longest that each place was unseen</h3>",
            '<div class="two">',
            *(_heat(zone) for zone in one.zones),
            "</div>",
            metric_charts(one.round.name, result),
        ]
    )


def _measured(rounds: Sequence[RoundResult]) -> str:
    rows = [
        (
            escape(f"{r.round} {r.zone}") + (" (cut short)" if r.cut_short else ""),
            f"{r.n} + {r.reserve} in reserve" if r.reserve else str(r.n),
            number(r.on_slot_after_s),
            f"{seen_pct(r.coverage):.1f}",
            number(r.worst_idleness_s),
            number(r.avg_idleness_s),
            number(r.p99_idleness_s),
            number(r.ideal_s),
            number(r.bound_s),
            number(r.ratio),
            number(r.off_slot_max_m),
        )
        for r in rounds
    ]
    head = (
        "",
        "n",
        "on slot s",
        "covered %",
        "worst s",
        "average s",
        "99 % of area s",
        "ideal s",
        "bound s",
        "worst / ideal",
        "off slot m",
    )
    return table(head, rows, numbers=1)


def _counted(one: RoundRecord) -> str:
    """Return the table of the planners' own metrics."""
    rows = [
        (escape(zone.team), escape(zone.zone.name), escape("; ".join(all_words(zone.metrics))))
        for zone in one.zones
        if zone.metrics
    ]
    return table(("team", "zone", "what its planner counted last"), rows) if rows else ""


def _intruders(result: FlightResult) -> str:
    if not result.intruders:
        return ""
    rows = [
        (escape(f"{r.round} {r.zone}"), str(r.came), str(r.met), str(r.under_way), number(r.nearest_m))
        for r in result.intruders
    ]
    head = ("", "came", "countered before the zone", "still on their way", "nearest to the zone m")
    return "<h2>Intruders</h2>" + table(head, rows, numbers=1)


def _heat(zone: ZoneRecord) -> str:
    seen = zone.worst_s[np.isfinite(zone.worst_s)]
    most_s = float(seen.max()) if seen.size and seen.max() > 0 else 1.0
    x0, y0, x1, y1 = bounds(zone.zone.shape)
    picture = SvgMap(f"heat map of {zone.zone.name}", (x0 - 5, y0 - 5), (x1 + 5, y1 + 5), width=370)
    picture.cells(zone.cells_m, zone.cell_m, zone.worst_s, most_s)
    picture.polygon(outline_m(zone.zone.shape), 'fill="none" stroke="#1c2126"')
    steps = [(f"to {most_s * (i + 1) / len(SCALE):.0f} s", colour) for i, colour in enumerate(SCALE)]
    if np.isinf(zone.worst_s).any():  # how long the others were unseen was not measured either
        steps = [("seen", SCALE[0]), ("never seen", NEVER)]
    ideal = f"ideal of {zone.serving} {zone.ideal_s:.1f} s" if zone.serving > 0 else "no vehicle flew"
    return f"<div><p>{escape(zone.zone.name)}, {ideal}</p>{picture}{legend(steps)}</div>"


def _separation(record: FlightRecord, happened: Sequence[tuple[float, str]]) -> str:
    times = [t for t, _ in record.separation]
    values = [min(value, 10.0) if math.isfinite(value) else math.nan for _, value in record.separation]
    if not times:
        return "<p>Nothing was in the air.</p>"
    lines = [
        ChartLine("nearest pair, in limits (10 and more is 10)", times, values, COLOURS[0]),
        ChartLine("limit", [times[0], times[-1]], [1.0, 1.0], "#b00020", dashed=True),
    ]
    return chart("separation", lines, unit="x limit", marks=happened)


def _events(events: Sequence[JournalEvent], begin_s: float, left_out: int) -> str:
    """Return the table of events. Those before the start are folded: links and vehicles come up before every flight."""
    rows = [
        (f"{event.t_s - begin_s:+.1f}", escape(event.source), escape(str(event.cls)), escape(event.text))
        for event in events
    ]
    head = ("T s", "who", "class", "what")
    before = sum(event.t_s < begin_s for event in events)
    closed = f"<details><summary>{before} before the start</summary>{table(head, rows[:before])}</details>"
    more = f"<p>{left_out} more are in the journal.</p>" if left_out else ""
    return (closed if before else "") + table(head, rows[before:]) + more
