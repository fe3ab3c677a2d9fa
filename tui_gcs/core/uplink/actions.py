"""What is asked of a vehicle, as data: a MAV_CMD with its parameters, and an action with its retry class.

A MAV_CMD travels in a COMMAND_LONG or a COMMAND_INT. Which of the two an autopilot takes for which command differs, so
the command service changes to the other one when the vehicle asks for that (MAV_RESULT 7 and 8).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import STATION, Order, OrderClass, StopReason

FRAME_AMSL = 0
"""MAV_FRAME_GLOBAL: heights are above mean sea level. The only frame that PX4 reads correctly in a COMMAND_INT."""
KEEP_1E7 = 2**31 - 1
"""Latitude or longitude of a COMMAND_INT that means the vehicle's own place (common.xml)."""


@dataclass(frozen=True)
class MavCommand:
    """A MAV_CMD with `param1` to `param7`; where it names a place, `param5` and `param6` are degrees."""

    command: int
    params: tuple[float, ...] = ()
    as_int: bool = False
    """Carried by COMMAND_INT instead of COMMAND_LONG."""
    is_place: bool = False
    """`param5` and `param6` are latitude and longitude: a COMMAND_INT has them in 1e-7 degrees."""
    frame: int = FRAME_AMSL
    """MAV_FRAME, which only a COMMAND_INT carries."""

    @property
    def message(self) -> str:
        """Name of the MAVLink message that carries it."""
        return "COMMAND_INT" if self.as_int else "COMMAND_LONG"

    def by_other_message(self) -> "MavCommand":
        """The same command, carried by the other message."""
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
    """How an action is repeated: (copies, gap s, slow gap s after the copies or 0). See docs/threats.md C.4."""

    START = (3, 0.9, 0.0)
    STOP = (25, 0.4, 2.0)
    SET = (5, 0.6, 0.0)

    @property
    def copies(self) -> int:
        """How many copies are sent at most before it is given up (stop: before the alarm)."""
        return int(self.value[0])

    @property
    def gap_s(self) -> float:
        """Time between two copies, in seconds."""
        return float(self.value[1])

    @property
    def slow_gap_s(self) -> float:
        """Time between further copies of a stop that is still not confirmed."""
        return float(self.value[2])


class Outcome(Enum):
    """How an action ended; the value is the operator's word for it."""

    CONFIRMED = "confirmed"
    REFUSED = "refused"
    EXPIRED = "no answer"
    NOT_CONFIRMED = "accepted, not confirmed"
    SUPERSEDED = "superseded"


@dataclass(eq=False)
class VehicleAction:
    """One thing asked of one vehicle: how it is sent, repeated, acknowledged and confirmed."""

    vehicle: int
    name: str
    """The operator's and the journal's word, e.g. "arm"; a newer action of the same name supersedes this one."""
    retry: RetryClass
    send: Callable[[int], object]
    """Sends copy number 0, 1, …"""
    confirmed: Callable[[Vehicle], bool]
    """Whether telemetry shows it done."""
    command: int | None = None
    """MAV_CMD whose COMMAND_ACK belongs to this action; None if it has none (set-points, modes confirmed by the
    heartbeat)."""
    confirm_s: float = 5.0
    """How long telemetry may take after an accepting ACK, or after the last copy."""
    on_done: "Callable[[VehicleAction, Outcome, str], None] | None" = None
    """Called once when it has ended, with the outcome and the reason."""
    stop: StopReason | None = None
    """The stop that it is a part of, where its retry class is not that of stops (the mode and the places of a return,
    motors that are stopped once and never later)."""
    starts: bool = False
    """By it a vehicle on the ground begins to fly. A calibration or a reboot is repeated as a start, and is none."""
    by: str = STATION
    """Who ordered it; set before it is submitted."""
    ack_ends: bool = True
    """Whether an accepting ACK ends the copies; not where a message was asked for that may be lost itself."""
    housekeeping: bool = False
    """A request for information or rates: a stop does not cancel it."""
    double_ack: bool = False
    """The vehicle's first ACK is always ACCEPTED and means nothing; a refusal after it is the answer (PX4's
    DO_SET_MODE)."""
    order: MavCommand | None = None
    """The command that `send` sends, if it sends one: the service may have it carried by the other message."""
    look: Callable[[], None] | None = None
    """Requests the telemetry that confirms it, instead of waiting until it comes by itself."""
    refusal: str = ""
    """Why it cannot even be sent: it ends as refused."""

    sent: int = 0
    """Copies sent so far."""
    asked_s: float = 0.0
    """When it was submitted."""
    first_s: float = 0.0
    """When the first copy was sent."""
    next_s: float = 0.0
    look_s: float = 0.0
    """Its telemetry is not requested again before this time."""
    acked_s: float | None = None
    refused_s: float | None = None
    in_progress: bool = False
    """Its newest ACK was IN_PROGRESS."""
    result: int | None = None
    """MAV_RESULT of its newest ACK."""
    acks: int = 0
    was_carried_otherwise: bool = False
    """It has been sent by the other message already."""
    doubtful: bool = False
    """The equal command before it was given up without an answer: an ACK may still be that one's."""
    alarmed: bool = False
    """A stop that was not confirmed in time has raised its alarm."""
    refusal_shown: bool = False
    """The refusal of a stop that goes on was shown to the operator."""

    def as_order(self) -> Order:
        """The order as the uplink judges and journals it."""
        if self.stop is not None:
            return Order(self.stop.what, OrderClass.STOP, self.stop.by)
        if self.retry is RetryClass.STOP:
            return Order(self.name, OrderClass.STOP, self.by)
        return Order(self.name, OrderClass.START if self.starts else OrderClass.SET, self.by)


def refused(
    vehicle: int, name: str, why: str, on_done: "Callable[[VehicleAction, Outcome, str], None] | None"
) -> VehicleAction:
    """An action that ends as refused by this station, before anything is sent."""
    return VehicleAction(
        vehicle, name, RetryClass.SET, send=lambda copy: None, confirmed=lambda v: False, on_done=on_done, refusal=why
    )
