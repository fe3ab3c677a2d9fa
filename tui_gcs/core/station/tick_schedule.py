"""The tick schedule: an ordered list of tasks, each with its period, that run on the caller's thread."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock

EVERY_TICK = 0.0


@dataclass(frozen=True)
class TickTask:
    """One thing that the station does again and again."""

    name: str
    run: Callable[[], Iterator[None] | None]
    """An iterator is run to its end in the same tick; between its pieces requests may be answered."""
    period_s: float | Callable[[], float] = EVERY_TICK
    """The least time from one run to the next; a function is called at each run."""
    serves: bool = False
    """Whether requests may be answered after it: only where the parts agree with each other."""


class TickSchedule:
    """Runs the tasks that are due, always in the same order."""

    def __init__(self, tasks: Sequence[TickTask], clock: Clock) -> None:
        self._tasks = tuple(tasks)
        self._clock = clock
        self._next_s = [-math.inf] * len(self._tasks)

    def run_due(self) -> Iterator[None]:
        """Run what is due; yields where requests may be answered."""
        for index, task in enumerate(self._tasks):
            if self._is_due(index, task):
                pieces = task.run()
                if pieces is not None:
                    yield from pieces
            if task.serves:
                yield

    def _is_due(self, index: int, task: TickTask) -> bool:
        if task.period_s == EVERY_TICK:
            return True
        now = self._clock.now()
        # Ticks are added up in floating point: without the slack a period of whole ticks would slip by one.
        if now < self._next_s[index] - 1e-9:
            return False
        self._next_s[index] = now + (task.period_s() if callable(task.period_s) else task.period_s)
        return True
