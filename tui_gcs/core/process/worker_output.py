"""What a planner worker prints: read from its pipes line by line, without ever waiting, into the planner log."""

import os
import re
import subprocess
from typing import IO

from tui_gcs.core.base.token_bucket import TokenBucket
from tui_gcs.core.protocol.planner_log import PlannerLogLevel
from tui_gcs.core.records.planner_log import PlannerLog

READ_BYTES = 64 * 1024
"""Capacity of a pipe on Linux: what one read returns at most."""
MAX_READS = 16
"""Reads of one pipe per look, so that a planner that prints without end does not hold the station up."""
MAX_LINE_BYTES = 4096
"""A longer line is cut; also what is kept of a line that has not ended yet."""
MAX_LINES, LINES_PER_S = 1000, 20.0
"""Lines of one worker that are kept at once, and in the long run; more are counted. A start of eight planners with all
their imports logs some dozens; 20 lines/s of usual length fill a file of the log in about half an hour."""
COUNT_GAP_S = 10.0
"""While a flood goes on, how many lines were left out is written this often."""

_PRIORITY = re.compile(rb"<([0-7])>")
_LEVELS = {
    0: PlannerLogLevel.CRITICAL,
    1: PlannerLogLevel.CRITICAL,
    2: PlannerLogLevel.CRITICAL,
    3: PlannerLogLevel.ERROR,
    4: PlannerLogLevel.WARNING,
    5: PlannerLogLevel.INFO,
    6: PlannerLogLevel.INFO,
    7: PlannerLogLevel.DEBUG,
}
"""Levels by syslog priority. A worker writes it before each line of a log record (`planner/runtime/worker_logging.py`),
in the form that sd-daemon(3) describes."""


class WorkerOutput:
    """Reads stdout and stderr of one worker process."""

    def __init__(self, process: subprocess.Popen[bytes], team: str, log: PlannerLog, now: float) -> None:
        """`process` was started with two unbuffered pipes."""
        assert process.stdout is not None and process.stderr is not None  # noqa: S101 - pipes, see above
        self._pipes = (
            _Pipe(process.stdout, PlannerLogLevel.STDOUT),
            _Pipe(process.stderr, PlannerLogLevel.STDERR),
        )
        self._team, self._log = team, log
        self._bucket = TokenBucket(LINES_PER_S, MAX_LINES, now)
        self._left_out = 0
        """Lines that were left out since the log said so last."""
        self._counted_s = now

    def read(self, planner: str, now: float) -> None:
        """Write what has come since the last call. `planner` is the name of the planner that the worker runs."""
        for pipe in self._pipes:
            for _ in range(MAX_READS):
                if not pipe.fill():
                    break
                self._keep(pipe, planner, now)
        if self._left_out and now >= self._counted_s + COUNT_GAP_S:
            self._count(planner, now)

    def close(self, planner: str, now: float) -> None:
        """Write the rest, also of a line that did not end, and close the pipes."""
        self.read(planner, now)
        for pipe in self._pipes:
            pipe.end()
            self._keep(pipe, planner, now)
        if self._left_out:
            self._count(planner, now)

    def _keep(self, pipe: "_Pipe", planner: str, now: float) -> None:
        """Write the whole lines of a pipe, as far as the rate limit allows."""
        if not self._bucket.has_one(now):
            self._leave_out(pipe.drop_lines(), now)
            return
        lines = pipe.take_lines()
        for at, line in enumerate(lines):
            if not self._bucket.has_one(now):
                self._leave_out(len(lines) - at, now)
                return
            self._bucket.take()
            level, text = _level_of(line, pipe.level)
            self._log.write(self._team, planner, level, text[:MAX_LINE_BYTES])

    def _leave_out(self, lines: int, now: float) -> None:
        if lines and not self._left_out:
            self._counted_s = now
        self._left_out += lines
        self._log.left_out += lines

    def _count(self, planner: str, now: float) -> None:
        text = f"prints too much: {self._left_out} lines were left out (more than {LINES_PER_S:.0f} a second)"
        self._log.write(self._team, planner, PlannerLogLevel.STATION, text)
        self._left_out, self._counted_s = 0, now


class _Pipe:
    """One pipe, and what came of a line that has not ended."""

    def __init__(self, file: IO[bytes], level: PlannerLogLevel) -> None:
        os.set_blocking(file.fileno(), False)
        self.level = level
        self._file = file
        self._data = b""

    def fill(self) -> bool:
        """Read once; return whether anything came."""
        try:
            data = self._file.read(READ_BYTES)
        except (OSError, ValueError):  # closed
            return False
        self._data += data or b""
        return bool(data)

    def take_lines(self) -> list[bytes]:
        """Return the whole lines that are not empty, and a part of one that is too long."""
        if len(self._data) > MAX_LINE_BYTES and not _has_end(self._data):
            lines, self._data = [self._data], b""
        else:
            lines = self._data.splitlines()
            whole = not self._data or self._data.endswith((b"\n", b"\r"))
            self._data = b"" if whole else lines.pop()
        return [line for line in lines if line.strip()]

    def drop_lines(self) -> int:
        """Forget the whole lines, and return their number; it takes much less time than to take them."""
        count = max(self._data.count(b"\n"), self._data.count(b"\r"))
        if not count and len(self._data) > MAX_LINE_BYTES:
            count, self._data = 1, b""
        self._data = self._data[max(self._data.rfind(b"\n"), self._data.rfind(b"\r")) + 1 :]
        return count

    def end(self) -> None:
        """End the last line and close the file."""
        self._data += b"\n" if self._data else b""
        self._file.close()


def _has_end(data: bytes) -> bool:
    return b"\n" in data or b"\r" in data


def _level_of(line: bytes, usual: PlannerLogLevel) -> tuple[PlannerLogLevel, bytes]:
    """Return the level that a line itself gives, or that of its pipe, and the text."""
    found = _PRIORITY.match(line) if usual is PlannerLogLevel.STDERR else None
    return (_LEVELS[int(found[1])], line[found.end() :]) if found else (usual, line)
