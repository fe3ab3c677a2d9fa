"""LOG_REQUEST_LIST: which logs there are. A vehicle without logs may answer with an empty entry or not at all."""

from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.fleet.fleet import Fields

MOST_LOGS = 4096
LAST = 0xFFFF
WAIT_S, SLOW_WAIT_S = 2.0, 4.0
QUIET_S, SLOW_QUIET_S = 0.6, 2.0
SILENT_TRIES, MOST_ROUNDS = 3, 20
"""Lists asked for without any answer; rounds in a row of asking for missing entries without one."""


@dataclass(frozen=True)
class LogEntry:
    """One log of a vehicle."""

    id: int
    size: int
    """Bytes; grows while it is written, and a little after disarming."""
    time_utc: int
    """Seconds since 1970; 0 if the vehicle does not know."""


class LogLister:
    """Decides what to ask next; `over` once all entries of `first` to `last` are there, or none come."""

    def __init__(
        self, ask: Callable[[int, int], None], now: float, *, slow: bool, first: int = 0, last: int = LAST
    ) -> None:
        """Asks at once."""
        self._ask, self._first, self._last = ask, first, last
        self._wait_s, self._quiet_s = (SLOW_WAIT_S, SLOW_QUIET_S) if slow else (WAIT_S, QUIET_S)
        self.entries: dict[int, LogEntry] = {}
        self.count = 0
        """How many there are, as announced."""
        self._newest = 0
        self._tries = self._rounds = 0
        self._due_s = 0.0
        self.over = False
        self.error = ""
        self.silent = False
        """Nothing came at all: there are none, or nobody listens."""
        self._ask_all(now)

    def hear(self, fields: Fields, now: float) -> None:
        """A LOG_ENTRY came."""
        if self.over:
            return
        self.count, self._newest = fields["num_logs"], fields["last_log_num"]
        if self.count == 0:
            self.over = True
            return
        number = fields["id"]
        if number not in self.entries and len(self.entries) < MOST_LOGS and self._first <= number <= self._last:
            self._rounds = 0
        if len(self.entries) < MOST_LOGS:
            self.entries[number] = LogEntry(number, fields["size"], fields["time_utc"])
        self._due_s = now + self._quiet_s
        self.over = not self._missing()

    def tick(self, now: float) -> None:
        """Ask again for what did not come."""
        if self.over or now < self._due_s:
            return
        if not self.count:
            if self._tries >= SILENT_TRIES:
                self.over = self.silent = True
            else:
                self._ask_all(now)
            return
        missing = self._missing()
        self._rounds += 1
        if self._rounds > MOST_ROUNDS:
            self.over, self.error = True, f"{len(self.entries)} of {self.count} entries came"
            return
        last = missing[0]
        while last + 1 in missing:
            last += 1
        self._due_s = now + self._quiet_s
        self._ask(missing[0], last)

    def _ask_all(self, now: float) -> None:
        self._tries += 1
        self._due_s = now + self._wait_s
        self._ask(self._first, self._last)

    def _missing(self) -> list[int]:
        """Which entries did not come, of those that were asked for."""
        if len(self.entries) >= min(self.count, MOST_LOGS):
            return []
        oldest = max(0, self._newest - self.count + 1)
        numbers = range(max(oldest, self._first), min(self._newest, self._last, oldest + MOST_LOGS) + 1)
        return [number for number in numbers if number not in self.entries]
