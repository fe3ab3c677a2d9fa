"""How far plans on their way are, and how long they still take at the measured pace.

A step is one item sent, or one item read back: the station counts both, because nothing is on board before it was read.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from tui_gcs.core.protocol.services import TaskInfo

STEPS_PER_ITEM = 2
"""An item is sent and read back."""
END_STEPS = 2
"""The begin and end of a plan (count, verdict) take about as long as this many steps."""
SETTLED_S = 1.0
"""No remaining time is computed from a shorter measurement."""


@dataclass
class TransferPace:
    """One plan on its way: its steps, and the time in which it moved, without that in the station's queue."""

    done: int = 0
    total: int = 0
    moving_s: float = 0.0
    _seen_s: float | None = None

    def look(self, info: TaskInfo, now_s: float) -> None:
        """Take how the station's task stands now."""
        if info.state == "queued":
            self._seen_s = None
            return
        if self._seen_s is not None:
            self.moving_s += now_s - self._seen_s
        self._seen_s = now_s
        self.done, self.total = info.done, info.total

    @property
    def left_s(self) -> float:
        """Remaining time; infinite while it is not known. It is never 0 before the end."""
        if not self.done or self.moving_s < SETTLED_S:
            return math.inf
        return self.moving_s / self.done * (self.total - self.done + END_STEPS)

    def words(self, info: TaskInfo) -> str:
        """Progress in words: `waits for vehicle 3`, `34 %, 1:20 left`."""
        if info.state == "queued":
            return f"waits for {info.text.partition(':')[0]}" if info.text else "waits"
        if not self.total:
            return ""
        left = f", {minutes(self.left_s)} left" if math.isfinite(self.left_s) else ""
        return f"{100 * self.done // self.total} %{left}"


def steps_of(counts: Iterable[int]) -> int:
    """Number of steps of plans with these numbers of items; an empty plan has none."""
    return sum(STEPS_PER_ITEM * count + END_STEPS for count in counts if count)


def all_words(done: float, total: int, since_s: float) -> str:
    """Progress of all plans together: `35 %, about 1:20 left`. Waiting in queues is part of this pace."""
    if not total:
        return ""
    left_s = since_s / done * (total - done) if done and since_s >= SETTLED_S else math.inf
    left = f", about {minutes(left_s)} left" if math.isfinite(left_s) else ""
    return f"{math.floor(100 * done / total)} %{left}"


def minutes(seconds: float) -> str:
    """A duration in words: `0:20`, `4:05`, `1:04:05`."""
    whole, rest = divmod(math.ceil(seconds), 60)
    hours, whole = divmod(whole, 60)
    return f"{hours}:{whole:02d}:{rest:02d}" if hours else f"{whole}:{rest:02d}"
