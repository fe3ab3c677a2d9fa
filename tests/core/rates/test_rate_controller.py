"""Who is asked for which messages, when and how often: on a virtual clock, against autopilots that obey or do not."""

from collections import Counter
from itertools import pairwise

import pytest

from tests.core.rigs.rate_rig import LAN, OFF, PX4, RADIO, REQUEST_MESSAGE, SATELLITE, SET_INTERVAL, Bench
from tui_gcs.core.firmware.streams import ARDUPILOT_ONLY, PX4_ONLY
from tui_gcs.core.rates.message_sets import LADDER
from tui_gcs.core.rates.rate_controller import CHECK_GAP_S

FULL, NORMAL, MINIMAL, LEAN, HALF_LEAN = (dict(LADDER[place].hz) for place in range(5))
FULL_AP, NORMAL_AP = ({m: hz for m, hz in rates.items() if m not in PX4_ONLY} for rates in (FULL, NORMAL))
"""The same as an ArduPilot is asked for."""
POSITION, EKF, VERSION = 33, 193, 148
PX4_HEAVY = {"m85": 50, "m36": 50, "m83": 50, "m31": 50, "m30": 50, "m32": 50}
"""What PX4 sends unasked at 50 Hz (docs/autopilots.md)."""


# ---------------------------------------------------------------- asking


def test_a_new_vehicle_is_asked_who_it_is_and_for_the_full_set_position_first() -> None:
    bench = Bench(LAN).fleet(1, LAN).run(3.0)
    assert (bench.asked[0].command, bench.asked[0].message) == (REQUEST_MESSAGE, VERSION)
    assert bench.intervals() == [(message, 1e6 / hz) for message, hz in FULL_AP.items()]
    assert bench.sends(LAN) == FULL_AP
    assert bench.controller.plan(LAN) == FULL


def test_what_comes_as_asked_is_not_asked_again() -> None:
    bench = Bench(LAN).fleet(3, LAN).run(5.0)
    asked = len(bench.asked)
    bench.run(300.0)
    assert len(bench.asked) == asked


def test_rates_below_one_hertz_on_purpose_are_not_read_as_silence() -> None:
    bench = Bench(RADIO).fleet(20, RADIO).run(60.0)
    assert bench.controller.plan(RADIO) == LEAN
    asked = len(bench.asked)
    bench.run(300.0)
    assert len(bench.asked) == asked


def test_a_silent_vehicle_is_asked_nothing_and_asked_again_when_it_is_back() -> None:
    bench = Bench(LAN).fleet(1, LAN).run(5.0)
    pilot = bench.pilots[1]
    pilot.talks = False
    bench.run(2.0)
    silent_s = bench.clock.now()
    bench.run(20.0)
    assert bench.intervals(since_s=silent_s) == []
    pilot.talks = True
    pilot.interval_s = {(LAN, 0): 1.0}  # a reboot that nobody noticed
    bench.run(5.0)
    assert bench.sends(LAN) == FULL_AP


def test_what_never_comes_is_asked_every_5_s_then_less_often_down_to_every_80_s() -> None:
    bench = Bench(LAN).fleet(1, LAN)
    bench.pilots[1].refuses = {EKF}
    bench.run(600.0)
    times = bench.times(EKF)
    waits = [b - a for a, b in pairwise(times)]
    assert waits[:11] == pytest.approx([5, 5, 5, 5, 5, 10, 20, 40, 80, 80, 80], abs=CHECK_GAP_S + 0.1)


def test_an_ack_without_the_message_is_no_proof() -> None:
    bench = Bench(LAN).fleet(1, LAN).run(3.0)
    bench.pilots[1].start(LAN, EKF, 0)
    bench.run(30.0)
    assert bench.sends(LAN) == FULL_AP
    assert len(bench.times(EKF)) == 2


def test_who_does_not_say_who_it_is_gets_its_messages_all_the_same_and_is_asked_again() -> None:
    bench = Bench(LAN).fleet(1, LAN)
    bench.pilots[1].refuses = {VERSION}
    bench.run(16.5)
    assert bench.sends(LAN) == FULL_AP
    waits = [b - a for a, b in pairwise([a.t_s for a in bench.asked if a.message == VERSION])]
    assert waits == pytest.approx([5, 5], abs=CHECK_GAP_S + 0.2)


def test_250_vehicles_are_not_asked_in_one_tick_and_all_positions_are_asked_within_2_seconds() -> None:
    bench = Bench(LAN).fleet(250, LAN).run(2.0)
    assert max(Counter(a.t_s for a in bench.asked).values()) <= 25
    assert all(bench.times(POSITION, number) for number in range(1, 251))
    bench.run(6.0)
    assert all(bench.sends(LAN, number) == FULL_AP for number in range(1, 251))
    assert len(bench.asked) == 250 * (1 + len(FULL_AP))


def test_a_rebooted_vehicle_is_asked_for_everything_at_once() -> None:
    bench = Bench(LAN).fleet(2, LAN).run(5.0)
    pilot = bench.pilots[1]
    pilot.interval_s = {(LAN, 0): 1.0}
    pilot.vehicle.identity.identified = False
    rebooted_s = bench.clock.now()
    bench.controller.forget(pilot.vehicle)
    bench.run(1.5)
    assert bench.sends(LAN) == FULL_AP
    assert pilot.vehicle.identity.identified
    assert bench.intervals(2, since_s=rebooted_s) == []


def test_forgetting_ends_the_waiting_for_what_was_refused() -> None:
    bench = Bench(LAN).fleet(1, LAN)
    bench.pilots[1].refuses = {EKF}
    bench.run(200.0)
    asked = len(bench.times(EKF))
    bench.controller.forget(bench.vehicles[1])
    bench.run(1.5)
    assert len(bench.times(EKF)) == asked + 1


def test_a_message_at_a_much_different_rate_is_asked_again() -> None:
    bench = Bench(LAN).fleet(1, LAN).run(10.0)
    bench.pilots[1].start(LAN, POSITION, 50)  # another station on the same link wants more
    bench.run(12.0)
    assert bench.sends(LAN) == FULL_AP
    bench.pilots[1].start(LAN, POSITION, 2)  # or less
    bench.run(20.0)
    assert bench.sends(LAN) == FULL_AP


def test_an_autopilot_that_slows_down_a_little_by_itself_is_left_alone() -> None:
    bench = Bench(LAN).fleet(1, LAN).run(10.0)
    bench.pilots[1].start(LAN, POSITION, 4)
    asked = len(bench.asked)
    bench.run(100.0)
    assert len(bench.asked) == asked


def test_one_that_never_keeps_its_rate_is_asked_less_and_less_often() -> None:
    bench = Bench(LAN).fleet(1, LAN).run(10.0)
    for _ in range(600):
        bench.pilots[1].start(LAN, POSITION, 50)
        bench.run(1.0)
    assert len(bench.times(POSITION)) <= 15


def test_a_vehicle_that_speaks_high_latency_is_asked_nothing() -> None:
    bench = Bench(LAN).fleet(1, LAN)
    bench.vehicles[1].telemetry.high_latency_s = 1e9
    bench.run(20.0)
    assert bench.asked == []


# ---------------------------------------------------------------- budgets


@pytest.mark.parametrize(("vehicles", "signed", "plan"), [(1, False, FULL), (8, False, MINIMAL), (8, True, MINIMAL)])
def test_vehicles_of_a_radio_send_the_best_set_that_fits(vehicles: int, signed: bool, plan: dict[int, float]) -> None:
    bench = Bench(RADIO).fleet(vehicles, RADIO, signed=signed).run(60.0)
    assert bench.controller.plan(RADIO) == plan
    for number in range(1, vehicles + 1):
        asked = {message: round(hz, 3) for message, hz in plan.items() if message not in PX4_ONLY}
        assert bench.sends(RADIO, number) == asked


def test_signatures_are_counted() -> None:
    assert Bench(RADIO).fleet(4, RADIO, signed=False).run(30.0).controller.plan(RADIO) == NORMAL
    assert Bench(RADIO).fleet(4, RADIO, signed=True).run(30.0).controller.plan(RADIO) == MINIMAL


def test_a_radio_starts_poor_and_gets_richer_when_nobody_joins_any_more() -> None:
    bench = Bench(RADIO).fleet(1, RADIO).run(4.0)
    assert bench.controller.plan(RADIO) == LEAN
    bench.run(2.0)
    assert bench.controller.plan(RADIO) == FULL


def test_when_vehicles_join_the_set_gets_poorer_at_once_and_richer_half_a_minute_after_they_left() -> None:
    bench = Bench(RADIO).fleet(3, RADIO).run(30.0)
    assert bench.controller.plan(RADIO) == FULL
    for number in range(4, 9):
        bench.add(number, RADIO)
    bench.run(0.5)
    assert bench.controller.plan(RADIO) == MINIMAL
    bench.run(30.0)
    assert all(bench.sends(RADIO, number) == MINIMAL for number in range(1, 9))
    for number in range(4, 9):
        bench.pilots[number].talks = False
    bench.run(25.0)
    assert bench.controller.plan(RADIO) == MINIMAL, "they may come back"
    bench.run(40.0)
    assert bench.controller.plan(RADIO) == FULL
    assert all(bench.sends(RADIO, number) == FULL_AP for number in (1, 2, 3))


def test_what_a_poorer_set_does_not_have_is_turned_off_and_heartbeats_never() -> None:
    bench = Bench(RADIO).fleet(3, RADIO).run(30.0)
    for number in range(4, 9):
        bench.add(number, RADIO)
    changed_s = bench.clock.now()
    bench.run(30.0)
    asked = dict(bench.intervals(1, since_s=changed_s))
    assert {message for message, interval_us in asked.items() if interval_us == OFF} == {30, 74, 193, 42, 242, 65, 168}
    assert not [a for a in bench.asked if a.command == SET_INTERVAL and a.message == 0]
    assert all(bench.pilots[n].hz(RADIO, 0) == 1.0 for n in range(1, 9))


def test_a_radio_carries_at_most_4_requests_a_second() -> None:
    bench = Bench(RADIO).fleet(8, RADIO).run(60.0)
    times = [a.t_s for a in bench.asked]
    assert len(times) >= 8 * 6
    assert max(sum(start <= t < start + 1.0 for t in times) for start in times) <= 4


def test_copies_that_nobody_answers_count_too() -> None:
    bench = Bench(RADIO).fleet(8, RADIO)
    for pilot in bench.pilots.values():
        pilot.answers = False
    bench.run(120.0)
    times = [a.t_s for a in bench.asked]
    assert len(times) <= 4 * 120
    assert max(sum(start <= t < start + 10.0 for t in times) for start in times) <= 45


def test_too_many_vehicles_get_the_poorest_set_and_the_operator_is_told_once() -> None:
    bench = Bench(RADIO).fleet(150, RADIO).run(60.0)
    assert bench.controller.plan(RADIO) == dict(LADDER[-1].hz)
    assert len([text for text in bench.texts() if "too many vehicles" in text]) == 1


def test_the_operator_is_told_of_a_radios_set_and_not_of_a_full_one_on_a_network() -> None:
    bench = Bench(RADIO, LAN).fleet(8, RADIO, signed=True)
    bench.add(9, LAN)
    bench.run(60.0)
    assert bench.texts() == ["telemetry minimal: 8 vehicles, 1794 of 2822 B/s"]


# ---------------------------------------------------------------- links


def test_a_vehicle_that_switches_links_is_told_the_other_links_set_once() -> None:
    bench = Bench(RADIO, LAN).fleet(8, RADIO).run(60.0)
    vehicle = bench.vehicles[1]
    radio, lan = vehicle.path, bench.way(1, LAN)
    bench.pilots[1].start(LAN, 0, 1.0)
    vehicle.paths.append(lan)
    vehicle.path = lan
    bench.run(5.0)
    assert bench.sends(LAN) == FULL_AP
    assert bench.sends(RADIO) == MINIMAL, "it still sends there, and is still counted there"
    switched_s = bench.clock.now()
    vehicle.path = radio
    bench.run(20.0)
    assert bench.intervals(since_s=switched_s) == []


def test_a_vehicle_heard_over_two_links_counts_on_both() -> None:
    bench = Bench(RADIO, LAN).fleet(4, RADIO).run(30.0)
    assert bench.controller.plan(RADIO) == NORMAL
    bench.add(5, LAN)
    bench.vehicles[5].paths.append(bench.way(5, RADIO))
    bench.pilots[5].start(RADIO, 0, 1.0)
    bench.run(1.0)
    assert bench.controller.plan(RADIO) == MINIMAL


def test_on_a_high_latency_link_nothing_is_asked_and_nothing_else_is_to_be_sent() -> None:
    bench = Bench(SATELLITE + ",highlatency", LAN).fleet(2, SATELLITE).run(30.0)
    assert bench.asked == []
    assert bench.controller.plan(SATELLITE) == {}
    assert bench.controller.silent(SATELLITE)
    assert not bench.controller.silent(LAN)
    assert not bench.controller.silent("never heard of")


def test_a_link_that_nobody_described_has_no_budget() -> None:
    bench = Bench().fleet(2, "memory").run(5.0)
    assert bench.sends("memory") == FULL_AP
    assert bench.controller.plan("never heard of") == {}


# ---------------------------------------------------------------- PX4 and other talkers


def test_px4_on_a_budget_is_told_to_be_quiet_before_anything_else() -> None:
    bench = Bench(RADIO)
    bench.add(1, RADIO, autopilot=PX4, signed=True, m33=50, **PX4_HEAVY)
    for number in range(2, 9):
        bench.add(number, RADIO)
    bench.run(60.0)
    assert bench.sends(RADIO) == MINIMAL
    assert {message for message, _ in bench.intervals()[:6]} == {85, 36, 83, 31, 30, 32}
    assert all(interval_us == OFF for _, interval_us in bench.intervals()[:6])


def test_px4_without_a_budget_keeps_its_habits_at_our_rates() -> None:
    bench = Bench(LAN)
    bench.add(1, LAN, autopilot=PX4, m33=50, **PX4_HEAVY)
    bench.run(10.0)
    ours = {message: hz for message, hz in FULL.items() if message not in ARDUPILOT_ONLY}
    assert bench.sends(LAN) == {85: 50, 36: 50, 83: 50, 31: 50, 32: 50} | ours
    assert bench.times(EKF) == [], "PX4 does not have it"


def test_what_was_turned_off_and_comes_again_is_turned_off_again() -> None:
    bench = Bench(RADIO).fleet(8, RADIO).run(60.0)
    bench.pilots[3].start(RADIO, 27, 10)
    bench.run(20.0)
    assert bench.intervals(3)[-1] == (27, OFF)
    bench.pilots[3].start(RADIO, 27, 10)
    bench.run(20.0)
    assert bench.sends(RADIO, 3) == MINIMAL
    assert len(bench.times(27, 3)) == 2


# ---------------------------------------------------------------- the radio's own word


def reports(bench: Bench, txbuf: int, seconds: int) -> None:
    for _ in range(seconds):
        bench.hear_radio(txbuf)
        bench.run(1.0)


def test_a_filling_buffer_is_a_step_down_for_every_vehicle_and_a_free_one_a_step_up() -> None:
    bench = Bench(RADIO).fleet(3, RADIO).run(30.0)
    assert bench.controller.plan(RADIO) == FULL
    reports(bench, 40, 1)
    assert bench.controller.plan(RADIO) == NORMAL
    bench.run(20.0)
    assert all(bench.sends(RADIO, number) == NORMAL_AP for number in (1, 2, 3))
    reports(bench, 95, 7)
    assert bench.controller.plan(RADIO) == FULL
    bench.run(20.0)
    assert all(bench.sends(RADIO, number) == FULL_AP for number in (1, 2, 3))


def test_a_step_waits_until_all_vehicles_were_asked_for_the_last_one() -> None:
    bench = Bench(RADIO).fleet(3, RADIO).run(30.0)
    reports(bench, 40, 3)
    assert bench.controller.plan(RADIO) == NORMAL
    reports(bench, 40, 2)
    assert bench.controller.plan(RADIO) == MINIMAL


def test_a_nearly_full_buffer_is_backed_off_from_hard_but_never_further_than_half_lean() -> None:
    bench = Bench(RADIO).fleet(3, RADIO).run(30.0)
    bench.hear_radio(15)
    assert bench.controller.plan(RADIO) == MINIMAL
    reports(bench, 0, 60)
    assert bench.controller.plan(RADIO) == HALF_LEAN
    assert bench.sends(RADIO) == HALF_LEAN
    assert any("the radio's buffer was full" in text for text in bench.texts())


def test_a_bridge_behind_a_link_without_a_budget_is_believed_too() -> None:
    bench = Bench(LAN).fleet(3, LAN).run(5.0)
    bench.hear_radio(30, LAN)
    bench.run(5.0)
    assert all(bench.sends(LAN, number) == NORMAL_AP for number in (1, 2, 3))


def test_the_newest_report_is_kept_with_its_age() -> None:
    bench = Bench(RADIO, LAN).fleet(1, RADIO)
    assert bench.controller.radio(RADIO) is None
    bench.hear_radio(88, rssi=150)
    bench.hear_radio(77, rssi=151)
    bench.run(3.0)
    report = bench.controller.radio(RADIO)
    assert report is not None
    assert (report.txbuf_pct, report.rssi, report.age_s) == (77, 151, pytest.approx(3.0))
    assert bench.controller.radio(LAN) is None
