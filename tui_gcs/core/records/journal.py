"""The journal: what was done and why, one JSON object per line, written through at once."""

from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.records.appender import FileAppender

_MAX_WAITING_BYTES = 4 * 1024 * 1024
_encoder = msgspec.json.Encoder(enc_hook=str)


class Journal(FileAppender):
    """Appends records; a line is on its way to the disk when `write` returns. Never raises."""

    def __init__(self, path: Path | str) -> None:
        """Write to `path`. If a crash left half a line there, it is ended first."""
        super().__init__(path, _MAX_WAITING_BYTES)
        if _ends_in_half_a_line(self.path):
            self.put(b"\n")

    def write(self, record: dict[str, Any]) -> None:
        """Append `record`. Numbers that are not finite become null; what JSON does not know becomes text."""
        try:
            line = _encoder.encode(record)
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            # A record that JSON cannot express must not be lost, nor stop the flight.
            line = _encoder.encode({"not_journalled": ascii(record)[:2000], "why": ascii(error)})
        self.put(line + b"\n")
        self.flush()


def _ends_in_half_a_line(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            file.seek(-1, 2)
            return file.read(1) != b"\n"
    except OSError:  # not there yet, or empty
        return False
