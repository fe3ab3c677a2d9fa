"""How far plans on their way are, and how long they take yet, by the pace that was measured. Plain, no feed.

A step is one item sent, or one item read back: the station counts both, because nothing is on board before it was read.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from tui_gcs.core.protocol.services import TaskInfo

WAYS = 2
"""An item goes there and is read back."""
ENDS = 2
"""What begins and ends a plan (counts, verdicts) takes about as long as so many steps."""
SETTLED_S = 1.0
"""No time is foretold from less than this."""


@dataclass
class TransferPace:
    """One plan on its way: how long it has been moving, which is not how long ago it was ordered."""

    done: int = 0
    total: int = 0
    moving_s: float = 0.0
    _seen_s: float | None = None

    def look(self, info: TaskInfo, now_s: float) -> None:
        """How it stands now."""
        if info.state == "queued":
            self._seen_s = None
            return
        if self._seen_s is not None:
            self.moving_s += now_s - self._seen_s
        self._seen_s = now_s
        self.done, self.total = info.done, info.total

    @property
    def left_s(self) -> float:
        """About so long yet; infinite while that cannot be told. Never 0 before it is over."""
        if not self.done or self.moving_s < SETTLED_S:
            return math.inf
        return self.moving_s / self.done * (self.total - self.done + ENDS)

    def words(self, info: TaskInfo) -> str:
        """`waits for vehicle 3`, `34 %, 1:20 left`."""
        if info.state == "queued":
            return f"waits for {info.text.partition(':')[0]}" if info.text else "waits"
        if not self.total:
            return ""
        left = f", {minutes(self.left_s)} left" if math.isfinite(self.left_s) else ""
        return f"{100 * self.done // self.total} %{left}"


def steps_of(counts: Iterable[int]) -> int:
    """Of plans of so many items each; none for empty ones."""
    return sum(WAYS * count + ENDS for count in counts if count)


def all_words(done: float, total: int, since_s: float) -> str:
    """Of all together: `35 %, about 1:20 left`, queues and all, because the pace is that of all together."""
    if not total:
        return ""
    left_s = since_s / done * (total - done) if done and since_s >= SETTLED_S else math.inf
    left = f", about {minutes(left_s)} left" if math.isfinite(left_s) else ""
    return f"{math.floor(100 * done / total)} %{left}"


def minutes(seconds: float) -> str:
    """`0:20`, `4:05`, `1:04:05`."""
    whole, rest = divmod(math.ceil(seconds), 60)
    hours, whole = divmod(whole, 60)
    return f"{hours}:{whole:02d}:{rest:02d}" if hours else f"{whole}:{rest:02d}"
