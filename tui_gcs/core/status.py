"""The station's status message, put together from its parts."""

import math
from typing import TYPE_CHECKING

from tui_gcs.core.flights import Flight
from tui_gcs.core.forward import Endpoint
from tui_gcs.core.links import Link
from tui_gcs.core.messages import Freshness, LinkStatus, Phase, RunPhase, StationStatus
from tui_gcs.core.snapshot import problem_of

if TYPE_CHECKING:
    from tui_gcs.core.station import Station


CRITICAL_BATTERY_PCT = 15.0
"""In the air: worse than any hold."""


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
        vehicles=len({flight.vehicle for flight in station.book} | set(station.fleet.vehicles)),
        armed=sum(1 for v in vehicles if v.armed),
        in_control=station.requests.in_control,
        teams=tuple(desk.status() for desk in station.desks.values()),
        links=_links(station),
        forward=tuple(_endpoint(endpoint) for endpoint in station.config.forward),
        min_separation_m=separation if math.isfinite(separation) else math.nan,
        outside_area_m=station.monitor.outside_area_m,
        vetoes=dict(station.guard.vetoes),
        not_ready={f.vehicle: why for f in station.book if (why := station.requests.why_not_start(f.vehicle))},
        if_silent={
            f.vehicle: station.firmware.of(v).if_silent(v)
            for f in station.book
            if (v := station.fleet.vehicles.get(f.vehicle)) is not None
        },
        faults=_faults(station),
        dropped=_dropped(station),
        recording=_recording(station),
        planner_files={
            info.name: f"{info.file} sha256 {info.sha256}" for info in station.config.planners.values() if info.file
        },
        alarm=_alarm(station, now),
    )


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
        "planner": sum(desk.fault_count for desk in station.desks.values()),
        "unanswered commands": len(station.commands.unanswered),
        "refused on slot": station.steering.vetoed_on_slot,
        "link": station.reception.faults,
    }
    return {name: count for name, count in counts.items() if count}


def _dropped(station: "Station") -> dict[str, int]:
    counts = station.fleet.dropped + station.commands.ignored + station.door.refused + station.dropped
    counts += station.trust.dropped + station.forwarder.refused + station.services.control.refused
    counts += station.services.ignored()
    for intake in station.fleet.intakes.values():
        counts += intake.dropped
    if ignored := sum(desk.ignored for desk in station.desks.values()):
        counts["plan for an older task"] = ignored
    if station.recorder.dropped:
        counts["frames not recorded"] = station.recorder.dropped
    return dict(counts)


def _recording(station: "Station") -> str:
    return f"NOT RECORDING: {station.recorder.error}" if station.recorder.error else station.recorder.path.name


def _alarm(station: "Station", now: float) -> str:
    """The worst thing an operator must act on, with the key that answers it."""
    lost = [flight.vehicle for flight in station.book if _is_lost(station, flight, now)]
    if lost:
        return f"LOST in the air: vehicle {_ids(lost)}   → !h hold all, r return the others"
    doubtful: dict[str, list[int]] = {}
    for vehicle in station.fleet.in_order():
        if problem := problem_of(vehicle):
            doubtful.setdefault(problem, []).append(vehicle.id)
    if doubtful:
        more = f" (+ {len(doubtful) - 1} other reasons)" if len(doubtful) > 1 else ""
        problem, ids = next(iter(doubtful.items()))
        return f"vehicle {_ids(ids)} {problem}{more}"
    low = [v for v in station.fleet.in_order() if v.airborne and v.battery_pct < CRITICAL_BATTERY_PCT]
    if low:
        worst = min(low, key=lambda v: v.battery_pct)
        text = f"battery {worst.battery_pct:.0f} % vehicle {worst.id}"
        return text + (f", low on {_ids([v.id for v in low])}" if len(low) > 1 else "") + "   → r return and land"
    taken = [flight.vehicle for flight in station.book.in_phase(Phase.TAKEN_OUT)]
    if taken:
        return f"vehicle {_ids(taken)} left the mission   → !h hold all"
    if station.executive.run in (RunPhase.RUNNING, RunPhase.RETURNING):
        held = [flight.vehicle for flight in station.book.in_phase(Phase.HOLDING)]
        if held:
            return f"vehicle {_ids(held)} holding   → Enter resume, r return and land"
    if station.executive.run is RunPhase.HOLD and station.book.in_phase(Phase.HOLDING):
        return "HOLD   → Enter resume, r return and land"
    if station.recorder.error:
        return f"not recording: {station.recorder.error}"
    down = [name for name, link in station.links.items() if link.error]
    return f"link {down[0]}: {station.links[down[0]].error}" if down else ""


def _is_lost(station: "Station", flight: Flight, now: float) -> bool:
    """In the air for all we know, and not heard (since a restart: never)."""
    vehicle = station.fleet.vehicles.get(flight.vehicle)
    if vehicle is None:
        return flight.phase is not Phase.GROUND
    lost = vehicle.freshness(now) is Freshness.LOST
    return lost and (vehicle.armed or flight.phase is not Phase.GROUND)


def _ids(vehicles: list[int]) -> str:
    return ", ".join(map(str, sorted(vehicles)))
