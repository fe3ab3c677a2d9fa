"""PARAM_REQUEST_LIST: all parameters, one message each; what was lost is asked for by index.

Names count, not indices: PX4's shift when more parameters come into use. Values with index 65535 are answers to other
questions, and no progress (ardupilot.md).
"""

from collections.abc import Callable

NO_INDEX = 65535
MOST_COUNT = 4096
LIST_TRIES = 4
FIRST_WAIT_S, SLOW_FIRST_WAIT_S = 3.0, 6.0
"""ArduPilot needs up to 4.5 s for all of them while it boots."""
QUIET_S, SLOW_QUIET_S = 0.7, 2.5
"""Silence after which the stream is over; PX4 sends 8 a second over a radio (mavlink.md C4)."""
AT_ONCE, SLOW_AT_ONCE = 10, 3
ASK_GAP_S, SLOW_ASK_GAP_S = 0.25, 1.5
"""After so long without an answer one index is asked for again."""
MOST_VAIN = 200
"""Questions in a row that brought nothing."""
RELIST_GAP_S = 10.0
"""When the number of parameters changed all are asked for again, at most so often (security.md B.6-67)."""
LONGEST_S = 900.0


class ParamLister:
    """Decides what to ask next; `over` once `error` tells how it ended."""

    def __init__(
        self, ask_list: Callable[[], None], ask_index: Callable[[int], None], now: float, *, slow: bool
    ) -> None:
        """Asks for the list at once."""
        self._ask_list, self._ask_index = ask_list, ask_index
        self._begun_s = now
        self._first_s = SLOW_FIRST_WAIT_S if slow else FIRST_WAIT_S
        self._quiet_s = SLOW_QUIET_S if slow else QUIET_S
        self._at_once = SLOW_AT_ONCE if slow else AT_ONCE
        self.count = 0
        """As announced last."""
        self.names: set[str] = set()
        self._seen: set[int] = set()
        self._asked_s: dict[int, float] = {}
        """Indices asked for and not answered, and when they are due again."""
        self._due_s = now + self._first_s
        self._lists = 1
        self._listed_s = now
        self._ask_gap_s = SLOW_ASK_GAP_S if slow else ASK_GAP_S
        self._vain = 0
        self._shifted = False
        self.over = False
        self.error = ""
        ask_list()

    def hear(self, name: str, index: int, count: int, now: float) -> None:
        """A PARAM_VALUE came."""
        if self.over or index == NO_INDEX:
            return
        if count != self.count:
            self._shifted = self.count > 0
            self.count = count
        new = name not in self.names or index not in self._seen
        if len(self.names) < MOST_COUNT:
            self.names.add(name)
        if index < min(count, MOST_COUNT):
            self._seen.add(index)
        if not new or self._look_whole():
            return
        self._vain = 0
        if self._asked_s.pop(index, None) is not None:
            self._ask_more(now)
        elif not self._asked_s:
            self._due_s = now + self._quiet_s

    def tick(self, now: float) -> None:
        """Ask again for what did not come."""
        if self.over or now < self._due_s:
            return
        if now - self._begun_s > LONGEST_S:
            self._end("it took too long")
        elif not self._seen and not self.names:
            self._list_again(now, "no answer")
        else:
            self._ask_more(now)

    def _look_whole(self) -> bool:
        """Whether all are there."""
        whole = 0 < self.count <= len(self.names) and (not self._shifted or len(self._seen) >= self.count)
        if whole and len(self._seen) >= self.count:
            self._end("")
        return self.over

    def _ask_more(self, now: float) -> None:
        """Keep some questions under way: the first that are missing."""
        missing = [i for i in range(min(self.count, MOST_COUNT)) if i not in self._seen]
        if not missing:  # all indices came, but not as many names: they shifted under way
            self._asked_s.clear()
            self._relist(now)
            return
        for index in missing[: self._at_once]:
            if now >= self._asked_s.get(index, 0.0):
                self._vain += 1
                self._asked_s[index] = now + self._ask_gap_s
                self._ask_index(index)
        if self._vain > MOST_VAIN:
            self._end(f"{len(self.names)} of {self.count} came")
        self._due_s = min(self._asked_s.values(), default=now + self._quiet_s)

    def _relist(self, now: float) -> None:
        if self.count > MOST_COUNT:
            self._end(f"{self.count} parameters are announced, at most {MOST_COUNT} are taken")
        elif now - self._listed_s < RELIST_GAP_S:
            self._due_s = self._listed_s + RELIST_GAP_S
        else:
            self._seen.clear()
            self._list_again(now, "the number of parameters keeps changing")

    def _list_again(self, now: float, why: str) -> None:
        if self._lists >= LIST_TRIES:
            self._end(why)
            return
        self._lists += 1
        self._listed_s = now
        self._shifted = False
        self._due_s = now + self._first_s
        self._ask_list()

    def _end(self, error: str) -> None:
        self.over, self.error = True, error
