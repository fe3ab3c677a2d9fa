"""What an instance of a planner on one vehicle may send to others, and what it receives.

Payloads are encoded where they are sent and decoded anew for every receiver: instances share no objects.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np

from tui_gcs.core.scenario.model import Communication

BURST = 2.0
"""Messages that a vehicle may send at once where its rate is lower than that."""


@dataclass(frozen=True)
class Received:
    """A message that another vehicle's instance has sent."""

    sender: int
    sent_s: float
    payload: Any
    """As sent. Tuples and arrays arrive as lists, unless the planner declares a `message_type`."""


@dataclass
class Radio:
    """The sending side of one vehicle: checks every message and keeps what is to be delivered.

    A message that may not be sent is dropped and counted. The planner goes on: radios do lose messages.
    """

    members: Collection[int] = ()
    communication: Communication = field(default_factory=Communication)
    t_s: float = 0.0
    tokens: float = math.inf
    """How many messages may be sent now."""
    outbox: list[tuple[int, bytes]] = field(default_factory=list)
    """(receiver, payload) since the last delivery; receiver 0: every neighbour."""
    dropped: dict[str, int] = field(default_factory=dict)
    """Messages that were not sent, by reason."""

    def refill(self, t_s: float) -> None:
        """Grant messages for the time since the last call."""
        rate_hz = self.communication.rate_hz
        self.tokens = min(self.tokens + rate_hz * max(t_s - self.t_s, 0.0), max(rate_hz, BURST))
        self.t_s = t_s

    def send(self, receiver: int, payload: object) -> bool:
        """Queue a message; return False if it was dropped. Raises TypeError for what msgspec cannot encode."""
        if receiver and receiver not in self.members:
            return self._drop(f"no vehicle {receiver} in the team")
        data = msgspec.msgpack.encode(payload, enc_hook=_plain)
        if len(data) > self.communication.message_bytes:
            return self._drop(f"larger than {self.communication.message_bytes:g} bytes")
        # 1e-9 against rounding: ten steps of 0.1 s must grant what one second does.
        if self.tokens < 1.0 - 1e-9:
            return self._drop(f"more than {self.communication.rate_hz:g} per second")
        self.tokens -= 1.0
        self.outbox.append((receiver, data))
        return True

    def _drop(self, why: str) -> bool:
        # Reasons that name vehicles are a planner's to choose: no more than a few are kept apart.
        key = why if why in self.dropped or len(self.dropped) < MAX_REASONS else "other reasons"
        self.dropped[key] = self.dropped.get(key, 0) + 1
        return False


MAX_REASONS = 8
"""Reasons of drops that are counted separately."""


def _plain(value: object) -> object:
    """Return numpy values as what msgpack can carry. Raises TypeError for anything else."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a message cannot hold {type(value).__name__}")
