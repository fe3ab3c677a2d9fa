"""The journal: what was done and why, one JSON object per line, written through at once."""

from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.records.appender import FileAppender

_MAX_WAITING_BYTES = 4 * 1024 * 1024
_encoder = msgspec.json.Encoder(enc_hook=str)


class Journal:
    """Appends records; a line is on its way to the disk when `write` returns. Never raises."""

    def __init__(self, path: Path | str) -> None:
        """Write to `path`. If a crash left half a line there, it is ended first."""
        self._file = FileAppender(path, _MAX_WAITING_BYTES)
        if _ends_in_half_a_line(self._file.path):
            self._file.put(b"\n")

    @property
    def path(self) -> Path:
        """The path of the journal."""
        return self._file.path

    @property
    def error(self) -> str:
        """Why the journal cannot be written at present; "" if it can."""
        return self._file.error

    @property
    def dropped(self) -> int:
        """How many lines were lost because the disk failed for too long."""
        return self._file.dropped

    def write(self, record: dict[str, Any]) -> None:
        """Append `record`. Numbers that are not finite become null; what JSON does not know becomes text."""
        try:
            line = _encoder.encode(record)
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            # A record that JSON cannot express must not be lost, nor stop the flight.
            line = _encoder.encode({"not_journalled": ascii(record)[:2000], "why": ascii(error)})
        self._file.put(line + b"\n")
        self._file.flush()

    def close(self) -> None:
        """Flush and close the file."""
        self._file.close()


def _ends_in_half_a_line(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            file.seek(-1, 2)
            return file.read(1) != b"\n"
    except OSError:  # not there yet, or empty
        return False
