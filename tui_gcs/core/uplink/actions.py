"""What is asked of a vehicle, as data: an order (a MAV_CMD with its parameters) and an action with its retry class.

An order is a COMMAND_LONG or a COMMAND_INT; which of the two an autopilot takes for which command differs, so the
command service says it the other way when it is told to (MAV_RESULT 7 and 8).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle

FRAME_AMSL = 0
"""MAV_FRAME_GLOBAL: heights are above mean sea level. The only frame that PX4 reads right in a COMMAND_INT."""
KEEP_1E7 = 2**31 - 1
"""Latitude or longitude of a COMMAND_INT that says "where it is" (common.xml)."""


@dataclass(frozen=True)
class MavCommand:
    """A MAV_CMD with `param1`…`param7`; of a place, `param5` and `param6` are degrees."""

    command: int
    params: tuple[float, ...] = ()
    as_int: bool = False
    """COMMAND_INT instead of COMMAND_LONG."""
    is_place: bool = False
    """`param5` and `param6` are latitude and longitude: a COMMAND_INT has them in 1e-7 degrees."""
    frame: int = FRAME_AMSL
    """MAV_FRAME, said by a COMMAND_INT only."""

    @property
    def message(self) -> str:
        """Name of the MAVLink message that carries it."""
        return "COMMAND_INT" if self.as_int else "COMMAND_LONG"

    def by_other_message(self) -> "MavCommand":
        """The same, carried by the other message."""
        return replace(self, as_int=not self.as_int)

    def fields(self, copy: int) -> dict[str, Any]:
        """The message's fields for copy number `copy` (0, 1, …); the uplink adds the targets."""
        p = (*self.params, *([0.0] * 7))[:7]
        if not self.as_int:
            values = {f"param{i}": float(value) for i, value in enumerate(p, start=1)}
            return {"command": self.command, "confirmation": min(copy, 255), **values}
        x, y = (_place_1e7(v) if self.is_place else round(v) for v in p[4:6])
        return {
            "command": self.command,
            "frame": self.frame,
            "current": 0,
            "autocontinue": 0,
            **{f"param{i}": float(value) for i, value in enumerate(p[:4], start=1)},
            "x": x,
            "y": y,
            "z": float(p[6]),
        }


def _place_1e7(degrees: float) -> int:
    return round(degrees * 1e7) if math.isfinite(degrees) else KEEP_1E7


class RetryClass(Enum):
    """How an action is repeated: (copies, gap s, slow gap s after the copies or 0)."""

    START = (3, 0.9, 0.0)
    STOP = (25, 0.4, 2.0)
    SET = (5, 0.6, 0.0)

    @property
    def copies(self) -> int:
        """How many are sent at most before it is given up (stop: before the alarm)."""
        return int(self.value[0])

    @property
    def gap_s(self) -> float:
        """Time between copies."""
        return float(self.value[1])

    @property
    def slow_gap_s(self) -> float:
        """Time between further copies of a stop that is still not confirmed."""
        return float(self.value[2])


class Outcome(Enum):
    """How an action ended."""

    CONFIRMED = "confirmed"
    REFUSED = "refused"
    EXPIRED = "no answer"
    NOT_CONFIRMED = "accepted, not confirmed"
    SUPERSEDED = "superseded"


@dataclass(eq=False)
class VehicleAction:
    """One thing asked of one vehicle."""

    vehicle: int
    name: str
    """For the operator and the journal, e.g. "arm"; a newer action of the same name supersedes this one."""
    retry: RetryClass
    send: Callable[[int], object]
    """Sends copy number 0, 1, …"""
    confirmed: Callable[[Vehicle], bool]
    """Whether telemetry shows it done."""
    command: int | None = None
    """MAV_CMD whose COMMAND_ACK belongs to this action; None if it has none (set-points, heartbeat-confirmed modes)."""
    confirm_s: float = 5.0
    """After an accepting ACK, or the last copy, wait this long for telemetry."""
    on_done: "Callable[[VehicleAction, Outcome, str], None] | None" = None
    ack_ends: bool = True
    """Whether an accepting ACK ends the copies; not where what is asked for is a message that may be lost itself."""
    housekeeping: bool = False
    """A request for information or rates: no stop needs to cancel it."""
    double_ack: bool = False
    """The vehicle's first ACK is always ACCEPTED and means nothing; a refusal after it is the answer."""
    order: MavCommand | None = None
    """What `send` says, where it is a command: the service may turn it into the other message."""
    look: Callable[[], None] | None = None
    """Asks for the telemetry that confirms it, instead of waiting for it to come by itself."""
    refusal: str = ""
    """Why it cannot even be sent: it ends as refused."""

    sent: int = 0
    asked_s: float = 0.0
    """When it was submitted."""
    first_s: float = 0.0
    """When the first copy was sent."""
    next_s: float = 0.0
    look_s: float = 0.0
    """Before this its telemetry is not asked for again."""
    acked_s: float | None = None
    refused_s: float | None = None
    in_progress: bool = False
    """Its newest ACK was IN_PROGRESS."""
    result: int | None = None
    acks: int = 0
    turned: bool = False
    """Said with the other message already."""
    doubtful: bool = False
    """The one before it was given up without an answer: an ACK may still be that one's."""
    alarmed: bool = False
    told_refusal: bool = False


def refused(
    vehicle: int, name: str, why: str, on_done: "Callable[[VehicleAction, Outcome, str], None] | None"
) -> VehicleAction:
    """An action that ends as refused by us, before anything is sent."""
    return VehicleAction(
        vehicle, name, RetryClass.SET, send=lambda copy: None, confirmed=lambda v: False, on_done=on_done, refusal=why
    )
