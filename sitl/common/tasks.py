"""Activities of a vehicle beside flying: long lists, bursts, retries, calibrations.

A task is a generator that yields how many microseconds to wait before it goes on. A vehicle without tasks costs one
comparison per tick.
"""

from collections.abc import Callable, Iterator

Task = Iterator[int]

NEVER_US = 1 << 62


class Tasks:
    """Tasks of one vehicle by name; a new task replaces the old one of its name."""

    def __init__(self) -> None:
        self._due_us: dict[str, int] = {}
        self._tasks: dict[str, Task] = {}
        self.next_us = NEVER_US
        """When the next task is due; compare it with the time before calling `run`."""

    def __contains__(self, name: str) -> bool:
        return name in self._tasks

    def start(self, name: str, task: Task, now_us: int) -> None:
        """Run `task` up to its first wait now, and the rest when it is due."""
        self.stop(name)
        self._tasks[name] = task
        self._due_us[name] = now_us
        self._continue(name, task, now_us)
        self._update_next()

    def after(self, name: str, wait_us: int, act: Callable[[], None], now_us: int) -> None:
        """Call `act` once, `wait_us` from now."""
        self.start(name, _once(wait_us, act), now_us)

    def stop(self, name: str) -> None:
        """End the task of that name, if there is one."""
        self._tasks.pop(name, None)
        self._due_us.pop(name, None)
        self._update_next()

    def clear(self) -> None:
        """End all tasks, as a reboot does."""
        self._tasks.clear()
        self._due_us.clear()
        self.next_us = NEVER_US

    def run(self, now_us: int) -> None:
        """Continue all tasks that are due by `now_us`.

        A wait counts from the time when the one before it was over, so rates are exact.
        """
        for name, task in list(self._tasks.items()):
            self._continue(name, task, now_us)
        self._update_next()

    def _continue(self, name: str, task: Task, now_us: int) -> None:
        while self._tasks.get(name) is task and self._due_us[name] <= now_us:
            self._advance(name, task, self._due_us[name])

    def _advance(self, name: str, task: Task, at_us: int) -> None:
        try:
            wait_us = next(task)
        except StopIteration:
            wait_us = None
        # A task may end itself, or start another one of its name.
        if self._tasks.get(name) is not task:
            return
        if wait_us is None:
            self.stop(name)
        else:
            self._due_us[name] = at_us + wait_us

    def _update_next(self) -> None:
        self.next_us = min(self._due_us.values(), default=NEVER_US)


def _once(wait_us: int, act: Callable[[], None]) -> Task:
    yield wait_us
    act()
