"""Requests about links: what goes over each, adding one, closing one, another rate.

Changes are journalled as commands and kept (`core/records/link_store.py`).
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links import Link
from tui_gcs.core.links.closed import ClosedLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.protocol import link_report as p
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.records.event_log import NOTICE
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
from tui_gcs.core.requests.links.link_reporter import LinkReporter
from tui_gcs.core.requests.links.partner_requests import PartnerRequests
from tui_gcs.core.station.assembly import StationParts

MAX_LINKS = 32
MIN_RATE_BYTES_PER_S, MAX_RATE_BYTES_PER_S = 100, 1_000_000_000
"""Below 100 B/s not even heartbeats of two vehicles pass."""

HEARD_S = 3.0
"""A path that was silent for this long does not stand in for another one."""


class LinkRequests:
    """Answers requests about links and partners."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._comms = parts.comms
        self._store = parts.config.link_store
        self._reporter = LinkReporter(parts)
        self._partners = PartnerRequests(parts)

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        reporter = self._reporter
        return {
            p.GetLinks: RequestHandler(Access.LOOK, lambda *_: ServiceReply(ok=True, link_report=reporter.report())),
            p.AddLink: RequestHandler(Access.COMMAND, lambda _, request: reply_of(lambda: self._add(request.link))),
            p.CloseLink: RequestHandler(
                Access.COMMAND, lambda principal, request: reply_of(lambda: self._close(request.name, principal))
            ),
            p.SetLinkRate: RequestHandler(
                Access.COMMAND, lambda _, request: reply_of(lambda: self._set_rate(request.name, request.bytes_per_s))
            ),
            **self._partners.handlers(),
        }

    def recall(self) -> None:
        """Make the kept changes again, at the start of a station; what cannot be made is reported in one line each."""
        store = self._store
        if store is None:
            return
        if store.lost:
            report_event(self._parts, f"changes of links are lost: {store.lost}")
        for name, text in store.added.items():
            if name in self._comms.links:
                store.forget_added(name)  # the command line names it now
            elif self._recall_one(name, partial(self._open_new, text), "`tui-gcs link close`"):
                report_event(self._parts, f"link {clean(name, 60)} is open as before", NOTICE)
        for name, by in store.closed.items():
            self._recall_one(name, partial(self._close_again, name, by))
        for name, text in store.reopened.items():
            self._recall_one(name, partial(self._reopen, name, text))
        for name, rate in store.rates.items():
            if name in self._comms.links and not self._comms.links[name].is_closed:
                self._recall_one(name, partial(self._rate_again, name, rate))
        self._partners.recall()

    def _close_again(self, name: str, by: str) -> None:
        self._close_open(self._open(name), by)

    def _reopen(self, name: str, text: str) -> None:
        """Open a link of the command line with the options that an operator gave it in this run."""
        self._close_open(self._open(name), "the restart of the station")
        self._open_new(text)

    def _rate_again(self, name: str, bytes_per_s: int | None) -> None:
        self._rate_open(self._open(name), bytes_per_s)

    def _recall_one(self, name: str, change: Callable[[], object], forgets: str = "") -> bool:
        """Make one change again; see `make_again`."""
        complaint = f"link {clean(name, 60)} is not as it was left on the links screen"
        return make_again(self._parts, complaint, change, forgets)

    # ---------------------------------------------------------------- changing

    def _add(self, text: str) -> str:
        spec = self._open_new(text, is_new=True)
        kept = keep_added(self._store, lambda store: store.keep_added(spec.name, text))
        return f"link {spec.name} is open{_options(spec)}{kept}"

    def _open_new(self, text: str, *, is_new: bool = False) -> LinkSpec:
        """Open the link that was typed; a new one is refused where there is no way to it now."""
        links = self._comms.links
        spec = parsed(text)
        held = links.get(spec.name)
        if held is not None and not held.is_closed:
            refuse(f"{spec.name} is open already")
        if len(links) >= MAX_LINKS and held is None:
            refuse(f"there are {MAX_LINKS} links already")
        check_address(spec, self._parts)
        links[spec.name] = opened(spec, self._parts, must_work=is_new)
        self._follow(spec)
        return spec

    def _close(self, name: str, by: str) -> str:
        store = self._store
        if store is not None and name not in self._comms.links and name in store.added:
            # It could not be opened again, e.g. because no link has its network now.
            kept = keep(store, lambda store: store.forget_added(name))
            return f"{clean(name, 60)} is not opened by later stations any more{kept}"
        link = self._open(name)
        alone = [vehicle.id for vehicle in self._parts.picture.fleet.vehicles.values() if self._needs(vehicle, name)]
        if alone:
            refuse(f"vehicle {', '.join(map(str, alone))} is armed and heard over it alone: land first")
        self._close_open(link, by)
        return f"link {name} is closed{keep(self._store, lambda store: store.keep_closed(name, clean(by, 40)))}"

    def _close_open(self, link: Link, by: str) -> None:
        link.close()
        self._comms.links[link.name] = ClosedLink(link.spec, clean(by, 40))

    def _set_rate(self, name: str, bytes_per_s: int | None) -> str:
        link = self._open(name)
        if bytes_per_s is not None and not MIN_RATE_BYTES_PER_S <= bytes_per_s <= MAX_RATE_BYTES_PER_S:
            refuse(f"a rate is from {MIN_RATE_BYTES_PER_S} to {MAX_RATE_BYTES_PER_S} B/s")
        self._rate_open(link, bytes_per_s)
        rate = "without a limit" if bytes_per_s is None else f"at {bytes_per_s} B/s"
        return f"link {name} {rate}{keep(self._store, lambda store: store.keep_rate(name, bytes_per_s))}"

    def _rate_open(self, link: Link, bytes_per_s: int | None) -> None:
        link.spec = replace(link.spec, bytes_per_s=bytes_per_s)
        self._follow(link.spec)

    def _open(self, name: str) -> Link:
        link = self._comms.links.get(name)
        if link is None or link.is_closed:
            refuse(f"there is no open link {clean(name, 60)}")
        return link

    def _needs(self, vehicle: Vehicle, name: str) -> bool:
        """Whether an armed vehicle would not be heard without this link."""
        now = self._parts.records.clock.now()
        if not vehicle.telemetry.armed or vehicle.freshness(now) is Freshness.LOST:
            return False
        return all(path.source.link == name for path in vehicle.used_paths() if now - path.last_heard_s < HEARD_S)

    def _follow(self, spec: LinkSpec) -> None:
        """Let the parts that plan by a link's description know the new one."""
        self._comms.rates.set_link(spec)
        self._parts.services.context.specs[spec.name] = spec


def _options(spec: LinkSpec) -> str:
    """Return the options of a link in words, with what they allow; "" without any."""
    options = [f"network {spec.network}"] if spec.network else []
    options += [f"at {spec.bytes_per_s} B/s"] if spec.bytes_per_s is not None else []
    options += ["secure, so keys may be sent"] if spec.secure else []
    options += ["highlatency, so commands only"] if spec.high_latency else []
    return f" ({'; '.join(options)})" if options else ""
