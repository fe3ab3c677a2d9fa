"""The summary of a telemetry log as plain text, for a terminal or a pipe."""

import textwrap
from collections.abc import Iterator
from datetime import UTC, datetime

from tui_gcs.core.judging.extent import Extent
from tui_gcs.core.judging.tlog_summary import ArmedSpan, Summary, SystemSummary
from tui_gcs.core.mavlink.enum_names import severity_name

_HEADINGS = ("id", "kind", "autopilot", "type", "frames", "from s", "to s", "armed s", "modes", "texts")
# Columns of numbers, which are aligned to the right.
_RIGHT = frozenset({0, 4, 5, 6, 7, 8, 9})
_LABEL_WIDTH = 10
_NO_BREAK = "\u00a0"


def summary_text(summary: Summary, width: int = 100) -> str:
    """A table of all systems, then each system in detail. Times are seconds from the first frame."""
    duration_s = summary.last_wall_s - summary.first_wall_s
    lines = [
        f"{summary.path}: {summary.frames} frames of {len(summary.systems)} systems, "
        f"{duration_s:.1f} s from {_date(summary.first_wall_s)}",
        *(f"warning: {warning}" for warning in summary.warnings),
        "",
        *_table([_HEADINGS, *(_row(system, summary.first_wall_s) for system in summary.systems)]),
    ]
    for system in summary.systems:
        lines += ["", *_details(system, summary.first_wall_s, width)]
    return "\n".join(lines) + "\n"


def _row(system: SystemSummary, start_s: float) -> tuple[str, ...]:
    armed_s = sum(span.to_wall_s - span.from_wall_s for span in system.armed)
    return (
        str(system.system),
        system.kind,
        system.autopilot or "-",
        system.vehicle_type or "-",
        str(system.frames),
        f"{system.first_wall_s - start_s:.1f}",
        f"{system.last_wall_s - start_s:.1f}",
        f"{armed_s:.1f}" if system.armed else "-",
        str(len(system.modes) or "-"),
        str((len(system.texts) + system.texts_left_off) or "-"),
    )


def _table(rows: list[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        cells = (
            cell.rjust(size) if column in _RIGHT else cell.ljust(size)
            for column, (cell, size) in enumerate(zip(row, widths, strict=True))
        )
        yield "  ".join(cells).rstrip()


def _details(system: SystemSummary, start_s: float, width: int) -> Iterator[str]:
    kind = " ".join(part for part in (system.autopilot, system.vehicle_type) if part)
    components = ", ".join(str(number) for number in system.components)
    signed = f", {system.signed_frames} of {system.frames} frames signed" if system.signed_frames else ""
    yield f"{system.kind} {system.system}: {kind or 'no heartbeat'}, component {components}{signed}"
    yield from _labelled("messages", [f"{name} {n}" for name, n in system.messages.items()], width)
    if system.kind == "vehicle" or system.extent:
        yield from _labelled("extent", _extent(system.extent), width)
    if system.modes:
        modes = [f"{span.wall_s - start_s:.1f} s {span.mode}" for span in system.modes]
        yield from _labelled("modes", modes, width)
        yield from _labelled("armed", [_armed(span, start_s) for span in system.armed] or ["never"], width)
    for index, text in enumerate(system.texts):
        label = "texts" if index == 0 else ""
        line = f"{text.wall_s - start_s:7.1f} s  {severity_name(text.severity):9}  {text.text}"
        yield f"  {label:{_LABEL_WIDTH}}{line}"
    if system.texts_left_off:
        yield f"  {'':{_LABEL_WIDTH}}and {system.texts_left_off} more"


def _labelled(label: str, items: list[str], width: int) -> list[str]:
    """`items` behind a label, on as many lines as it takes; no item is broken."""
    unbroken = (item.replace(" ", _NO_BREAK) for item in items)
    lines = textwrap.wrap(
        ", ".join(unbroken),
        max(width, 40),
        initial_indent=f"  {label:{_LABEL_WIDTH}}",
        subsequent_indent=" " * (_LABEL_WIDTH + 2),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_NO_BREAK, " ") for line in lines]


def _extent(extent: Extent | None) -> list[str]:
    if extent is None:
        return ["no valid position"]
    parts = [
        f"lat {extent.lat_min_deg:.7f}…{extent.lat_max_deg:.7f}",
        f"lon {extent.lon_min_deg:.7f}…{extent.lon_max_deg:.7f}",
        f"{extent.alt_amsl_min_m:z.1f}…{extent.alt_amsl_max_m:z.1f} m AMSL",
    ]
    if extent.alt_rel_min_m is not None and extent.alt_rel_max_m is not None:
        parts.append(f"{extent.alt_rel_min_m:z.1f}…{extent.alt_rel_max_m:z.1f} m above home")
    return [*parts, f"{extent.positions} valid positions"]


def _armed(span: ArmedSpan, start_s: float) -> str:
    until = "" if span.ended else ", still armed at the end"
    return f"{span.from_wall_s - start_s:.1f}…{span.to_wall_s - start_s:.1f} s{until}"


def _date(wall_s: float) -> str:
    try:
        return f"{datetime.fromtimestamp(wall_s, UTC):%Y-%m-%d %H:%M:%S} UTC"
    except (OverflowError, ValueError, OSError):  # a damaged clock
        return f"Unix time {wall_s:.0f} s"
