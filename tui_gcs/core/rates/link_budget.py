"""One link as the rate controller sees it.

Its vehicles, the message set they are to send, and its request rate limit.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from tui_gcs.core.base.token_bucket import TokenBucket
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.frames import SIGNATURE_BYTES
from tui_gcs.core.mavlink.sources import Slot
from tui_gcs.core.rates.message_sets import (
    FRAME_BYTES,
    FULL,
    HALF_LEAN,
    LADDER,
    LEAN,
    RateSet,
    best_fit,
    bytes_per_s,
    telemetry_budget,
)
from tui_gcs.core.rates.radio_status import BackOff

CALM_S = 5.0
"""A set gets richer when no vehicle has joined or left the link for this long; poorer at once."""
REQUEST_BYTES = 2 * (FRAME_BYTES + SIGNATURE_BYTES) + 33 + 10
"""COMMAND_LONG there, COMMAND_ACK back, signed."""
REQUEST_SHARE = 0.09
"""Share of a link with a budget that goes to requests: 3.9 requests a second on a 57.6 kbit/s radio."""
MAX_PER_S, MAX_AT_ONCE = 500.0, 25.0
"""Requests on a link without a budget: a fleet of 250 is asked for its positions within a second."""


@dataclass
class RateRequest:
    """One request to one vehicle on one link: a message at a rate, or its identity."""

    hz: float = 0.0
    """0: not to be sent."""
    settled_s: float = math.nan
    """When the vehicle agreed; NaN while it has not."""
    next_s: float = -math.inf
    asked: int = 0
    """How often it was sent since it was last in order."""
    under_way: bool = False


@dataclass
class LinkMember:
    """A vehicle on a link."""

    last_heard_s: float
    """When it was last heard there."""
    signed: bool
    """Its frames carry signatures, 13 bytes each."""
    identity_request: RateRequest = field(default_factory=RateRequest)
    rate_requests: dict[int, RateRequest] = field(default_factory=dict)
    """By message id, most important first."""
    check_s: float = -math.inf
    """When it is to be checked next."""
    window_s: float = -math.inf
    """Since when its frames are counted."""
    frame_counts: dict[int, tuple[Slot, int]] = field(default_factory=dict)
    """By message id: its slot and the number of frames at the beginning of the window."""


class LinkRates:
    """A link's vehicles and the message set that is requested from all of them."""

    def __init__(self, name: str, spec: LinkSpec | None, now: float) -> None:
        """Without a spec the link has no budget."""
        self.name = name
        self.silent = spec is not None and spec.high_latency
        capacity = spec.bytes_per_s if spec is not None else None
        self.budget = telemetry_budget(capacity)
        """Bytes per second for telemetry; None is no limit."""
        self.fit = FULL if capacity is None else LEAN
        """Place on the ladder that fits by calculation. With a budget it starts poor: more vehicles may come."""
        self.place = self.fit
        """Place on the ladder that is requested: `fit`, lowered by the radio's back-off."""
        self.changed_s = now
        """When a vehicle last joined or left."""
        self.reported: tuple[int, bool] | None = None
        """(place, too many) that the operator was last informed of."""
        self.back_off = BackOff()
        self.radio: tuple[float, dict[str, Any]] | None = None
        """When its newest radio report came, and its fields."""
        self.members: dict[int, LinkMember] = {}
        self.queue: deque[int] = deque()
        """Vehicles in the order in which they are checked; the first has waited longest."""
        self.bucket = _request_bucket(capacity, now)

    def set_capacity(self, bytes_per_s: int | None, now: float) -> None:
        """Take another capacity of the link; the set follows with the next `plan`, a poorer one at once."""
        self.budget = telemetry_budget(bytes_per_s)
        self.bucket = _request_bucket(bytes_per_s, now)

    @property
    def set(self) -> RateSet:
        """The message set that is requested from every vehicle there."""
        return LADDER[self.place]

    @property
    def lowest(self) -> int:
        """The poorest place that a full radio buffer leads to."""
        # The radio's report can be forged: it may not starve the picture of the fleet.
        return max(self.fit, HALF_LEAN)

    @property
    def too_many(self) -> bool:
        """Whether not even the poorest set fits."""
        return self.budget is not None and self.needed(len(LADDER) - 1) > self.budget

    @property
    def signed(self) -> int:
        """How many of its vehicles sign."""
        return sum(member.signed for member in self.members.values())

    def needed(self, place: int) -> float:
        """Bytes per second of all vehicles with the set at `place`."""
        return bytes_per_s(LADDER[place].hz, len(self.members), self.signed)

    def join(self, vehicle: int, member: LinkMember, now: float) -> None:
        """A vehicle is heard on this link from now on."""
        self.members[vehicle] = member
        self.queue.append(vehicle)
        self.changed_s = now

    def leave(self, vehicle: int, now: float) -> None:
        """A vehicle is not heard here any more: its share is for the others."""
        del self.members[vehicle]
        self.queue.remove(vehicle)
        self.changed_s = now

    def plan(self, now: float) -> None:
        """Choose the set anew; after a change every vehicle is checked at once."""
        fit = best_fit(self.budget, len(self.members), self.signed)
        # Vehicles often join one after the other: a richer set would be taken back at once.
        if fit > self.fit or now - self.changed_s >= CALM_S:
            self.fit = fit
        place = min(self.fit + self.back_off.steps, self.lowest)
        if place != self.place:
            self.place = place
            for member in self.members.values():
                member.check_s = now


def _request_bucket(capacity: int | None, now: float) -> TokenBucket:
    """The limit of requests a second on a link of this capacity in bytes per second."""
    per_s = MAX_PER_S if capacity is None else min(MAX_PER_S, REQUEST_SHARE * capacity / REQUEST_BYTES)
    # The copies that a request needs may overdraw it; then no new request is sent.
    return TokenBucket(per_s, max(1.0, min(MAX_AT_ONCE, per_s / 10)), now)
