"""The three retry classes, on a virtual clock, against a vehicle that answers as the test says."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.records.event_log import ALERT, WARNING, EventLog
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction, refused
from tui_gcs.core.uplink.commands import (
    ACCEPTED,
    DENIED,
    FAILED,
    IN_PROGRESS,
    INT_ONLY,
    LONG_ONLY,
    RESULT_WORDS,
    TEMPORARILY_REJECTED,
    CommandService,
)

ARM, MODE, TAKEOFF, SPEED = 400, 176, 22, 178


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
                self.vehicle.telemetry.heartbeat_s = self.vehicle.telemetry.position_s = now
            self.service.tick({1: self.vehicle})
        return self

    def ask(
        self,
        name: str,
        retry: RetryClass,
        command: int | None = None,
        confirmed: Callable[[Vehicle], bool] = lambda v: v.telemetry.armed,
        vehicle: int = 1,
        housekeeping: bool = False,
    ) -> VehicleAction:
        action = VehicleAction(
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
    bench.ask("arm", RetryClass.START, ARM)
    bench.run(60.0)
    assert len(bench.times("arm")) == 3
    assert bench.times("arm")[-1] <= 2.0
    assert bench.ended == [("arm", Outcome.EXPIRED, "")]
    assert bench.service.unanswered == ["vehicle 1: arm"]


def test_an_ack_ends_the_copies_and_telemetry_confirms(bench: Bench) -> None:
    bench.ask("arm", RetryClass.START, ARM)
    bench.run(0.3)
    bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)
    bench.run(2.0)
    assert len(bench.times("arm")) == 1
    assert bench.ended == [], "accepted is not done"
    bench.vehicle.telemetry.armed = True
    bench.run(0.1)
    assert bench.ended == [("arm", Outcome.CONFIRMED, "")]


def test_a_lost_ack_does_not_matter_when_telemetry_shows_it(bench: Bench) -> None:
    bench.ask("arm", RetryClass.START, ARM)
    bench.run(0.5)
    bench.vehicle.telemetry.armed = True
    bench.run(5.0)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED]
    assert len(bench.sent) == 1
    assert bench.service.unanswered == []


def test_accepted_but_never_shown_is_told_as_that(bench: Bench) -> None:
    bench.ask("take-off", RetryClass.START, TAKEOFF)
    bench.service.on_ack(bench.vehicle, TAKEOFF, ACCEPTED)
    bench.run(10.0)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.NOT_CONFIRMED]
    assert bench.service.unanswered == []


def test_a_refusal_collects_the_vehicles_own_reasons_for_half_a_second(bench: Bench) -> None:
    bench.ask("arm", RetryClass.START, ARM)
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
    bench.ask("arm", RetryClass.START, ARM)
    bench.service.on_ack(bench.vehicle, ARM, DENIED)
    bench.run(1.0)
    assert bench.ended == [("arm", Outcome.REFUSED, "denied")]


def test_accepted_after_refused_is_accepted(bench: Bench) -> None:
    """Copy 1 was refused as too early, copy 2 taken: the later word counts."""
    bench.ask("arm", RetryClass.START, ARM)
    bench.service.on_ack(bench.vehicle, ARM, FAILED)
    bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)
    bench.service.on_ack(bench.vehicle, ARM, FAILED)
    bench.vehicle.telemetry.armed = True
    bench.run(1.0)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED]


# ---------------------------------------------------------------- stop class


def test_stop_class_repeats_until_telemetry_shows_it_alarms_after_ten_seconds_and_goes_on(bench: Bench) -> None:
    bench.ask("land", RetryClass.STOP, MODE)
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
    bench.vehicle.telemetry.armed = True
    bench.run(60.0)
    assert bench.ended == [("land", Outcome.CONFIRMED, "")]
    assert bench.times("land")[-1] < 31.0


@pytest.mark.parametrize("result", [ACCEPTED, FAILED])
def test_no_ack_ends_a_stop(bench: Bench, result: int) -> None:
    bench.ask("land", RetryClass.STOP, MODE)
    bench.run(0.1)
    bench.service.on_ack(bench.vehicle, MODE, result)
    bench.run(5.0)
    assert len(bench.times("land")) == 13
    assert bench.ended == []


def test_a_stop_is_sent_at_once_and_cancels_what_is_queued(bench: Bench) -> None:
    bench.ask("arm", RetryClass.START, ARM)
    bench.ask("speed", RetryClass.SET, 178)
    bench.ask("interval", RetryClass.SET, 511, housekeeping=True)
    bench.sent.clear()
    bench.ask("hold", RetryClass.STOP)
    assert bench.times("hold") == [0.0], "before the next tick"
    bench.run(2.0)
    assert bench.times("arm") == bench.times("speed") == []
    assert len(bench.times("interval")) == 3, "requests for rates do no harm"
    assert {name for name, outcome, _ in bench.ended if outcome is Outcome.SUPERSEDED} == {"arm", "speed"}


def test_a_newer_stop_supersedes_the_older_one(bench: Bench) -> None:
    bench.ask("hold", RetryClass.STOP)
    bench.run(1.0)
    bench.ask("land", RetryClass.STOP, MODE)
    bench.sent.clear()
    bench.run(1.0)
    assert {name for _, name in bench.sent} == {"land"}


def test_a_stop_for_one_vehicle_is_not_for_another(bench: Bench) -> None:
    bench.ask("arm", RetryClass.START, ARM, vehicle=2)
    bench.ask("hold", RetryClass.STOP, vehicle=1)
    bench.run(5.0)
    assert len(bench.times("arm")) == 3


def test_what_was_shown_before_the_stop_was_sent_does_not_confirm_it(bench: Bench) -> None:
    """The picture is older than the order: a vehicle that looks landed because it fell silent is not stopped."""
    bench.run(1.0)
    bench.vehicle.telemetry.armed = True
    bench.talks = False
    bench.ask("land", RetryClass.STOP, MODE)
    bench.run(5.0)
    assert bench.ended == []
    assert len(bench.times("land")) == 13
    bench.talks = True
    bench.run(0.1)
    assert bench.ended == [("land", Outcome.CONFIRMED, "")]


# ---------------------------------------------------------------- set class


def test_set_class_tries_five_times(bench: Bench) -> None:
    bench.ask("speed", RetryClass.SET, 178)
    bench.run(30.0)
    assert bench.times("speed") == pytest.approx([0.0, 0.6, 1.2, 1.8, 2.4], abs=0.06)
    assert bench.service.unanswered == ["vehicle 1: speed"]


def test_set_class_is_dropped_when_superseded(bench: Bench) -> None:
    first = bench.ask("speed", RetryClass.SET, 178)
    bench.run(0.7)
    second = bench.ask("speed", RetryClass.SET, 178)
    bench.run(10.0)
    assert (first.sent, second.sent) == (2, 5)
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.SUPERSEDED, Outcome.EXPIRED]


def test_without_an_ack_of_its_own_it_waits_for_telemetry_after_the_last_copy(bench: Bench) -> None:
    bench.ask("go to", RetryClass.SET)
    bench.run(2.4 + 4.9)
    assert bench.ended == []
    bench.run(0.3)
    assert bench.ended == [("go to", Outcome.NOT_CONFIRMED, "")]


def test_two_with_the_same_command_go_one_after_the_other(bench: Bench) -> None:
    """An ACK names only the command: with two under way nobody could tell whose it is."""
    bench.ask("interval 33", RetryClass.SET, 511, confirmed=lambda v: v.telemetry.prearm_ok)
    bench.ask("interval 24", RetryClass.SET, 511, confirmed=lambda v: v.telemetry.prearm_ok)
    bench.run(1.0)
    assert bench.times("interval 24") == []
    bench.vehicle.telemetry.prearm_ok = True
    bench.run(0.05)
    bench.vehicle.telemetry.prearm_ok = False
    bench.run(1.0)
    assert len(bench.times("interval 33")) == 2
    assert len(bench.times("interval 24")) == 2


def test_what_has_no_acks_waits_for_nobody(bench: Bench) -> None:
    bench.ask("go to", RetryClass.SET)
    bench.ask("speed by message", RetryClass.SET)
    assert bench.times("go to") == bench.times("speed by message") == [0.0]


def test_only_a_start_that_may_still_happen_is_an_alert(bench: Bench) -> None:
    bench.ask("take-off", RetryClass.START, TAKEOFF)
    bench.service.on_ack(bench.vehicle, TAKEOFF, ACCEPTED)
    bench.ask("arm", RetryClass.START, ARM)
    bench.service.on_ack(bench.vehicle, ARM, DENIED)
    bench.ask("speed", RetryClass.SET, SPEED)
    bench.service.on_ack(bench.vehicle, SPEED, ACCEPTED)
    bench.run(20.0)
    reported = {event.text: event.severity for event in bench.events.since(0, 100)}
    assert reported == {
        "arm: refused (denied)": WARNING,
        "speed: accepted, not confirmed": WARNING,
        "take-off: accepted, not confirmed": ALERT,
    }


def test_answers_are_listened_for_only_while_something_flown_was_said(bench: Bench) -> None:
    bench.ask("interval 33", RetryClass.SET, 511, housekeeping=True)
    assert len(bench.sent) == 1 and not bench.service.waiting, "that can wait"
    bench.ask("arm", RetryClass.START, ARM)
    assert bench.service.waiting
    bench.service.on_ack(bench.vehicle, ARM, DENIED)
    bench.run(1.0)
    assert [name for name, _, _ in bench.ended] == ["arm"] and not bench.service.waiting


# ---------------------------------------------------------------- ACKs


def test_acks_that_belong_to_nothing_are_counted_and_change_nothing(bench: Bench) -> None:
    bench.ask("arm", RetryClass.START, ARM)
    bench.service.on_ack(bench.vehicle, TAKEOFF, ACCEPTED)  # foreign
    bench.vehicle.telemetry.armed = True
    bench.run(0.2)
    bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)  # late, or a duplicate
    bench.service.on_ack(a_vehicle(2), ARM, ACCEPTED)
    assert bench.service.ignored == {"ack for nothing asked": 2, "repeated ack": 1}


def test_with_30_percent_loss_every_stop_is_confirmed(bench: Bench) -> None:
    """An hour of stops in a second: copies and telemetry are lost, the stop gets through."""
    import random

    chance = random.Random(7)
    for _ in range(120):
        bench.vehicle.telemetry.armed = False
        bench.ask("land", RetryClass.STOP, MODE)
        count = len(bench.sent)
        while bench.service.pending(1, "land"):
            bench.run(0.05)
            if len(bench.sent) > count:
                count = len(bench.sent)
                bench.vehicle.telemetry.armed = bench.vehicle.telemetry.armed or chance.random() > 0.3
            bench.talks = chance.random() > 0.3
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED] * 120
    assert not [e for e in bench.events.since(0, 2000) if e.severity <= ALERT]


# ---------------------------------------------------------------- what results mean


def order_bench(bench: Bench, *, as_int: bool = False) -> tuple[VehicleAction, list[tuple[str, int]]]:
    """A speed order, and what of it was sent: (message, copy)."""
    said: list[tuple[str, int]] = []
    order = MavCommand(SPEED, (1, 5, -1), as_int=as_int)
    action = VehicleAction(
        1,
        "speed",
        RetryClass.SET,
        send=lambda copy: said.append(((action.order or order).message, copy)),
        confirmed=lambda v: action.acked_s is not None,
        command=SPEED,
        on_done=lambda a, outcome, why: bench.ended.append((a.name, outcome, why)),
        order=order,
    )
    bench.service.submit(action)
    return action, said


@pytest.mark.parametrize(("result", "as_int"), [(LONG_ONLY, True), (INT_ONLY, False)])
def test_what_is_taken_by_the_other_message_only_is_said_that_way_at_once(
    bench: Bench, result: int, as_int: bool
) -> None:
    _, said = order_bench(bench, as_int=as_int)
    bench.run(0.1)
    bench.service.on_ack(bench.vehicle, SPEED, result)
    bench.run(0.05)
    both = [("COMMAND_LONG", 0), ("COMMAND_INT", 1)] if not as_int else [("COMMAND_INT", 0), ("COMMAND_LONG", 1)]
    assert said == both, "not 0.6 s later"
    bench.service.on_ack(bench.vehicle, SPEED, ACCEPTED)
    bench.run(0.1)
    assert bench.ended == [("speed", Outcome.CONFIRMED, "")]


def test_who_takes_it_neither_way_has_refused_it(bench: Bench) -> None:
    order_bench(bench)
    bench.service.on_ack(bench.vehicle, SPEED, INT_ONLY)
    bench.run(0.05)
    bench.service.on_ack(bench.vehicle, SPEED, LONG_ONLY)
    bench.run(1.0)
    assert bench.ended == [("speed", Outcome.REFUSED, "taken as COMMAND_LONG only")]


def test_a_place_keeps_its_digits_as_command_int_and_nan_means_where_it_is() -> None:
    order = MavCommand(192, (5, 1, 0, math.nan, -35.36326218, 149.16523749, 604.5), as_int=True, is_place=True)
    fields = order.fields(0)
    assert (fields["x"], fields["y"], fields["z"]) == (-353632622, 1491652375, 604.5)
    assert fields["frame"] == 0 and math.isnan(fields["param4"])
    here = MavCommand(192, (-1, 1, 0, math.nan, math.nan, math.nan, 604.5), as_int=True, is_place=True).fields(0)
    assert here["x"] == here["y"] == 2**31 - 1
    assert order.by_other_message().fields(1)["param5"] == pytest.approx(-35.36326218)


def test_in_progress_waits_for_the_end_but_not_longer_than_a_minute(bench: Bench) -> None:
    bench.ask("calibrate", RetryClass.SET, 241)
    bench.service.on_ack(bench.vehicle, 241, IN_PROGRESS)
    bench.run(50.0)
    assert bench.ended == [] and len(bench.sent) == 1
    bench.service.on_ack(bench.vehicle, 241, FAILED)
    bench.run(1.0)
    assert bench.ended == [("calibrate", Outcome.REFUSED, "failed")]
    bench.ask("level", RetryClass.SET, 241)
    bench.service.on_ack(bench.vehicle, 241, IN_PROGRESS)
    bench.run(59.0)
    assert len(bench.ended) == 1, "a minute from when it was asked, whenever that was"
    bench.run(2.0)
    assert bench.ended[1:] == [("level", Outcome.NOT_CONFIRMED, "still in progress")]


@pytest.mark.parametrize("word", RESULT_WORDS)
def test_every_result_but_accepted_has_a_word(word: int) -> None:
    assert bool(RESULT_WORDS[word]) is (word != ACCEPTED)
    assert set(RESULT_WORDS) == set(range(11))


def test_the_first_ack_of_a_mode_change_means_nothing_where_two_are_sent(bench: Bench) -> None:
    """PX4: ACCEPTED by its receiver, a few ms later the refusal by its commander, in whatever order they arrive."""
    for pair in ((ACCEPTED, TEMPORARILY_REJECTED), (TEMPORARILY_REJECTED, ACCEPTED)):
        action = bench.ask("mode", RetryClass.SET, MODE)
        action.double_ack = True
        for result in pair:
            bench.service.on_ack(bench.vehicle, MODE, result)
        bench.run(1.0)
    assert bench.ended == [("mode", Outcome.REFUSED, "temporarily rejected")] * 2
    assert bench.service.ignored == {}


def test_what_cannot_even_be_sent_ends_as_refused(bench: Bench) -> None:
    bench.service.submit(
        refused(1, "take-off", "height unknown", lambda a, o, why: bench.ended.append((a.name, o, why)))
    )
    assert bench.ended == [("take-off", Outcome.REFUSED, "height unknown")]


# ---------------------------------------------------------------- time


def test_no_copy_of_a_start_leaves_later_than_two_seconds_after_it_was_asked(bench: Bench) -> None:
    """The station was held up for a minute after the first copy: nobody expects the second any more."""
    bench.ask("arm", RetryClass.START, ARM)
    bench.clock.advance(60.0)
    bench.run(10.0)
    assert bench.times("arm") == [0.0]
    assert [outcome for _, outcome, _ in bench.ended] == [Outcome.EXPIRED]


def test_a_start_that_waits_behind_an_equal_command_is_not_sent_later(bench: Bench) -> None:
    bench.ask("calibrate", RetryClass.SET, ARM)
    bench.service.on_ack(bench.vehicle, ARM, IN_PROGRESS)
    bench.ask("arm", RetryClass.START, ARM, confirmed=lambda v: v.telemetry.prearm_ok)
    bench.run(30.0)
    assert bench.times("arm") == []
    assert ("arm", Outcome.EXPIRED, "not sent in time") in bench.ended


def test_a_stop_that_the_vehicle_refuses_is_told_once_and_goes_on(bench: Bench) -> None:
    bench.ask("land", RetryClass.STOP, MODE)
    for _ in range(5):
        bench.service.on_ack(bench.vehicle, MODE, DENIED)
        bench.run(0.4)
    assert len(bench.times("land")) >= 5
    assert [e.text for e in bench.events.since(0)] == ["land: refused (denied), still trying"]


def test_a_stop_asks_for_the_telemetry_that_would_confirm_it(bench: Bench) -> None:
    looks: list[float] = []
    action = bench.ask("land", RetryClass.STOP, MODE)
    action.look = lambda: looks.append(bench.clock.now())
    bench.run(4.0)
    assert 7 <= len(looks) <= 9 and looks[0] == pytest.approx(0.8, abs=0.06)
    bench.service.on_ack(bench.vehicle, 512, ACCEPTED)
    assert bench.service.ignored == {}, "the answer to that question is nobody's"


# ---------------------------------------------------------------- telemetry that is asked for


@pytest.mark.parametrize("retry", RetryClass)
def test_what_is_accepted_is_looked_at_at_once_and_not_at_the_next_heartbeat(bench: Bench, retry: RetryClass) -> None:
    looks: list[float] = []
    action = bench.ask("mode", retry, MODE)
    action.look = lambda: looks.append(bench.clock.now())
    bench.run(0.2)
    bench.service.on_ack(bench.vehicle, MODE, ACCEPTED)
    bench.run(1.3)
    assert looks[:2] == pytest.approx([0.25, 0.75], abs=0.06)
    bench.vehicle.telemetry.armed = True
    bench.run(2.0)
    assert len(looks) <= 5 and [outcome for _, outcome, _ in bench.ended] == [Outcome.CONFIRMED]


def test_a_flood_of_acks_is_no_flood_of_questions(bench: Bench) -> None:
    looks: list[float] = []
    bench.ask("arm", RetryClass.START, ARM).look = lambda: looks.append(bench.clock.now())
    for _ in range(50):
        bench.service.on_ack(bench.vehicle, ARM, ACCEPTED)
        bench.run(0.05)
    assert len(looks) <= 7


def test_what_was_never_answered_is_counted_and_only_the_newest_is_kept(bench: Bench) -> None:
    for number in range(150):
        bench.ask(f"speed {number}", RetryClass.SET, SPEED)
        bench.run(4.0)
    assert bench.service.unanswered_count == 150
    assert len(bench.service.unanswered) == 100 and bench.service.unanswered[-1] == "vehicle 1: speed 149"
