"""Stepping back while a radio's buffer is full, and up again; on made-up times."""

from itertools import pairwise

import pytest

from tui_gcs.core.protocol.link_report import RadioRow
from tui_gcs.core.rates.radio_status import BackOff, radio_report

MOST = 4


def heard(back_off: BackOff, txbuf: int, start_s: int, seconds: int, *, asked: bool = True) -> list[int]:
    """Steps after each of one report a second."""
    steps = []
    for t in range(start_s, start_s + seconds):
        back_off.on_report(txbuf, float(t), MOST, requested=asked)
        steps.append(back_off.steps)
    return steps


def test_half_full_is_a_step_down_at_most_every_2_seconds() -> None:
    assert heard(BackOff(), 40, 0, 8) == [1, 1, 2, 2, 3, 3, 4, 4]


def test_nearly_full_is_two_steps_at_once() -> None:
    assert heard(BackOff(), 10, 0, 4) == [2, 2, 4, 4]


def test_a_step_waits_until_everybody_was_asked_unless_the_buffer_is_nearly_full() -> None:
    assert heard(BackOff(), 40, 0, 8, asked=False) == [0] * 8
    assert heard(BackOff(), 10, 0, 4, asked=False) == [2, 2, 4, 4]


def test_between_50_and_90_percent_free_nothing_moves() -> None:
    back_off = BackOff()
    heard(back_off, 40, 0, 1)
    assert heard(back_off, 50, 2, 60) == [1] * 60
    assert heard(back_off, 90, 70, 60) == [1] * 60


def test_a_free_buffer_leads_up_one_step_every_5_seconds() -> None:
    back_off = BackOff()
    heard(back_off, 40, 0, 3)
    assert back_off.steps == 2
    assert heard(back_off, 95, 10, 12) == [2] * 5 + [1] * 5 + [0] * 2


def test_one_report_of_a_filled_buffer_starts_the_5_seconds_anew() -> None:
    back_off = BackOff()
    heard(back_off, 40, 0, 1)
    assert heard(back_off, 95, 10, 4) == [1] * 4
    assert heard(back_off, 80, 14, 1) == [1]
    assert heard(back_off, 95, 15, 6) == [1] * 5 + [0]


def test_a_step_up_that_fills_the_buffer_again_is_tried_less_and_less_often() -> None:
    back_off = BackOff()
    climbs = []
    txbuf = 40
    for t in range(900):
        before = back_off.steps
        back_off.on_report(txbuf, float(t), MOST, requested=True)
        if back_off.steps < before:
            climbs.append(t)
        txbuf = 95 if back_off.steps else 40  # the radio carries one step less than calculated
    waits = [b - a for a, b in pairwise(climbs)]
    assert waits[:4] == sorted(waits[:4])
    assert waits[-1] >= 160
    assert len(climbs) <= 10


def test_after_a_good_while_on_top_a_step_down_is_a_new_one() -> None:
    back_off = BackOff()
    heard(back_off, 40, 0, 1)
    heard(back_off, 95, 1, 10)
    heard(back_off, 40, 12, 1)  # relapse: the next try takes 10 s
    assert heard(back_off, 95, 14, 12) == [1] * 10 + [0] * 2
    heard(back_off, 95, 30, 100)
    heard(back_off, 40, 130, 1)
    assert heard(back_off, 95, 140, 6) == [1] * 5 + [0]


def test_a_radio_that_does_not_know_its_buffer_moves_nothing() -> None:
    assert heard(BackOff(), 255, 0, 10) == [0] * 10


def test_steps_that_are_no_longer_there_are_given_back() -> None:
    back_off = BackOff()
    heard(back_off, 10, 0, 4)
    back_off.on_report(95, 20.0, 1, requested=True)
    assert back_off.steps == 1


def test_a_report_has_the_radios_own_units() -> None:
    fields = {"txbuf": 87, "rssi": 190, "remrssi": 185, "noise": 40, "remnoise": 41, "rxerrors": 12, "fixed": 3}
    assert radio_report(fields, 0.5) == RadioRow(87, 190, 185, 40, 41, 12, 3, 0.5)


@pytest.mark.parametrize("name", ["RADIO_STATUS", "RADIO"])
def test_both_messages_have_the_fields_of_a_report(name: str) -> None:
    from pymavlink.dialects.v20 import all as pymavlink_all

    kind = next(kind for kind in pymavlink_all.mavlink_map.values() if kind.msgname == name)
    radio_report(dict.fromkeys(kind.fieldnames, 0), 0.0)
