"""Vehicles as the station knows them now, as rows of replies: identity, state, health, links."""

import math

from tui_gcs.core.firmware.base import may_be_flying
from tui_gcs.core.firmware.registry import name_of
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.mavlink.enum_names import type_name
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol import services as s
from tui_gcs.core.requests.homes import home_deg
from tui_gcs.core.requests.plan_rows import plan_rows
from tui_gcs.core.requests.vehicle_details import details
from tui_gcs.core.requests.vehicle_requests import failsafe_rows
from tui_gcs.core.station.assembly import StationParts

_STAGES = {0: "dev", 64: "alpha", 128: "beta", 192: "rc", 255: ""}
"""Suffixes of versions by MAVLink's FIRMWARE_VERSION_TYPE."""


def vehicle_info(parts: StationParts, vehicle: Vehicle) -> s.VehicleInfo:
    """All that is known about one vehicle."""
    services, now = parts.services, parts.records.clock.now()
    health, link_time = services.health.of(vehicle), services.link_timing.of(vehicle)
    mission, table = services.missions.state(vehicle.id), services.params.table(vehicle.id)
    held = mission.held[PlanKind.MISSION]
    flight = parts.flight.flights.get(vehicle.id)
    job = services.context.jobs.running(vehicle.id)
    found = parts.flight.emergencies.found.get(vehicle.id)
    emergency = (s.ProblemRow(text=f"EMERGENCY: {found.text}", blocks=True),) if found is not None else ()
    doubt = vehicle.identity_problem
    identity = (s.ProblemRow(text=doubt, blocks=bool(vehicle.why_not_commanded)),) if doubt else ()
    links = [vehicle.link, *(path.source.link for path in vehicle.used_paths() if path is not vehicle.path)]
    return s.VehicleInfo(
        id=vehicle.id,
        network=vehicle.network,
        system=vehicle.system,
        autopilot=name_of(vehicle),
        type=type_name(vehicle.type),
        firmware=_version(parts, vehicle),
        uid=vehicle.identity.uid,
        team=flight.team if flight is not None else "",
        mode=services.modes.name(vehicle),
        armed=vehicle.telemetry.armed,
        in_flight=may_be_flying(vehicle),
        freshness=vehicle.freshness(now).value,
        heard_age_s=now - vehicle.last_heard_s,
        signing=vehicle.identity.signing.value,
        ready=health.ready and not emergency and not identity,
        problems=(*emergency, *identity, *(s.ProblemRow(text=p.text, blocks=p.blocks) for p in health.problems)),
        failsafes=failsafe_rows(services, vehicle) if services.failsafes.known(vehicle) else (),
        links=tuple(dict.fromkeys(links)),
        loss_pct=vehicle.loss_pct,
        rtt_s=link_time.rtt_s if link_time is not None else math.nan,
        best_rtt_s=link_time.best_rtt_s if link_time is not None else math.nan,
        home=home_deg(parts, vehicle),
        mission_items=len(held.plan.items) if held.plan is not None and held.known else mission.total,
        mission_current=mission.current,
        params_known=len(table.params),
        params_complete=table.complete,
        busy=job.name if job is not None else "",
        details=details(parts, vehicle),
    )


def on_board(parts: StationParts, vehicle: int) -> s.OnBoardRow:
    """The plans that a vehicle is known to hold."""
    held = parts.services.missions.state(vehicle).held
    known = {kind: plan_rows(one.plan) for kind, one in held.items() if one.plan is not None and one.known}
    return s.OnBoardRow(vehicle, known.get(PlanKind.MISSION), known.get(PlanKind.FENCE), known.get(PlanKind.RALLY))


def _version(parts: StationParts, vehicle: Vehicle) -> str:
    """The version in AUTOPILOT_VERSION, e.g. "4.7.0-dev"; "" before it was received."""
    newest = parts.picture.fleet.newest(vehicle, c.AUTOPILOT_VERSION)
    if newest is None:
        return ""
    number = int(newest.fields["flight_sw_version"])
    stage = _STAGES.get(number & 0xFF, str(number & 0xFF))
    return f"{number >> 24 & 0xFF}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}" + (f"-{stage}" if stage else "")
