"""`tui-gcs replay`: a recorded flight on the fly screen, or as a text summary."""

import argparse
import math
import shutil
import sys
import threading
from typing import TYPE_CHECKING

from tui_gcs.actions.replay_times import ReplayTimeError, since_beginning_s
from tui_gcs.cli.common import need_terminal
from tui_gcs.cli.console import ConsolePreferences, preferences, recordings, stations_beside
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.terminal.terminal_options import wants_slow

if TYPE_CHECKING:
    from tui_gcs.core.protocol.bus import MemoryBus
    from tui_gcs.core.station.replay_player import Player
    from tui_gcs.feed.live_watch import LiveWatch

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
    from tui_gcs.core.base.clock import MonotonicClock
    from tui_gcs.core.protocol.bus import MemoryBus
    from tui_gcs.core.records.tlog_reader import TlogError
    from tui_gcs.core.station.replay_player import Player

    bus = MemoryBus()
    try:
        player = Player(file, speed, bus, MonotonicClock(), begin_s)
    except TlogError as error:
        raise CommandError(str(error)) from None
    with stations_beside("replay") as beside:
        return _played(player, bus, options, beside)


def _played(player: "Player", bus: "MemoryBus", options: ConsolePreferences, beside: "LiveWatch") -> int:
    """Show what the player plays until the operator leaves; return the exit code."""
    from tui_gcs.app import ReplayApp
    from tui_gcs.console.parts import ConsoleOptions

    app = ReplayApp(
        bus,
        kind=RunKind.REPLAY,
        options=ConsoleOptions(
            replay=True,
            beside=beside,
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
    return app.return_code or 0
