"""`tui-gcs replay`: a recorded flight on the fly screen, or as a text summary."""

import argparse
import math
import os
import shutil
import sys
import threading

from tui_gcs.actions.replay_times import ReplayTimeError, since_beginning_s
from tui_gcs.cli.common import need_terminal
from tui_gcs.cli.console import ConsolePreferences, preferences, recordings
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.terminal.terminal_options import wants_slow

TICK_S = 0.05


def run(arguments: argparse.Namespace) -> int:
    """Show the flight; print the summary instead without a terminal or where it is asked for."""
    if arguments.json or arguments.output or arguments.summary or not sys.stdout.isatty():
        return _summary(arguments)
    if not (math.isfinite(arguments.speed) and 0 < arguments.speed <= 1000):
        raise CommandError(f"--speed {arguments.speed:g}: more than 0 and at most 1000")
    need_terminal()
    return _show(arguments.file, arguments.speed, _begin_s(arguments.at), preferences(arguments))


def _begin_s(text: str) -> float:
    """Return the time to begin at, in seconds since the beginning. Raises `CommandError`."""
    try:
        return since_beginning_s(text)
    except ReplayTimeError as error:
        raise CommandError(f"--at {clean(text, 20)}: {error}") from None


def _summary(arguments: argparse.Namespace) -> int:
    import msgspec

    from tui_gcs.cli.command_report import CommandReport, finish
    from tui_gcs.core.judging.summary_text import summary_text
    from tui_gcs.core.judging.tlog_summary import summarize
    from tui_gcs.core.records.tlog_reader import TlogError

    try:
        summary = summarize(arguments.file)
    except TlogError as error:
        raise CommandError(str(error)) from None
    if not arguments.json:
        sys.stdout.write(summary_text(summary, shutil.get_terminal_size((100, 24)).columns))
        sys.stdout.flush()
    for warning in summary.warnings:
        sys.stderr.write(f"tui-gcs: {warning}\n")
    code = ReportCode.FAILED if summary.truncated else ReportCode.NONE
    text = "; ".join(summary.warnings)
    return finish(arguments, CommandReport(not summary.truncated, code, text, msgspec.structs.asdict(summary)))


def _show(file: str, speed: float, begin_s: float, options: ConsolePreferences) -> int:
    from tui_gcs.app import ReplayApp
    from tui_gcs.console.parts import ConsoleOptions
    from tui_gcs.core.base.clock import MonotonicClock
    from tui_gcs.core.protocol.bus import MemoryBus
    from tui_gcs.core.protocol.zenoh_bus import connect_later
    from tui_gcs.core.records.tlog_reader import TlogError
    from tui_gcs.core.station.replay_player import Player
    from tui_gcs.feed.live_watch import LiveWatch

    bus, clock = MemoryBus(), MonotonicClock()
    try:
        player = Player(file, speed, bus, clock, begin_s)
    except TlogError as error:
        raise CommandError(str(error)) from None
    buses = {kind: connect_later(socket_path(kind)) for kind in (RunKind.LIVE, RunKind.SIM)}
    app = ReplayApp(
        bus,
        kind=RunKind.REPLAY,
        options=ConsoleOptions(
            replay=True,
            beside=LiveWatch(buses, f"replay-{os.getpid()}", clock),
            overlays=options.overlays,
            base_map=options.base_map,
            keymap=options.keymap,
            theme=options.theme,
            own_commands=options.own_commands,
            settings=options.settings,
            recordings=recordings(),
        ),
    )
    over = threading.Event()

    def play() -> None:
        while not over.wait(TICK_S):
            player.tick()

    thread = threading.Thread(target=play, name="replay", daemon=True)
    thread.start()
    try:
        app.run(mouse=not wants_slow())
    finally:
        over.set()
        thread.join(2.0)
        player.close()
        for one in buses.values():
            one.close()
    return app.return_code or 0
