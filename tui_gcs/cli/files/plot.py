"""`tui-gcs plot`: values of recorded flights over time, on a screen or as text."""

import argparse
import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tui_gcs.actions.replay_times import DAY_S, ReplayTimeError, since_beginning_s
from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.console import operators_theme, stations_beside
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.files.file_access import MAX_CELLS
from tui_gcs.core.base.directories import state_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.records.flight_series import FlightSeries
from tui_gcs.core.records.onboard_logs import OnboardLogError
from tui_gcs.core.records.onboard_series import open_flight
from tui_gcs.core.records.tlog_reader import TlogError
from tui_gcs.terminal.terminal_options import prepare_textual, wants_slow

if TYPE_CHECKING:
    from tui_gcs.feed.plots.flight_source import FlightPlotSource
    from tui_gcs.feed.plots.plot_layout import PlotLayout
    from tui_gcs.widgets.basics.glyphs import GlyphSet

PANE_ROWS = 16
SHORTLY_S = 3600.0


def run(arguments: argparse.Namespace) -> int:
    """Show the flights; without a terminal, or where it is asked for, print the panes once. Raises `CommandError`."""
    prepare_textual(os.environ)  # before anything imports Textual
    from tui_gcs.feed.plots.flight_source import FlightPlotSource
    from tui_gcs.widgets.basics.glyphs import glyph_set, wants_ascii

    paths = [Path(name) for name in arguments.flight]
    source = FlightPlotSource([_opened(path) for path in paths])
    if arguments.list:
        return _list(arguments, source)
    layout = _layout(source, arguments.show)
    at_s = moment_s(arguments.at, source.begin_s, source.now_s) if arguments.at is not None else None
    glyphs = glyph_set(wants_ascii(os.environ, getattr(sys.__stdout__, "encoding", None)))
    as_text = arguments.text or arguments.json or arguments.output or not sys.stdout.isatty()
    if as_text:
        return _print(arguments, source, layout, glyphs)
    from tui_gcs.console.flight_plot_app import FlightPlotApp

    title = clean(", ".join(path.name for path in paths), MAX_CELLS)
    with stations_beside("plot") as beside:
        app = FlightPlotApp(
            source,
            title,
            layout,
            folder=state_dir(RunKind.REPLAY),
            glyphs=glyphs,
            theme=operators_theme(),
            beside=beside,
            at_s=at_s,
        )
        app.run(mouse=not wants_slow())
    return app.return_code or 0


def _opened(path: Path) -> FlightSeries:
    try:
        return open_flight(path)
    except TlogError as error:
        raise CommandError(str(error)) from None
    except OnboardLogError as error:
        raise CommandError(f"{clean(str(path), MAX_CELLS)}: {error}") from None


def moment_s(text: str, begin_s: float, end_s: float) -> float:
    """Return the time of `text` on the logs' clock, at most as far as they reach. Raises `CommandError`."""
    is_time_of_day = text[-1:] in ("Z", "z")
    try:
        seconds = since_beginning_s(text[:-1] if is_time_of_day else text)
    except ReplayTimeError:
        raise CommandError(f"--at {clean(text, 20)}: no time: 95, 1:35 or 12:41:07Z") from None
    if is_time_of_day:
        # What the station noted may lie shortly before the first record of a log.
        seconds = (seconds - begin_s + SHORTLY_S) % DAY_S - SHORTLY_S
    return min(max(begin_s + seconds, begin_s), end_s)


def _layout(source: "FlightPlotSource", wanted: list[str]) -> "PlotLayout":
    """Return the panes for what was asked for on the command line. Raises `CommandError`."""
    from tui_gcs.feed.plots.plot_layout import WHOLE_FLIGHT, PlotLayout
    from tui_gcs.feed.plots.plotted_values import matching, split_vehicles

    layout = PlotLayout(window=WHOLE_FLIGHT)
    for words in wanted:
        vehicles, rest = split_vehicles(words)
        found = matching(source.names(), rest)
        values = found[0].of(vehicles or source.vehicles) if found else ()
        if not values:
            raise CommandError(f"--show {clean(words, 60)!r}: no such value; --list names all that these flights have")
        layout.toggle(values)
    layout.chosen = 0
    return layout


def _list(arguments: argparse.Namespace, source: "FlightPlotSource") -> int:
    """Print what can be plotted, a line for each value."""
    from tui_gcs.core.protocol.alarms import id_ranges

    names = sorted(source.names(), key=lambda each: (each.kind.value, each.name))
    if not arguments.json:
        for name in names:
            sys.stdout.write(
                f"{name.name:<48} {name.unit:<6} {id_ranges(name.holders):<12} {name.text}".rstrip() + "\n"
            )
    values = [
        {"name": each.name, "unit": each.unit, "kind": each.kind.value, "vehicles": list(each.holders)}
        for each in names
    ]
    return finish(arguments, CommandReport(True, ReportCode.NONE, "", {"values": values}))


def _print(arguments: argparse.Namespace, source: "FlightPlotSource", layout: "PlotLayout", glyphs: "GlyphSet") -> int:
    """Print the panes as text, or what is in them as JSON. Raises `CommandError`."""
    if not layout.values:
        raise CommandError(
            "nothing to plot: --show WORDS chooses a value, --list names all; on a terminal / finds them"
        )
    source.follow(layout.values)
    source.read()
    if source.error:
        raise CommandError(source.error)
    if not arguments.json:
        sys.stdout.write(_text(source, layout, glyphs, shutil.get_terminal_size((100, 24)).columns))
    curves = []
    for value in layout.values:
        times_s, values = source.points(value)
        known = [None if number != number else number for number in values.tolist()]
        curves.append(
            {"vehicle": value.subject, "name": value.name, "unit": value.unit, "t_s": times_s.tolist(), "value": known}
        )
    return finish(arguments, CommandReport(True, ReportCode.NONE, "", {"curves": curves}))


def _text(source: "FlightPlotSource", layout: "PlotLayout", glyphs: "GlyphSet", columns: int) -> str:
    """Return the panes one below the other."""
    from tui_gcs.widgets.plots.plot_curve import Curve
    from tui_gcs.widgets.plots.plot_pane import PaneContent, PlotPane, plain_text

    parts = []
    for plan in layout.panes:
        curves = tuple(Curve(plan.label(value), *source.points(value)) for value in plan.values)
        pane = PlotPane(glyphs=glyphs)
        pane.content = PaneContent(curves, plan.unit, source.begin_s, source.now_s, source.time_words)
        parts.append(f"{plan.title}  {plan.unit}".rstrip() + "\n" + plain_text(pane.lines(columns, PANE_ROWS)) + "\n")
    return "\n".join(parts)
