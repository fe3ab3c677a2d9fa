"""The request table: every request that consoles, workers and scripts may send, and the handler that answers it.

The principal comes from the bus key, never from the payload (docs/architecture.md, "Who owns what").
"""

from collections.abc import Callable

import msgspec

from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.common import EventClass, Reply, ReplyCode
from tui_gcs.core.protocol.flight import Nudge
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.requests.key_provisioning import KeyProvisioning
from tui_gcs.core.requests.links.link_requests import LinkRequests
from tui_gcs.core.requests.people_requests import ControlHolder
from tui_gcs.core.requests.planner_requests import PlannerRequests
from tui_gcs.core.requests.point_requests import PointRequests
from tui_gcs.core.requests.station_requests import StationRequests
from tui_gcs.core.requests.vehicle_tasks import VehicleTasks

NUDGE_JOURNAL_GAP_S = 5.0
"""A key that is held down nudges several times a second; the journal gets one line in this time."""


class RequestRouter:
    """Answers requests, one at a time, by the handler of their type."""

    def __init__(self, context: RequestContext) -> None:
        self._parts = context.parts
        self.planners = PlannerRequests(context)
        self._vehicle_tasks = VehicleTasks(context)
        self.tasks = self._vehicle_tasks.tasks
        self.links = LinkRequests(context.parts)
        self._control = ControlHolder(context.parts)
        self.handlers: dict[type, RequestHandler] = {
            **StationRequests(context).handlers(),
            **self.planners.handlers(),
            **PointRequests(context.parts).handlers(),
            **KeyProvisioning(context.parts).handlers(),
            **self.links.handlers(),
            **self._control.handlers(),
            **self._vehicle_tasks.handlers(),
        }

    @property
    def in_control(self) -> str:
        """The principal that holds control: of the newest command, or to whom it was handed over."""
        return self._control.principal

    def answer(self, key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        """Do what the principal of `key` asks, and reply what became of it, or why it was not done."""
        principal = key.rsplit("/", 1)[1]
        found = self._handler_of(principal, payload)
        if isinstance(found, Reply):
            reply(m.encode(found))
            return
        handler, request = found
        if handler.access is Access.COMMAND:
            # Before the handler runs: what it publishes names the new holder already.
            self._control.commanded(principal, request_words(request))
        answer = handler.answer(principal, request)
        if handler.access is Access.COMMAND and handler.is_journalled:
            self._journal(principal, request, answer)
        reply(m.encode(answer))

    def _handler_of(self, principal: str, payload: bytes) -> tuple[RequestHandler, m.Request] | Reply:
        """The handler of an encoded request, and the request; or the reply that refuses it."""
        try:
            request = s.decode_request(payload)
        except msgspec.MsgspecError as error:
            self._parts.conditions.dropped["request not understood"] += 1
            return Reply(ok=False, text=f"request not understood: {error}", code=ReplyCode.NOT_UNDERSTOOD)
        # Decoding lets through only types that are in the table; a test holds the two together.
        handler = self.handlers[type(request)]
        if handler.access is not Access.LOOK and principal.startswith("planner-"):
            return Reply(ok=False, text="a planner worker may not command")
        return handler, request

    def _journal(self, principal: str, request: m.Request, reply: Reply) -> None:
        """Report what was asked and what became of it."""
        every_s = NUDGE_JOURNAL_GAP_S if isinstance(request, Nudge) else 0.0
        refused = "; ".join(f"vehicle {r.vehicle}: {r.text}" for r in reply.results if not r.ok)
        text = (reply.text or "done") + (f" ({refused})" if refused else "")
        if not reply.ok:
            partly = " in part" if any(r.ok for r in reply.results) else ""
            text = f"{request_words(request)} refused{partly}: {text}"
        severity = NOTICE if reply.ok else WARNING
        self._parts.records.events.report(EventClass.OPERATOR, principal, text, severity, every_s=every_s)


def request_words(request: m.Request) -> str:
    """The kind of a request in words, e.g. `limit speed`."""
    return str(request.__struct_config__.tag).replace("-", " ")
