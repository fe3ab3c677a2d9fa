"""The dialogue of one upload: the count, items as the vehicle requests them, its result.

Measured behaviour that is handled here (docs/autopilots.md, missions of both autopilots; MAVLink guide):

* ArduPilot requests with the old MISSION_REQUEST, and only every second; a NACK "wrong sequence" does not end its
  transfer. So an unanswered item is sent again after a few round trips. Where that brings "wrong sequence", the
  vehicle has the item already, and the next one follows. That happens once, or copies would breed copies.
* PX4 refuses a count with ERROR while it is busy with another transfer (5 s at most), so the count is repeated. It
  acknowledges a repeated last item once more, and gives up silently.
* An ACCEPTED before all items were requested may be a late copy of another one. It is a failure only if nothing more
  is requested.
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
"""How often the count is sent: at 20 % loss each way five in a million fail."""
COUNT_GAP_S = 1.5
BUSY_S = 10.0
"""How long a vehicle may be busy with another transfer: ArduPilot gives one up after 8 s, PX4 after 5 s."""
SILENT_TRIES = 20
"""How often an item is repeated without any answer: at 30 % loss each way one in a million fails."""
MAX_SENDS = 100
"""How often one item is sent, requested or not: a vehicle that requests it for ever must not be answered for ever."""
NACK_S, SOFT_NACK_S = 0.6, 1.6
"""How long after a refusal its texts are waited for; how long after what may be no refusal, whether the vehicle goes on
(ArduPilot requests every 1 s)."""
EARLY_ACK_WAIT_S = 4.0
MAX_RESTARTS = 2
STRAY_REQUEST_S = 2.0
"""How long stray requests are ignored: ArduPilot requests items of a cancelled upload every second until another one
begins."""


class UploadResult(Enum):
    """How an upload ended on the wire."""

    ACCEPTED = "accepted"
    DOUBTFUL = "all items were asked for, the result is not known"
    FAILED = "failed"


class UploadDialogue:
    """One upload of `items`; over when `result` is set."""

    def __init__(
        self,
        channel: PlanChannel,
        items: tuple[PlanItem, ...],
        timer: RetryTimer,
        *,
        patience_s: float,
        from_start: bool,
    ) -> None:
        """Prepare an upload.

        Args:
            channel: Sends the messages.
            items: The items as they travel.
            timer: The retry timer of this vehicle.
            patience_s: How long this autopilot takes for one item; see `PlanDialect`.
            from_start: Whether the mission is to begin with its first item.
        """
        self._channel = channel
        self._items = items
        self._timer = timer
        self._patience_s = patience_s
        self._from_start = from_start
        self.result: UploadResult | None = None
        self.error = ""
        self.opaque_id = 0
        """The vehicle's own number for the plan, 0 if it has none."""
        self.requested = 0
        """How many items were requested, in order."""
        self._sends: Counter[int] = Counter()
        self._counts, self._first_s = 0, 0.0
        self._last, self._last_s = -1, 0.0
        self._silent, self._next_s = 0, 0.0
        self._repeated = False
        """The last item was repeated unasked, and nothing was received since."""
        self._nack: tuple[int, float] | None = None
        """A refusal, and the time at which it counts."""
        self._early_s: float | None = None
        self._busy = ""
        self._begun_anew = 0

    @property
    def _all_requested(self) -> bool:
        return self.requested == len(self._items)

    def _item(self, seq: int) -> str:
        return self._channel.item(seq, len(self._items))

    def begin(self, now: float) -> None:
        """Send the count of items."""
        self._first_s = now
        self._send_count(now)

    def tick(self, now: float) -> None:
        """Repeat what is not answered, and accept a result that was waited for."""
        if self.result is not None:
            return
        if self._nack is not None:
            if now >= self._nack[1]:
                self._refused(self._nack[0])
        elif self._early_s is not None and now - self._early_s >= EARLY_ACK_WAIT_S:
            own, count = self._channel.own(self.requested), self._channel.own(len(self._items))
            self._fail(f"the vehicle accepted it after {own} of {count} items")
        elif now >= self._next_s:
            self._repeat(now)

    def on_message(self, name: str, fields: dict[str, Any], now: float) -> None:
        """Take a message about this kind of plan that is addressed to us."""
        if self.result is not None:
            return
        if name in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            self._on_request(fields["seq"], now)
        elif name == "MISSION_ACK":
            self._on_ack(fields["type"], fields.get("opaque_id", 0), now)

    def _on_request(self, seq: int, now: float) -> None:
        # Items are requested in order; something else belongs to another transfer.
        if seq > self.requested or seq >= len(self._items):
            self._strange(seq, now)
            return
        # Only an item that was sent once can be measured.
        if seq == self._last + 1 and (self._sends[self._last] == 1 if seq else self._counts == 1):
            self._timer.add_sample(now - self._last_s)
        self.requested = max(self.requested, seq + 1)
        self._nack, self._early_s, self._repeated, self._silent = None, None, False, 0
        self._send(seq, now)

    def _on_ack(self, code: int, opaque_id: int, now: float) -> None:
        if code == ACCEPTED:
            if self._all_requested:
                self.opaque_id = opaque_id
                self.result = UploadResult.ACCEPTED
            elif self._early_s is None:
                self._early_s = now
        elif code == INVALID_SEQUENCE:
            # The vehicle has the repeated item already, and waits for the next one (ArduPilot).
            if self._repeated and self._last + 1 < len(self._items):
                self._repeated = False
                self.requested = max(self.requested, self._last + 2)
                self._send(self._last + 1, now)
        # Before the first item this means that the vehicle is busy with another transfer (PX4 for 5 s, ArduPilot for 8
        # s).
        elif code in (ERROR, DENIED) and not self.requested:
            self._busy = f"the vehicle is busy with another transfer ({result_word(code)})"
            if now - self._first_s > BUSY_S:
                self._fail(self._busy)
        elif code == CANCELLED and self.requested and not self._all_requested and self._begun_anew < MAX_RESTARTS:
            self._begun_anew += 1
            self._begin_anew(now)
        elif self._nack is None:
            soft = code in (ERROR, DENIED)
            self._nack = (code, now + (SOFT_NACK_S if soft else NACK_S))

    def _strange(self, seq: int, now: float) -> None:
        """Take a request out of turn: at first it may still belong to an upload that was cut off."""
        if self.requested or now - self._first_s > STRAY_REQUEST_S:
            self._channel.end(CANCELLED)
            self._fail(f"the vehicle asks for {self._item(seq)} after {self._channel.own(self.requested)}")

    def _begin_anew(self, now: float) -> None:
        """Begin again: ArduPilot gave up after 8 s in which nothing arrived, and the link may be better now."""
        self.requested, self._last, self._silent, self._counts = 0, -1, 0, 0
        self._sends.clear()
        self._nack, self._early_s, self._repeated = None, None, False
        self.begin(now)

    def _send_count(self, now: float) -> None:
        self._counts += 1
        self._last_s, self._next_s = now, now + max(COUNT_GAP_S, self._timer.wait_s)
        if not self._channel.begin("upload", "MISSION_COUNT", count=len(self._items)):
            self._fail(self._channel.refused)

    def _send(self, seq: int, now: float) -> None:
        self._sends[seq] += 1
        if self._sends[seq] > MAX_SENDS:
            self._channel.end(CANCELLED)
            self._fail(f"the vehicle asks for {self._item(seq)} again and again")
            return
        self._last, self._last_s = seq, now
        self._next_s = now + max(self._timer.wait_s, self._patience_s)
        if not self._channel.part(self._items[seq], seq, current=self._from_start and seq == 0):
            self._fail(self._channel.refused)

    def _repeat(self, now: float) -> None:
        self._timer.add_loss()
        if not self.requested:
            if self._counts >= COUNT_TRIES or (self._busy and now - self._first_s > BUSY_S):
                self._fail(self._busy or "no answer")
            else:
                self._send_count(now)
            return
        self._silent += 1
        if self._silent <= SILENT_TRIES:
            self._repeated = True
            self._send(self._last, now)
        elif self._all_requested:
            self.result, self.error = UploadResult.DOUBTFUL, "no answer to the last item"
        else:
            self._fail(f"no answer to {self._item(self._last)}")

    def _refused(self, result: int) -> None:
        at = f"{self._item(self.requested - 1)}: " if self.requested else ""
        why = "the vehicle gave up waiting" if result == CANCELLED else f"refused: {result_word(result)}"
        # ArduPilot answers ERROR to a copy of the last item when the ACK of a good upload was lost.
        if self._all_requested:
            self.result, self.error = UploadResult.DOUBTFUL, at + why
        else:
            self._fail(at + why)

    def _fail(self, why: str) -> None:
        if self.result is None:
            self.result, self.error = UploadResult.FAILED, why
