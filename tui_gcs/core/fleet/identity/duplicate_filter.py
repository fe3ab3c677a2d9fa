"""Frames of a vehicle that come over several paths: each counts once, whichever path brings it first."""

from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.mavlink.frames import MAGIC_V2

WINDOW_S = 3.0
"""Longer than one path is slower than another."""
POSITION = b"\x21\0\0"
"""GLOBAL_POSITION_INT, which begins with the boot time, in a version 2 frame."""
MAX_FRAMES = 4096
"""Of one vehicle: 3 s of a very talkative one."""


class DuplicateFilter:
    """The newest frames of one vehicle, and who brought them."""

    def __init__(self) -> None:
        """None yet."""
        self._brought: dict[bytes, tuple[float, tuple[Path, ...], bool]] = {}
        """When it came first, who brought it, and whether one of these is accepted."""
        self._news: dict[bytes, tuple[float, Path]] = {}
        """Payloads of positions: when they came first, and who brought them, an accepted path before all others."""

    def __len__(self) -> int:
        return len(self._brought)

    def is_first(self, raw: bytes, path: Path, now: float, *, accepted: bool = True) -> bool:
        """Note that `path` brought this frame; whether no accepted one did before.

        Who repeats frames faster than they come may not keep them from being counted.
        """
        if raw[7:10] == POSITION and raw[0] == MAGIC_V2:
            self._compare_news(raw, path, now)
        known = self._brought.get(raw)
        if known is None:
            if len(self._brought) < MAX_FRAMES:
                self._brought[raw] = (now, (path,), accepted)
            return True
        since_s, paths, counted = known
        self._brought[raw] = (since_s, paths if path in paths else (*paths, path), counted or accepted)
        return not counted

    def is_copy(self, raw: bytes, path: Path) -> bool:
        """Whether another path brought this frame, and this one has not yet: no replay, and checked already."""
        known = self._brought.get(raw)
        return known is not None and path not in known[1]

    def prune(self, now: float) -> None:
        """Forget what is old."""
        self._brought = {raw: known for raw, known in self._brought.items() if now - known[0] < WINDOW_S}
        self._news = {said: known for said, known in self._news.items() if now - known[0] < WINDOW_S}

    def _compare_news(self, raw: bytes, path: Path, now: float) -> None:
        """Autopilots number the frames of each link by themselves: only what a position says is the same."""
        said = raw[10 : 10 + raw[1]]
        known = self._news.get(said)
        if known is None:
            if len(self._news) < MAX_FRAMES and any(said[4:12]):  # latitude, longitude: known
                self._news[said] = (now, path)
        elif known[1].state is PathState.USED:
            path.matching_positions += path.state is not PathState.USED
        elif path.state is PathState.USED:  # what two others agree on proves nothing
            known[1].matching_positions += 1
            self._news[said] = (known[0], path)
