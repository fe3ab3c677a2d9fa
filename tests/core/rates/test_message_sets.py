"""Which set of messages fits a link; sizes and sums against pymavlink's own tables."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tui_gcs.core.links.spec import parse_link
from tui_gcs.core.rates.message_sets import (
    FULL,
    HALF_LEAN,
    LADDER,
    LEAN,
    PAYLOAD_BYTES,
    UNASKED,
    best_fit,
    bytes_per_s,
    telemetry_budget,
)

RADIO_BYTES_PER_S = parse_link("serial:/dev/ttyUSB0:57600").bytes_per_s
PICTURE = {33, 245, 1, 24, 147}
"""Position, landed state, health, GPS, battery: what the station acts on."""


NEWER_BYTES = {42: 18}
"""With extensions that pymavlink 2.4.50 does not know yet: MISSION_CURRENT's total, state, mode and plan ids."""


def payload_bytes(message: int) -> int:
    """From pymavlink's message classes."""
    return NEWER_BYTES.get(message) or pymavlink_all.mavlink_map[message].unpacker.size


def by_hand(rates: dict[int, float], signed: bool) -> float:
    """Bytes per second of one vehicle and its heartbeat, from pymavlink's message classes."""
    trailer = 13 if signed else 0
    return sum(hz * (12 + payload_bytes(message) + trailer) for message, hz in {0: 1.0, **rates}.items())


def test_payload_sizes_are_those_of_the_dialect_with_all_extensions() -> None:
    assert {message: payload_bytes(message) for message in PAYLOAD_BYTES} == PAYLOAD_BYTES


@pytest.mark.parametrize("rates", [hz for _, hz in LADDER], ids=[name for name, _ in LADDER])
def test_bytes_are_counted_frame_by_frame(rates: dict[int, float]) -> None:
    assert bytes_per_s(rates, 1, 0) == pytest.approx(by_hand(rates, signed=False))
    assert bytes_per_s(rates, 8, 3) == pytest.approx(5 * by_hand(rates, False) + 3 * by_hand(rates, True))


def test_the_sum_is_about_the_one_of_the_facts() -> None:
    # docs/threats.md C.3: HB 1, POS 2, SYS .5 signed is 168 B/s, without the 12 bytes of SYS_STATUS's extensions;
    # ours adds landed state 1, GPS .2, battery .1
    extra = 0.5 * 12 + 27 + 0.2 * (12 + 52 + 13) + 0.1 * (12 + 54 + 13)
    minimal = dict(LADDER)["minimal"]
    assert bytes_per_s(minimal, 1, 1) - extra == pytest.approx(168, abs=1)


@pytest.mark.parametrize(
    ("vehicles", "signed", "name"),
    [
        (1, 0, "full"),
        (3, 0, "full"),
        (4, 0, "normal"),
        (3, 3, "normal"),
        (4, 4, "minimal"),
        (8, 0, "minimal"),
        (8, 8, "minimal"),
        (13, 13, "lean"),
        (20, 20, "lean"),
        (21, 21, "half lean"),
        (60, 60, "eighth lean"),
        (200, 200, "eighth lean"),
    ],
)
def test_what_fits_a_57600_radio(vehicles: int, signed: int, name: str) -> None:
    assert LADDER[best_fit(telemetry_budget(RADIO_BYTES_PER_S), vehicles, signed)].name == name


def test_a_link_without_a_budget_carries_the_full_set_of_any_fleet() -> None:
    assert best_fit(telemetry_budget(None), 1000, 1000) == FULL


@given(capacity=st.integers(1, 10**6), vehicles=st.integers(0, 300), data=st.data())
def test_the_best_fit_is_within_70_percent_and_the_next_richer_one_is_not(
    capacity: int, vehicles: int, data: st.DataObject
) -> None:
    signed = data.draw(st.integers(0, vehicles))
    place = best_fit(telemetry_budget(capacity), vehicles, signed)
    if place < len(LADDER) - 1:
        assert bytes_per_s(LADDER[place].hz, vehicles, signed) <= 0.7 * capacity
    if place > FULL:
        assert bytes_per_s(LADDER[place - 1].hz, vehicles, signed) > 0.7 * capacity


def test_the_ladder_goes_down_and_no_set_leaves_the_picture_incomplete() -> None:
    costs = [bytes_per_s(hz, 1, 1) for _, hz in LADDER]
    assert costs == sorted(costs, reverse=True)
    assert all(set(hz) >= PICTURE for _, hz in LADDER)
    assert (LADDER[LEAN].name, LADDER[HALF_LEAN].name) == ("lean", "half lean")


def test_positions_of_every_planned_set_are_fresh_enough() -> None:
    assert all(hz[33] >= 1.0 for _, hz in LADDER[: LEAN + 1]), "R18: age p95 below 1.5 s"
    assert all(hz[message] >= 1 / 65 for _, hz in LADDER for message in hz), "ArduPilot: 16 bits of milliseconds"


def test_neither_heartbeats_nor_answers_are_ever_turned_off() -> None:
    assert not UNASKED & {0, 22, 39, 42, 44, 47, 51, 73, 77, 109, 110, 148, 242, 253, 300, 436}
