"""The planner log: what planner workers print and log, one line of text each, bounded in size.

A line has five fields between tabs: UTC time, team, planner, level, text. Texts are cleaned, so none holds a tab or a
line break. When the file is full it becomes `….log.1`, and the one that had this name before is removed.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from msgspec.structs import replace

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.planner_log import (
    PLANNER_LOG_END,
    GetPlannerLog,
    PlannerLogLevel,
    PlannerLogLine,
    PlannerLogPiece,
)
from tui_gcs.core.records.appender import FileAppender

MAX_FILE_BYTES = 5_000_000
"""A full file is kept beside the one that is written: twice this is the most on disk for one run."""
PIECE_BYTES = 64 * 1024
"""Read for one answer: some hundred lines, a few milliseconds."""
MAX_TEXT_CELLS, MAX_NAME_CELLS = 500, 60
EARLIER_ENDING = ".1"


def log_files(flight: Path) -> tuple[Path, Path]:
    """Return the planner logs of a flight by the path of its telemetry log: the newest, and the full one before it."""
    newest = flight.with_name(f"{flight.stem}-planners.log")
    return newest, newest.with_name(newest.name + EARLIER_ENDING)


class PlannerLog:
    """Appends lines, and reads pieces of the file and of the one before it. Never raises.

    A place in the log is a number of bytes since the oldest line of the files at the start of this station. It stays
    valid when a file is full. One of before the start of the station leads to some line, not to an error.
    """

    def __init__(self, path: Path, wall: Callable[[], float]) -> None:
        """Append to `path`; `wall` returns the time that new lines get, in Unix seconds."""
        self.path = path
        self.left_out = 0
        """Lines of floods that were not kept; counted by who reads the output of workers."""
        self._earlier = path.with_name(path.name + EARLIER_ENDING)
        self._wall = wall
        self._file = FileAppender(path)
        self._size = _size(path)
        self._base = 0
        """Place of the oldest line on disk."""

    def write(self, team: str, planner: str, level: PlannerLogLevel, text: str | bytes) -> None:
        """Append one line; on disk after the next `flush`."""
        when = datetime.fromtimestamp(self._wall(), UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        fields = (when, clean(team, MAX_NAME_CELLS), clean(planner, MAX_NAME_CELLS), level, clean(text, MAX_TEXT_CELLS))
        line = ("\t".join(fields) + "\n").encode()
        if self._size and self._size + len(line) > MAX_FILE_BYTES:
            self._rotate()
        self._size += len(line)
        self._file.put(line)

    def flush(self) -> None:
        """Hand all lines to the operating system."""
        self._file.flush()

    def close(self) -> None:
        """Flush and close the file."""
        self._file.close()

    def before(self, place: int, piece_bytes: int = PIECE_BYTES) -> PlannerLogPiece:
        """Return the lines that end at a place; `PLANNER_LOG_END` is the end of the log."""
        self.flush()
        top = self._end()
        end = top if place == PLANNER_LOG_END else min(max(place, self._base), top)
        begin = max(self._base, end - piece_bytes)
        data = self._read(begin, end)
        if begin > self._base:
            # The piece begins inside a line, which belongs to the piece before it. No line is as long as a piece.
            cut = data.find(b"\n") + 1
            data, begin = data[cut:], begin + cut
        return self._piece(data, begin, end)

    def after(self, place: int, piece_bytes: int = PIECE_BYTES) -> PlannerLogPiece:
        """Return the lines that begin at a place."""
        self.flush()
        top = self._end()
        begin = min(max(place, self._base), top)
        data = self._read(begin, min(top, begin + piece_bytes))
        data = data[: data.rfind(b"\n") + 1]
        return self._piece(data, begin, begin + len(data))

    def _piece(self, data: bytes, begin: int, end: int) -> PlannerLogPiece:
        lines = tuple(line for raw in data.split(b"\n") if (line := _parsed(raw)) is not None)
        return PlannerLogPiece(lines, begin, end, begin <= self._base, self.left_out, str(self.path))

    def _end(self) -> int:
        return self._base + _size(self._earlier) + _size(self.path)

    def _read(self, begin: int, end: int) -> bytes:
        """Return the bytes from place to place, from both files; fewer if one of them cannot be read."""
        data, at = b"", self._base
        for path in (self._earlier, self.path):
            size = _size(path)
            first, last = max(begin, at), min(end, at + size)
            if first < last:
                data += _bytes_of(path, first - at, last - first)
            at += size
        return data

    def _rotate(self) -> None:
        """Begin a new file. If the full one cannot be renamed, it is written on and tried again with the next line."""
        self._file.flush()
        if self._file.error:
            return  # the disk is full: what waits in memory must not be lost
        self._file.close()
        dropped = _size(self._earlier)
        try:
            self.path.replace(self._earlier)
        except OSError:
            pass
        else:
            self._base += dropped
            self._size = 0
        self._file = FileAppender(self.path)


class RecordedPlannerLog:
    """Reads the planner log that a flight left, as far as it was written at a time of that flight. Never raises."""

    def __init__(self, flight: Path) -> None:
        """Read beside the telemetry log `flight`; the files are read with the first question."""
        self._files = log_files(flight)
        self._lines: list[PlannerLogLine] = []
        self._ends = [0]
        """The place after each line; the first is where the log begins."""
        self._is_read = False

    def piece(self, request: GetPlannerLog, until_wall_s: float) -> PlannerLogPiece | None:
        """Return the lines asked for among those written until then; None if the flight left no log."""
        self._read()
        if not self._lines:
            return None
        top = bisect_right(self._lines, until_wall_s, key=lambda line: line.wall_s)
        asked = top if request.at == PLANNER_LOG_END else min(bisect_left(self._ends, request.at), top)
        if request.newer:
            first, last = asked, max(asked, min(top, bisect_right(self._ends, self._ends[asked] + PIECE_BYTES) - 1))
        else:
            first, last = bisect_left(self._ends, self._ends[asked] - PIECE_BYTES), asked
        places = self._ends[first], self._ends[last]
        return PlannerLogPiece(tuple(self._lines[first:last]), *places, first == 0, 0, str(self._files[0]))

    def _read(self) -> None:
        if self._is_read:
            return
        self._is_read = True
        newest, earlier = self._files
        for path in (earlier, newest):
            for raw in _bytes_of(path, 0, MAX_FILE_BYTES).split(b"\n"):
                if (line := _parsed(raw)) is not None:
                    self._lines.append(line)
                    self._ends.append(self._ends[-1] + len(raw) + 1)
        # A clock that was set back while recording: lines stay in the order in which they came.
        for at in range(1, len(self._lines)):
            before_s = self._lines[at - 1].wall_s
            if self._lines[at].wall_s < before_s:
                self._lines[at] = replace(self._lines[at], wall_s=before_s)


def _parsed(raw: bytes) -> PlannerLogLine | None:
    """Return the line in `raw`; None if it is none, because a crash cut it or an older version wrote it."""
    try:
        when, team, planner, level, text = raw.decode("utf-8", "replace").split("\t", 4)
        wall_s = datetime.fromisoformat(when).timestamp()
        # Anybody may have written into the file: what is shown is cleaned again.
        names = clean(team, MAX_NAME_CELLS), clean(planner, MAX_NAME_CELLS)
        return PlannerLogLine(wall_s, *names, PlannerLogLevel(level), clean(text, MAX_TEXT_CELLS))
    except (ValueError, OverflowError, OSError):
        return None


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _bytes_of(path: Path, offset: int, count: int) -> bytes:
    try:
        with path.open("rb") as file:
            file.seek(offset)
            return file.read(count)
    except OSError:
        return b""
