"""Requests about who is connected and holds control.

`ControlHolder` keeps the holder and what each principal commanded last; the request router tells it of every command.
"""

import math
from collections import OrderedDict

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol import people as p
from tui_gcs.core.protocol.common import EventClass, Reply
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.records.event_log import NOTICE
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.station.assembly import StationParts

MAX_COMMANDERS = 64
"""Principals whose newest command is remembered; the one that is longest ago is forgotten first."""


class ControlHolder:
    """Who holds control, and who commanded what last."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self.principal = ""
        """The principal in control; "" until the first command."""
        self._commands: OrderedDict[str, tuple[float, str]] = OrderedDict()
        """(when, words) of the newest command by principal."""

    def commanded(self, principal: str, words: str) -> None:
        """Note a command: its principal is in control from now on."""
        self.principal = principal
        self._commands[principal] = (self._parts.records.clock.now(), words)
        self._commands.move_to_end(principal)
        while len(self._commands) > MAX_COMMANDERS:
            self._commands.popitem(last=False)

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        return {
            p.GetPeople: RequestHandler(Access.LOOK, lambda *_: ServiceReply(ok=True, people=self._people())),
            # No command: it must not take control before it is known whether its asker may give it away.
            p.HandOver: RequestHandler(Access.ASSIST, self._hand_over),
            p.TakeControl: RequestHandler(Access.COMMAND, lambda *_: Reply(ok=True, text="has control")),
        }

    def _people(self) -> tuple[p.PersonRow, ...]:
        connected, now = self._parts.conditions.connected, self._parts.records.clock.now()
        names = sorted({*connected, *self._commands})
        rows = []
        for name in names:
            at_s, words = self._commands.get(name, (math.nan, ""))
            since_s = connected.get(name, math.nan)
            rows.append(
                p.PersonRow(
                    clean(name, 60), name in connected, now - since_s, name == self.principal, words, now - at_s
                )
            )
        return tuple(rows)

    def _hand_over(self, principal: str, request: p.HandOver) -> Reply:
        if self.principal not in ("", principal):
            return Reply(ok=False, text=f"{clean(self.principal, 60)} has control: only its holder hands it over")
        to = clean(request.to, 60)
        if request.to not in self._parts.conditions.connected:
            return Reply(ok=False, text=f"{to} is not connected")
        if request.to.startswith("planner-"):
            return Reply(ok=False, text=f"{to} is a planner worker: it may not command")
        self.principal = request.to
        self._parts.records.events.report(EventClass.OPERATOR, principal, f"hands control over to {to}", NOTICE)
        return Reply(ok=True, text=f"{to} has control")
