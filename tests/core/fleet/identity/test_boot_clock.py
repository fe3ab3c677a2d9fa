"""Boot clocks: times that continue, late ones, reboots, and two clocks that alternate."""

import random

import pytest

from tui_gcs.core.fleet.identity.boot_clock import WRAP_MS, BootClock, BootTimeResult


def told(clock: BootClock, *times: tuple[float, float]) -> list[BootTimeResult]:
    """What (boot time in s, received at s) mean one after the other."""
    return [clock.check(round(boot_s * 1e3), now) for boot_s, now in times]


def running(boot_s: float = 1000.0, until: float = 10.0) -> BootClock:
    """A clock heard at 10 Hz for 10 s; at 10 s it shows `boot_s`."""
    clock = BootClock()
    for k in range(101):
        assert clock.check(round((boot_s - until + k / 10) * 1e3), k / 10) is BootTimeResult.CONTINUES
    return clock


def test_a_clock_goes_on_whatever_the_gaps() -> None:
    clock = running()
    assert (
        told(clock, (1000.1, 10.1), (1005.0, 15.0), (1005.0, 15.05), (1600.0, 615.0)) == [BootTimeResult.CONTINUES] * 4
    )


def test_drift_of_a_loaded_simulator_is_no_step() -> None:
    clock = running()
    assert {clock.check(round((1000 + 0.5 * k) * 1e3), 10.0 + k) for k in range(600)} == {BootTimeResult.CONTINUES}
    assert {clock.check(round((1300 + 10 * k) * 1e3), 610.0 + k) for k in range(600)} == {BootTimeResult.CONTINUES}


def test_frames_held_up_and_delivered_at_once_go_on() -> None:
    clock = running()
    assert {clock.check(1_000_000 + 100 * k, 40.0) for k in range(300)} == {BootTimeResult.CONTINUES}


def test_swapped_and_late_frames_are_late_and_disturb_nothing() -> None:
    clock = running()
    late = told(clock, (1000.3, 10.3), (1000.2, 10.31), (999.4, 10.32), (997.0, 10.33), (1000.4, 10.4))
    assert late == [
        BootTimeResult.CONTINUES,
        BootTimeResult.LATE,
        BootTimeResult.LATE,
        BootTimeResult.LATE,
        BootTimeResult.CONTINUES,
    ]


@pytest.mark.parametrize("jitter_s", [0.7, 1.0, 1.5, 2.0, 4.0])
def test_a_link_with_jitter_is_neither_a_reboot_nor_a_twin(jitter_s: float) -> None:
    chance = random.Random(7)
    arrivals = sorted((k / 10 + chance.uniform(0.0, jitter_s), k) for k in range(18_000))
    clock = BootClock()
    steps = [clock.check(100_000 + 100 * k, at) for at, k in arrivals]
    assert set(steps) == {BootTimeResult.CONTINUES, BootTimeResult.LATE}


@pytest.mark.parametrize("down_s", [0.5, 2.0, 30.0])
def test_a_reboot_is_told_with_the_first_time(down_s: float) -> None:
    clock = running()
    back_s = 10.0 + down_s
    assert told(clock, (min(0.4, down_s), back_s), (0.5 + down_s / 2, back_s + 0.1)) == [
        BootTimeResult.REBOOT,
        BootTimeResult.CONTINUES,
    ]


def test_a_reboot_right_after_a_reboot() -> None:
    clock = running()
    times = [(0.3, 12.0), (3.0, 14.7), (0.2, 15.0), (0.3, 15.1)]
    assert told(clock, *times) == [
        BootTimeResult.REBOOT,
        BootTimeResult.CONTINUES,
        BootTimeResult.REBOOT,
        BootTimeResult.CONTINUES,
    ]


def test_another_board_that_has_run_for_long_replaces_the_silent_one_within_two_seconds() -> None:
    clock = running()
    steps = told(clock, *((500.0 + k / 10, 10.1 + k / 10) for k in range(20)))
    assert steps[0] is BootTimeResult.LATE, "it might be anything"
    assert steps.count(BootTimeResult.REBOOT) == 1 and steps[-1] is BootTimeResult.CONTINUES
    assert steps.index(BootTimeResult.REBOOT) <= 10


def test_a_leap_of_a_day_is_told_once() -> None:
    clock = running()
    steps = told(clock, *((1000 + 86400 + k / 10, 10.1 + k / 10) for k in range(30)))
    assert (
        steps.count(BootTimeResult.REBOOT) == 1
        and BootTimeResult.OTHER_CLOCK not in steps
        and steps[-1] is BootTimeResult.CONTINUES
    )


def test_after_49_days_it_wraps_and_goes_on() -> None:
    clock = BootClock()
    steps = [clock.check((WRAP_MS - 2_000 + 100 * k) % WRAP_MS, k / 10) for k in range(60)]
    assert set(steps) == {BootTimeResult.CONTINUES}
    assert clock.check(WRAP_MS - 100, 6.0) is BootTimeResult.LATE


def test_a_reboot_shortly_before_the_wrap_is_no_wrap() -> None:
    clock = running(boot_s=(WRAP_MS - 40_000) / 1e3)
    assert told(clock, (0.5, 12.0)) == [BootTimeResult.REBOOT]


@pytest.mark.parametrize("apart_s", [-900.0, -100.0, -7.0, 7.0, 100.0, 500.0, 100_000.0])
@pytest.mark.parametrize("hz", [1.0, 10.0])
def test_two_clocks_by_turns_are_twins_at_once(apart_s: float, hz: float) -> None:
    clock = running()
    steps = []
    for k in range(1, 6):
        now = 10.0 + k / hz
        steps += told(clock, (990 + now, now), (990 + now + apart_s, now + 0.4 / hz))
    assert steps.count(BootTimeResult.OTHER_CLOCK) >= 3
    assert steps.count(BootTimeResult.REBOOT) <= (apart_s > 600)


@pytest.mark.parametrize("apart_s", [-900.0, -7.0, 7.0, 500.0, 100_000.0])
@pytest.mark.parametrize("turn_s", [1.0, 1.5, 3.0, 10.0])
@pytest.mark.parametrize("hz", [1.0, 4.0])
def test_two_clocks_that_take_long_turns_are_twins_and_no_row_of_reboots(
    apart_s: float, turn_s: float, hz: float
) -> None:
    """Two vehicles over a relay that lets them through one after the other; each turn was a reboot, again and again."""
    clock, steps = running(), []
    for k in range(1, 1 + round(12 * turn_s * hz)):
        now = 10.0 + k / hz
        steps += told(clock, (990 + now + (apart_s if k / hz % (2 * turn_s) < turn_s else 0.0), now))
    assert steps.count(BootTimeResult.OTHER_CLOCK) >= 3
    assert steps.count(BootTimeResult.REBOOT) <= 1, "the first may be one"
    left = told(clock, *((steps_s + 990, steps_s) for steps_s in (now + 2 + j / 10 for j in range(60))))
    assert left[-40:] == [BootTimeResult.CONTINUES] * 40, "one goes away"
    assert told(clock, (0.5, now + 12.0), (0.6, now + 12.1)) == [BootTimeResult.REBOOT, BootTimeResult.CONTINUES], (
        "and boots again"
    )


def test_a_board_that_was_replaced_is_no_twin_and_neither_is_the_next() -> None:
    clock = running()
    for boot_s, begin_s in ((500.0, 12.0), (200.0, 20.0), (800.0, 28.0)):
        steps = told(clock, *((boot_s + k / 10, begin_s + k / 10) for k in range(50)))
        assert BootTimeResult.OTHER_CLOCK not in steps and steps[-30:] == [BootTimeResult.CONTINUES] * 30


@pytest.mark.parametrize("apart_s", [-4.0, -2.0, 2.0, 4.0])
def test_two_clocks_near_each_other_are_twins_if_they_are_steady(apart_s: float) -> None:
    clock = running()
    steps = []
    for k in range(1, 31):
        now = 10.0 + k / 10
        steps += told(clock, (990 + now, now), (990 + now + apart_s, now + 0.04))
    assert steps.count(BootTimeResult.OTHER_CLOCK) >= 2
    assert BootTimeResult.REBOOT not in steps


def test_a_twin_that_goes_away_leaves_the_clock_in_order() -> None:
    clock = running()
    for k in range(1, 20):
        now = 10.0 + k / 10
        told(clock, (990 + now, now), (490 + now, now + 0.05))
    assert set(told(clock, *((1002 + k / 10, 12.0 + k / 10) for k in range(50)))) == {BootTimeResult.CONTINUES}
