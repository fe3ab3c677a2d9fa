"""The messages of the mission protocol: items to and from fields, texts for results, the retry timer.

Reference: MAVLink guide, services/mission; enum MAV_MISSION_RESULT of common.xml.
"""

from dataclasses import dataclass
from typing import Any

from tui_gcs.core.guard.permission import Order
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.core.uplink.uplink import Uplink

ACCEPTED, ERROR, DENIED, INVALID_SEQUENCE, CANCELLED = 0, 1, 14, 13, 15
RESULT_WORDS = (
    "accepted",
    "error",
    "unsupported frame",
    "unsupported command",
    "no space for so many items",
    "invalid",
    "invalid param 1",
    "invalid param 2",
    "invalid param 3",
    "invalid param 4",
    "invalid latitude",
    "invalid longitude",
    "invalid height",
    "wrong sequence",
    "denied",
    "cancelled",
)
FIRST_WAIT_S = 1.5
MIN_WAIT_S, MAX_WAIT_S = 0.25, 5.0
"""How long an answer to one item is waited for: the guide's 250 ms, stretched to three round trips."""
ROUND_TRIPS = 3.0
MAX_CHANCE_LOSSES = 8
"""So many losses in a row on a link that was quick before are no chance: 0.03 % of all at 20 % loss each way."""
MAX_LOSSY_WAIT_S, MAX_UNMEASURED_WAIT_S = 1.0, 2.5
"""However often nothing comes, a request is repeated after this, unless the round trip itself is longer."""


def result_word(result: int) -> str:
    """The text for a MAV_MISSION_RESULT."""
    return RESULT_WORDS[result] if 0 <= result < len(RESULT_WORDS) else f"result {result}"


def fields_of(item: PlanItem, seq: int, kind: PlanKind, *, current: bool) -> dict[str, Any]:
    """The fields of the MISSION_ITEM_INT of one item. With `current` the mission begins with it."""
    return {
        "seq": seq,
        "frame": item.frame,
        "command": item.command,
        "current": int(current),
        "autocontinue": int(item.autocontinue),
        **{f"param{number}": value for number, value in enumerate(item.params, 1)},
        "x": item.x,
        "y": item.y,
        "z": item.z,
        "mission_type": int(kind),
    }


def item_of(fields: dict[str, Any]) -> PlanItem:
    """The item in a MISSION_ITEM_INT. Its values may be anything that a vehicle can send."""
    params = (fields["param1"], fields["param2"], fields["param3"], fields["param4"])
    x, y, z = fields["x"], fields["y"], fields["z"]
    return PlanItem(fields["command"], fields["frame"], params, x, y, z, bool(fields["autocontinue"]))


@dataclass
class PlanChannel:
    """Sends messages about one kind of plan to one vehicle."""

    uplink: Uplink
    vehicle: int
    kind: PlanKind
    refused: str = ""
    """Why the last message did not leave."""
    home_items: int = 0
    """How many items travel before the plan's own: 1 in a mission of an ArduPilot, whose item 0 is home."""

    def item(self, seq: int, count: int) -> str:
        """Name an item of the `count` that travel as the operator counts the plan's: from 1, without home."""
        return f"item {self.own(seq + 1)} of {self.own(count)}" if seq >= self.home_items else "home"

    def own(self, count: int) -> int:
        """How many of the first `count` that travel are the plan's own."""
        return max(0, count - self.home_items)

    def begin(self, what: str, name: str, **fields: Any) -> bool:
        """Send a message that changes the vehicle, checked and journalled; returns whether it left."""
        what = f"{self.kind.word} {what}"
        self.refused = self.uplink.action(self.vehicle, Order(what), name, mission_type=int(self.kind), **fields)
        return not self.refused

    def part(self, item: PlanItem, seq: int, *, current: bool) -> bool:
        """Send an item of an upload; returns whether it left."""
        fields = fields_of(item, seq, self.kind, current=current)
        left = self.uplink.transfer(self.vehicle, f"{self.kind.word} upload", "MISSION_ITEM_INT", **fields)
        self.refused = "" if left else "the items may not be sent any more"
        return left

    def ask(self, name: str, **fields: Any) -> bool:
        """Send a request, or the end of a transfer; returns whether it left."""
        self.refused = self.uplink.ask(self.vehicle, name, mission_type=int(self.kind), **fields)
        return not self.refused

    def end(self, result: int) -> None:
        """Send MISSION_ACK: the transfer is over."""
        self.ask("MISSION_ACK", type=result)


class RetryTimer:
    """The measured time after which an unanswered message to one vehicle is repeated."""

    def __init__(self) -> None:
        self._round_trip_s: float | None = None
        self._lost = 0
        self.wait_s = FIRST_WAIT_S

    def add_sample(self, seconds: float) -> None:
        """Take a measured round trip. Only a message that was sent once can be measured."""
        before, self._lost = self._round_trip_s, 0
        if before is None:
            self._round_trip_s = seconds
        # Falls quickly: a long one may answer the vehicle's second request, when its first was lost.
        else:
            self._round_trip_s = before + (seconds - before) * (0.5 if seconds < before else 0.125)
        self.wait_s = _wait_s(self._round_trip_s)

    def add_loss(self) -> None:
        """Take a loss. After several in a row wait longer, because the link may just be slow."""
        self._lost += 1
        # On a lossy link a longer wait would only make the transfer slower.
        if self._round_trip_s is not None and self._lost < MAX_CHANCE_LOSSES:
            return
        trip_s = self._round_trip_s
        most = MAX_UNMEASURED_WAIT_S if trip_s is None else max(MAX_LOSSY_WAIT_S, _wait_s(trip_s))
        self.wait_s = min(most, self.wait_s * 1.5)


def _wait_s(trip_s: float) -> float:
    """Three round trips, on slow links one and a second, because PX4 gives up after 5 s of silence."""
    return min(MAX_WAIT_S, max(MIN_WAIT_S, min(ROUND_TRIPS * trip_s, trip_s + 1.0)))
