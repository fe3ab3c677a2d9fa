"""The three retry classes, on a virtual clock, against a vehicle that answers as the test says."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from vehicles import a_vehicle

from tui_gcs.core.clock import VirtualClock
from tui_gcs.core.events import ALERT, EventLog
from tui_gcs.core.services.command import ACCEPTED, DENIED, FAILED, IN_PROGRESS, Action, CommandService, Outcome, Retry
from tui_gcs.core.vehicle import Vehicle

ARM, MODE, TAKEOFF = 400, 176, 22


@dataclass
class Bench:
    """A command service and one vehicle; `run` moves time in 50 ms ticks."""

    clock: VirtualClock = field(default_factory=VirtualClock)
    sent: list[tuple[float, str]] = field(default_factory=list)
    ended: list[tuple[str, Outcome, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.events = EventLog(self.clock)
        self.service = CommandService(self.clock, self.events)
        self.vehicle = a_vehicle(1)
        self.talks = True

    def run(self, seconds: float) -> "Bench":
        for _ in range(round(seconds / 0.05)):
            self.clock.advance(0.05)
            if self.talks:
                now = self.clock.now()
                self.vehicle.heartbeat_s = self.vehicle.position_s = now
            self.service.tick({1: self.vehicle})
        return self

    def ask(
        self,
        name: str,
        retry: Retry,
        command: int | None = None,
        confirmed: Callable[[Vehicle], bool] = lambda v: v.armed,
        vehicle: int = 1,
        housekeeping: bool = False,
    ) -> Action:
        action = Action(
            vehicle,
            name,
            retry,
            send=lambda copy: self.sent.append((round(self.clock.now(), 2), name)),
            confirmed=confirmed,
            command=command,
            on_done=lambda a, outcome, why: self.ended.append((a.name, outcome, why)),
            housekeeping=housekeeping,
        )
        self.service.submit(action)
        return action

    def times(self, name: str) -> list[float]:
        return [t for t, n in self.sent if n == name]


@pytest.fixture
def bench() -> Bench:
    return Bench()


# ---------------------------------------------------------------- start class


def test_start_class_says_it_three_times_within_two_seconds_and_never_again(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM)
    bench.run(60.0)
    assert len(bench.times("arm")) == 3
    assert bench.times("arm")[-1] <= 2.0
    assert bench.ended == [("arm", Outcome.EXPIRED, "")]
    assert bench.service.unanswered == ["vehicle 1: arm"]


def test_an_ack_ends_the_copies_and_telemetry_confirms(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM)
    bench.run(0.3)
    bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)
    bench.run(2.0)
    assert len(bench.times("arm")) == 1
    assert bench.ended == [], "accepted is not done"
    bench.vehicle.armed = True
    bench.run(0.1)
    assert bench.ended == [("arm", Outcome.CONFIRMED, "")]


def test_a_lost_ack_does_not_matter_when_telemetry_shows_it(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM)
    bench.run(0.5)
    bench.vehicle.armed = True
    bench.run(5.0)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED]
    assert len(bench.sent) == 1
    assert bench.service.unanswered == []


def test_accepted_but_never_shown_is_told_as_that(bench: Bench) -> None:
    bench.ask("take-off", Retry.START, TAKEOFF)
    bench.service.on_ack(bench.vehicle, TAKEOFF, ACCEPTED)
    bench.run(10.0)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.NOT_CONFIRMED]
    assert bench.service.unanswered == []


def test_a_refusal_collects_the_vehicles_own_reasons_for_half_a_second(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM)
    bench.service.on_ack(bench.vehicle, ARM, FAILED)
    bench.run(0.2)
    assert bench.ended == []
    bench.vehicle.recent_reasons.append((bench.clock.now(), "Arm: Need Position Estimate"))
    bench.run(0.4)
    assert bench.ended == [("arm", Outcome.REFUSED, "failed: Arm: Need Position Estimate")]
    assert len(bench.sent) == 1, "a refused start is not tried again"


def test_an_old_reason_is_not_this_refusals(bench: Bench) -> None:
    bench.vehicle.recent_reasons.append((bench.clock.now(), "Battery failsafe"))
    bench.run(5.0)
    bench.ask("arm", Retry.START, ARM)
    bench.service.on_ack(bench.vehicle, ARM, DENIED)
    bench.run(1.0)
    assert bench.ended == [("arm", Outcome.REFUSED, "denied")]


def test_accepted_after_refused_is_accepted(bench: Bench) -> None:
    """Copy 1 was refused as too early, copy 2 taken: the later word counts."""
    bench.ask("arm", Retry.START, ARM)
    bench.service.on_ack(bench.vehicle, ARM, FAILED)
    bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)
    bench.service.on_ack(bench.vehicle, ARM, FAILED)
    bench.vehicle.armed = True
    bench.run(1.0)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED]


# ---------------------------------------------------------------- stop class


def test_stop_class_repeats_until_telemetry_shows_it_alarms_after_ten_seconds_and_goes_on(bench: Bench) -> None:
    bench.ask("land", Retry.STOP, MODE)
    bench.run(9.9)
    times = bench.times("land")
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert min(gaps) >= 0.25 and max(gaps) <= 0.5
    assert [e for e in bench.events.since(0) if e.severity <= ALERT] == []
    bench.run(20.0)
    alarms = [e.text for e in bench.events.since(0) if e.severity <= ALERT]
    assert alarms == ["land not confirmed after 10 s: still trying"]
    late = [t for t in bench.times("land") if t > 12.0]
    assert len(late) == pytest.approx(18 / 2, abs=1), "every 2 s from then on"
    bench.vehicle.armed = True
    bench.run(60.0)
    assert bench.ended == [("land", Outcome.CONFIRMED, "")]
    assert bench.times("land")[-1] < 31.0


@pytest.mark.parametrize("result", [ACCEPTED, FAILED])
def test_no_ack_ends_a_stop(bench: Bench, result: int) -> None:
    bench.ask("land", Retry.STOP, MODE)
    bench.run(0.1)
    bench.service.on_ack(bench.vehicle, MODE, result)
    bench.run(5.0)
    assert len(bench.times("land")) == 13
    assert bench.ended == []


def test_a_stop_is_sent_at_once_and_cancels_what_is_queued(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM)
    bench.ask("speed", Retry.SET, 178)
    bench.ask("interval", Retry.SET, 511, housekeeping=True)
    bench.sent.clear()
    bench.ask("hold", Retry.STOP)
    assert bench.times("hold") == [0.0], "before the next tick"
    bench.run(2.0)
    assert bench.times("arm") == bench.times("speed") == []
    assert len(bench.times("interval")) == 3, "requests for rates do no harm"
    assert {name for name, outcome, _ in bench.ended if outcome is Outcome.SUPERSEDED} == {"arm", "speed"}


def test_a_newer_stop_supersedes_the_older_one(bench: Bench) -> None:
    bench.ask("hold", Retry.STOP)
    bench.run(1.0)
    bench.ask("land", Retry.STOP, MODE)
    bench.sent.clear()
    bench.run(1.0)
    assert {name for _, name in bench.sent} == {"land"}


def test_a_stop_for_one_vehicle_is_not_for_another(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM, vehicle=2)
    bench.ask("hold", Retry.STOP, vehicle=1)
    bench.run(5.0)
    assert len(bench.times("arm")) == 3


def test_what_was_shown_before_the_stop_was_sent_does_not_confirm_it(bench: Bench) -> None:
    """The picture is older than the order: a vehicle that looks landed because it fell silent is not stopped."""
    bench.run(1.0)
    bench.vehicle.armed = True
    bench.talks = False
    bench.ask("land", Retry.STOP, MODE)
    bench.run(5.0)
    assert bench.ended == []
    assert len(bench.times("land")) == 13
    bench.talks = True
    bench.run(0.1)
    assert bench.ended == [("land", Outcome.CONFIRMED, "")]


# ---------------------------------------------------------------- set class


def test_set_class_tries_five_times(bench: Bench) -> None:
    bench.ask("speed", Retry.SET, 178)
    bench.run(30.0)
    assert bench.times("speed") == pytest.approx([0.0, 0.6, 1.2, 1.8, 2.4], abs=0.06)
    assert bench.service.unanswered == ["vehicle 1: speed"]


def test_set_class_is_dropped_when_superseded(bench: Bench) -> None:
    first = bench.ask("speed", Retry.SET, 178)
    bench.run(0.7)
    second = bench.ask("speed", Retry.SET, 178)
    bench.run(10.0)
    assert (first.sent, second.sent) == (2, 5)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.SUPERSEDED, Outcome.EXPIRED]


def test_without_an_ack_of_its_own_it_waits_for_telemetry_after_the_last_copy(bench: Bench) -> None:
    bench.ask("go to", Retry.SET)
    bench.run(2.4 + 4.9)
    assert bench.ended == []
    bench.run(0.3)
    assert bench.ended == [("go to", Outcome.NOT_CONFIRMED, "")]


def test_two_with_the_same_command_go_one_after_the_other(bench: Bench) -> None:
    """An ACK names only the command: with two under way nobody could tell whose it is."""
    bench.ask("interval 33", Retry.SET, 511, confirmed=lambda v: v.prearm_ok)
    bench.ask("interval 24", Retry.SET, 511, confirmed=lambda v: v.prearm_ok)
    bench.run(1.0)
    assert bench.times("interval 24") == []
    bench.vehicle.prearm_ok = True
    bench.run(0.05)
    bench.vehicle.prearm_ok = False
    bench.run(1.0)
    assert len(bench.times("interval 33")) == 2
    assert len(bench.times("interval 24")) == 2


# ---------------------------------------------------------------- ACKs


def test_acks_that_belong_to_nothing_are_counted_and_change_nothing(bench: Bench) -> None:
    bench.ask("arm", Retry.START, ARM)
    bench.service.on_ack(bench.vehicle, TAKEOFF, ACCEPTED)  # foreign
    bench.vehicle.armed = True
    bench.run(0.2)
    bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)  # late, or a duplicate
    bench.service.on_ack(a_vehicle(2), ARM, ACCEPTED)
    assert bench.service.ignored == {"ack for nothing asked": 2, "repeated ack": 1}


def test_with_30_percent_loss_every_stop_is_confirmed(bench: Bench) -> None:
    """An hour of stops in a second: copies and telemetry are lost, the stop gets through."""
    import random

    chance = random.Random(7)
    for _ in range(120):
        bench.vehicle.armed = False
        bench.ask("land", Retry.STOP, MODE)
        count = len(bench.sent)
        while bench.service.pending(1, "land"):
            bench.run(0.05)
            if len(bench.sent) > count:
                count = len(bench.sent)
                bench.vehicle.armed = bench.vehicle.armed or chance.random() > 0.3
            bench.talks = chance.random() > 0.3
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED] * 120
    assert not [e for e in bench.events.since(0, 2000) if e.severity <= ALERT]
