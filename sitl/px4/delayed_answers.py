"""Acknowledgements of PX4's commander, which come some milliseconds after the command."""

from sitl.common.command import Command
from sitl.common.platform import Part, Platform
from sitl.common.states import Result

COMMANDER_US = 5_000
"""How long the commander takes to answer (measured 2 to 10 ms)."""


class DelayedAnswers(Part):
    """Acknowledges commands after a while."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._count = 0

    def answer(self, command: Command, result: Result, wait_us: int = COMMANDER_US) -> None:
        """Acknowledge a command after `wait_us`, then send what was held back until now."""
        held = self._outbox.take_held()

        def act() -> None:
            self._outbox.answer(command, result)
            self._outbox.send_all(held)

        self._count += 1
        self._tasks.after(f"ack {self._count}", wait_us, act, self._clock.now_us)
