"""Stops on a station that does not answer: given at once, not lost, not doubled, none after a newer one."""

import asyncio
from collections.abc import Callable
from functools import partial
from itertools import count

import msgspec
import pytest

from tui_gcs.core.protocol.base import StopRequest
from tui_gcs.core.protocol.bus import BusError, MemoryBus, OnAnswer
from tui_gcs.core.protocol.common import Hold, Return, decode
from tui_gcs.core.protocol.flight import Land
from tui_gcs.feed.stop_requests import StopRequests

KEY = "req/console-1"


class SilentStation(MemoryBus):
    """Takes questions, and answers (or does not) when the test says so."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[StopRequest] = []
        self.given_ns: list[int] = []
        self._waiting: list[OnAnswer] = []

    def begin(
        self, key: str, payload: bytes, on_answer: OnAnswer, timeout_s: float = 2.0, *, late: bool = False
    ) -> None:
        assert key == KEY and late
        stop = decode(payload, Hold | Return | Land)
        self.given_ns.append(stop.given_ns)
        self.asked.append(msgspec.structs.replace(stop, given_ns=0))
        self._waiting.append(on_answer)

    def answer(self, number: int, yes: bool) -> None:
        self._waiting[number](b"%d" % number if yes else None)


def stop_requests(station: SilentStation, timeout_s: float = 2.0) -> StopRequests:
    return StopRequests(station, KEY, timeout_s, count(1001).__next__)


async def until(true: Callable[[], bool]) -> None:
    async with asyncio.timeout(5.0):
        while not true():
            await asyncio.sleep(0.001)


async def given(line: StopRequests, stop: StopRequest, tries: int = 3) -> "asyncio.Task[bytes]":
    task = asyncio.ensure_future(line.begin(stop, tries))
    await asyncio.sleep(0.005)
    return task


async def test_the_same_stop_forty_times_is_one_and_all_hear_its_answer() -> None:
    station = SilentStation()
    line = stop_requests(station)
    waiting = [await given(line, Hold()) for _ in range(40)]
    await until(lambda: len(station.asked) == 1)
    station.answer(0, True)
    assert set(await asyncio.gather(*waiting)) == {b"0"}
    assert station.asked == [Hold()]
    again = await given(line, Hold())
    await until(lambda: len(station.asked) == 2)
    station.answer(1, True)
    assert await again == b"1", "the next one is a new one"


async def test_a_stop_given_in_the_last_try_of_the_same_is_not_lost() -> None:
    station = SilentStation()
    line = stop_requests(station)
    first = await given(line, Hold(), tries=1)
    second = await given(line, Hold(), tries=1)
    station.answer(0, False)
    await until(lambda: len(station.asked) == 2)
    station.answer(1, True)
    assert await asyncio.gather(first, second) == [b"1", b"1"]


async def test_another_stop_goes_at_once_and_the_older_one_is_not_said_again() -> None:
    station = SilentStation()
    line = stop_requests(station)
    hold = await given(line, Hold())
    back = await given(line, Return())
    await until(lambda: station.asked == [Hold(), Return()])
    station.answer(0, False)
    station.answer(1, True)
    assert await back == b"1"
    with pytest.raises(BusError):
        await hold
    assert station.asked == [Hold(), Return()]


async def test_a_stop_of_one_vehicle_ends_no_stop_of_all() -> None:
    station = SilentStation()
    line = stop_requests(station)
    hold = await given(line, Hold())
    land = await given(line, Land((3,)))
    await until(lambda: len(station.asked) == 2)
    station.answer(0, False)
    await until(lambda: station.asked[2:] == [Hold()])
    for number in (1, 2):
        station.answer(number, True)
    assert await asyncio.gather(hold, land) == [b"2", b"1"]


async def test_said_again_a_stop_says_when_it_was_given_first() -> None:
    """HOLD ALL is not heard; vehicle 3 is ordered to land: the station must see that the repeated HOLD ALL is older."""
    station = SilentStation()
    line = stop_requests(station)
    hold = await given(line, Hold())
    land = await given(line, Land((3, 4)))
    station.answer(1, True)
    await land
    station.answer(0, False)
    await until(lambda: len(station.asked) == 3)
    station.answer(2, True)
    assert await hold == b"2"
    assert station.asked == [Hold(), Land((3, 4)), Hold()]
    assert station.given_ns == [1001, 1002, 1001]


async def test_after_another_order_the_same_stop_is_a_new_one() -> None:
    """HOLD, resume, HOLD: the second one must come after what it stops."""
    station = SilentStation()
    line = stop_requests(station)
    first = await given(line, Hold())
    line.note_other_order()
    second = await given(line, Hold())
    await until(lambda: len(station.asked) == 2)
    for number in (0, 1):
        station.answer(number, True)
    assert await asyncio.gather(first, second) == [b"0", b"1"]


async def test_nobody_is_left_waiting_however_often_others_give_it_again() -> None:
    line = stop_requests(SilentStation(), timeout_s=0.02)
    presses = [await given(line, Hold(), tries=1) for _ in range(10)]
    for press in presses:
        with pytest.raises(BusError, match="answer"):
            await press


async def test_stops_given_at_once_are_said_in_turn() -> None:
    station = SilentStation()
    line = stop_requests(station)
    given_at_once = [Hold(), Land((1,)), Return((2,)), Land((3,))]
    waiting = [asyncio.ensure_future(line.begin(stop, 1)) for stop in given_at_once]
    await until(lambda: len(station.asked) == 4)
    assert station.asked == given_at_once
    for number in range(4):
        station.answer(number, True)
    assert await asyncio.gather(*waiting) == [b"0", b"1", b"2", b"3"]


async def test_a_stop_does_not_wait_for_one_that_is_stuck() -> None:
    station = SilentStation()
    line = stop_requests(station)
    stuck = await given(line, Land((1,)))
    held = await given(line, Hold())
    station.answer(1, True)
    assert await held == b"1"
    assert not stuck.done()
    station.answer(0, True)
    await stuck


async def test_tries_are_not_used_up_at_once_where_the_bus_fails_at_once() -> None:
    """A killed station: the bus says so immediately, three times within a millisecond; it is back a second later."""
    station = SilentStation()
    line = stop_requests(station, timeout_s=1.0)
    hold = await given(line, Hold(), tries=2)
    for number in range(3):
        station.answer(number, False)
        await until(partial(lambda count: len(station.asked) == count, number + 2))
    station.answer(3, True)
    assert await hold == b"3"
    assert station.given_ns == [1001] * 4
