"""Requests about links: what goes over each, adding one, closing one, another rate.

Changes are journalled as commands and kept (`core/records/link_store.py`).
"""

import ipaddress
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import NoReturn

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import loss_pct
from tui_gcs.core.fleet.identity.path import Path
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.ports import Partner, Port
from tui_gcs.core.links import Link, LinkError, open_link, parse_link
from tui_gcs.core.links.closed import ClosedLink
from tui_gcs.core.links.spec import LinkSpec, is_loopback
from tui_gcs.core.protocol import link_report as p
from tui_gcs.core.protocol.common import EventClass, Freshness, Reply
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.records.link_store import LinkStore
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.received_messages import address_text

SYS_STATUS = 1
MAX_LINKS = 32
MIN_RATE_BYTES_PER_S, MAX_RATE_BYTES_PER_S = 100, 1_000_000_000
"""Below 100 B/s not even heartbeats of two vehicles pass."""

HEARD_S = 3.0
"""A path that was silent for this long does not stand in for another one."""


class LinkRefusedError(Exception):
    """Why a link is not changed, in one line for the operator."""


class LinkRequests:
    """Answers requests about links."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._comms = parts.comms
        self._store = parts.config.link_store

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        return {
            p.GetLinks: RequestHandler(Access.LOOK, lambda *_: ServiceReply(ok=True, link_report=self._report())),
            p.AddLink: RequestHandler(Access.COMMAND, lambda _, request: _reply(lambda: self._add(request.link))),
            p.CloseLink: RequestHandler(
                Access.COMMAND, lambda principal, request: _reply(lambda: self._close(request.name, principal))
            ),
            p.SetLinkRate: RequestHandler(
                Access.COMMAND, lambda _, request: _reply(lambda: self._set_rate(request.name, request.bytes_per_s))
            ),
        }

    def recall(self) -> None:
        """Make the kept changes again, at the start of a station; what cannot be made is reported in one line each."""
        store = self._store
        if store is None:
            return
        if store.lost:
            self._report_event(f"changes of links are lost: {store.lost}")
        for name, text in store.added.items():
            if name in self._comms.links:
                store.forget_added(name)  # the command line names it now
                continue
            self._recall_one(name, partial(self._open_new, text))
        for name, by in store.closed.items():
            self._recall_one(name, partial(self._close_again, name, by))
        for name, rate in store.rates.items():
            if name in self._comms.links and not self._comms.links[name].is_closed:
                self._recall_one(name, partial(self._rate_again, name, rate))

    def _close_again(self, name: str, by: str) -> None:
        self._close_open(self._open(name), by)

    def _rate_again(self, name: str, bytes_per_s: int | None) -> None:
        self._rate_open(self._open(name), bytes_per_s)

    def _recall_one(self, name: str, change: Callable[[], object]) -> None:
        try:
            change()
        except LinkRefusedError as error:
            self._report_event(f"link {clean(name, 60)} is not as it was left on the links screen: {error}")

    def _report_event(self, text: str) -> None:
        self._parts.records.events.report(EventClass.CONNECTION, "station", clean(text, 300), WARNING)

    # ---------------------------------------------------------------- looking

    def _report(self) -> p.LinkReport:
        vehicles = self._parts.picture.fleet.vehicles.values()
        paths = [(vehicle, path) for vehicle in vehicles for path in vehicle.paths]
        return p.LinkReport(
            t_s=self._parts.records.clock.now(),
            links=tuple(self._link_row(link) for link in self._comms.links.values()),
            paths=tuple(self._path_row(vehicle, path) for vehicle, path in paths[: p.MAX_PATHS]),
            partners=tuple(row for port in self._comms.forwarder.ports for row in self._partner_rows(port)),
            passed=self._comms.forwarder.passed,
            left_out=max(0, len(paths) - p.MAX_PATHS),
        )

    def _link_row(self, link: Link) -> p.LinkRow:
        counts = self._parts.picture.fleet.intakes[link.spec.network].counts(link.name)
        rates, radio = self._comms.rates.rates_of(link.name), self._comms.rates.radio(link.name)
        return p.LinkRow(
            name=link.name,
            network=link.spec.network,
            up=not link.error,
            error=link.error,
            capacity_bytes_per_s=link.spec.bytes_per_s,
            telemetry_bytes_per_s=rates.needed(rates.place),
            budget_bytes_per_s=rates.budget,
            set_name=rates.set.name if rates.members and not rates.silent else "",
            vehicles=len(rates.members),
            bytes_in=link.bytes_in,
            bytes_out=link.bytes_out,
            frames=counts["frames"],
            junk_bytes=counts["junk bytes"],
            bad_crc=counts["bad CRC"],
            kernel_drops=link.kernel_drops,
            send_refused=link.send_refused,
            secure=link.spec.secure,
            high_latency=link.spec.high_latency,
            radio=radio,
            is_added=self._store is not None and link.name in self._store.added,
        )

    def _path_row(self, vehicle: Vehicle, path: Path) -> p.PathRow:
        in_use = path is vehicle.path
        timing = self._parts.services.link_timing.of(vehicle) if in_use else None
        return p.PathRow(
            vehicle=vehicle.id,
            link=path.source.link,
            address=address_text(path.source),
            state=path.state.value,
            in_use=in_use,
            heard_age_s=self._parts.records.clock.now() - path.last_heard_s,
            frames=sum(slot.count for slot in path.slots.values()) + sum(stream.frames for stream in path.streams),
            loss_pct=loss_pct(path),
            up_loss_pct=_up_loss_pct(path),
            duplicates=path.repeated_frames + sum(stream.duplicates for stream in path.streams),
            restarts=sum(stream.count_restarts for stream in path.streams),
            signing=vehicle.identity.signing.value,
            rtt_s=timing.rtt_s if timing is not None else math.nan,
            best_rtt_s=timing.best_rtt_s if timing is not None else math.nan,
        )

    def _partner_rows(self, port: Port) -> Iterator[p.PartnerRow]:
        """A row for each partner of an endpoint; one without an address while there is none."""
        partners: list[Partner | None] = [*port.partners.values()]
        for partner in partners or [None]:
            systems = sorted(partner.systems) if partner is not None else []
            heard_s = partner.last_heard_s if partner is not None else -math.inf
            address = partner.address if partner is not None else ""
            yield p.PartnerRow(
                endpoint=port.link.name,
                takes_commands=port.commands,
                up=not port.link.error,
                error=port.link.error,
                address=clean(f"{address[0]}:{address[1]}" if isinstance(address, tuple) else address),
                systems=tuple(f"{system}/{component}" for system, component in systems),
                heard_age_s=self._parts.records.clock.now() - heard_s,
                bytes_out=port.link.bytes_out,
                refused=dict(port.refused),
            )

    # ---------------------------------------------------------------- changing

    def _add(self, text: str) -> str:
        spec = self._open_new(text)
        kept = self._keep(lambda store: store.keep_added(spec.name, text, spec.bytes_per_s))
        return f"link {spec.name} is open{kept}"

    def _open_new(self, text: str) -> LinkSpec:
        links = self._comms.links
        try:
            spec = parse_link(text)
        except LinkError as error:
            _refuse(clean(str(error), 300))
        held = links.get(spec.name)
        if held is not None and not held.is_closed:
            _refuse(f"{spec.name} is open already")
        if len(links) >= MAX_LINKS:
            _refuse(f"there are {MAX_LINKS} links already")
        self._check_addable(spec)
        try:
            link = open_link(spec, self._parts.records.clock)
        except LinkError as error:
            _refuse(clean(str(error), 300))
        links[spec.name] = link
        self._follow(spec)
        return spec

    def _keep(self, change: Callable[[LinkStore], None]) -> str:
        """Keep a change for the next start; return what the operator must know about that."""
        if self._store is None:
            return ""
        change(self._store)
        return f"; NOT kept for a restart: {clean(self._store.error, 200)}" if self._store.error else ""

    def _check_addable(self, spec: LinkSpec) -> None:
        if spec.scheme == "replay":
            _refuse("a recording is no link of a running station: tui-gcs replay shows it")
        if spec.network not in self._parts.picture.fleet.intakes:
            _refuse(f"no link had network {spec.network!r} when the station began: start it with that link")
        if self._parts.config.kind is RunKind.SIM and not is_loopback(spec.host):
            _refuse("a SIM station takes links of this machine only (127.0.0.1)")
        # Looking a name up may take seconds, in which the station would do nothing else.
        if spec.host and not _is_number(spec.host):
            _refuse(f"{clean(spec.host, 60)} is a name: give the number of the address")

    def _close(self, name: str, by: str) -> str:
        link = self._open(name)
        alone = [vehicle.id for vehicle in self._parts.picture.fleet.vehicles.values() if self._needs(vehicle, name)]
        if alone:
            _refuse(f"vehicle {', '.join(map(str, alone))} is armed and heard over it alone: land first")
        self._close_open(link, by)
        return f"link {name} is closed{self._keep(lambda store: store.keep_closed(name, clean(by, 40)))}"

    def _close_open(self, link: Link, by: str) -> None:
        link.close()
        self._comms.links[link.name] = ClosedLink(link.spec, clean(by, 40))

    def _set_rate(self, name: str, bytes_per_s: int | None) -> str:
        link = self._open(name)
        if bytes_per_s is not None and not MIN_RATE_BYTES_PER_S <= bytes_per_s <= MAX_RATE_BYTES_PER_S:
            _refuse(f"a rate is from {MIN_RATE_BYTES_PER_S} to {MAX_RATE_BYTES_PER_S} B/s")
        self._rate_open(link, bytes_per_s)
        rate = "without a limit" if bytes_per_s is None else f"at {bytes_per_s} B/s"
        return f"link {name} {rate}{self._keep(lambda store: store.keep_rate(name, bytes_per_s))}"

    def _rate_open(self, link: Link, bytes_per_s: int | None) -> None:
        link.spec = replace(link.spec, bytes_per_s=bytes_per_s)
        self._follow(link.spec)

    def _open(self, name: str) -> Link:
        link = self._comms.links.get(name)
        if link is None or link.is_closed:
            _refuse(f"there is no open link {clean(name, 60)}")
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


def _up_loss_pct(path: Path) -> float:
    slot = path.slots.get(SYS_STATUS)
    if slot is None or not slot.raw:
        return math.nan
    # ArduPilot always sends 0: that says nothing.
    hundredths = slot.fields()["drop_rate_comm"]
    return float(hundredths) / 100 if 0 < hundredths <= 10_000 else math.nan


def _is_number(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return host == "localhost"
    return True


def _refuse(why: str) -> NoReturn:
    raise LinkRefusedError(why)


def _reply(change: Callable[[], str]) -> Reply:
    try:
        return Reply(ok=True, text=change())
    except LinkRefusedError as error:
        return Reply(ok=False, text=str(error))
