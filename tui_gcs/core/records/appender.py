"""File appender: appends records to a file that may fail; the flight goes on, and so does the file when it can."""

import os
import weakref
from collections import deque
from pathlib import Path

WRITE_AT_BYTES = 64 * 1024
"""Records are written when this much is queued, or at a flush."""
MAX_WAITING_BYTES = 16 * 1024 * 1024
"""Kept in memory while the disk refuses: minutes of eight vehicles. Then the oldest records are dropped."""


class FileAppender:
    """Queues records in memory and writes them in whole pieces; never raises.

    A disk that is full or gone is described in `error` and tried again at every flush. A piece of which a part reached
    the disk is completed first, so the file is torn only at its very end.
    """

    def __init__(self, path: Path | str, max_waiting_bytes: int = MAX_WAITING_BYTES) -> None:
        """Append to `path`; directories are made as needed."""
        self.path = Path(path)
        self.error = ""
        """Why the file cannot be written at present; "" if it can."""
        self.dropped = 0
        """How many records were lost because the disk failed for too long."""
        self._max_waiting_bytes = max_waiting_bytes
        self._waiting: deque[tuple[bytes, int]] = deque()
        """(piece, number of records in it)."""
        self._waiting_bytes = 0
        self._begun = b""
        """Rest of a piece that is partly on disk, and can no longer be dropped."""
        self._file: int | None = None
        self._release: weakref.finalize[[int], FileAppender] | None = None
        """Closes the file, at the latest when the appender is garbage collected."""
        self._closed = False

    def put(self, piece: bytes, records: int = 1) -> None:
        """Append one record, or several that stay or go together; on disk after the next `flush` at the latest."""
        if self._closed:
            self.dropped += records
            return
        self._waiting.append((piece, records))
        self._waiting_bytes += len(piece)
        if self._waiting_bytes >= WRITE_AT_BYTES and not self.error:
            self.flush()
        while self._waiting_bytes > self._max_waiting_bytes:
            oldest, lost = self._waiting.popleft()
            self._waiting_bytes -= len(oldest)
            self.dropped += lost

    def flush(self) -> None:
        """Hand everything to the operating system, or set `error`."""
        try:
            while self._begun or self._waiting:
                self._write_some()
        except OSError as error:
            self.error = f"{self.path}: {error.strerror or error}"
        else:
            self.error = ""

    def close(self) -> None:
        """Flush and close the file."""
        if self._closed:
            return
        self.flush()
        self._closed = True
        if self._release is not None:
            self._release()
            self._release, self._file = None, None

    def _write_some(self) -> None:
        """Write what waits in one piece, and keep what did not fit. Raises OSError."""
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            self._release = weakref.finalize(self, os.close, self._file)
        # One write for everything: a full disk takes a part of it, which `_begun` completes later.
        written = os.write(self._file, b"".join((self._begun, *(piece for piece, _ in self._waiting))))
        if written < len(self._begun):
            self._begun = self._begun[written:]
            return
        written -= len(self._begun)
        self._begun = b""
        while written > 0:
            piece, _ = self._waiting.popleft()
            self._waiting_bytes -= len(piece)
            self._begun = piece[written:]
            written -= len(piece)
