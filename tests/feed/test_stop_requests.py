"""Stops on a station that does not answer: given at once, not lost, not doubled, none after a newer one."""

import asyncio
import threading
from collections.abc import Callable

import pytest

from tui_gcs.core.protocol.bus import BusError, MemoryBus, OnGone
from tui_gcs.core.protocol.common import Hold, Reply, Return, VehicleResult, decode, encode
from tui_gcs.core.protocol.flight import Land
from tui_gcs.feed.request_sequence import RequestSequence
from tui_gcs.feed.stop_requests import Stop, StopRequests

KEY = "req/console-1"


class SilentBus(MemoryBus):
    """Passes each stop to `asked`, which takes it, the timeout and what to call when it is sent."""

    def __init__(self, asked: Callable[[Stop, float, OnGone], bytes]) -> None:
        super().__init__()
        self.asked = asked

    def ask(
        self, key: str, payload: bytes, timeout_s: float = 2.0, *, late: bool = False, gone: OnGone = lambda: None
    ) -> bytes:
        assert key == KEY and late
        return self.asked(decode(payload, Stop), timeout_s, gone)


def stop_requests(asked: Callable[[Stop, float, OnGone], bytes], timeout_s: float = 2.0) -> StopRequests:
    return StopRequests(SilentBus(asked), KEY, RequestSequence(), timeout_s)


class Station:
    """Takes a question, and answers (or does not) when the test says so."""

    def __init__(self) -> None:
        self.asked: list[Stop] = []
        self.answers: dict[int, bool] = {}
        self.answers_with: dict[int, bytes] = {}
        self._changed = threading.Condition()

    def ask(self, stop: Stop, timeout_s: float, gone: OnGone) -> bytes:
        with self._changed:
            number = len(self.asked)
            self.asked.append(stop)
            gone()
            assert self._changed.wait_for(lambda: number in self.answers, 5.0), "the test forgot to answer"
        if not self.answers[number]:
            raise BusError("no answer")
        return self.answers_with.get(number, b"%d" % number)

    def answer(self, number: int, yes: bool) -> None:
        with self._changed:
            self.answers[number] = yes
            self._changed.notify_all()


async def until(true: Callable[[], bool]) -> None:
    async with asyncio.timeout(5.0):
        while not true():
            await asyncio.sleep(0.001)


async def given(line: StopRequests, stop: Stop, tries: int = 3) -> "asyncio.Task[bytes]":
    task = asyncio.create_task(line.send(stop, tries))
    await asyncio.sleep(0.005)
    return task


async def test_the_same_stop_forty_times_is_one_and_all_hear_its_answer() -> None:
    station = Station()
    line = stop_requests(station.ask)
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
    station = Station()
    line = stop_requests(station.ask)
    first = await given(line, Hold(), tries=1)
    second = await given(line, Hold(), tries=1)
    station.answer(0, False)
    await until(lambda: len(station.asked) == 2)
    station.answer(1, True)
    assert await asyncio.gather(first, second) == [b"1", b"1"]


async def test_another_stop_goes_at_once_and_the_older_one_is_not_said_again() -> None:
    station = Station()
    line = stop_requests(station.ask)
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
    station = Station()
    line = stop_requests(station.ask)
    hold = await given(line, Hold())
    land = await given(line, Land((3,)))
    await until(lambda: len(station.asked) == 2)
    station.answer(0, False)
    await until(lambda: station.asked[2:] == [Hold()])
    for number in (1, 2):
        station.answer(number, True)
    assert await asyncio.gather(hold, land) == [b"2", b"1"]


async def test_said_again_a_stop_leaves_alone_who_has_obeyed_a_newer_one() -> None:
    """HOLD ALL is not heard; vehicle 3 is told to land, and lands: HOLD ALL, said again, must not stop it."""
    station = Station()
    line = stop_requests(station.ask)
    hold = await given(line, Hold())
    land = await given(line, Land((3, 4)))
    await until(lambda: len(station.asked) == 2)
    results = (VehicleResult(3, True, "lands where it is"), VehicleResult(4, False, "is not in the air"))
    station.answers_with[1] = encode(Reply(ok=False, results=results))
    station.answer(1, True)
    await land
    station.answer(0, False)
    await until(lambda: station.asked[2:] == [Hold(but=(3,))])
    station.answer(2, True)
    assert await hold == b"2"


async def test_after_another_order_the_same_stop_is_a_new_one() -> None:
    """HOLD, resume, HOLD: the second one must come after what it stops."""
    station = Station()
    line = stop_requests(station.ask)
    first = await given(line, Hold())
    line.note_other_order()
    second = await given(line, Hold())
    await until(lambda: len(station.asked) == 2)
    for number in (0, 1):
        station.answer(number, True)
    assert await asyncio.gather(first, second) == [b"0", b"1"]


async def test_nobody_is_left_waiting_however_often_others_give_it_again() -> None:
    def silent(stop: Stop, timeout_s: float, gone: OnGone) -> bytes:
        threading.Event().wait(timeout_s)
        raise BusError("no answer")

    line = stop_requests(silent, timeout_s=0.02)
    presses = [await given(line, Hold(), tries=1) for _ in range(10)]
    for press in presses:
        with pytest.raises(BusError, match="answer"):
            await press


async def test_stops_given_at_once_are_said_in_turn_whichever_thread_is_first() -> None:
    said: list[Stop] = []

    def slow_for_all(stop: Stop, timeout_s: float, gone: OnGone) -> bytes:
        if not stop.vehicles:
            threading.Event().wait(0.02)  # its thread is late
        said.append(stop)
        gone()
        return b""

    line = stop_requests(slow_for_all)
    given_at_once = [Hold(), Land((1,)), Return((2,)), Land((3,))]
    await asyncio.gather(*(line.send(stop, 1) for stop in given_at_once))
    assert said == given_at_once


async def test_a_stop_does_not_wait_for_one_that_is_stuck() -> None:
    never = threading.Event()

    def stuck_for_one(stop: Stop, timeout_s: float, gone: OnGone) -> bytes:
        if stop.vehicles:
            never.wait()
        return b"held"

    line = stop_requests(stuck_for_one)
    stuck = await given(line, Land((1,)))
    assert await asyncio.wait_for(line.send(Hold(), 1), 5.0) == b"held"
    never.set()
    await stuck
