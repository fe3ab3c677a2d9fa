"""The station's status message, put together from its parts."""

import math

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.ports import Port
from tui_gcs.core.links import Link
from tui_gcs.core.protocol.common import Freshness, LinkStatus, StationStatus
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.frontend_protocol import StationFrontend


def station_status(parts: StationParts, frontend: StationFrontend | None, seq: int) -> StationStatus:
    """The station in one message; without a frontend nothing is known of control, readiness and checks."""
    clock, now = parts.records.clock, parts.records.clock.now()
    fleet, flight, active = parts.picture.fleet, parts.flight, parts.active
    vehicles, flights = fleet.vehicles.values(), parts.flight.flights
    # The monitor begins with infinity; unknown numbers are NaN on the bus.
    started_s, separation_m = flight.executive.started_s, flight.monitor.min_separation_m
    not_ready = {}
    if frontend is not None:
        not_ready = {f.vehicle: why for f in flights if (why := frontend.why_not_start(f.vehicle))}
    return StationStatus(
        seq=seq,
        t_s=now,
        wall_s=clock.wall(),
        kind=parts.config.kind,
        scenario=active.scenario.name,
        revision=active.revision,
        run=flight.executive.run,
        round_index=active.round_index,
        rounds=tuple(round_.name for round_ in active.scenario.rounds),
        mission_time_s=0.0 if math.isnan(started_s) else now - started_s,
        heard=sum(1 for v in vehicles if v.freshness(now) is not Freshness.LOST),
        vehicles=len({flight.vehicle for flight in flights} | set(fleet.vehicles)),
        armed=sum(1 for v in vehicles if v.telemetry.armed),
        in_control=frontend.in_control if frontend is not None else "",
        teams=tuple(controller.status() for controller in active.team_controllers.values()),
        links=tuple(_link(parts, link) for link in parts.comms.links.values()),
        forward=tuple(_endpoint(port) for port in parts.comms.forwarder.ports),
        min_separation_m=separation_m if math.isfinite(separation_m) else math.nan,
        outside_area_m=flight.monitor.outside_area_m,
        vetoes=dict(parts.flight.guard.vetoes),
        not_ready=not_ready,
        preflight=frontend.checks() if frontend is not None else (),
        if_silent={
            f.vehicle: _if_silent(parts, v) for f in flights if (v := fleet.vehicles.get(f.vehicle)) is not None
        },
        homes={v.id: home[:2] for v in vehicles if (home := flights.home_m(v)) is not None},
        faults=_faults(parts),
        dropped=_dropped(parts),
        recording=_recording(parts),
        ending=parts.conditions.ending,
        planner_files={
            info.name: f"{info.file} sha256 {info.sha256}" for info in parts.config.planners.values() if info.file
        },
        alarms=parts.alarms.alarms(),
        points=parts.flight.points.all(),
    )


def _if_silent(parts: StationParts, vehicle: Vehicle) -> str:
    """What the vehicle does without set-points at once, and later on, e.g. an ArduCopter's FS_GCS_ENABLE."""
    later = parts.services.failsafes.lost_link_text(vehicle)
    return parts.comms.firmware.of(vehicle).if_silent(vehicle) + (f"; not heard, it {later}" if later else "")


def _link(parts: StationParts, link: Link) -> LinkStatus:
    counts = parts.picture.fleet.intakes[link.spec.network].counts(link.name)
    radio = parts.comms.rates.radio(link.name)
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


def _endpoint(port: Port) -> LinkStatus:
    link = port.link
    return LinkStatus(
        name=link.name + (" (takes commands)" if port.commands else ""),
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


def _faults(parts: StationParts) -> dict[str, int]:
    counts = {
        "planner": sum(controller.planner.fault_count for controller in parts.active.team_controllers.values()),
        "unanswered commands": parts.comms.commands.unanswered_count,
        "refused on slot": parts.flight.steering.vetoed_on_slot,
        "link": parts.comms.reception.faults,
        "too close": parts.flight.monitor.violations,
    }
    return {name: count for name, count in counts.items() if count}


def _dropped(parts: StationParts) -> dict[str, int]:
    fleet, comms = parts.picture.fleet, parts.comms
    counts = fleet.dropped + comms.commands.ignored + comms.uplink.refused + parts.conditions.dropped
    counts += parts.picture.trust.dropped + comms.forwarder.refused + parts.services.control.refused
    counts += parts.services.ignored()
    for intake in fleet.intakes.values():
        counts += intake.dropped
    controllers = parts.active.team_controllers.values()
    counts["plan for an older task"] = sum(controller.ignored for controller in controllers)
    counts["notes of planners: too many"] = sum(controller.dropped_notes for controller in controllers)
    counts["clients of links: all places taken"] = sum(link.refused_clients for link in comms.links.values())
    counts["TIMESYNC and PING: too many"] = comms.time_responder.ignored
    counts["frames not recorded"] = parts.records.recorder.dropped
    return {reason: count for reason, count in counts.items() if count}


def _recording(parts: StationParts) -> str:
    recorder = parts.records.recorder
    return f"NOT RECORDING: {recorder.error}" if recorder.error else recorder.path.name
