"""A million stops at 30 % loss each way, and as many starts: the real command service on a virtual clock.

Each vehicle loses and answers datagrams by a seeded chance; its heartbeat comes once a second and is lost, too. What
counts is what the vehicle did and when, which the service never sees.
"""

import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.bench.row import Row
from tui_gcs.core.clock import VirtualClock
from tui_gcs.core.events import EventLog
from tui_gcs.core.links.base import Address
from tui_gcs.core.services.command import Action, CommandService, Outcome, Retry
from tui_gcs.core.vehicle import Path as Way
from tui_gcs.core.vehicle import PathState, Vehicle
from tui_gcs.core.wire.sources import Source

LOSS = 0.3
DELAY_S = 0.05
"""One way."""
TICK_S = 0.1
VEHICLES = 200
COMMANDS = 1_000_000
STOP_LIMIT_S, STOP_FAILURES_PER_MILLION = 10.0, 10
START_LIMIT_S = 2.0
MODE = 176
NOWHERE: Address = ("nowhere", 0)


@dataclass
class Flight:
    """One vehicle and the command it is given."""

    vehicle: Vehicle
    chance: random.Random
    begun_s: float = 0.0
    effects_s: list[float] = field(default_factory=list)
    """When it did what it was told; a copy that finds it done has no effect."""
    ended_s: float | None = None
    next_beat_s: float = 0.0
    due: list[tuple[float, str]] = field(default_factory=list)


@dataclass
class Tally:
    """What became of them all."""

    commands: int = 0
    late: int = 0
    """Not confirmed within the limit."""
    late_effects: int = 0
    """Took effect later than a start may, delay apart."""
    sent_after_end: int = 0
    """Copies that left after it was over: a second effect."""
    most_copies: int = 0


class Air:
    """The service, and vehicles at the other end of bad links."""

    def __init__(self, retry: Retry, seed: int, vehicles: int = VEHICLES) -> None:
        self.clock = VirtualClock()
        self.service = CommandService(self.clock, EventLog(self.clock))
        self.retry = retry
        self.tally = Tally()
        rolls = random.Random(seed)
        self.flights = [self._flight(number, rolls.random()) for number in range(1, vehicles + 1)]
        self.vehicles = {flight.vehicle.id: flight.vehicle for flight in self.flights}

    def _flight(self, number: int, seed: float) -> Flight:
        way = Way(Source("", "air", NOWHERE), PathState.USED, 0.0)
        chance = random.Random(seed)
        return Flight(Vehicle(number, number, "", way, 3, 2, paths=[way]), chance, next_beat_s=chance.random())

    def run(self, commands: int) -> Tally:
        """Give so many commands, one after the other to each vehicle."""
        left = commands
        for flight in self.flights:
            left -= self._begin(flight, left)
        while self.tally.commands < commands:
            self.clock.advance(TICK_S)
            now = self.clock.now()
            for flight in self.flights:
                self._arrive(flight, now)
            self.service.tick(self.vehicles)
            for flight in self.flights:
                if flight.ended_s is not None and not flight.due:
                    self._judge(flight)
                    left -= self._begin(flight, left)
        return self.tally

    def _begin(self, flight: Flight, left: int) -> int:
        if left <= 0:
            flight.ended_s = None
            return 0
        flight.begun_s, flight.ended_s, flight.effects_s = self.clock.now(), None, []
        flight.vehicle.armed = False

        def ended(action: Action, outcome: Outcome, why: str) -> None:
            flight.ended_s = self.clock.now()
            self.tally.most_copies = max(self.tally.most_copies, action.sent)

        action = Action(
            flight.vehicle.id,
            "order",
            self.retry,
            send=lambda copy: self._send(flight, "order"),
            confirmed=lambda v: v.armed,
            command=MODE,
            confirm_s=3.0,
            on_done=ended,
            look=lambda: self._send(flight, "look"),
        )
        self.service.submit(action)
        return 1

    def _send(self, flight: Flight, what: str) -> None:
        self.tally.sent_after_end += flight.ended_s is not None
        if flight.chance.random() >= LOSS:
            flight.due.append((self.clock.now() + DELAY_S, what))

    def _arrive(self, flight: Flight, now: float) -> None:
        """Everything that is due at the vehicle and at the station."""
        if now >= flight.next_beat_s:
            flight.next_beat_s += 1.0
            self._beat(flight, now)
        if not flight.due:
            return
        due, flight.due = [d for d in flight.due if d[0] <= now], [d for d in flight.due if d[0] > now]
        for at_s, what in due:
            if what == "order":
                if not flight.effects_s:
                    flight.effects_s.append(at_s)
                self._answer(flight, at_s, "ack")
            elif what == "look":
                self._beat(flight, at_s)
            elif what == "ack":
                self.service.on_ack(flight.vehicle, MODE, 0)
            else:
                flight.vehicle.heartbeat_s = now
                flight.vehicle.armed = what == "beat: done"

    def _beat(self, flight: Flight, at_s: float) -> None:
        self._answer(flight, at_s, "beat: done" if flight.effects_s else "beat")

    def _answer(self, flight: Flight, at_s: float, what: str) -> None:
        if flight.chance.random() >= LOSS:
            flight.due.append((at_s + DELAY_S, what))

    def _judge(self, flight: Flight) -> None:
        self.tally.commands += 1
        took_s = (flight.ended_s or 0.0) - flight.begun_s
        self.tally.late += took_s > STOP_LIMIT_S
        self.tally.late_effects += any(t - flight.begun_s > START_LIMIT_S + DELAY_S + 1e-6 for t in flight.effects_s)


def commands(folder: Path) -> Iterator[Row]:
    """A million of each."""
    stops = Air(Retry.STOP, 1).run(COMMANDS)
    yield Row("stops not confirmed in 10 s, 30 % loss, of 1e6", stops.late, "", STOP_FAILURES_PER_MILLION)
    starts = Air(Retry.START, 2).run(COMMANDS)
    yield Row("starts that took effect after 2 s, of 1e6", starts.late_effects, "", 0)
    yield Row("copies sent after the end, of 2e6", stops.sent_after_end + starts.sent_after_end, "", 0)
    yield Row("copies of a start, at most", starts.most_copies, "", 3)
