"""Duplicate filter: frames that arrive over several paths count once, over whichever path brings them first."""

from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.mavlink.frames import MAGIC_V2

WINDOW_S = 3.0
"""Frames are remembered for this long: more than one path is slower than another."""
POSITION = b"\x21\0\0"
"""Message id of GLOBAL_POSITION_INT in a version 2 frame; its payload begins with the boot time."""
MAX_FRAMES = 4096
"""Frames remembered of one vehicle: 3 s of one that sends very much."""


class DuplicateFilter:
    """The newest frames of one vehicle, and which paths brought them."""

    def __init__(self) -> None:
        self._frames: dict[bytes, tuple[float, tuple[Path, ...], bool]] = {}
        """(when it first came, paths that brought it, whether an accepted path did) by frame."""
        self._positions: dict[bytes, tuple[float, Path]] = {}
        """(when it first came, path that brought it, an accepted one if any did) by payload of a position."""

    def __len__(self) -> int:
        return len(self._frames)

    def is_first(self, raw: bytes, path: Path, now: float, *, accepted: bool = True) -> bool:
        """Record that `path` brought this frame, and return whether no accepted path had brought it before.

        A source that repeats frames faster than the original arrives cannot keep the original from being counted,
        because copies over paths that are not accepted do not count.
        """
        if raw[7:10] == POSITION and raw[0] == MAGIC_V2:
            self._compare_position(raw, path, now)
        known = self._frames.get(raw)
        if known is None:
            if len(self._frames) < MAX_FRAMES:
                self._frames[raw] = (now, (path,), accepted)
            return True
        since_s, paths, counted = known
        self._frames[raw] = (since_s, paths if path in paths else (*paths, path), counted or accepted)
        return not counted

    def is_copy(self, raw: bytes, path: Path) -> bool:
        """Return whether another path brought this frame and this one has not.

        Then it is no replay, and was checked already.
        """
        known = self._frames.get(raw)
        return known is not None and path not in known[1]

    def prune(self, now: float) -> None:
        """Forget frames older than `WINDOW_S`."""
        self._frames = {raw: known for raw, known in self._frames.items() if now - known[0] < WINDOW_S}
        self._positions = {payload: known for payload, known in self._positions.items() if now - known[0] < WINDOW_S}

    def _compare_position(self, raw: bytes, path: Path, now: float) -> None:
        """Count positions that `path` and an accepted path both bring."""
        # Autopilots number the frames of each link separately, so whole frames never match across links: payloads do.
        payload = raw[10 : 10 + raw[1]]
        known = self._positions.get(payload)
        if known is None:
            if len(self._positions) < MAX_FRAMES and any(payload[4:12]):
                self._positions[payload] = (now, path)
        elif known[1].state is PathState.USED:
            path.matching_positions += path.state is not PathState.USED
        # Agreement between two paths that are not accepted proves nothing.
        elif path.state is PathState.USED:
            known[1].matching_positions += 1
            self._positions[payload] = (known[0], path)
