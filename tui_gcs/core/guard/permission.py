"""Permissions: what must come with every frame to a vehicle.

A set-point carries the guard's verdict on its course, an order the guard's verdict on it. A stop (hold, return, land,
disarm) carries a stop reason instead: it is never vetoed, and leaves over every path to the vehicle. A question carries
no more than its name, which has to be on the list of `uplink.questions`. The uplink has no way to send without one of
the three.
"""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

STATION = "station"
"""The principal of orders that neither an operator nor a planner gave."""


class OrderClass(Enum):
    """What an order does to a vehicle. It decides what may be vetoed, never how the order is called on a screen."""

    STOP = "stop"
    """It holds, returns, lands or disarms: never vetoed, over every path."""
    START = "start"
    """A vehicle on the ground begins to fly."""
    SET = "set"
    """All that changes anything else."""


@dataclass(frozen=True)
class Order:
    """What is ordered, in the operator's and the journal's words, its class, and the principal that ordered it."""

    what: str
    order_class: OrderClass = OrderClass.SET
    by: str = STATION


@dataclass(frozen=True)
class Verdict:
    """Passed, or the reason why not. `code` groups reasons for counting."""

    code: str = ""
    text: str = ""

    @property
    def ok(self) -> bool:
        """Whether the course or action passed."""
        return not self.code


PASS = Verdict()


@dataclass(frozen=True)
class StopReason:
    """Why a stop leaves: which one it is, and the principal that ordered it."""

    what: str
    by: str = STATION
    ok: ClassVar[bool] = True
    """A stop is never vetoed."""


@dataclass(frozen=True)
class Question:
    """A frame that changes nothing a vehicle does: a request for information, an answer, our heartbeat."""

    name: str


SetpointPermission = Verdict | StopReason
"""What a set-point needs."""
Permission = Verdict | StopReason | Question
"""What every frame to a vehicle needs."""
