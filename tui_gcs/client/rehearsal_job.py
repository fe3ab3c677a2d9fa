"""A rehearsal in the background: `tui-gcs rehearse` as a process of lowest priority, which outlives its console.

One runs at a time. What belongs to it is in one folder of the SIM state directory, so that every console finds it:
`lock` (held for as long as it runs), `job.json`, `scenario.toml`, `progress.txt` and `output.txt`. It shares neither
sockets nor links with a station: its vehicles live in its own memory.
"""

import contextlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tui_gcs.core.base.descendants import kill_descendants
from tui_gcs.core.base.directories import try_lock
from tui_gcs.core.base.text import clean
from tui_gcs.core.records.rehearsal_store import FOLDER_NAME, RECORDING

FOLDER = "background-rehearsal"
LOWEST_PRIORITY = 19
MAX_LOAD_PER_CPU = 2.0
"""With more processes than this ready to run on each processor, a planner of a flight may already wait for one."""
TAIL_BYTES = 4_096
MAX_CELLS = 300
OPTIONS = {
    "--lose": "3@60",
    "--drain": "2@90",
    "--restart": "45",
    "--fault": "loss=0.2,delay=200ms",
    "--wind": "5,0",
    "--gps-noise": "1.5",
    "--intruders": "2",
    "--sensor": "range=60",
    "--autopilot": "mixed",
}
"""Options of `tui-gcs rehearse` that a console may give, with an example of the one value that each takes.

None changes the plan.
"""
PRINTED_ABOVE = "; the result is as printed above"
PROGRAM = "tui-gcs: "
"""Begins every error that a command prints."""
_RESULT = re.compile(r"\d+ of \d+ checks hold")
_BAR = re.compile(r"\[[#.]+\] +(\d+)% ?(.*)")


class RehearsalJobError(Exception):
    """A rehearsal is not started; one line with what and why."""


class _JobFile(msgspec.Struct, frozen=True):
    """What `job.json` holds."""

    pid: int
    began_wall_s: float
    scenario: str
    options: str = ""
    cancelled: bool = False


@dataclass(frozen=True)
class RehearsalJobState:
    """How the newest background rehearsal stands."""

    running: bool
    scenario: str
    options: str
    began_wall_s: float
    done: float
    """Share of the flight, 0 to 1, as it was printed last."""
    text: str
    """While it runs what it prints beside the progress, then why it could not be flown; "" where it was."""
    cancelled: bool
    """An operator has cancelled it; its process may still run for a moment."""
    result: str = ""
    """What was printed as the result of its gates; "" until it has landed."""


def parsed_options(text: str) -> list[str]:
    """Return the words of typed options. Raises `RehearsalJobError` for one that is unknown or has no value."""
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise RehearsalJobError(f"options: {error}") from None
    found: list[str] = []
    while words:
        name, equals, value = words.pop(0).partition("=")
        if name not in OPTIONS:
            raise RehearsalJobError(f"{clean(name, 40)}: not known here; {', '.join(sorted(OPTIONS))}")
        if not equals:
            if not words:
                raise RehearsalJobError(f"{name}: its value is missing")
            value = words.pop(0)
        found.append(f"{name}={value}")
    return found


def load_per_cpu() -> float:
    """Return the number of processes that are ready to run, per processor, over the last minute; 0 if unknown."""
    try:
        return os.getloadavg()[0] / (os.cpu_count() or 1)
    except OSError:
        return 0.0


class RehearsalJob:
    """Starts, looks at and cancels the background rehearsal of one state directory."""

    def __init__(self, state: Path, load: Callable[[], float] = load_per_cpu) -> None:
        """`state` is the state directory of SIM, which need not exist."""
        self._folder = state / FOLDER
        self._load = load
        self._child: subprocess.Popen[bytes] | None = None

    @property
    def is_running(self) -> bool:
        """Whether the process of a rehearsal lives, whichever console started it."""
        try:
            with (self._folder / "lock").open("r+") as lock:
                return not try_lock(lock)
        except OSError:
            return False

    def too_busy(self) -> str:
        """Return why this computer has no time for a rehearsal beside a flight; "" where it has."""
        if (load := self._load()) <= MAX_LOAD_PER_CPU:
            return ""
        return (
            f"the computer is too busy: {load:.1f} processes wait for each processor"
            f" (at most {MAX_LOAD_PER_CPU:.0f}); end some, or rehearse on another computer"
        )

    def start(self, name: str, toml: str, planners: Sequence[str], options: Sequence[str]) -> None:
        """Begin to rehearse this text of a scenario with planners in these files.

        Raises:
            RehearsalJobError: one runs already, or a file cannot be written.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            with (self._folder / "lock").open("w") as lock:
                if not try_lock(lock):
                    raise RehearsalJobError("a rehearsal is under way: Del cancels it")
                (self._folder / "job.json").unlink(missing_ok=True)
                file = self._folder / "scenario.toml"
                file.write_text(toml, encoding="utf-8")
                pid = self._begin(lock.fileno(), [str(file), *(f"--planner={one}" for one in planners), *options])
                try:
                    self._write(_JobFile(pid, time.time(), name, shlex.join(options)))
                except OSError:
                    _kill(pid)  # no console would know of it
                    raise
        except OSError as error:
            raise RehearsalJobError(f"{self._folder}: {error.strerror or error}") from None

    def _begin(self, lock: int, arguments: Sequence[str]) -> int:
        """Start the process, which holds the lock from now on; return its id."""
        command = [sys.executable, "-m", "tui_gcs", "rehearse", *arguments, "--report"]
        environment = {name: value for name, value in os.environ.items() if name != "TUI_GCS_QUIET"}
        with (self._folder / "progress.txt").open("wb") as errors, (self._folder / "output.txt").open("wb") as output:
            # A session of its own: it outlives the terminal, and its planners are found by their group.
            process = self._child = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                cwd=self._folder,
                env=environment,
                pass_fds=[lock],
                start_new_session=True,
            )
        with contextlib.suppress(OSError):  # it may have ended already
            os.setpriority(os.PRIO_PROCESS, process.pid, LOWEST_PRIORITY)
        # With autogroups Linux weighs sessions against each other, and a process's own priority only inside one.
        with contextlib.suppress(OSError):
            (Path("/proc") / str(process.pid) / "autogroup").write_text(str(LOWEST_PRIORITY), encoding="ascii")
        return process.pid

    def cancel(self) -> str:
        """End the rehearsal with its planners; return what became of it."""
        job = self._read()
        if job is None or not self.is_running:
            return "no rehearsal is under way"
        remark = ""
        try:
            self._write(msgspec.structs.replace(job, cancelled=True))
        except OSError as error:  # a full disk is no reason to let it run
            remark = f" ({self._folder}: {error.strerror or error})"
        _kill(job.pid)
        return f"the rehearsal is cancelled; it is not on record{remark}"

    def look(self) -> RehearsalJobState | None:
        """Return how the newest rehearsal stands; None where none was started here."""
        job = self._read()
        if job is None:
            return None
        if self._child is not None:
            self._child.poll()  # an ended child of ours is forgotten by the system only then
        running, lines = self.is_running, self._tail("progress.txt")
        if job.cancelled and not running:
            self._remove_recording()
        bars = [found for line in lines if (found := _BAR.fullmatch(line)) is not None]
        done = int(bars[-1][1]) / 100.0 if bars else 0.0
        text = bars[-1][2] if running and bars else ""
        if not running and not job.cancelled:
            text = _reason(lines)
        return RehearsalJobState(
            running,
            clean(job.scenario, 80),
            clean(job.options, MAX_CELLS),
            job.began_wall_s,
            min(done, 1.0),
            clean(text.strip(), MAX_CELLS),
            job.cancelled,
            self._result(),
        )

    def _result(self) -> str:
        """Return the printed line that counts the gates; it is there even if nothing could be put on record."""
        return next((line for line in reversed(self._tail("output.txt")) if _RESULT.fullmatch(line)), "")

    def _remove_recording(self) -> None:
        """Remove what a cancelled rehearsal has recorded so far: nothing refers to it, and it looks like a flight."""
        try:
            printed = (self._folder / "output.txt").read_text(encoding="utf-8", errors="replace")[:TAIL_BYTES]
        except OSError:
            return
        for line in printed.splitlines():
            recording = self._folder.parent / Path(line.removeprefix(RECORDING)).name
            if line.startswith(RECORDING) and FOLDER_NAME.fullmatch(recording.name) and not recording.is_symlink():
                shutil.rmtree(recording, ignore_errors=True)

    def _tail(self, name: str) -> list[str]:
        try:
            with (self._folder / name).open("rb") as file:
                size = file.seek(0, os.SEEK_END)
                file.seek(max(0, size - TAIL_BYTES))
                return file.read().decode(errors="replace").splitlines()
        except OSError:
            return []

    def _read(self) -> _JobFile | None:
        try:
            return msgspec.json.decode((self._folder / "job.json").read_bytes(), type=_JobFile)
        except (OSError, msgspec.MsgspecError):
            return None

    def _write(self, job: _JobFile) -> None:
        new = self._folder / f"job.{os.getpid()}.new"
        try:
            new.write_bytes(msgspec.json.encode(job))
            new.replace(self._folder / "job.json")
        except OSError:
            with contextlib.suppress(OSError):
                new.unlink(missing_ok=True)
            raise


def _kill(pid: int) -> None:
    """Kill the process of a rehearsal with all that it has started."""
    kill_descendants(pid)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)


def _reason(lines: Sequence[str]) -> str:
    """Return why a rehearsal has no result, by the end of what it printed to stderr; "" if that does not say it."""
    errors = [line.removeprefix(PROGRAM) for line in lines if line.startswith(PROGRAM)]
    if errors:
        return errors[-1].removesuffix(PRINTED_ABOVE)
    # A fault of this program itself: the last line of its traceback says most.
    words = [line.strip() for line in lines if line.strip() and _BAR.fullmatch(line) is None]
    return words[-1] if words else ""
