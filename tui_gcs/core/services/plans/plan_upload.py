"""An upload as the wire sees it: count, items as the vehicle asks for them, its verdict.

What was measured and is handled here (docs/autopilots.md; MAVLink guide):

* ArduPilot asks with the old MISSION_REQUEST, and only every second; a NACK "wrong sequence" does not end its
  transfer. So an item that nobody answers is sent again after a few round trips, and where that brings "wrong
  sequence", the vehicle has it already: the next one follows. That once, or copies would breed copies.
* PX4 refuses a count with ERROR while it is still busy with another transfer (5 s at most): the count is repeated. It
  acknowledges a last item that comes again once more, and gives up without a word.
* An ACCEPTED before all items were asked for may be a late copy of another one: only if nothing more is asked for
  it is a failure.
"""

from collections import Counter
from enum import Enum
from typing import Any

from tui_gcs.core.plans.model import PlanItem
from tui_gcs.core.services.plans.plan_messages import (
    ACCEPTED,
    CANCELLED,
    DENIED,
    ERROR,
    INVALID_SEQUENCE,
    PlanChannel,
    RetryTimer,
    result_word,
)

COUNT_TRIES = 12
"""At 20 % loss each way five in a million fail."""
COUNT_GAP_S = 1.5
BUSY_S = 10.0
"""So long a vehicle may be busy with another transfer: ArduPilot gives one up after 8 s, PX4 after 5 s."""
SILENT_TRIES = 20
"""An item is repeated so often without any answer: at 30 % loss each way one in a million fails."""
MAX_SENDS = 100
"""Of one item, asked for or not: a vehicle that asks for it for ever must not be answered for ever."""
NACK_S, SOFT_NACK_S = 0.6, 1.6
"""After a refusal its texts are waited for; after what may be no refusal, whether it asks on (ArduPilot: every 1 s)."""
EARLY_S = 4.0
MAX_ANEW = 2
LATE_S = 2.0
"""ArduPilot asks for items of an upload that was cancelled every second, until it is told of another."""


class UploadResult(Enum):
    """How an upload ended on the wire."""

    ACCEPTED = "accepted"
    DOUBTFUL = "all items were asked for, the verdict is not known"
    FAILED = "failed"


class UploadDialogue:
    """One upload of `items`."""

    def __init__(
        self, wire: PlanChannel, items: tuple[PlanItem, ...], pace: RetryTimer, *, patience_s: float, from_start: bool
    ) -> None:
        """`patience_s`: see `PlanDialect`; `from_start`: the mission is to begin with its first item."""
        self._wire = wire
        self._items = items
        self._pace = pace
        self._patience_s = patience_s
        self._from_start = from_start
        self.verdict: UploadResult | None = None
        self.error = ""
        self.opaque_id = 0
        """The vehicle's own number for the plan, 0 if it has none."""
        self.asked = 0
        """How many items were asked for, in order."""
        self._sends: Counter[int] = Counter()
        self._counts, self._first_s = 0, 0.0
        self._last, self._last_s = -1, 0.0
        self._silent, self._next_s = 0, 0.0
        self._repeated = False
        """The last item was sent by ourselves, and nothing came since."""
        self._nack: tuple[int, float] | None = None
        """A refusal, and when it is believed."""
        self._early_s: float | None = None
        self._busy = ""
        self._begun_anew = 0

    @property
    def _all_asked(self) -> bool:
        return self.asked == len(self._items)

    def _item(self, seq: int) -> str:
        return self._wire.item(seq, len(self._items))

    def begin(self, now: float) -> None:
        """Say how many come."""
        self._first_s = now
        self._say_count(now)

    def tick(self, now: float) -> None:
        """Repeat what is not answered; believe what was waited for."""
        if self.verdict is not None:
            return
        if self._nack is not None:
            if now >= self._nack[1]:
                self._refused(self._nack[0])
        elif self._early_s is not None and now - self._early_s >= EARLY_S:
            own, count = self._wire.own(self.asked), self._wire.own(len(self._items))
            self._fail(f"the vehicle accepted it after {own} of {count} items")
        elif now >= self._next_s:
            self._repeat(now)

    def hear(self, name: str, fields: dict[str, Any], now: float) -> None:
        """A message about this kind of plan, for us."""
        if self.verdict is not None:
            return
        if name in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            self._on_request(fields["seq"], now)
        elif name == "MISSION_ACK":
            self._on_ack(fields["type"], fields.get("opaque_id", 0), now)

    # ------------------------------------------------------------ what the vehicle says

    def _on_request(self, seq: int, now: float) -> None:
        if seq > self.asked or seq >= len(self._items):
            self._strange(seq, now)
            return
        if seq == self._last + 1 and (self._sends[self._last] == 1 if seq else self._counts == 1):
            self._pace.measured(now - self._last_s)
        self.asked = max(self.asked, seq + 1)
        self._nack, self._early_s, self._repeated, self._silent = None, None, False, 0
        self._send(seq, now)

    def _on_ack(self, result: int, opaque_id: int, now: float) -> None:
        if result == ACCEPTED:
            if self._all_asked:
                self.opaque_id = opaque_id
                self.verdict = UploadResult.ACCEPTED
            elif self._early_s is None:
                self._early_s = now
        elif result == INVALID_SEQUENCE:
            if self._repeated and self._last + 1 < len(self._items):
                self._repeated = False
                self.asked = max(self.asked, self._last + 2)
                self._send(self._last + 1, now)
        elif result in (ERROR, DENIED) and not self.asked:
            self._busy = f"the vehicle is busy with another transfer ({result_word(result)})"
            if now - self._first_s > BUSY_S:
                self._fail(self._busy)
        elif result == CANCELLED and self.asked and not self._all_asked and self._begun_anew < MAX_ANEW:
            self._begun_anew += 1
            self._begin_anew(now)
        elif self._nack is None:
            soft = result in (ERROR, DENIED)
            self._nack = (result, now + (SOFT_NACK_S if soft else NACK_S))

    def _strange(self, seq: int, now: float) -> None:
        """It asks for what is not its turn: at first that may still be for an upload that was cut off."""
        if self.asked or now - self._first_s > LATE_S:
            self._wire.end(CANCELLED)
            self._fail(f"the vehicle asks for {self._item(seq)} after {self._wire.own(self.asked)}")

    def _begin_anew(self, now: float) -> None:
        """ArduPilot gave up after 8 s in which nothing arrived: the link may be better now."""
        self.asked, self._last, self._silent, self._counts = 0, -1, 0, 0
        self._sends.clear()
        self._nack, self._early_s, self._repeated = None, None, False
        self.begin(now)

    # ------------------------------------------------------------ what we say

    def _say_count(self, now: float) -> None:
        self._counts += 1
        self._last_s, self._next_s = now, now + max(COUNT_GAP_S, self._pace.wait_s)
        if not self._wire.begin("upload", "MISSION_COUNT", count=len(self._items)):
            self._fail(self._wire.refused)

    def _send(self, seq: int, now: float) -> None:
        self._sends[seq] += 1
        if self._sends[seq] > MAX_SENDS:
            self._wire.end(CANCELLED)
            self._fail(f"the vehicle asks for {self._item(seq)} again and again")
            return
        self._last, self._last_s = seq, now
        self._next_s = now + max(self._pace.wait_s, self._patience_s)
        if not self._wire.part(self._items[seq], seq, current=self._from_start and seq == 0):
            self._fail(self._wire.refused)

    def _repeat(self, now: float) -> None:
        self._pace.lost()
        if not self.asked:
            if self._counts >= COUNT_TRIES or (self._busy and now - self._first_s > BUSY_S):
                self._fail(self._busy or "no answer")
            else:
                self._say_count(now)
            return
        self._silent += 1
        if self._silent <= SILENT_TRIES:
            self._repeated = True
            self._send(self._last, now)
        elif self._all_asked:
            self.verdict, self.error = UploadResult.DOUBTFUL, "no answer to the last item"
        else:
            self._fail(f"no answer to {self._item(self._last)}")

    # ------------------------------------------------------------ how it ends

    def _refused(self, result: int) -> None:
        at = f"{self._item(self.asked - 1)}: " if self.asked else ""
        why = "the vehicle gave up waiting" if result == CANCELLED else f"refused: {result_word(result)}"
        if self._all_asked:  # ArduPilot says ERROR to a copy of the last item, when all is well and that ACK was lost
            self.verdict, self.error = UploadResult.DOUBTFUL, at + why
        else:
            self._fail(at + why)

    def _fail(self, why: str) -> None:
        if self.verdict is None:
            self.verdict, self.error = UploadResult.FAILED, why
