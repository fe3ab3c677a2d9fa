"""Requests of this console to the station, and their replies."""

from collections.abc import Awaitable

import msgspec

from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as wire
from tui_gcs.core.protocol.base import StopRequest
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.inspection import GetMessages, GetValues
from tui_gcs.core.protocol.link_report import GetLinks
from tui_gcs.core.protocol.people import GetPeople
from tui_gcs.core.protocol.planner_log import GetPlannerLog
from tui_gcs.core.protocol.replay import ControlReplay
from tui_gcs.core.protocol.services import (
    GetModes,
    GetOnBoard,
    GetParamInfos,
    GetParams,
    GetTaskResult,
    GetTasks,
    GetVehicles,
    ServiceReply,
)
from tui_gcs.core.protocol.setup import GetRemoteIds, GetSetup, GetTraffic
from tui_gcs.feed.bus_questions import awaited_answer
from tui_gcs.feed.stop_requests import StopRequests

NO_ANSWER = "the station does not answer"

READING = (
    ControlReplay,
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
    GetLinks,
    GetMessages,
    GetPeople,
    GetPlannerLog,
    GetModes,
    GetOnBoard,
    GetParamInfos,
    GetParams,
    GetSetup,
    GetTaskResult,
    GetTasks,
    GetRemoteIds,
    GetTraffic,
    GetValues,
    GetVehicles,
)
"""Requests that command nothing: a read-only console may send them."""


class ConsoleRequests:
    """Sends this console's requests and returns the replies. Call it on the event loop."""

    def __init__(self, bus: Bus, principal: str) -> None:
        """Prepare to ask as `principal`."""
        self.principal = principal
        self.read_only = ""
        """Why this console may not command; empty if it may."""
        self._bus = bus
        self._key = keys.REQUEST.format(principal=principal)
        self._stops = StopRequests(bus, self._key)

    async def send(self, request: wire.Request, *, tries: int = 1, timeout_s: float = 2.0) -> ServiceReply:
        """Ask the station, and wait for its reply; see `begin`."""
        return await self.begin(request, tries=tries, timeout_s=timeout_s)

    def begin(self, request: wire.Request, *, tries: int = 1, timeout_s: float = 2.0) -> Awaitable[ServiceReply]:
        """Ask the station before returning; what is returned gives the reply when it is awaited.

        A reply always comes; `code` is NO_ANSWER or UNREADABLE if the station gave none. Stops are asked `tries` times
        (see `stop_requests`), everything else once.
        """
        if self.read_only and not isinstance(request, READING):
            return _reply(ServiceReply(ok=False, text=self.read_only))
        if isinstance(request, StopRequest):
            return _reply(self._stops.begin(request, tries))
        if not isinstance(request, READING):
            # HOLD, resume, HOLD: the second HOLD must not join the first, for it comes after what it stops.
            self._stops.note_other_order()
        answer, on_answer = awaited_answer(timeout_s)
        self._bus.begin(self._key, wire.encode(request), on_answer, timeout_s)
        return _reply(answer)

    def close(self) -> None:
        """End the repetition of stops."""
        self._stops.close()


async def _reply(answer: Awaitable[bytes] | ServiceReply) -> ServiceReply:
    """The reply in an answer; or one with the reason if the station gave none."""
    if isinstance(answer, ServiceReply):
        return answer
    try:
        return wire.decode(await answer, ServiceReply)
    except BusError as error:
        return ServiceReply(ok=False, text=f"{NO_ANSWER} ({error})", code=wire.ReplyCode.NO_ANSWER)
    except msgspec.MsgspecError:
        text = "the station's answer cannot be read: another version of tui-gcs?"
        return ServiceReply(ok=False, text=text, code=wire.ReplyCode.UNREADABLE)
