"""Requests about forwarding partners: another station begins to hear the vehicles, or does not hear them any more.

A partner may be given the permission to send commands. Each is judged and leaves through the uplink, as those of a
partner that was named at the start (`core/forward`).
"""

from collections.abc import Callable
from functools import partial

from tui_gcs.core.base.text import clean
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.forward.ports import Port
from tui_gcs.core.links import LinkError
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.protocol import link_report as p
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.requests.links.address_checks import check_address, opened, parsed
from tui_gcs.core.requests.links.changes import (
    keep,
    keep_added,
    make_again,
    refuse,
    reply_of,
    report_event,
)
from tui_gcs.core.station.assembly import StationParts

MAX_ENDPOINTS = 16
"""Open endpoints: each partner there costs a copy of every frame."""


class PartnerRequests:
    """Answers requests that change partners."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._forwarder = parts.comms.forwarder
        self._store = parts.config.link_store
        self._given = {endpoint.link.name for endpoint in parts.config.forward}
        """Names of those of the command line."""

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        return {
            p.AddPartner: RequestHandler(
                Access.COMMAND, lambda _, asked: reply_of(lambda: self._add(asked.link, asked.takes_commands))
            ),
            p.ClosePartner: RequestHandler(
                Access.COMMAND, lambda principal, asked: reply_of(lambda: self._close(asked.name, principal))
            ),
        }

    def recall(self) -> None:
        """Make the kept changes again, at the start of a station; what cannot be made is reported in one line each."""
        store = self._store
        if store is None:
            return
        for name, by in store.partners_closed.items():
            self._recall_one(name, partial(self._close_open, name, by))
        for name, (text, takes_commands) in store.partners.items():
            if self._open(name) is not None:
                store.forget_partner(name)  # the command line names it now
            elif self._recall_one(name, partial(self._open_new, text, takes_commands), "`tui-gcs forward close`"):
                self._report_open_again(name, takes_commands, was_commanding=name in store.ended_permissions)

    def _recall_one(self, name: str, change: Callable[[], object], forgets: str = "") -> bool:
        """Make one change again; see `make_again`."""
        return make_again(self._parts, f"partner {clean(name, 60)} is not as it was left", change, forgets)

    def _report_open_again(self, name: str, takes_commands: bool, *, was_commanding: bool) -> None:
        """Report who hears the vehicles of this station though its command line does not say so."""
        judged = "; its commands are judged, and may reach vehicles" if takes_commands else ""
        if was_commanding:
            judged = "; its commands were allowed for the run before, and are not now: close and add it to allow them"
        severity = WARNING if was_commanding else NOTICE
        report_event(self._parts, f"{clean(name, 60)} hears the vehicles as before{judged}", severity)

    def _add(self, text: str, takes_commands: bool) -> str:
        spec = self._open_new(text, takes_commands, is_new=True)
        kept = keep_added(self._store, lambda store: store.keep_partner(spec.name, text, takes_commands=takes_commands))
        judged = "; its commands are judged, and may reach vehicles" if takes_commands else ""
        return f"{spec.name} hears the vehicles{judged}{kept}"

    def _open_new(self, text: str, takes_commands: bool, *, is_new: bool = False) -> LinkSpec:
        """Open the endpoint that was typed; a new one is refused where there is no way to it now."""
        spec = parsed(text)
        if spec.secure or spec.high_latency or any(part.strip().startswith("rate=") for part in text.split(",")):
            refuse("rate, secure and highlatency are for links to vehicles: a partner has network= only")
        if sum(not port.is_closed for port in self._forwarder.ports) >= MAX_ENDPOINTS:
            refuse(f"{MAX_ENDPOINTS} partners are open already: close one first")
        check_address(spec, self._parts)
        link = opened(spec, self._parts, must_work=is_new)
        try:
            self._forwarder.open(Endpoint(link, takes_commands))
        except LinkError as error:
            link.close()
            refuse(clean(str(error), 300))
        return spec

    def _close(self, name: str, by: str) -> str:
        by = clean(by, 40)
        store = self._store
        if store is not None and self._open(name) is None and name in store.partners:
            # It could not be opened again, e.g. because no link has its network now.
            return (
                f"{name} is not opened by later stations any more{keep(store, lambda kept: kept.forget_partner(name))}"
            )
        self._close_open(name, by)
        kept = keep(self._store, lambda store: store.keep_partner_closed(name, by, is_given=name in self._given))
        return f"{name} does not hear the vehicles any more{kept}"

    def _close_open(self, name: str, by: str) -> None:
        if self._open(name) is None:
            refuse(f"nothing is forwarded to {clean(name, 60)}")
        self._forwarder.close(name, by)

    def _open(self, name: str) -> Port | None:
        """Return the open endpoint of this name."""
        return next((port for port in self._forwarder.ports if port.link.name == name and not port.is_closed), None)
