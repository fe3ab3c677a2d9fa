"""A download as the wire sees it: count, items one after the other, an end.

PX4 wants items asked for strictly in order. It ends the transfer with ERROR when an old copy of a question comes late,
and without a word after 5 s of silence: then it is begun anew. ArduPilot refuses to be read (DENIED) while it believes
to be in an upload, for up to 8 s: it is asked again. A count that changes begins it anew once (docs/threats.md B.6-53);
one above the most that we read is refused.
"""

import math
from typing import Any

from tui_gcs.core.plans.check import MOST_ITEMS
from tui_gcs.core.plans.model import PlanItem
from tui_gcs.core.services.plans.plan_messages import (
    ACCEPTED,
    CANCELLED,
    DENIED,
    PlanChannel,
    RetryTimer,
    item_of,
    result_word,
)

TRIES, COUNT_TRIES = 20, 12
"""Of one question: at 30 % loss each way one in a million fails; of the first, for whoever knows no plans at all."""
MAX_RESTARTS, MAX_RECOUNTS = 5, 1
BUSY_S, BUSY_GAP_S = 12.0, 1.0


class DownloadDialogue:
    """One download; `items` are complete once it is `over` without an `error`."""

    def __init__(
        self, wire: PlanChannel, pace: RetryTimer, *, gives_up_s: float = math.inf, count_only: bool = False
    ) -> None:
        """`gives_up_s`: see `PlanDialect`; `count_only`: how many there are is all that is asked."""
        self._wire = wire
        self._pace = pace
        self._gives_up_s = gives_up_s
        self._count_only = count_only
        self.over = False
        self.error = ""
        self.count: int | None = None
        self.opaque_id = 0
        self._items: dict[int, PlanItem] = {}
        self._wanted = 0
        """The item that is asked for now."""
        self._tries, self._asked_s, self._next_s, self._first_s = 0, 0.0, 0.0, 0.0
        self._heard_s = 0.0
        self._restarts = self._recounts = 0

    @property
    def items(self) -> tuple[PlanItem, ...]:
        """What has come, in order."""
        return tuple(self._items[seq] for seq in sorted(self._items))

    @property
    def come(self) -> int:
        """How many have come."""
        return len(self._items)

    def begin(self, now: float) -> None:
        """Ask how many there are."""
        self._first_s = now
        self._again(now)

    def tick(self, now: float) -> None:
        """Ask again for what did not come."""
        if self.over or now < self._next_s:
            return
        self._pace.lost()
        if self.count is not None and now - self._heard_s > self._gives_up_s:
            self._restart(f"{self._wire.item(self._wanted, self.count)} does not come", now)
        elif self._tries < (COUNT_TRIES if self.count is None else TRIES):
            self._ask(now)
        elif self.count is None:
            self._fail("no answer")
        else:
            self._restart(f"{self._wire.item(self._wanted, self.count)} does not come", now)

    def hear(self, name: str, fields: dict[str, Any], now: float) -> None:
        """A message about this kind of plan, for us."""
        if self.over:
            return
        self._heard_s = now
        if name == "MISSION_COUNT":
            self._on_count(fields["count"], fields.get("opaque_id", 0), now)
        elif name == "MISSION_ITEM_INT":
            self._on_item(fields, now)
        elif name == "MISSION_ACK" and fields["type"] != ACCEPTED:
            self._on_nack(fields["type"], now)

    # ------------------------------------------------------------ what the vehicle says

    def _on_count(self, count: int, opaque_id: int, now: float) -> None:
        if count > MOST_ITEMS and not self._count_only:
            self._wire.end(CANCELLED)
            self._fail(f"the vehicle says that it holds {count} items; at most {MOST_ITEMS} are read")
            return
        if self.count is None:
            self._measure(now)
        elif count == self.count:
            return
        else:
            self._recounts += 1
            if self._recounts > MAX_RECOUNTS:
                self._wire.end(CANCELLED)
                self._fail(f"the number of its items changes: {self.count}, then {count}")
                return
        self.count, self.opaque_id = count, opaque_id
        self._items.clear()
        if count == 0 or self._count_only:
            self._end()
        else:
            self._want(0, now)

    def _on_item(self, fields: dict[str, Any], now: float) -> None:
        seq = fields["seq"]
        if self.count is None or seq >= self.count or seq in self._items:
            return
        self._items[seq] = item_of(fields)
        if seq == self._wanted:
            self._measure(now)
        missing = next((i for i in range(self._wanted, self.count) if i not in self._items), None)
        if missing is not None:
            if missing != self._wanted:
                self._want(missing, now)
        elif len(self._items) == self.count:
            self._end()

    def _on_nack(self, result: int, now: float) -> None:
        if result == DENIED and now - self._first_s < BUSY_S:
            self.count, self._tries, self._next_s = None, 0, now + BUSY_GAP_S
            self._items.clear()
        else:
            self._restart(result_word(result), now)

    # ------------------------------------------------------------ what we say

    def _want(self, seq: int, now: float) -> None:
        self._wanted, self._tries = seq, 0
        self._ask(now)

    def _again(self, now: float) -> None:
        self.count, self._tries = None, 0
        self._items.clear()
        self._ask(now)

    def _ask(self, now: float) -> None:
        self._tries += 1
        self._asked_s, self._next_s = now, now + self._pace.wait_s
        if self.count is None:
            left = self._wire.ask("MISSION_REQUEST_LIST")
        else:
            left = self._wire.ask("MISSION_REQUEST_INT", seq=self._wanted)
        if not left:
            self._fail(self._wire.refused)

    def _measure(self, now: float) -> None:
        if self._tries == 1:
            self._pace.measured(now - self._asked_s)

    def _restart(self, why: str, now: float) -> None:
        self._restarts += 1
        if self._restarts > MAX_RESTARTS:
            self._fail(why)
        else:
            self._again(now)

    def _end(self) -> None:
        self._wire.end(ACCEPTED)
        self.over = True

    def _fail(self, why: str) -> None:
        self.over, self.error = True, why
