"""`tui-gcs vehicle gimbal`, `camera`, `roi`, `traffic` and `remote-id`: payloads, and traffic that vehicles receive."""

import argparse
import math

from tui_gcs.cli.exit_codes import FAILED, OK, CommandError
from tui_gcs.cli.vehicle.station_client import StationClient, exit_code, say, say_json, tell, tell_failed
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
        return tell(station.carry_out(ReleaseGimbal(ids)), as_json=arguments.json)
    if arguments.pitch is None and arguments.yaw is None:
        return _payloads(station, ids, "gimbal", as_json=arguments.json)
    request = PointGimbal(ids, arguments.pitch or 0.0, arguments.yaw or 0.0, to_north=arguments.north)
    return tell(station.carry_out(request), as_json=arguments.json)


def run_camera(station: StationClient, arguments: argparse.Namespace) -> int:
    """Take a picture, start or stop a video, or print the known cameras."""
    ids = vehicle_ids(arguments.ids)
    if arguments.act is None:
        return _payloads(station, ids, "camera", as_json=arguments.json)
    return tell(station.carry_out(UseCamera(ids, arguments.act)), as_json=arguments.json)


def _payloads(station: StationClient, ids: tuple[int, ...], kind: str, *, as_json: bool) -> int:
    station.carry_out(AskPayloads(ids))
    reply = station.ask(GetPayloads(ids))
    rows = [row for row in reply.payloads if row.kind == kind]
    if as_json:
        say_json(rows)
        return OK if reply.ok else FAILED
    for vehicle in ids:
        own = [row for row in rows if row.vehicle == vehicle]
        for row in own:
            say(f"{vehicle:>4} {_payload(row)}")
        if not own and all(result.vehicle != vehicle for result in reply.results):
            say(f"vehicle {vehicle}: no {kind} was heard; its autopilot may have one that tells nothing")
    for result in reply.results:
        say(f"vehicle {result.vehicle}: {result.text}")
    return OK if reply.ok else FAILED


def _payload(row: PayloadRow) -> str:
    who = f"{row.kind} (component {row.component}) {row.name}".rstrip()
    if row.kind == "camera":
        return f"{who}: {row.images} pictures"
    owner = {None: "control not known", 0: "controlled by nobody"}.get(
        row.controlled_by, f"controlled by system {row.controlled_by}"
    )
    if row.angles_deg is None:
        return f"{who}: {owner}"
    roll, pitch, yaw = row.angles_deg
    turned = f"roll {roll:.0f}, pitch {pitch:.0f}, yaw {yaw:.0f} from {'north' if row.to_north else 'the nose'}"
    return f"{who}: {turned}, {row.age_s:.0f} s ago; {owner}"


def run_roi(station: StationClient, arguments: argparse.Namespace) -> int:
    """Point payloads at a place, or release them."""
    ids = vehicle_ids(arguments.ids)
    if arguments.place == ["none"]:
        return tell(station.carry_out(LookAhead(ids)), as_json=arguments.json)
    try:
        lat_deg, lon_deg, alt_m = map(float, arguments.place)
    except ValueError:
        raise CommandError("say LAT LON HEIGHT (degrees, metres), or none") from None
    request = LookAt(ids, lat_deg, lon_deg, alt_m, "sea" if arguments.amsl else "home")
    return tell(station.carry_out(request), as_json=arguments.json)


# ---------------------------------------------------------------- who is heard


def run_traffic(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print aircraft that were received lately; the vehicles that are named are asked first."""
    asked = station.carry_out(HearTraffic(vehicle_ids(arguments.ids))) if arguments.ids else []
    rows = station.ask(GetTraffic()).traffic
    new_at = 0
    for look in range(HEAR_LOOKS if asked else 0):
        station.pause()
        before, rows = len(rows), station.ask(GetTraffic()).traffic
        new_at = look if len(rows) > before else new_at
        if rows and look - new_at >= QUIET_LOOKS:
            break
    if arguments.json:
        say_json(rows)
    else:
        for row in rows:
            say(_traffic(row))
        if not rows:
            say("no aircraft was heard within the last minute")
        tell_failed([one for one in asked if not one.ok])
    return exit_code(asked) if asked else OK


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
    if arguments.json:
        say_json(reply.remote_ids)
        return OK if reply.ok else FAILED
    for vehicle in ids:
        row = next((row for row in reply.remote_ids if row.vehicle == vehicle), None)
        if row is not None:
            _remote_id(f"vehicle {vehicle}", row)
        elif all(result.vehicle != vehicle for result in reply.results):
            say(f"vehicle {vehicle}: nothing was heard of Remote ID")
    for row in reply.remote_ids:
        if not row.vehicle:
            _remote_id(f"another aircraft, heard by vehicle {row.heard_by}", row)
    for result in reply.results:
        say(f"vehicle {result.vehicle}: {result.text}")
    return OK if reply.ok else FAILED


def _remote_id(who: str, row: RemoteIdRow) -> None:
    arm = {True: "ready to arm", None: "says nothing of arming"}.get(
        row.may_arm, f"NOT READY TO ARM: {row.arm_error or 'no reason told'}"
    )
    source = "its autopilot" if row.component == 1 else f"component {row.component}"
    say(f"{who}: {arm}; told by {source} {row.age_s:.0f} s ago")
    said = [(word, value) for word, value in _said(row) if value]
    for word, value in said:
        say(f"  {word:<12} {value}")
    if not any(word == "id" for word, _ in said):
        say("  id           NONE: it does not say who it is")


def _said(row: RemoteIdRow) -> list[tuple[str, str]]:
    height = f", {row.alt_m:.0f} m above the ellipsoid" if math.isfinite(row.alt_m) else ""
    return [
        ("id", row.uas_id),
        ("operator", row.operator_id),
        ("description", row.description),
        ("at", _degrees(row.lat_deg, row.lon_deg, height)),
        ("operator at", _degrees(row.operator_lat_deg, row.operator_lon_deg)),
    ]


def _degrees(lat_deg: float, lon_deg: float, more: str = "") -> str:
    return f"{lat_deg:.7f} {lon_deg:.7f}{more}" if math.isfinite(lat_deg) and math.isfinite(lon_deg) else ""
