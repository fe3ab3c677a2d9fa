"""The station's status message, put together from its parts."""

import math
from typing import TYPE_CHECKING

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.links import Link
from tui_gcs.core.protocol.common import Freshness, LinkStatus, StationStatus

if TYPE_CHECKING:
    from tui_gcs.core.station.station import Station


def station_status(station: "Station", seq: int) -> StationStatus:
    """The station in one message."""
    now = station.clock.now()
    vehicles = station.fleet.vehicles.values()
    started = station.executive.started_s
    separation = station.monitor.min_separation_m
    return StationStatus(
        seq=seq,
        t_s=now,
        wall_s=station.clock.wall(),
        kind=station.config.kind,
        scenario=station.scenario.name,
        revision=station.revision,
        run=station.executive.run,
        round_index=station.round_index,
        rounds=tuple(round_.name for round_ in station.scenario.rounds),
        mission_time_s=0.0 if math.isnan(started) else now - started,
        heard=sum(1 for v in vehicles if v.freshness(now) is not Freshness.LOST),
        vehicles=len({flight.vehicle for flight in station.flights} | set(station.fleet.vehicles)),
        armed=sum(1 for v in vehicles if v.telemetry.armed),
        in_control=station.requests.in_control,
        teams=tuple(desk.status() for desk in station.team_controllers.values()),
        links=_links(station),
        forward=tuple(_endpoint(endpoint) for endpoint in station.config.forward),
        min_separation_m=separation if math.isfinite(separation) else math.nan,
        outside_area_m=station.monitor.outside_area_m,
        vetoes=dict(station.guard.vetoes),
        not_ready={f.vehicle: why for f in station.flights if (why := station.readiness.why_not_start(f.vehicle))},
        preflight=station.preflight.checks(),
        if_silent={
            f.vehicle: _if_silent(station, v)
            for f in station.flights
            if (v := station.fleet.vehicles.get(f.vehicle)) is not None
        },
        homes={v.id: home[:2] for v in vehicles if (home := station.flights.home_m(v)) is not None},
        faults=_faults(station),
        dropped=_dropped(station),
        recording=_recording(station),
        planner_files={
            info.name: f"{info.file} sha256 {info.sha256}" for info in station.config.planners.values() if info.file
        },
        alarms=station.alarms.alarms(),
    )


def _if_silent(station: "Station", vehicle: Vehicle) -> str:
    """At once, and some seconds later: an ArduCopter that brakes and holds may return by FS_GCS_ENABLE."""
    later = station.services.failsafes.unheard(vehicle)
    return station.firmware.of(vehicle).if_silent(vehicle) + (f"; not heard, it {later}" if later else "")


def _links(station: "Station") -> tuple[LinkStatus, ...]:
    return tuple(_link(station, link) for link in station.links.values())


def _link(station: "Station", link: Link) -> LinkStatus:
    counts = station.fleet.intakes[link.spec.network].counts(link.name)
    radio = station.rates.radio(link.name)
    return LinkStatus(
        name=link.name,
        network=link.spec.network,
        up=not link.error,
        datagrams=counts["datagrams"],
        frames=counts["frames"],
        bad=counts["junk bytes"],
        bad_crc=counts["bad CRC"],
        kernel_drops=link.kernel_drops,
        send_refused=link.send_refused,
        bytes_in=link.bytes_in,
        bytes_out=link.bytes_out,
        radio=f"txbuf {radio.txbuf_pct} % rssi {radio.rssi}/{radio.remote_rssi}" if radio is not None else "",
        error=link.error,
    )


def _endpoint(endpoint: Endpoint) -> LinkStatus:
    link = endpoint.link
    return LinkStatus(
        name=link.name + (" (takes commands)" if endpoint.commands else ""),
        network=link.spec.network,
        up=not link.error,
        datagrams=0,
        frames=0,
        bad=0,
        send_refused=link.send_refused,
        bytes_in=link.bytes_in,
        bytes_out=link.bytes_out,
        error=link.error,
    )


def _faults(station: "Station") -> dict[str, int]:
    counts = {
        "planner": sum(desk.planner.fault_count for desk in station.team_controllers.values()),
        "unanswered commands": station.commands.unanswered_count,
        "refused on slot": station.steering.vetoed_on_slot,
        "link": station.reception.faults,
    }
    return {name: count for name, count in counts.items() if count}


def _dropped(station: "Station") -> dict[str, int]:
    counts = station.fleet.dropped + station.commands.ignored + station.uplink.refused + station.dropped
    counts += station.trust.dropped + station.forwarder.refused + station.services.control.refused
    counts += station.services.ignored()
    for intake in station.fleet.intakes.values():
        counts += intake.dropped
    if ignored := sum(desk.ignored for desk in station.team_controllers.values()):
        counts["plan for an older task"] = ignored
    if station.recorder.dropped:
        counts["frames not recorded"] = station.recorder.dropped
    return dict(counts)


def _recording(station: "Station") -> str:
    return f"NOT RECORDING: {station.recorder.error}" if station.recorder.error else station.recorder.path.name
