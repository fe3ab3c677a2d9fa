"""The rows of the links screen: links with their budgets, the paths of vehicles, forwarding partners."""

import math
from collections import Counter
from collections.abc import Iterator

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import loss_pct
from tui_gcs.core.fleet.identity.path import Path
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.ports import Partner, Port
from tui_gcs.core.links import Link
from tui_gcs.core.protocol import link_report as p
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.received_messages import address_text

SYS_STATUS = 1


class LinkReporter:
    """Makes a report when it is asked. It is made with the station, before any link is added."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._comms = parts.comms
        self._store = parts.config.link_store
        # Made before changes of earlier are made again: these are the names of the command line.
        self._given_links = frozenset(parts.comms.links)
        self._given_partners = frozenset(port.link.name for port in parts.comms.forwarder.ports)

    def report(self) -> p.LinkReport:
        """Return all links, paths and partners at this moment."""
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
            is_added=link.name not in self._given_links,
            is_kept=self._is_kept,
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
        """Yield a row for each partner of an endpoint, and one without an address for what came from others.

        Others are partners that are gone, and senders that were never served; an endpoint without anybody has this row.
        """
        partners = list(port.partners.values())
        refused, passed = Counter(port.refused), port.passed
        for partner in partners:
            refused -= partner.refused
            passed -= partner.passed
            yield self._partner_row(port, partner, partner.refused, partner.passed)
        if refused or passed or not partners:
            yield self._partner_row(port, None, refused, passed)

    def _partner_row(self, port: Port, partner: Partner | None, refused: Counter[str], passed: int) -> p.PartnerRow:
        systems = sorted(partner.systems) if partner is not None else []
        heard_s = partner.last_heard_s if partner is not None else -math.inf
        address = partner.address if partner is not None else ""
        return p.PartnerRow(
            endpoint=port.link.name,
            takes_commands=port.commands,
            up=not port.link.error,
            error=port.link.error,
            address=clean(f"{address[0]}:{address[1]}" if isinstance(address, tuple) else address),
            systems=tuple(f"{system}/{component}" for system, component in systems),
            heard_age_s=self._parts.records.clock.now() - heard_s,
            bytes_out=port.link.bytes_out,
            refused=dict(refused),
            bytes_in=port.link.bytes_in,
            passed=passed,
            is_closed=port.is_closed,
            is_added=self._is_added(port),
            is_kept=self._is_kept,
        )

    def _is_added(self, port: Port) -> bool:
        """Whether an operator opened the endpoint, also in place of one of the command line that was closed."""
        name = port.link.name
        return name not in self._given_partners or (self._store is not None and name in self._store.partners)

    @property
    def _is_kept(self) -> bool:
        return self._store is not None and self._store.keeps_added


def _up_loss_pct(path: Path) -> float:
    slot = path.slots.get(SYS_STATUS)
    if slot is None or not slot.raw:
        return math.nan
    # ArduPilot always sends 0: that says nothing.
    hundredths = slot.fields()["drop_rate_comm"]
    return float(hundredths) / 100 if 0 < hundredths <= 10_000 else math.nan
