"""`tui-gcs vehicle mode`, `shell` and `reboot`."""

import argparse
import sys
from dataclasses import replace

import msgspec

from tui_gcs.cli.command_report import VehicleReport, finish, of_vehicles
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.vehicle.station_client import (
    NOT_SENT,
    StationClient,
    VehicleOutcome,
    confirmed,
    order,
    say,
    tell,
)
from tui_gcs.cli.vehicle_numbers import listed, only_one, vehicle_ids
from tui_gcs.core.protocol.services import MEANT, MEET, GetModes, Reboot, SetMode, SetParams, TypeShell
from tui_gcs.core.protocol.setup import SetCurrentItem, SetGain

LIST_LOOKS = 25
"""How often, five times a second, a list of modes that is still arriving is looked at."""


def run_mode(station: StationClient, arguments: argparse.Namespace) -> int:
    """List the modes, or change to one of them."""
    if arguments.name is None:
        return _list_modes(station, arguments)
    request = SetMode(vehicle_ids(arguments.ids), arguments.name, sure=arguments.yes, meet=arguments.meet)
    return tell(carry_out_sure(station, request, f"mode {arguments.name}"), arguments)


def _list_modes(station: StationClient, arguments: argparse.Namespace) -> int:
    vehicle = only_one(arguments.ids, "or a mode to change to")
    reply = station.ask(GetModes(vehicle))
    for _ in range(LIST_LOOKS):
        if not reply.ok or reply.complete:
            break
        station.pause()
        reply = station.ask(GetModes(vehicle))
    if not reply.ok:
        raise CommandError(reply.text, ReportCode.REFUSED)
    for mode in reply.modes if not arguments.json else ():
        present = "*" if mode.name == reply.text else " "
        say(f"{present} {mode.name}" + ("  (for experts)" if mode.advanced else ""))
    data = {"mode": reply.text, "modes": reply.modes}
    text = "" if reply.modes else "it has not listed its modes"
    code = ReportCode.NONE if reply.modes else ReportCode.FAILED
    return finish(arguments, of_vehicles([VehicleReport(vehicle, bool(reply.modes), code, text, data)]))


Meant = SetMode | SetParams | SetGain | SetCurrentItem
"""The requests that the station may refuse until they are confirmed."""


def carry_out_sure(station: StationClient, request: Meant, act: str) -> list[VehicleOutcome]:
    """Send a request; where the station wants a confirmation, ask the user and send it again for those vehicles."""
    ended = _with_meet(station.carry_out(request))
    unsure = {one.vehicle: one for one in ended if not one.ok and one.code is ReportCode.NOT_CONFIRMED}
    if not unsure:
        return ended
    if len(unsure) < len(ended) and not sys.stdin.isatty():
        # It is done for the others already: an error would hide their results.
        return [one if one.vehicle not in unsure else replace(one, text=_with_yes(one.text)) for one in ended]
    why = next(iter(unsure.values())).text.removesuffix(f": {MEANT}")
    if not confirmed(f"{listed(tuple(unsure))}: {act} ({why})", yes=False, vehicles=len(unsure)):
        declined = {v: replace(one, code=ReportCode.CANCELLED, text=NOT_SENT) for v, one in unsure.items()}
        return [declined.get(one.vehicle, one) for one in ended]
    sure = {"in_flight": True} if isinstance(request, SetParams) else {"sure": True}
    again = _with_meet(station.carry_out(msgspec.structs.replace(request, vehicles=tuple(unsure), **sure)))
    second = {one.vehicle: one for one in again}
    return [second.get(one.vehicle, one) for one in ended]


def _with_meet(ended: list[VehicleOutcome]) -> list[VehicleOutcome]:
    """Name the option that begins missions that meet: a "y" on a terminal is no look at them."""
    for one in ended:
        if not one.ok and one.text.endswith(MEET):
            one.text, one.code = f"{one.text.removesuffix(MEET)}--meet does it all the same", ReportCode.REFUSED
    return ended


def _with_yes(text: str) -> str:
    return f"{text.removesuffix(MEANT)}say --yes, or answer on a terminal"


def run_shell(station: StationClient, arguments: argparse.Namespace) -> int:
    """Type a line into the vehicle's shell and print the answer."""
    if not arguments.line:
        raise CommandError("nothing to type, e.g.: tui-gcs vehicle shell 2 ver all")
    ended = station.carry_out(TypeShell(vehicle_ids(arguments.ids), " ".join(arguments.line)))
    for one in ended if not arguments.json else ():
        if len(ended) > 1 or not one.ok:
            say(f"vehicle {one.vehicle}:" + ("" if one.ok else f" FAILED: {one.text}"))
        for line in one.result.lines:
            say(line)
    return finish(arguments, of_vehicles(one.report("lines") for one in ended))


def run_reboot(station: StationClient, arguments: argparse.Namespace) -> int:
    """Reboot vehicles, and wait until their boot clocks have begun anew."""
    ids = vehicle_ids(arguments.ids)
    return order(station, arguments, Reboot(ids), f"reboot {listed(ids)}")
