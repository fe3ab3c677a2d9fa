"""The mission protocol's messages: items to and from fields, result words, how long to wait for an answer.

MAVLink guide, services/mission; enum MAV_MISSION_RESULT of common.xml.
"""

from dataclasses import dataclass
from typing import Any

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
"""For one item; the guide's 250 ms, stretched to three round trips."""
ROUND_TRIPS = 3.0
LOST_BY_CHANCE = 8
"""In a row, on a link that answered quickly before: 0.03 % of all at 20 % loss each way."""
IMPATIENT_S, UNMEASURED_S = 1.0, 2.5
"""However often nothing comes, it is asked again after that, unless the round trip itself is longer."""


def result_word(result: int) -> str:
    """What a MAV_MISSION_RESULT says."""
    return RESULT_WORDS[result] if 0 <= result < len(RESULT_WORDS) else f"result {result}"


def fields_of(item: PlanItem, seq: int, kind: PlanKind, *, current: bool) -> dict[str, Any]:
    """MISSION_ITEM_INT of one item. `current`: a mission begins with it."""
    one, two, three, four = item.params
    return {
        "seq": seq,
        "frame": item.frame,
        "command": item.command,
        "current": int(current),
        "autocontinue": int(item.autocontinue),
        "param1": one,
        "param2": two,
        "param3": three,
        "param4": four,
        "x": item.x,
        "y": item.y,
        "z": item.z,
        "mission_type": int(kind),
    }


def item_of(fields: dict[str, Any]) -> PlanItem:
    """The item in a MISSION_ITEM_INT; its values may be anything a vehicle can send."""
    params = (fields["param1"], fields["param2"], fields["param3"], fields["param4"])
    return PlanItem(
        fields["command"],
        fields["frame"],
        params,
        fields["x"],
        fields["y"],
        fields["z"],
        bool(fields["autocontinue"]),
    )


@dataclass
class PlanChannel:
    """Says things to one vehicle about one kind of plan."""

    uplink: Uplink
    vehicle: int
    kind: PlanKind
    refused: str = ""
    """Why the last thing did not leave."""
    home_items: int = 0
    """How many travel before the plan's own: 1 in a mission of an ArduPilot, whose item 0 is home."""

    def item(self, seq: int, count: int) -> str:
        """Which of the `count` items that travel, as an operator counts those of the plan: from 1, without home."""
        return f"item {self.own(seq + 1)} of {self.own(count)}" if seq >= self.home_items else "home"

    def own(self, count: int) -> int:
        """How many of the first `count` that travel are the plan's own."""
        return max(0, count - self.home_items)

    def begin(self, what: str, name: str, **fields: Any) -> bool:
        """What changes the vehicle: judged and journalled; whether it left."""
        what = f"{self.kind.word} {what}"
        self.refused = self.uplink.action(self.vehicle, what, name, mission_type=int(self.kind), **fields)
        return not self.refused

    def part(self, item: PlanItem, seq: int, *, current: bool) -> bool:
        """An item of an upload; whether it left."""
        fields = fields_of(item, seq, self.kind, current=current)
        left = self.uplink.transfer(self.vehicle, f"{self.kind.word} upload", "MISSION_ITEM_INT", **fields)
        self.refused = "" if left else "the items may not be sent any more"
        return left

    def ask(self, name: str, **fields: Any) -> bool:
        """A question, or the end of a transfer; whether it left."""
        self.refused = self.uplink.ask(self.vehicle, name, mission_type=int(self.kind), **fields)
        return not self.refused

    def end(self, result: int) -> None:
        """Tell the vehicle that a transfer is over."""
        self.ask("MISSION_ACK", type=result)


class RetryTimer:
    """How long to wait for an answer before it is asked again: measured, one per vehicle."""

    def __init__(self) -> None:
        """Nothing measured."""
        self._round_trip_s: float | None = None
        self._lost = 0
        self.wait_s = FIRST_WAIT_S

    def measured(self, seconds: float) -> None:
        """What was said once was answered after `seconds`."""
        before, self._lost = self._round_trip_s, 0
        if before is None:
            self._round_trip_s = seconds
        else:  # down quickly: a long one may be the vehicle's second question, for its first was lost
            self._round_trip_s = before + (seconds - before) * (0.5 if seconds < before else 0.125)
        self.wait_s = _wait_s(self._round_trip_s)

    def lost(self) -> None:
        """Nothing came; if that happens again and again, wait longer, for it may just be slow."""
        self._lost += 1
        if self._round_trip_s is not None and self._lost < LOST_BY_CHANCE:
            return
        trip_s = self._round_trip_s
        most = UNMEASURED_S if trip_s is None else max(IMPATIENT_S, _wait_s(trip_s))
        self.wait_s = min(most, self.wait_s * 1.5)


def _wait_s(trip_s: float) -> float:
    """Three round trips; on slow links one and a second, for PX4 gives up after 5 s of silence."""
    return min(MAX_WAIT_S, max(MIN_WAIT_S, min(ROUND_TRIPS * trip_s, trip_s + 1.0)))
