"""What a vehicle has under way beside flying: long lists, bursts, retries, calibrations.

A task is a generator that yields how many microseconds it wants to wait before it goes on. A vehicle without tasks
pays one comparison per tick.
"""

from collections.abc import Callable, Iterator

Task = Iterator[int]

NEVER_US = 1 << 62


class Tasks:
    """Tasks of one vehicle by name; a new one of the same name takes the old one's place."""

    def __init__(self) -> None:
        self._due_us: dict[str, int] = {}
        self._tasks: dict[str, Task] = {}
        self.next_us = NEVER_US
        """When something is due; compare before calling `run`."""

    def __contains__(self, name: str) -> bool:
        return name in self._tasks

    def start(self, name: str, task: Task, now_us: int) -> None:
        """Run `task` up to its first wait now, the rest when it is due."""
        self.stop(name)
        self._tasks[name] = task
        self._due_us[name] = now_us
        self._go_on(name, task, now_us)
        self._reckon()

    def after(self, name: str, wait_us: int, act: Callable[[], None], now_us: int) -> None:
        """Call `act` once, `wait_us` from now."""
        self.start(name, _once(wait_us, act), now_us)

    def stop(self, name: str) -> None:
        """End a task; nothing happens if there is none of that name."""
        self._tasks.pop(name, None)
        self._due_us.pop(name, None)
        self._reckon()

    def clear(self) -> None:
        """End all (reboot)."""
        self._tasks.clear()
        self._due_us.clear()
        self.next_us = NEVER_US

    def run(self, now_us: int) -> None:
        """Let everything due by `now_us` go on. Waits count from when they were due, so rates are exact."""
        for name, task in list(self._tasks.items()):
            self._go_on(name, task, now_us)
        self._reckon()

    def _go_on(self, name: str, task: Task, now_us: int) -> None:
        while self._tasks.get(name) is task and self._due_us[name] <= now_us:
            self._advance(name, task, self._due_us[name])

    def _advance(self, name: str, task: Task, at_us: int) -> None:
        try:
            wait_us = next(task)
        except StopIteration:
            wait_us = None
        if self._tasks.get(name) is not task:
            return  # it ended or replaced itself
        if wait_us is None:
            self.stop(name)
        else:
            self._due_us[name] = at_us + wait_us

    def _reckon(self) -> None:
        self.next_us = min(self._due_us.values(), default=NEVER_US)


def _once(wait_us: int, act: Callable[[], None]) -> Task:
    yield wait_us
    act()
