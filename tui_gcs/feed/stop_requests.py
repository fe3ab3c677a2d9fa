"""Stops on their way to the station: sent at once, repeated until answered, never doubled, never after a newer one.

The same stop given again while it is under way joins that one and renews all its tries. A stop that a newer one
replaces is not sent again. Each stop carries when it was given: the station leaves out of one that arrives late the
vehicles that have obeyed a newer one.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

import msgspec

from tui_gcs.core.protocol.base import StopRequest
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import encode
from tui_gcs.feed.bus_questions import awaited_answer

EARLY_RETRY_S = 0.2
"""A question that fails before its time is asked again after this."""
TRIES_OVER_RESTART = 6
"""Tries, of 2 s each, of a stop that is given once and waited for: a station that was killed comes back in 1 s, on a
busy machine in several."""
SPARE_S = 0.5
"""Added to the time of all tries before the caller gets an error."""


@dataclass
class _PendingStop:
    """One stop that is under way, shared by all callers that gave the same one."""

    stop: StopRequest
    payload: bytes
    tries: int
    sent: int = 1
    """Tries begun; each lasts the whole time of a try, however often it is asked in it."""
    replaced: bool = False
    task: asyncio.Task[bytes] | None = None


class StopRequests:
    """Sends stops over the bus and repeats those without an answer. Call it on the event loop."""

    def __init__(
        self, bus: Bus, key: str, timeout_s: float = 2.0, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Prepare to ask on `key` of `bus`, `timeout_s` for each try; `now_ns` is this machine's monotonic clock."""
        self._bus = bus
        self._key = key
        self._timeout_s = timeout_s
        self._now_ns = now_ns
        self._pending: list[_PendingStop] = []
        self._newest: _PendingStop | None = None
        """The one that the same stop, given again, joins."""

    def begin(self, stop: StopRequest, tries: int) -> Awaitable[bytes]:
        """Send a stop before returning; what is returned gives the station's answer when it is awaited.

        It raises `BusError`: none came within `tries`, or a newer stop took its place.
        """
        # An operator who sees no effect presses again: forty presses must not become forty stops.
        pending = self._newest
        if pending is not None and pending.stop == stop:
            pending.tries = pending.sent + tries
        else:
            for older in self._pending:
                older.replaced = older.replaced or _covers(stop, older.stop)
            payload = encode(msgspec.structs.replace(stop, given_ns=self._now_ns()))
            pending = self._newest = _PendingStop(stop, payload, tries)
            self._pending.append(pending)
            # Sent before anything else runs: what is ordered after it must not arrive before it.
            first, on_answer = awaited_answer(self._timeout_s)
            self._bus.begin(self._key, payload, on_answer, self._timeout_s, late=True)
            pending.task = asyncio.get_running_loop().create_task(self._repeat(pending, first))
            # All callers may have given up by then: asyncio would log the error as never retrieved.
            pending.task.add_done_callback(lambda task: task.cancelled() or task.exception())
        return self._answer(pending.task, tries * self._timeout_s)

    async def _answer(self, task: asyncio.Task[bytes] | None, wait_s: float) -> bytes:
        # Each caller waits for its own tries only: others may renew those of the shared task without end.
        if task is None or not (await asyncio.wait({task}, timeout=wait_s + SPARE_S))[0]:
            raise BusError(f"the station did not answer within {wait_s:.0f} s")
        return task.result()

    def note_other_order(self) -> None:
        """Something else was ordered, which may undo the stop before it: the same stop given again is a new one."""
        self._newest = None

    def close(self) -> None:
        """End all repetition; callers that still wait are cancelled."""
        for pending in self._pending:
            if pending.task is not None:
                pending.task.cancel()

    async def _repeat(self, pending: _PendingStop, question: asyncio.Future[bytes]) -> bytes:
        loop = asyncio.get_running_loop()
        try_ends_s = loop.time() + self._timeout_s
        try:
            while True:
                try:
                    return await question
                except BusError:
                    if pending.replaced:
                        raise
                # The bus fails at once where no station is: all tries would be over while a killed one comes back.
                if (left_s := try_ends_s - loop.time()) > 0.0:
                    await asyncio.sleep(min(EARLY_RETRY_S, left_s))
                if pending.replaced:
                    raise BusError("a newer stop took its place")
                if loop.time() >= try_ends_s:
                    if pending.sent >= pending.tries:
                        raise BusError(f"the station did not answer within {pending.sent * self._timeout_s:.0f} s")
                    pending.sent += 1
                    try_ends_s = loop.time() + self._timeout_s
                question, on_answer = awaited_answer(self._timeout_s)
                self._bus.begin(self._key, pending.payload, on_answer, self._timeout_s, late=True)
        finally:
            self._pending.remove(pending)
            if self._newest is pending:
                self._newest = None


def _covers(newer: StopRequest, older: StopRequest) -> bool:
    """Whether the newer stop is for every vehicle that the older one is for; no vehicles means all."""
    return not newer.vehicles or (bool(older.vehicles) and set(older.vehicles) <= set(newer.vehicles))
