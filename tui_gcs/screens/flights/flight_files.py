"""What the flights screen does with recordings: replay, plot, export, delete, open, copy the path."""

import asyncio
import math
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from textual.screen import Screen

from tui_gcs.actions.replay_times import DAY_S
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.records.flight_archive import FlightArchive, RecordedFlight, delete_flight
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.flights.flight_lists import length_words, size_words

MAX_LINES = 4
"""The last lines of an export's output are shown."""


def time_of_day(wall_s: float) -> str:
    """Return a time in seconds as `12:41:07.3Z`, for a command line."""
    tenths = round(wall_s * 10) % round(10 * DAY_S)
    return f"{tenths // 36_000:02d}:{tenths // 600 % 60:02d}:{tenths % 600 / 10:04.1f}Z"


class FlightFiles(ScreenEdits):
    """Works on files of this computer; reports by `report`."""

    def __init__(
        self,
        host: Screen[None],
        feed: Feed,
        clock: Clock,
        glyphs: GlyphSet,
        show: Callable[[], None],
        archive: FlightArchive,
    ) -> None:
        """Work on the recordings of `archive`; `show` is called whenever something has changed."""
        super().__init__(host, feed, clock, glyphs, show)
        self._archive = archive
        self.run_program: Callable[[list[str]], int] = self._run_suspended
        """Runs the command of a replay or of plots in this terminal; returns its exit code."""

    def replay(self, flight: RecordedFlight | None, at_s: float = 0.0) -> None:
        """Show a recording on the fly screen from `at_s` on; this console waits behind it."""
        why = self._why_no_replay(flight)
        if why or flight is None:
            self.say(why, Ink.CAUTION)
            return
        command = [sys.executable, "-m", "tui_gcs", "replay", str(flight.path), "--at", f"{max(0.0, at_s):.1f}"]
        self._run(command, clean(flight.path.name, 60), "replay")

    def plot(self, flights: Sequence[RecordedFlight], at_s: float = math.nan) -> None:
        """Show values of these recordings over time, joined by their times; this console waits behind them.

        The cursor stands at the time `at_s` of the recordings' clock, if that is a number.
        """
        paths = [str(flight.path) for flight in flights]
        if not paths:
            self.say("no flight is chosen", Ink.CAUTION)
        elif armed := self._armed():
            self.say(
                f"{armed} armed: plot in another terminal: tui-gcs plot {clean(' '.join(paths), 200)}", Ink.CAUTION
            )
        else:
            names = clean(flights[0].path.name, 60) if len(flights) == 1 else f"{len(flights)} recordings"
            at = ["--at", time_of_day(at_s)] if math.isfinite(at_s) else []
            self._run([sys.executable, "-m", "tui_gcs", "plot", *paths, *at], names, "plots")

    def _run(self, command: list[str], name: str, what: str) -> None:
        code = self.run_program(command)
        self.say(f"back from {name}" if code == 0 else f"{name}: {what} ended with exit code {code}", Ink.TEXT)

    def _armed(self) -> int:
        """How many vehicles are armed: nothing that covers this console is shown meanwhile."""
        status = self._feed.status
        return status.armed if status is not None and status.replay is None and not self._feed.station_lost else 0

    def _why_no_replay(self, flight: RecordedFlight | None) -> str:
        status = self._feed.status
        if flight is None:
            return "no flight is chosen"
        if not flight.is_telemetry:
            return f"only a telemetry log can be replayed; {flight.what}: Enter shows what happened, g plots it"
        if status is not None and status.replay is not None:
            return f"this is a replay: q leaves it, then tui-gcs replay {clean(str(flight.path), 200)}"
        # A replay shows one line of what flies: enough to notice what happens, not enough to fly by.
        if armed := self._armed():
            return f"{armed} armed: replay in another terminal: tui-gcs replay {clean(str(flight.path), 200)}"
        return ""

    def _run_suspended(self, command: list[str]) -> int:
        with self._host.app.suspend():
            # A long recording is read for seconds before there is a picture.
            if sys.__stdout__ is not None:
                sys.__stdout__.write(f"tui-gcs {command[3]}: reading; q comes back\n")
                sys.__stdout__.flush()
            return subprocess.run(command, check=False).returncode

    def export(self, flight: RecordedFlight, target: Path) -> None:
        """Write the tracks of a recording to a new file."""
        if target.exists():
            self.say(f"NOT WRITTEN: {clean(str(target), 200)} is there already: choose another name", Ink.CAUTION)
            return
        self.say(f"writing {clean(str(target), 200)} …")
        self._host.run_worker(self._export(flight, target), group="export", exit_on_error=False)

    async def _export(self, flight: RecordedFlight, target: Path) -> None:
        # In a process of its own, as `core/judging/timeline_process.py` says why.
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "tui_gcs", "export", str(flight.path), "--file", str(target)),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        try:
            out, errors = await process.communicate()
        finally:
            if process.returncode is None:
                process.kill()
        lines = [line.removeprefix("tui-gcs: ") for line in (out + errors).decode(errors="replace").splitlines()]
        text = "; ".join(lines[-MAX_LINES:]) or f"export ended with exit code {process.returncode}"
        self.say(text if target.exists() else f"NOT WRITTEN: {text}", Ink.CAUTION if process.returncode else Ink.NORMAL)

    def delete(self, flight: RecordedFlight | None, on_done: Callable[[], None]) -> None:
        """Ask whether a recording is to be removed."""
        if flight is None:
            self.say("no flight is chosen", Ink.CAUTION)
            return

        def answered(yes: bool | None) -> None:
            why = delete_flight(flight, time.time()) if yes else "it stays"
            name = clean(flight.path.name, 60)
            self.say(f"NOT DELETED: {why}" if why else f"{name} is deleted", Ink.CAUTION if why else Ink.NORMAL)
            on_done()

        size = size_words(flight.size_bytes)
        what = f"{flight.what}, {length_words(flight.length_s)}, {size}: it cannot be brought back"
        title = f"delete {clean(flight.path.name, 50)}"
        self._host.app.push_screen(SureDialog(title, [what], "delete", self._glyphs, self._clock), answered)

    def open_file(self, path: Path) -> None:
        """Add a file of this computer to the list."""
        why = self._archive.open_file(path)
        self.say(why or f"{clean(path.name, 60)} is in the list", Ink.CAUTION if why else Ink.NORMAL)

    def copy_path_of(self, flight: RecordedFlight | None) -> None:
        """Send the path of the report, or of the recording, to the terminal's clipboard."""
        if flight is None:
            self.say("no flight is chosen", Ink.CAUTION)
            return
        self.copy_path(flight.report or str(flight.path))
