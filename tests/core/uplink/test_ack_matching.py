"""Whose an ACK is, where the way there and back is longer than the time between copies."""

import random
from collections.abc import Iterator

import pytest

from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.ack_matching import AckMatcher
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction
from tui_gcs.core.uplink.commands import ACCEPTED, FAILED, CommandService

TICK_S = 0.05
ARM, INTERVAL, SPEED = 400, 511, 178


class FarAway:
    """A vehicle that does what it is told and says so, at the end of a long way that loses and doubles frames."""

    def __init__(self, one_way_s: float, jitter_s: float = 0.0, loss: float = 0.0, doubled: float = 0.0) -> None:
        self.clock = VirtualClock()
        self.service = CommandService(self.clock, EventLog(self.clock))
        self.service.ack_matcher.round_trips = lambda _: (2 * one_way_s, 2 * (one_way_s + jitter_s))
        self.vehicle = a_vehicle(1)
        self.done: set[str] = set()
        self.sent: list[float] = []
        self.ended: list[tuple[str, Outcome]] = []
        self.result = ACCEPTED
        self._way = (one_way_s, jitter_s, loss, doubled)
        self._random = random.Random(5)
        self._there: list[tuple[float, str, int]] = []
        self._back: list[tuple[float, int, int]] = []

    def ask(
        self, name: str, command: int, retry: RetryClass = RetryClass.SET, *, housekeeping: bool = True
    ) -> VehicleAction:
        """Ask for something whose ACK is all the confirmation there is."""

        def send(copy: int) -> None:
            self.sent.append(self.clock.now())
            self._there += [(due_s, name, command) for due_s in self._arrivals()]

        action = VehicleAction(
            1,
            name,
            retry,
            send=send,
            confirmed=lambda _: action.acked_s is not None,
            command=command,
            on_done=lambda a, outcome, why: self.ended.append((a.name, outcome)),
            housekeeping=housekeeping,
        )
        self.service.submit(action)
        return action

    def run(self, seconds: float) -> "FarAway":
        for _ in range(round(seconds / TICK_S)):
            self.clock.advance(TICK_S)
            now = self.clock.now()
            for reported in [t for t in self._there if t[0] <= now]:
                self._there.remove(reported)
                self.done.add(reported[1])
                self._back += [(due_s, reported[2], self.result) for due_s in self._arrivals()]
            for heard in sorted(b for b in self._back if b[0] <= now):
                self._back.remove(heard)
                self.service.on_ack(self.vehicle, heard[1], heard[2])
            self.service.tick({1: self.vehicle})
        return self

    def _arrivals(self) -> Iterator[float]:
        one_way_s, jitter_s, loss, doubled = self._way
        if self._random.random() >= loss:
            for _ in range(1 + (self._random.random() < doubled)):
                yield self.clock.now() + one_way_s + self._random.random() * jitter_s - 1e-9


@pytest.mark.parametrize(
    ("one_way_s", "jitter_s", "loss", "doubled"),
    [(0.5, 0.1, 0.0, 0.0), (0.5, 0.1, 0.1, 0.3), (1.0, 0.5, 0.0, 0.3), (1.0, 0.5, 0.1, 0.3), (0.02, 0.0, 0.1, 0.3)],
)
def test_nothing_is_said_to_have_happened_that_did_not(
    one_way_s: float, jitter_s: float, loss: float, doubled: float
) -> None:
    """A vehicle's message rates, one after the other: none stays unset, none is taken for set before it is."""
    air = FarAway(one_way_s, jitter_s, loss, doubled)
    for number in range(40):
        name = f"interval {number}"
        while (name, Outcome.CONFIRMED) not in air.ended:
            if not air.service.pending(1, name):
                air.ask(name, INTERVAL)
            air.run(TICK_S)
        assert name in air.done
    assert len(air.ended) == 40, "no order was given up"


def test_what_is_only_set_is_not_repeated_before_its_answer_can_have_come() -> None:
    air = FarAway(1.0)
    air.ask("speed", SPEED)
    air.run(3.0)
    assert air.sent == [0.0] and air.ended == [("speed", Outcome.CONFIRMED)]


def test_where_frames_are_lost_on_a_short_way_nobody_waits_for_answers_that_cannot_come() -> None:
    air = FarAway(0.02, loss=0.3)
    for number in range(50):
        air.ask(f"interval {number}", INTERVAL)
        while air.service.pending(1, f"interval {number}"):
            air.run(TICK_S)
    assert air.clock.now() < 50 * 0.7, "at 30 % loss each way every second copy is answered"


def test_the_refusals_of_an_older_start_do_not_refuse_the_next_one() -> None:
    air = FarAway(1.0)
    air.result = FAILED
    air.ask("arm", ARM, RetryClass.START, housekeeping=False)
    air.run(2.6)  # three copies, the first refused after 2 s
    assert air.ended == [("arm", Outcome.REFUSED)]
    air.result = ACCEPTED
    air.ask("arm", ARM, RetryClass.START, housekeeping=False)
    air.run(5.0)
    assert air.ended[1:] == [("arm", Outcome.CONFIRMED)]


def test_one_late_ack_is_not_applied_to_the_next_same_order() -> None:
    """docs/threats.md B.6-45. The first was given up; its ACK comes 10 s later, while the second is under way."""
    air = FarAway(0.02, loss=1.0)
    air.ask("speed", SPEED, housekeeping=False)
    air.run(10.0)
    air.ask("speed", SPEED, housekeeping=False)
    air.run(0.2)
    air.service.on_ack(air.vehicle, SPEED, ACCEPTED)
    air.run(5.0)
    assert air.ended == [("speed", Outcome.EXPIRED)] * 2


# ---------------------------------------------------------------- the matcher itself


def order(**traits: bool) -> VehicleAction:
    return VehicleAction(
        1, "mode", RetryClass.SET, send=lambda _: None, confirmed=lambda _: False, command=SPEED, **traits
    )


def told(matcher: AckMatcher, *acks: tuple[VehicleAction, float]) -> list[str]:
    """Whose each ACK is taken for, that comes while this order is under way, so many seconds after the first copy."""
    return ["older" if matcher.is_older(1, SPEED, action, at_s) else "its own" for action, at_s in acks]


def test_copies_are_answered_in_the_order_in_which_they_left() -> None:
    matcher, first, second = AckMatcher(), order(), order()
    matcher.sent(first, 0.0)
    matcher.sent(first, 0.1)
    matcher.sent(second, 0.2)
    assert told(matcher, (second, 0.3), (second, 0.35), (second, 0.4)) == ["older", "older", "its own"]


def test_who_answers_twice_is_owed_two_and_no_third() -> None:
    matcher, first, second = AckMatcher(), order(double_ack=True), order(double_ack=True)
    matcher.sent(first, 0.0)
    assert told(matcher, (first, 0.1), (first, 0.1)) == ["its own", "its own"]
    matcher.sent(second, 0.2)
    assert told(matcher, (second, 0.3), (second, 0.3)) == ["its own", "its own"]


def test_an_answer_may_take_somewhat_longer_than_any_that_was_measured() -> None:
    matcher, first, second = AckMatcher(), order(), order()
    matcher.round_trips = lambda _: (0.0, 1.0)
    matcher.sent(first, 0.0)
    matcher.sent(second, 1.0)
    assert told(matcher, (second, 1.4)) == ["older"], "the first's, 1.4 s after it left"
    matcher = AckMatcher()
    matcher.round_trips = lambda _: (0.0, 1.0)
    matcher.sent(first, 0.0)
    matcher.sent(second, 1.0)
    assert told(matcher, (second, 1.6)) == ["its own"], "after so long the first's will not come any more"
