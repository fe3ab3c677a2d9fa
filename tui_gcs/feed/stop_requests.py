"""Stops on their way to the station: sent at once, repeated until answered, never doubled, never after a newer one.

A station that does not answer must not make stops queue: they would arrive when the operator has long ordered something
else. Therefore each stop gets a thread at once. The same stop given again while it is under way joins that one and
renews all its tries. A stop that a newer one replaces is not sent again. A repeated stop leaves out the vehicles that
have obeyed a newer one: a vehicle that was ordered to land after HOLD ALL is not held.
"""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import msgspec

from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import Hold, Reply, Return, decode, encode
from tui_gcs.core.protocol.flight import Land
from tui_gcs.feed.request_sequence import RequestSequence, RequestTicket

Stop = Hold | Return | Land
STOPS = (Hold, Return, Land)
"""Requests that are carried out even if the caller has given up: a stop is never too late."""
MAX_UNDER_WAY = 16
"""Different stops whose answers are waited for; others wait for a thread, and are dropped if replaced meanwhile."""
SPARE_S = 0.5
"""Added to the time of all tries before the caller gets an error."""


@dataclass
class _PendingStop:
    """One stop that is under way, shared by all callers that gave the same one."""

    stop: Stop
    tries: int
    ticket: RequestTicket
    sent: int = 0
    replaced: bool = False
    task: asyncio.Task[bytes] | None = None


class StopRequests:
    """Sends stops over the bus and repeats those without an answer. Call it on the event loop."""

    def __init__(self, bus: Bus, key: str, sequence: RequestSequence, timeout_s: float = 2.0) -> None:
        """Prepare to ask on `key` of `bus`, `timeout_s` for each try; `sequence` orders all requests of a console."""
        self._bus = bus
        self._key = key
        self._sequence = sequence
        self._timeout_s = timeout_s
        self._threads = ThreadPoolExecutor(MAX_UNDER_WAY, "stop")
        self._pending: list[_PendingStop] = []
        self._newest: _PendingStop | None = None
        """The one that the same stop, given again, joins."""

    async def send(self, stop: Stop, tries: int) -> bytes:
        """Return the station's answer. Raises `BusError`: none came within `tries`, or a newer stop took its place."""
        # An operator who sees no effect presses again: forty presses must not become forty stops.
        pending = self._newest
        if pending is not None and pending.stop == stop:
            pending.tries = pending.sent + tries
        else:
            for older in self._pending:
                older.replaced = older.replaced or _covers(stop, older.stop)
            pending = self._newest = _PendingStop(stop, tries, self._sequence.next_ticket())
            self._pending.append(pending)
            pending.task = asyncio.get_running_loop().create_task(self._repeat(pending))
            # All callers may have given up by then: asyncio would log the error as never retrieved.
            pending.task.add_done_callback(lambda task: task.cancelled() or task.exception())
        wait_s = tries * self._timeout_s
        task = pending.task
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
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def _repeat(self, pending: _PendingStop) -> bytes:
        problem = BusError("not sent")
        loop = asyncio.get_running_loop()
        try:
            while pending.sent < pending.tries:
                pending.sent += 1
                try:
                    answer = await loop.run_in_executor(self._threads, self._ask, pending)
                    self._leave_out(pending, _obeyed(answer))
                    return answer
                except BusError as error:
                    problem = error
                if pending.replaced:
                    break
            raise problem
        finally:
            self._pending.remove(pending)
            if self._newest is pending:
                self._newest = None

    def _leave_out(self, newer: _PendingStop, obeyed: set[int]) -> None:
        """Take the vehicles that have obeyed `newer` out of the older stops."""
        for older in self._pending[: self._pending.index(newer)]:
            older.stop = msgspec.structs.replace(older.stop, but=tuple(sorted(obeyed | set(older.stop.but))))

    def _ask(self, pending: _PendingStop) -> bytes:
        """Ask the station, on a thread of the pool."""
        try:
            # The pool may start this thread late, or before that of the request given before it.
            pending.ticket.wait()
            if pending.replaced:
                raise BusError("not said any more: a newer stop took its place")
            sent = pending.ticket.sent.set
            return self._bus.ask(self._key, encode(pending.stop), self._timeout_s, late=True, gone=sent)
        finally:
            pending.ticket.sent.set()


def _obeyed(answer: bytes) -> set[int]:
    try:
        return {result.vehicle for result in decode(answer, Reply).results if result.ok}
    except msgspec.MsgspecError:
        return set()  # the caller reports that the answer cannot be read


def _covers(newer: Stop, older: Stop) -> bool:
    """Whether the newer stop is for every vehicle that the older one is for; no vehicles means all."""
    return not newer.vehicles or (bool(older.vehicles) and set(older.vehicles) <= set(newer.vehicles))
