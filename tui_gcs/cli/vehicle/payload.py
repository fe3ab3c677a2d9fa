"""`tui-gcs vehicle gimbal`, `camera`, `roi`, `traffic` and `remote-id`: payloads, and traffic that vehicles receive."""

import argparse
import math
from itertools import chain

from tui_gcs.cli.command_report import CommandReport, finish, of_vehicles
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.vehicle.station_client import (
    StationClient,
    lines_by_vehicle,
    order,
    reports_by_vehicle,
    say,
    say_failed,
    tell_reply,
)
from tui_gcs.cli.vehicle_numbers import vehicle_ids
from tui_gcs.core.protocol.setup import (
    AskPayloads,
    GetPayloads,
    GetRemoteIds,
    GetTraffic,
    HearTraffic,
    LookAhead,
    LookAt,
    PayloadRow,
    PointGimbal,
    ReleaseGimbal,
    RemoteIdRow,
    TrafficRow,
    UseCamera,
)

HEAR_LOOKS, QUIET_LOOKS = 20, 5
"""How often traffic is looked at, five times a second, after vehicles were asked for it.

Each message reports one aircraft after the other. The list is complete once several looks found no new one.
"""

# ---------------------------------------------------------------- cameras and gimbals


def run_gimbal(station: StationClient, arguments: argparse.Namespace) -> int:
    """Point gimbals, release them, or print what is known of them."""
    ids = vehicle_ids(arguments.ids)
    if arguments.act == "release":
        return order(station, arguments, ReleaseGimbal(ids))
    if arguments.pitch is None and arguments.yaw is None:
        return _payloads(station, ids, "gimbal", arguments)
    request = PointGimbal(ids, arguments.pitch or 0.0, arguments.yaw or 0.0, to_north=arguments.north)
    return order(station, arguments, request)


def run_camera(station: StationClient, arguments: argparse.Namespace) -> int:
    """Take a picture, start or stop a video, or print the known cameras."""
    ids = vehicle_ids(arguments.ids)
    if arguments.act is None:
        return _payloads(station, ids, "camera", arguments)
    return order(station, arguments, UseCamera(ids, arguments.act))


def _payloads(station: StationClient, ids: tuple[int, ...], kind: str, arguments: argparse.Namespace) -> int:
    station.carry_out(AskPayloads(ids))
    reply = station.ask(GetPayloads(ids))

    def rows(vehicle: int) -> list[PayloadRow]:
        return [row for row in reply.payloads if row.kind == kind and row.vehicle == vehicle]

    lines = lines_by_vehicle(
        reply,
        ids,
        lambda vehicle: [f"{vehicle:>4} {_payload(row)}" for row in rows(vehicle)],
        f"no {kind} was heard; its autopilot may have one that reports nothing",
    )
    return tell_reply(
        arguments, reply, lines, reports_by_vehicle(reply, ids, lambda vehicle: {"payloads": rows(vehicle)})
    )


def _payload(row: PayloadRow) -> str:
    device = f"{row.kind} (component {row.component}) {row.name}".rstrip()
    if row.kind == "camera":
        return f"{device}: {row.images} pictures"
    owner = {None: "control not known", 0: "controlled by no system"}.get(
        row.controlled_by, f"controlled by system {row.controlled_by}"
    )
    if row.angles_deg is None:
        return f"{device}: {owner}"
    roll, pitch, yaw = row.angles_deg
    turned = f"roll {roll:.0f}, pitch {pitch:.0f}, yaw {yaw:.0f} from {'north' if row.to_north else 'the nose'}"
    return f"{device}: {turned}, {row.age_s:.0f} s ago; {owner}"


def run_roi(station: StationClient, arguments: argparse.Namespace) -> int:
    """Point payloads at a place, or release them."""
    ids = vehicle_ids(arguments.ids)
    if arguments.place == ["none"]:
        return order(station, arguments, LookAhead(ids))
    try:
        lat_deg, lon_deg, alt_m = map(float, arguments.place)
    except ValueError:
        raise CommandError("say LAT LON HEIGHT (degrees, metres), or none") from None
    return order(station, arguments, LookAt(ids, lat_deg, lon_deg, alt_m, "sea" if arguments.amsl else "home"))


# ---------------------------------------------------------------- who is heard


def run_traffic(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print aircraft that were received lately; the vehicles that are named are asked first."""
    outcomes = station.carry_out(HearTraffic(vehicle_ids(arguments.ids))) if arguments.ids else []
    rows = station.ask(GetTraffic()).traffic
    new_at = 0
    for look in range(HEAR_LOOKS if outcomes else 0):
        station.pause()
        before, rows = len(rows), station.ask(GetTraffic()).traffic
        new_at = look if len(rows) > before else new_at
        if rows and look - new_at >= QUIET_LOOKS:
            break
    if not arguments.json:
        for row in rows:
            say(_traffic(row))
        if not rows:
            say("no aircraft was heard within the last minute")
        say_failed(outcomes)
    data = {"traffic": rows}
    if not outcomes:
        return finish(arguments, CommandReport(True, data=data))
    return finish(arguments, of_vehicles((one.report() for one in outcomes), data=data))


def _traffic(row: TrafficRow) -> str:
    name = f"{row.callsign or '-':<9} {row.icao:06X}"
    away = f"{row.distance_m / 1e3:7.1f} km" if math.isfinite(row.distance_m) else f"{'? km':>10}"
    height = f"{row.alt_m:6.0f} m {'AMSL' if row.is_geometric else 'pressure'}" if math.isfinite(row.alt_m) else "? m"
    above = f", {row.above_m:+.0f} m from us" if math.isfinite(row.above_m) else ""
    speed = f"  {row.speed_m_s:.0f} m/s" if math.isfinite(row.speed_m_s) else ""
    course = f" to {row.heading_deg:.0f}°" if math.isfinite(row.heading_deg) else ""
    made_up = "  SIMULATED" if row.simulated else ""
    return f"{name} {away} {height}{above}{speed}{course}  by {row.heard_by}, {row.age_s:.0f} s ago{made_up}"


def run_remote_id(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print what vehicles broadcast, whether their transmitters let them arm, and which others are received."""
    ids = vehicle_ids(arguments.ids)
    reply = station.ask(GetRemoteIds(ids))

    def lines(vehicle: int) -> list[str]:
        row = next((row for row in reply.remote_ids if row.vehicle == vehicle), None)
        return _remote_id(f"vehicle {vehicle}", row) if row is not None else []

    own = lines_by_vehicle(reply, ids, lines, "nothing was heard of Remote ID")
    others = (
        _remote_id(f"another aircraft, heard by vehicle {row.heard_by}", row)
        for row in reply.remote_ids
        if not row.vehicle
    )
    heard = [row for row in reply.remote_ids if not row.vehicle]
    entries = reports_by_vehicle(
        reply, ids, lambda vehicle: {"remote_ids": [row for row in reply.remote_ids if row.vehicle == vehicle]}
    )
    return tell_reply(arguments, reply, chain(own, *others), entries, {"others": heard})


def _remote_id(whose: str, row: RemoteIdRow) -> list[str]:
    arm = {True: "ready to arm", None: "does not report whether it may arm"}.get(
        row.may_arm, f"NOT READY TO ARM: {row.arm_error or 'no reason given'}"
    )
    source = "its autopilot" if row.component == 1 else f"component {row.component}"
    height = f", {row.alt_m:.0f} m above the ellipsoid" if math.isfinite(row.alt_m) else ""
    values = {
        "id": row.uas_id,
        "operator": row.operator_id,
        "description": row.description,
        "at": _degrees(row.lat_deg, row.lon_deg, height),
        "operator at": _degrees(row.operator_lat_deg, row.operator_lon_deg),
    }
    lines = [f"{whose}: {arm}; reported by {source} {row.age_s:.0f} s ago"]
    lines += [f"  {word:<12} {value}" for word, value in values.items() if value]
    return lines if row.uas_id else [*lines, "  id           NONE: it does not say who it is"]


def _degrees(lat_deg: float, lon_deg: float, more: str = "") -> str:
    return f"{lat_deg:.7f} {lon_deg:.7f}{more}" if math.isfinite(lat_deg) and math.isfinite(lon_deg) else ""
