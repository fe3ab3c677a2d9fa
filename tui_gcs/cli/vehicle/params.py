"""`tui-gcs vehicle params …`: reads, sets and compares parameters."""

import argparse
from fnmatch import fnmatchcase
from functools import partial

from tui_gcs.cli.command_report import finish, of_vehicles
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.vehicle import param_files as files
from tui_gcs.cli.vehicle.mode_shell_reboot import carry_out_sure
from tui_gcs.cli.vehicle.station_client import StationClient, VehicleOutcome, say, say_failed, tell, tell_lines
from tui_gcs.cli.vehicle_numbers import vehicle_ids
from tui_gcs.core.base.float32 import shown, typed_number
from tui_gcs.core.protocol.services import FetchParams, GetParams, ParamRow, ReadParams, SetParams


def run(station: StationClient, arguments: argparse.Namespace) -> int:
    """Run one of the actions on parameters."""
    actions = {"get": _get, "set": _set, "list": _list, "save": files.save, "load": files.load, "diff": files.diff}
    return actions[arguments.act](station, arguments)


def _get(station: StationClient, arguments: argparse.Namespace) -> int:
    ended = station.carry_out(ReadParams(vehicle_ids(arguments.ids), tuple(dict.fromkeys(arguments.names))))
    return tell_lines(
        ended, lambda one: map(partial(_line, one.vehicle), one.result.params), arguments, "params", "missing"
    )


def _line(vehicle: int, row: ParamRow) -> str:
    default = f"  default {shown(row.default)}" if row.default is not None and row.default != row.value else ""
    meaning = f"  {row.text}" if row.text else ""
    return f"{vehicle:>4} {row.name:<16} {shown(row.value)}{' ' + row.units if row.units else ''}{default}{meaning}"


def _set(station: StationClient, arguments: argparse.Namespace) -> int:
    value = number_argument(arguments.value)
    request = SetParams(
        vehicle_ids(arguments.ids),
        {arguments.name: value},
        in_flight=arguments.yes,
        beyond_range=arguments.beyond_range,
    )
    ended = carry_out_sure(station, request, f"set {arguments.name} = {shown(value)}")
    for one in ended:
        if one.ok:
            remark = f" ({one.text})" if one.text else ""
            one.text = ", ".join(f"{row.name} = {shown(row.value)}" for row in one.result.params) + remark
    return tell(ended, arguments)


def number_argument(text: str) -> int | float:
    """Return the number of an argument. Raises `CommandError` where it is none that a vehicle can take."""
    value = typed_number(text)
    if value is None:
        raise CommandError(f"{text[:40]!r} is no number that a vehicle can take: write 3, 0x1F or 2.5")
    return value


def _list(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    fetched = station.carry_out(FetchParams(ids)) if arguments.fetch else []
    failed = {one.vehicle: one for one in fetched if not one.ok}
    ended: list[VehicleOutcome] = []
    for vehicle in ids:
        reply = station.ask(GetParams(vehicle))
        found = tuple(row for row in reply.params if _fits(row.name, arguments.pattern))
        text = "" if reply.complete or not reply.ok else f"{len(reply.params)} are known, --fetch asks for all"
        ended.append(failed.get(vehicle) or VehicleOutcome(vehicle, reply.ok, reply.text or text))
        ended[-1].data = {"params": found, "complete": reply.complete}
        if not arguments.json:
            for row in found:
                say(_line(vehicle, row))
            if text and vehicle not in failed:
                say(f"vehicle {vehicle}: {text}")
    if not arguments.json:
        say_failed(ended)
    return finish(arguments, of_vehicles(one.report() for one in ended))


def _fits(name: str, pattern: str) -> bool:
    wanted = pattern.upper()
    return fnmatchcase(name, wanted if any(char in wanted for char in "*?[") else f"*{wanted}*")
