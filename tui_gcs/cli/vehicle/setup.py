"""`tui-gcs vehicle tune`, `airframe` and `motor-test`."""

import argparse

from tui_gcs.cli.exit_codes import FAILED, OK, CommandError
from tui_gcs.cli.vehicle.mode_shell_reboot import carry_out_sure
from tui_gcs.cli.vehicle.params import number
from tui_gcs.cli.vehicle.prompts import PromptGuide
from tui_gcs.cli.vehicle.station_client import StationClient, confirmed, exit_code, say, say_json, tell, tell_failed
from tui_gcs.cli.vehicle_numbers import listed, only_one, vehicle_ids
from tui_gcs.core.firmware.calibration_setup import motor_word
from tui_gcs.core.protocol.services import GetVehicles
from tui_gcs.core.protocol.setup import (
    AirframeRow,
    ChooseAirframe,
    GetAirframes,
    ReadAirframe,
    ReadGains,
    SetGain,
    TestMotor,
    UndoGains,
)
from tui_gcs.core.services.parameters.param_values import shown

# ---------------------------------------------------------------- gains


def run_tune(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print gains, change one, or take changes back."""
    ids, group, name = vehicle_ids(arguments.ids), arguments.group or "", (arguments.name or "").upper()
    if arguments.undo:
        if group and not name:
            raise CommandError("--undo takes back all changes, or (GROUP NAME --undo) the last one of one gain")
        return tell(station.carry_out(UndoGains(ids, name)), as_json=arguments.json)
    if name and arguments.value is None:
        raise CommandError(f"{name}: which value?")
    read = station.carry_out(ReadGains(ids, group))
    if name:
        good = tuple(one.vehicle for one in read if one.ok)
        request = SetGain(good, name, number(arguments.value), sure=arguments.yes)
        ended = carry_out_sure(station, request, f"set {name} = {arguments.value}") if good else []
        second = {one.vehicle: one for one in ended}
        return tell([second.get(one.vehicle, one) for one in read], as_json=arguments.json)
    if arguments.json:
        return tell(read, as_json=True)
    for one in read:
        for row in one.result.gains:
            was = f"  was {', '.join(map(shown, row.former))}" if row.former else ""
            say(f"{one.vehicle:>4} {row.group:<9} {row.name:<16} {shown(row.value)}{was}")
        if one.result.missing:
            say(f"vehicle {one.vehicle} has no {', '.join(one.result.missing)}")
    tell_failed(read)
    return exit_code(read)


# ---------------------------------------------------------------- airframe


def run_airframe(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print a vehicle's airframe and the possible ones, or set another."""
    ids = vehicle_ids(arguments.ids)
    if arguments.act == "list":
        return _choices(station, ids, as_json=arguments.json)
    if arguments.act == "set":
        return _choose(station, ids, arguments)
    if arguments.words:
        raise CommandError("say `list`, or `set` and what it is")
    ended = station.carry_out(ReadAirframe(ids))
    if arguments.json:
        return tell(ended, as_json=True)
    for one in ended:
        for row in one.result.airframe:
            say(f"{one.vehicle:>4} {row.label:<9} {_choice(row)}  ({row.param})")
    tell_failed(ended)
    return exit_code(ended)


def _choice(row: AirframeRow) -> str:
    if row.value is None:
        return "not known"
    return f"{row.value} {row.choices.get(row.value, '(no name here)')}"


def _choices(station: StationClient, ids: tuple[int, ...], *, as_json: bool) -> int:
    reply = station.ask(GetAirframes(ids))
    if as_json:
        say_json(reply.airframes)
        return OK if reply.ok else FAILED
    for row in reply.airframes:
        for value, name in sorted(row.choices.items()):
            say(f"{row.vehicle:>4} {row.label:<9} {value:>6} {name}")
    for result in reply.results:
        say(f"vehicle {result.vehicle}: {result.text}")
    return OK if reply.ok else FAILED


def _choose(station: StationClient, ids: tuple[int, ...], arguments: argparse.Namespace) -> int:
    if not arguments.words:
        raise CommandError("which airframe? `list` shows the choices, with their labels")
    warnings = dict.fromkeys(row.warning for row in station.ask(GetAirframes(ids)).airframes)
    act = f"airframe {' '.join(arguments.words)} for {listed(ids)}" + "".join(f" ({words})" for words in warnings)
    if not confirmed(act, yes=arguments.yes, vehicles=len(ids)):
        return FAILED
    return tell(station.carry_out(ChooseAirframe(ids, tuple(arguments.words))), as_json=arguments.json)


# ---------------------------------------------------------------- motors


def run_motor_test(station: StationClient, arguments: argparse.Namespace) -> int:
    """Turn one motor of one vehicle; Ctrl-C stops it."""
    vehicle = only_one(arguments.ids, "for one motor")
    known = station.ask(GetVehicles((vehicle,))).vehicles
    motor = motor_word(known[0].autopilot if known else "", arguments.motor)
    turn = f"turn {motor} of vehicle {vehicle} with {arguments.throttle:g} % for {arguments.seconds:g} s"
    if not confirmed(f"{turn}: are ALL its propellers OFF", yes=arguments.yes):
        return FAILED
    request = TestMotor((vehicle,), arguments.motor, arguments.throttle / 100, arguments.seconds, props_removed=True)
    return tell(station.carry_out(request, PromptGuide(station)), as_json=arguments.json)
