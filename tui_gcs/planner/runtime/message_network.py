"""The network between instances of a planner that runs once on each vehicle: range, losses and delays.

Every vehicle within range hears two things: beacons with the state of its neighbours, one a step, and messages. Both
are lost and delayed at the scenario's rates. All chance comes from one seeded generator, so that lock-step runs repeat.
"""

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.protocol.base import Message, Vec3
from tui_gcs.core.scenario.model import Communication
from tui_gcs.planner.api import Fleet

NEIGHBOUR_TIMEOUT_S = 3.0
"""A neighbour that was not heard for this long is no neighbour any more; the station's own limit for STALE."""
MAX_IN_FLIGHT = 20_000
"""Messages on their way at one time; more are dropped. 250 vehicles at 20 Hz with 4 s of delay reach it."""
# Steps come at sums of floats: a delay of exactly one step must not become two.
ROUNDING_S = 1e-6


class Beacon(Message, frozen=True, array_like=True):
    """The state of one vehicle as its neighbours hear it; the fields are columns of `Fleet`."""

    vehicle: int
    sent_s: float
    position_m: Vec3
    velocity_m_s: Vec3
    heading_deg: float
    age_s: float
    battery_pct: float
    active: bool
    held: bool


class MessageInFlight(Message, frozen=True, array_like=True):
    """A message that was sent and not lost."""

    sent_s: float
    sender: int
    receivers: tuple[int, ...]
    data: bytes


class BeaconsInFlight(Message, frozen=True, array_like=True):
    """The beacons of one step: which receivers hear which senders."""

    sent_s: float
    beacons: tuple[Beacon, ...]
    receivers: tuple[tuple[int, ...], ...]
    """Of each beacon."""


class NetworkState(Message, frozen=True):
    """Everything that a network needs to go on. Field names are stored in snapshots."""

    rng: dict[str, Any]
    beacons: tuple[Beacon, ...]
    heard: dict[int, tuple[int, ...]]
    """Places in `beacons`, by receiver."""
    beacons_in_flight: tuple[BeaconsInFlight, ...]
    messages_in_flight: tuple[MessageInFlight, ...]
    counts: dict[str, int]


class MessageNetwork:
    """Delivers beacons and messages between the vehicles of one team."""

    def __init__(self, communication: Communication, rng: np.random.Generator) -> None:
        self._radio, self._rng = communication, rng
        self._heard: dict[int, dict[int, Beacon]] = {}
        """The newest beacon of each sender, by receiver and sender."""
        self._beacons: deque[BeaconsInFlight] = deque()
        self._messages: deque[MessageInFlight] = deque()
        self._reach: dict[int, tuple[int, ...]] = {}
        """Who is within range of each vehicle in the present step, ascending."""
        self.counts = dict.fromkeys(("delivered", "lost", "out of range", "queue full"), 0)

    def exchange(self, fleet: Fleet, t_s: float) -> dict[int, list[MessageInFlight]]:
        """Send the beacons of a step, and return the messages that arrive by `t_s`, by receiver.

        `fleet` holds the vehicles that take part, each with a position.
        """
        ids = fleet.id.tolist()
        within = _within_range(fleet.position_m, self._radio.range_m)
        self._reach = {v: tuple(fleet.id[within[i]].tolist()) for i, v in enumerate(ids)}
        arrives = within & self._kept(within.shape)
        receivers = tuple(tuple(fleet.id[arrives[i]].tolist()) for i in range(len(ids)))
        self._beacons.append(BeaconsInFlight(t_s, tuple(_beacons(fleet, t_s)), receivers))
        self._deliver_beacons(t_s)
        return self._arrived(set(ids), t_s)

    def heard(self, receiver: int) -> list[Beacon]:
        """Return the newest beacons of the vehicles that a receiver has heard lately, ordered by vehicle."""
        return [beacon for _, beacon in sorted(self._heard.get(receiver, {}).items())]

    def post(self, t_s: float, sender: int, receiver: int, data: bytes) -> None:
        """Send a message to one vehicle, or to all within range if `receiver` is 0."""
        near = self._reach.get(sender, ())
        goals = near if receiver == 0 else tuple(v for v in near if v == receiver)
        if receiver and not goals:
            self.counts["out of range"] += 1
            return
        kept = self._kept((len(goals),))
        arriving = tuple(v for v, arrives in zip(goals, kept, strict=True) if arrives)
        self.counts["lost"] += len(goals) - len(arriving)
        if not arriving:
            return
        if len(self._messages) >= MAX_IN_FLIGHT:
            self.counts["queue full"] += 1
            return
        self._messages.append(MessageInFlight(t_s, sender, arriving, data))

    def state(self) -> NetworkState:
        """Return everything that `restore` needs."""
        table: dict[tuple[int, float], int] = {}
        beacons: list[Beacon] = []
        heard: dict[int, tuple[int, ...]] = {}
        for receiver, by_sender in self._heard.items():
            for beacon in by_sender.values():
                if (key := (beacon.vehicle, beacon.sent_s)) not in table:
                    table[key] = len(beacons)
                    beacons.append(beacon)
            heard[receiver] = tuple(table[(b.vehicle, b.sent_s)] for b in by_sender.values())
        rng = rng_as_text(self._rng.bit_generator.state)
        return NetworkState(rng, tuple(beacons), heard, tuple(self._beacons), tuple(self._messages), dict(self.counts))

    def restore(self, state: NetworkState) -> None:
        """Go on where another network was."""
        self._rng.bit_generator.state = rng_from_text(state.rng)
        self._heard = {
            receiver: {state.beacons[k].vehicle: state.beacons[k] for k in places}
            for receiver, places in state.heard.items()
        }
        self._beacons, self._messages = deque(state.beacons_in_flight), deque(state.messages_in_flight)
        self.counts = self.counts | state.counts

    def _kept(self, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Draw what is not lost. Without losses nothing is drawn."""
        loss = self._radio.loss
        if loss <= 0.0:
            return np.ones(shape, dtype=bool)
        return self._rng.random(shape) >= loss

    def _deliver_beacons(self, t_s: float) -> None:
        while self._beacons and self._beacons[0].sent_s + self._radio.delay_s <= t_s + ROUNDING_S:
            sent = self._beacons.popleft()
            for beacon, receivers in zip(sent.beacons, sent.receivers, strict=True):
                for receiver in receivers:
                    self._heard.setdefault(receiver, {})[beacon.vehicle] = beacon
        oldest_s = t_s - self._radio.delay_s - NEIGHBOUR_TIMEOUT_S
        for by_sender in self._heard.values():
            for vehicle in [v for v, beacon in by_sender.items() if beacon.sent_s < oldest_s]:
                del by_sender[vehicle]

    def _arrived(self, present: set[int], t_s: float) -> dict[int, list[MessageInFlight]]:
        """Return the messages of earlier steps whose delay is over; a receiver that is absent misses them."""
        found: dict[int, list[MessageInFlight]] = {}
        while self._messages and self._messages[0].sent_s + self._radio.delay_s <= t_s + ROUNDING_S:
            message = self._messages.popleft()
            for receiver in message.receivers:
                arrives = receiver in present
                self.counts["delivered" if arrives else "lost"] += 1
                if arrives:
                    found.setdefault(receiver, []).append(message)
        return found


def _within_range(position_m: NDArray[np.float64], range_m: float) -> NDArray[np.bool_]:
    """Return (n, n) whether two different vehicles are at most `range_m` apart; with range 0 none are."""
    apart_m = np.linalg.norm(position_m[:, None] - position_m[None], axis=2)
    within: NDArray[np.bool_] = (apart_m <= range_m) & (range_m > 0.0)
    np.fill_diagonal(within, False)
    return within


def _beacons(fleet: Fleet, t_s: float) -> list[Beacon]:
    columns = zip(
        fleet.id.tolist(),
        fleet.position_m.tolist(),
        fleet.velocity_m_s.tolist(),
        fleet.heading_deg.tolist(),
        fleet.age_s.tolist(),
        fleet.battery_pct.tolist(),
        fleet.active.tolist(),
        fleet.held.tolist(),
        strict=True,
    )
    return [
        Beacon(v, t_s, (p[0], p[1], p[2]), (w[0], w[1], w[2]), heading, age_s, battery, active, held)
        for v, p, w, heading, age_s, battery, active, held in columns
    ]


def rng_as_text(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return the state of a generator with its integers as text: those of PCG64 have 128 bits, msgpack's have 64."""
    return {
        k: rng_as_text(v) if isinstance(v, dict) else f"#{v}" if isinstance(v, int) else v for k, v in state.items()
    }


def rng_from_text(state: dict[str, Any]) -> dict[str, Any]:
    """Return a generator's state that `rng_as_text` has made."""
    return {
        k: rng_from_text(v) if isinstance(v, dict) else int(v[1:]) if str(v).startswith("#") else v
        for k, v in state.items()
    }
