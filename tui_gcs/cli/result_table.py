"""The result of a flight as a table and as a document."""

import argparse
import sys
import textwrap
from pathlib import Path

import msgspec

from tui_gcs.cli.command_report import CommandReport
from tui_gcs.cli.exit_codes import ReportCode
from tui_gcs.core.base.text import clean
from tui_gcs.core.judging.flight_result import FlightResult, RoundResult
from tui_gcs.core.protocol.metric_names import seen_pct

NAME_WIDTH = 9
WHY_CHARS = 300
"""A longer reason of a check is cut in the table; files have it whole."""


def show(arguments: argparse.Namespace, result: FlightResult, problem: str) -> None:
    """Print the table, unless `--json` asks for a document instead."""
    if not arguments.json:
        sys.stdout.write(table(result))
        sys.stdout.flush()
    if problem:
        sys.stderr.write(f"tui-gcs: the flight ended early: {problem}\n")


def document(result: FlightResult, problem: str) -> CommandReport:
    """Return the result for scripts: its fields are the document's `data`."""
    ok = result.ok and not problem
    text = f"the flight ended early: {problem}" if problem else _held(result)
    return CommandReport(ok, ReportCode.NONE if ok else ReportCode.FAILED, text, msgspec.structs.asdict(result))


def written(path: str, data: bytes) -> bool:
    """Write a file after a flight, and return whether that succeeded; a failure is one line on stderr."""
    try:
        Path(path).write_bytes(data)
    except OSError as error:
        sys.stderr.write(f"tui-gcs: {path}: cannot be written ({error.strerror}); the result is as printed above\n")
        return False
    return True


def table(result: FlightResult) -> str:
    """Return the result as a table of 80 columns."""
    lines = [
        f"{result.scenario}  seed {result.seed}",
        "",
        _row(("", "", "", "n"), ("on", "cover", "worst", "avg", "ideal"), ("ratio", "off", "slot")),
        _row(("round", "zone", "role", ""), ("slot s", "%", "s", "s", "s"), ("", "p95 m", "max m")),
    ]
    for r in result.rounds:
        cover, ideal = f"{seen_pct(r.coverage):.1f}", _number(r.ideal_s)
        idle = (_number(r.on_slot_after_s, 1), cover, _number(r.worst_idleness_s), _number(r.avg_idleness_s), ideal)
        off = (_number(r.ratio), _number(r.off_slot_p95_m), _number(r.off_slot_max_m))
        if len(r.round) > NAME_WIDTH:  # as rehearsals call what follows a loss: whole, on a line of its own
            lines.append(r.round[:80])
        name = r.round if len(r.round) <= NAME_WIDTH else ""
        lines.append(_row((name, r.zone, r.role, str(r.n)), idle, off))
        if r.reserve:
            lines.append(f"{'':10}and {r.reserve} in reserve: ideal and ratio are of the {r.n} that fly")
        lines += [f"{'':10}{text}"[:80] for text in _remarks(r)]
    lines += _covered(result) + _intruders(result) + _metrics(result)
    lines += ["", f"{'check':<57}{'value':>10}{'limit':>10}"]
    last_why = ""
    for check in result.checks:
        mark = "ok  " if check.ok else "FAIL"
        lines.append(f"{mark} {check.name:<52.52}{_number(check.value):>10}{_number(check.limit):>10}")
        if check.why and check.why != last_why:
            why = clean(check.why, WHY_CHARS)
            lines += textwrap.wrap(why, 80, initial_indent="     -- ", subsequent_indent=" " * 8)
            last_why = check.why
    lines += ["", _held(result), *filter(None, [result.incomplete]), ""]
    return "\n".join(lines)


def _held(result: FlightResult) -> str:
    return f"{sum(check.ok for check in result.checks)} of {len(result.checks)} checks hold"


def _remarks(r: RoundResult) -> list[str]:
    """Return what else is to be known of one zone: percentile and bound, cells that were not or cannot be seen."""
    remarks = []
    if r.p99_idleness_s is not None and r.bound_s is not None:
        remarks.append(f"99 % of it every {r.p99_idleness_s:.2f} s; no plan is under {r.bound_s:.2f} s (bound)")
    if r.unseen:
        remarks.append(f"{r.unseen}: worst and average count them")
    return remarks + [f"cannot be seen: {part.area_m2:.0f} m2 {part.why}" for part in r.unreachable]


MAX_METRIC_LINES = 40
"""More lines of metrics are left out of the table; files have them all."""


def _covered(result: FlightResult) -> list[str]:
    """Return a line for each zone that was to be seen once."""
    lines = []
    for r in result.rounds:
        if r.judged_by == "coverage":
            when = "not seen whole" if r.covered_s is None else f"seen whole after {r.covered_s:.1f} s"
            lines.append(f"{r.round} {r.zone}: {when}, least time {_number(r.cover_bound_s, 1)} s"[:80])
    return ["", *lines] if lines else []


def _metrics(result: FlightResult) -> list[str]:
    """Return a line for each metric of a planner that is judged by its own: its last value, its mean and its range."""
    own = {(r.round, r.team) for r in result.rounds if r.judged_by == "metrics"}
    shown = [s for s in result.metrics if (s.round, s.team) in own]
    if not shown:
        return []
    lines = ["", f"{'metric':<40}{'last':>10}{'mean':>10}{'least':>10}{'most':>10}"]
    for s in shown[:MAX_METRIC_LINES]:
        name = f"{s.round} {s.team}: {s.name}" + (f", {s.unit}" if s.unit else "")
        numbers = "".join(f"{_number(value):>10}" for value in (s.last, s.mean, s.low, s.high))
        lines.append(f"{clean(name):<40.40}{numbers}")
    if len(shown) > MAX_METRIC_LINES:
        lines.append(f"and {len(shown) - MAX_METRIC_LINES} more: --metrics FILE.csv writes them all")
    return lines


def _intruders(result: FlightResult) -> list[str]:
    """Return the lines about intruders: how many were met and how many came in; none for a flight without any."""
    lines = [""] if result.intruders else []
    for r in result.intruders:
        left = f", {r.under_way} still on their way" if r.under_way else ""
        lines.append(f"intruders, {r.round} {r.zone}:"[:80])
        lines.append(f"  {r.met} of {r.came} countered before the zone{left};")
        near = "none came near" if r.nearest_m is None else f"the nearest came to {r.nearest_m:.1f} m of the zone"
        lines.append(f"  {'at least one was in the zone' if r.nearest_m == 0.0 else near}")
    return lines


def _row(zone_words: tuple[str, str, str, str], idle: tuple[str, ...], off: tuple[str, str, str]) -> str:
    name, zone, role, count = zone_words
    numbers = "".join(f"{text:>7}" for text in idle)
    return f"{name:<10.10}{zone:<7.7} {role:<7.7}{count:>2}{numbers}{off[0]:>6}{off[1]:>6}{off[2]:>6}".rstrip()


def _number(value: float | None, digits: int = 2) -> str:
    return "--" if value is None else f"{value:.{digits}f}"
