"""Tlog writer: the telemetry log of every frame of a run, both directions.

Format: 8 bytes big-endian microseconds since 1970, then the raw frame; repeated, no header, as Mission Planner,
MAVProxy and QGroundControl write it.
"""

import struct
from pathlib import Path

from tui_gcs.core.mavlink.frames import MAGIC_V2
from tui_gcs.core.records.appender import FileAppender

_SETUP_SIGNING = b"\x00\x01\x00"
"""Message id 256 in bytes 7 to 9 of a version 2 frame; version 1 has no room for it."""
# The year 2096. A wall clock that is set wrong must not make a file that cannot be written.
_MAX_WALL_S = 4e9
_TIME = struct.Struct(">Q")


class TlogWriter(FileAppender):
    """Writes a .tlog. Disk errors never raise: they are described in `error` and cost only the oldest frames."""

    def __init__(self, path: Path | str) -> None:
        """Write to `path`; an existing log is continued."""
        super().__init__(path)
        self.frames = 0

    def write(self, wall_s: float, raw: bytes) -> None:
        """Record one frame at Unix time `wall_s`; see `write_many`."""
        self.write_many(wall_s, [raw])

    def write_many(self, wall_s: float, raws: list[bytes]) -> None:
        """Record frames at Unix time `wall_s`. SETUP_SIGNING holds a key and is never written."""
        # Bytes 7 to 9 are the message id in version 2 frames only.
        kept = [raw for raw in raws if raw[7:10] != _SETUP_SIGNING or raw[0] != MAGIC_V2]
        if kept:
            stamp = _TIME.pack(round(min(max(0.0, wall_s), _MAX_WALL_S) * 1e6))
            # All frames of one wake-up share a time, so that one join makes all records.
            self.put(stamp + stamp.join(kept), len(kept))
            self.frames += len(kept)
