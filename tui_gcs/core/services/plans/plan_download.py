"""The dialogue of one download: the count, the items one after the other, the end.

Measured behaviour that is handled here (docs/autopilots.md, missions of both autopilots):

* PX4 wants items requested strictly in order. It ends the transfer with ERROR when an old copy of a request comes
  late, and silently after 5 s of silence. Then the download begins anew.
* ArduPilot refuses to be read (DENIED) while it believes to be in an upload, for up to 8 s. Then it is asked again.
* A count that changes begins the download anew once (docs/threats.md B.6-53).
* A count above the most that is read is refused.
"""

import math
from typing import Any

from tui_gcs.core.plans.check import MAX_ITEMS
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
"""How often one request is sent: at 30 % loss each way one in a million fails. The second is for the first request,
which a vehicle without plans never answers."""
MAX_RESTARTS, MAX_RECOUNTS = 5, 1
BUSY_S, BUSY_GAP_S = 12.0, 1.0


class DownloadDialogue:
    """One download; `items` are complete once it is `over` without an `error`."""

    def __init__(
        self, channel: PlanChannel, timer: RetryTimer, *, gives_up_s: float = math.inf, count_only: bool = False
    ) -> None:
        """Prepare a download.

        Args:
            channel: Sends the messages.
            timer: The retry timer of this vehicle.
            gives_up_s: After this silence the vehicle has ended the transfer; see `PlanDialect`.
            count_only: Ask only how many items there are.
        """
        self._channel = channel
        self._timer = timer
        self._gives_up_s = gives_up_s
        self._count_only = count_only
        self.over = False
        self.error = ""
        self.count: int | None = None
        self.opaque_id = 0
        self._items: dict[int, PlanItem] = {}
        self._wanted = 0
        """The item that is requested now."""
        self._tries, self._asked_s, self._next_s, self._first_s = 0, 0.0, 0.0, 0.0
        self._last_heard_s = 0.0
        self._restarts = self._recounts = 0

    @property
    def items(self) -> tuple[PlanItem, ...]:
        """The items that have arrived, in order."""
        return tuple(self._items[seq] for seq in sorted(self._items))

    @property
    def received(self) -> int:
        """How many items have arrived."""
        return len(self._items)

    def begin(self, now: float) -> None:
        """Request the count of items."""
        self._first_s = now
        self._again(now)

    def tick(self, now: float) -> None:
        """Repeat the request when it is due."""
        if self.over or now < self._next_s:
            return
        self._timer.add_loss()
        if self.count is not None and now - self._last_heard_s > self._gives_up_s:
            self._restart(f"{self._channel.item(self._wanted, self.count)} does not come", now)
        elif self._tries < (COUNT_TRIES if self.count is None else TRIES):
            self._ask(now)
        elif self.count is None:
            self._fail("no answer")
        else:
            self._restart(f"{self._channel.item(self._wanted, self.count)} does not come", now)

    def on_message(self, name: str, fields: dict[str, Any], now: float) -> None:
        """Take a message about this kind of plan that is addressed to us."""
        if self.over:
            return
        self._last_heard_s = now
        if name == "MISSION_COUNT":
            self._on_count(fields["count"], fields.get("opaque_id", 0), now)
        elif name == "MISSION_ITEM_INT":
            self._on_item(fields, now)
        elif name == "MISSION_ACK" and fields["type"] != ACCEPTED:
            self._on_nack(fields["type"], now)

    def _on_count(self, count: int, opaque_id: int, now: float) -> None:
        # A vehicle may announce 65535 items (docs/threats.md B.6-53).
        if count > MAX_ITEMS and not self._count_only:
            self._channel.end(CANCELLED)
            self._fail(f"the vehicle reports {count} items; at most {MAX_ITEMS} are read")
            return
        if self.count is None:
            self._measure(now)
        elif count == self.count:
            return
        else:
            self._recounts += 1
            if self._recounts > MAX_RECOUNTS:
                self._channel.end(CANCELLED)
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
        # Items that were not requested, or arrive twice, change nothing.
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
        # ArduPilot believes to be in an upload for up to 8 s.
        if result == DENIED and now - self._first_s < BUSY_S:
            self.count, self._tries, self._next_s = None, 0, now + BUSY_GAP_S
            self._items.clear()
        else:
            self._restart(result_word(result), now)

    def _want(self, seq: int, now: float) -> None:
        self._wanted, self._tries = seq, 0
        self._ask(now)

    def _again(self, now: float) -> None:
        self.count, self._tries = None, 0
        self._items.clear()
        self._ask(now)

    def _ask(self, now: float) -> None:
        self._tries += 1
        self._asked_s, self._next_s = now, now + self._timer.wait_s
        if self.count is None:
            left = self._channel.ask("MISSION_REQUEST_LIST")
        else:
            left = self._channel.ask("MISSION_REQUEST_INT", seq=self._wanted)
        if not left:
            self._fail(self._channel.refused)

    def _measure(self, now: float) -> None:
        # Of several copies it is not known which one was answered.
        if self._tries == 1:
            self._timer.add_sample(now - self._asked_s)

    def _restart(self, why: str, now: float) -> None:
        self._restarts += 1
        if self._restarts > MAX_RESTARTS:
            self._fail(why)
        else:
            self._again(now)

    def _end(self) -> None:
        self._channel.end(ACCEPTED)
        self.over = True

    def _fail(self, why: str) -> None:
        self.over, self.error = True, why
