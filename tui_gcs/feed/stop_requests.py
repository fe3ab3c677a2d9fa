"""Stops on their way to the station: sent the moment they are given, not lost, not doubled, never after a newer one.

A station that does not answer must not make stops queue: they would come when the operator has long done something
else. So each stop has a thread at once; the same one given again while it is under way is that one, with all its tries
anew; one whose place a newer one has taken is not said again; and said again it is not for those who have obeyed a
newer one: who was told to land after HOLD ALL is not held.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import msgspec

from tui_gcs.core.protocol.bus import BusError, OnGone
from tui_gcs.core.protocol.common import Hold, Reply, Return, decode
from tui_gcs.core.protocol.flight import Land
from tui_gcs.feed.request_sequence import RequestSequence, Turn

Stop = Hold | Return | Land
STOPS = (Hold, Return, Land)
"""Done although nobody waits for the answer any more: a stop is never too late."""
MOST_UNDER_WAY = 16
"""Different ones whose answers are waited for; more wait for a thread, and are not sent if replaced meanwhile."""
SPARE_S = 0.5
"""Beyond the time of all its tries: then who gave it is told that nobody answers."""


@dataclass
class _Way:
    """One stop that is under way."""

    stop: Stop
    tries: int
    turn: Turn
    sent: int = 0
    replaced: bool = False
    task: asyncio.Task[bytes] | None = None


class StopRequests:
    """Gives stops to the station by `ask`, which waits at most `timeout_s` and raises `BusError`."""

    def __init__(
        self, ask: Callable[[Stop, float, OnGone], bytes], turns: RequestSequence, timeout_s: float = 2.0
    ) -> None:
        """Nothing is under way. `turns`: of all orders of this console."""
        self._turns = turns
        self._ask = ask
        self._timeout_s = timeout_s
        self._threads = ThreadPoolExecutor(MOST_UNDER_WAY, "stop")
        self._ways: list[_Way] = []
        self._newest: _Way | None = None
        """The one that the same stop, given again, joins."""

    async def give(self, stop: Stop, tries: int) -> bytes:
        """The station's answer. Raises `BusError`: none within the time of `tries`, or a newer stop took its place."""
        way = self._newest
        if way is not None and way.stop == stop:
            way.tries = way.sent + tries
        else:
            for older in self._ways:
                older.replaced = older.replaced or _covers(stop, older.stop)
            way = self._newest = _Way(stop, tries, self._turns.next())
            self._ways.append(way)
            way.task = asyncio.get_running_loop().create_task(self._repeat(way))
            way.task.add_done_callback(lambda task: task.cancelled() or task.exception())  # whoever waits has given up
        wait_s = tries * self._timeout_s
        task = way.task
        if task is None or not (await asyncio.wait({task}, timeout=wait_s + SPARE_S))[0]:
            raise BusError(f"the station did not answer within {wait_s:.0f} s")
        return task.result()

    def other_order(self) -> None:
        """Something else was ordered: the stop before it may be undone by that, so the same one again is a new one."""
        self._newest = None

    def close(self) -> None:
        """Nobody waits any more."""
        for way in self._ways:
            if way.task is not None:
                way.task.cancel()
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def _repeat(self, way: _Way) -> bytes:
        problem = BusError("not sent")
        loop = asyncio.get_running_loop()
        try:
            while way.sent < way.tries:
                way.sent += 1
                try:
                    answer = await loop.run_in_executor(self._threads, self._say, way)
                    self._spare(way, _obeyed(answer))
                    return answer
                except BusError as error:
                    problem = error
                if way.replaced:
                    break
            raise problem
        finally:
            self._ways.remove(way)
            if self._newest is way:
                self._newest = None

    def _spare(self, newer: _Way, obeyed: set[int]) -> None:
        """Those who have obeyed `newer` are not meant by older ones any more."""
        for older in self._ways[: self._ways.index(newer)]:
            older.stop = msgspec.structs.replace(older.stop, but=tuple(sorted(obeyed | set(older.stop.but))))

    def _say(self, way: _Way) -> bytes:
        """On a thread, which may have come late, or before that of the order before."""
        try:
            way.turn.wait()
            if way.replaced:
                raise BusError("not said any more: a newer stop took its place")
            return self._ask(way.stop, self._timeout_s, way.turn.gone.set)
        finally:
            way.turn.gone.set()


def _obeyed(answer: bytes) -> set[int]:
    try:
        return {result.vehicle for result in decode(answer, Reply).results if result.ok}
    except msgspec.MsgspecError:
        return set()  # who asked is told that it cannot be read


def _covers(newer: Stop, older: Stop) -> bool:
    """Whether the newer one is for everybody whom the older one is for."""
    return not newer.vehicles or (bool(older.vehicles) and set(older.vehicles) <= set(newer.vehicles))
