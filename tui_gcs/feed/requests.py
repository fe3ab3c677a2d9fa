"""Requests of this console to the station, and their replies."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import msgspec

from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as wire
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.services import GetModes, GetOnBoard, GetTasks, GetVehicles, ServiceReply
from tui_gcs.core.protocol.setup import GetTraffic
from tui_gcs.feed.request_sequence import RequestSequence, RequestTicket
from tui_gcs.feed.stop_requests import STOPS, StopRequests

MAX_READING_THREADS, MAX_COMMANDING_THREADS = 4, 16
"""Threads that wait for answers, apart from those of the stops."""
NO_ANSWER = "the station does not answer"

READING = (
    wire.Hello,
    wire.GetScenario,
    wire.GetEvents,
    wire.GetTask,
    wire.GetPlan,
    wire.GetPlanners,
    wire.GetPreviews,
    wire.Preview,
    wire.CancelPreview,
    wire.GetJournal,
    wire.Note,
    GetModes,
    GetOnBoard,
    GetTasks,
    GetTraffic,
    GetVehicles,
)
"""Requests that command nothing: a read-only console may send them, and they never wait behind a command."""


class ConsoleRequests:
    """Sends this console's requests and returns the replies. Call it on the event loop; bus calls run on threads."""

    def __init__(self, bus: Bus, principal: str) -> None:
        """Prepare to ask as `principal`."""
        self.principal = principal
        self.read_only = ""
        """Why this console may not command; empty if it may."""
        self._bus = bus
        self._key = keys.REQUEST.format(principal=principal)
        # Separate pools: no command waits for a thread in which a question to a silent station runs out its time.
        self._readers = ThreadPoolExecutor(MAX_READING_THREADS, "read")
        self._commanders = ThreadPoolExecutor(MAX_COMMANDING_THREADS, "command")
        self._sequence = RequestSequence()
        self._stops = StopRequests(bus, self._key, self._sequence)

    async def send(self, request: wire.Request, *, tries: int = 1, timeout_s: float = 2.0) -> ServiceReply:
        """Ask the station. A reply always comes back; `code` is NO_ANSWER or UNREADABLE if the station gave none.

        Stops are asked `tries` times (see `stop_requests`), everything else once.
        """
        if self.read_only and not isinstance(request, READING):
            return ServiceReply(ok=False, text=self.read_only)
        try:
            if isinstance(request, STOPS):
                answer = await self._stops.send(request, tries)
            else:
                answer = await self._ask(request, timeout_s)
            return wire.decode(answer, ServiceReply)
        except BusError as error:
            return ServiceReply(ok=False, text=f"{NO_ANSWER} ({error})", code=wire.ReplyCode.NO_ANSWER)
        except msgspec.MsgspecError:
            text = "the station's answer cannot be read: another version of tui-gcs?"
            return ServiceReply(ok=False, text=text, code=wire.ReplyCode.UNREADABLE)

    async def _ask(self, request: wire.Request, timeout_s: float) -> bytes:
        loop = asyncio.get_running_loop()
        if isinstance(request, READING):
            return await loop.run_in_executor(self._readers, self._bus.ask, self._key, wire.encode(request), timeout_s)
        # HOLD, resume, HOLD: the second HOLD must not join the first, for it comes after what it stops.
        self._stops.note_other_order()
        ticket = self._sequence.next_ticket()
        return await loop.run_in_executor(self._commanders, self._ask_in_turn, request, timeout_s, ticket)

    def _ask_in_turn(self, request: wire.Request, timeout_s: float, ticket: RequestTicket) -> bytes:
        """Ask the station, on a thread of the commands, after the request given before this one."""
        try:
            ticket.wait()
            return self._bus.ask(self._key, wire.encode(request), timeout_s, gone=ticket.sent.set)
        finally:
            ticket.sent.set()

    def close(self) -> None:
        """End all waiting for answers."""
        self._stops.close()
        for threads in (self._readers, self._commanders):
            threads.shutdown(wait=False, cancel_futures=True)
