"""Guides a user through manual steps: prompts that change, Enter when a step is done, Ctrl-C to cancel.

Prompts go to stderr: stdout has the results, also for scripts.
"""

import shutil
import sys
from collections.abc import Sequence
from textwrap import wrap

from tui_gcs.cli.vehicle.station_client import LINE_CELLS, StationClient
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.services import CancelTask, TaskInfo
from tui_gcs.core.protocol.setup import ConfirmStep

ENTER, CANCEL, LEAVE = "Enter: done as asked", "ctrl-c: cancel", "ctrl-c again: leave it as it is"


class PromptGuide:
    """Shows the progress of tasks, and sends the user's answers to the station."""

    def __init__(self, station: StationClient) -> None:
        """Guide the user through tasks of `station`; nothing is drawn yet."""
        self._station = station
        self._drawn = 0
        """The number of lines on the terminal that the next picture replaces."""
        self._last_prompts: dict[int, str] = {}
        """The last prompt of each task, where there is no terminal."""
        self._notes: dict[int, tuple[str, ...]] = {}
        self._waited: set[int] = set()
        """The tasks that waited for Enter at the last look: input from before that is not meant for them."""
        self._cancelled = False

    # ---------------------------------------------------------------- for who waits for tasks

    def look(self, infos: Sequence[TaskInfo]) -> None:
        """Show the tasks as they are now; an Enter answers all that wait."""
        entered = self._station.entered()
        if entered and self._drawn:
            self._drawn += 1  # the terminal's own echo of it
        for info in infos:
            self._say_notes(info)
        self._show(infos)
        waiting = {info.number for info in infos if info.waits and not info.over}
        if entered:
            for number in sorted(waiting & self._waited):
                self._confirm(next(info for info in infos if info.number == number))
        self._waited = waiting

    def interrupted(self, infos: Sequence[TaskInfo]) -> bool:
        """Handle Ctrl-C.

        the first cancels in the vehicles and returns True to wait for it, the second returns False.
        """
        if self._cancelled or not infos:
            return False
        self._cancelled = True
        for info in infos:
            if not info.over:
                reply = self._station.ask(CancelTask(info.number))
                self.keep(_of_vehicle(info, reply.text if not reply.ok else "cancelling …"))
        return True

    def over(self) -> None:
        """Clear the picture: the results follow on stdout."""
        self._draw([])

    def keep(self, text: str) -> None:
        """Print a line that stays."""
        self._draw([])
        sys.stderr.write(clean(text, LINE_CELLS).rstrip() + "\n")
        sys.stderr.flush()

    # ---------------------------------------------------------------- inside

    def _confirm(self, info: TaskInfo) -> None:
        reply = self._station.ask(ConfirmStep(info.number))
        if not reply.ok:
            self.keep(_of_vehicle(info, reply.text))

    def _say_notes(self, info: TaskInfo) -> None:
        """Print new texts of the vehicle; the station reports only the newest."""
        before = self._notes.get(info.number, ())
        self._notes[info.number] = info.notes
        gone = next(n for n in range(len(before) + 1) if info.notes[: len(before) - n] == before[n:])
        for note in info.notes[len(before) - gone :]:
            self.keep(f"vehicle {info.vehicle} says: {note}")

    def _show(self, infos: Sequence[TaskInfo]) -> None:
        running = [info for info in infos if not info.over]
        if sys.stderr.isatty():
            lines = [line for info in running for line in (*_lines(info, alone=len(running) == 1), _now(info))]
            keys = [ENTER] if any(info.waits for info in running) else []
            keys.append(LEAVE if self._cancelled else CANCEL)
            self._draw([*lines, "    ".join(keys)] if lines else [])
            return
        for info in running:
            if info.prompt and info.prompt != self._last_prompts.get(info.number):
                self._last_prompts[info.number] = info.prompt
                self.keep(_now(info))

    def _draw(self, lines: list[str]) -> None:
        """Draw over the last picture. Only the last lines are drawn if the terminal is too low: they matter most."""
        if not sys.stderr.isatty():
            return
        size = shutil.get_terminal_size()
        # The last column stays free: a row that fills it wraps, and the next picture would begin a line too low.
        wide = max(20, size.columns - 1)
        rows = [row for line in lines for row in wrap(clean(line, LINE_CELLS), wide, subsequent_indent="  ")]
        rows = rows[-max(1, size.lines - 1) :]
        up = f"\x1b[{self._drawn}A" if self._drawn else ""
        text = "".join(clean(row, wide) + "\x1b[K\n" for row in rows)
        sys.stderr.write(f"\r{up}{text}\x1b[J")
        sys.stderr.flush()
        self._drawn = len(rows)


def _of_vehicle(info: TaskInfo, text: str) -> str:
    """Put the vehicle's name before a text about a task."""
    return f"vehicle {info.vehicle}: {text.removeprefix(f'task {info.number}: ')}"


def _lines(info: TaskInfo, *, alone: bool) -> tuple[str, ...]:
    """Return the lines about the task's parts, with the vehicle where there are several."""
    return info.lines if alone else tuple(f"{info.vehicle:>4} {line}" for line in info.lines)


def _now(info: TaskInfo) -> str:
    """Return the line about one vehicle: its progress, and what the user has to do."""
    far = f"{100 * info.done // info.total:>3} %  " if info.total else ""
    return f"vehicle {info.vehicle}: {far}{info.prompt or info.what}"
