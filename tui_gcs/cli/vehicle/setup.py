"""`tui-gcs vehicle tune`, `airframe` and `motor-test`."""

import argparse
from collections.abc import Iterator

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.vehicle.mode_shell_reboot import carry_out_sure
from tui_gcs.cli.vehicle.params import number_argument
from tui_gcs.cli.vehicle.prompts import PromptGuide
from tui_gcs.cli.vehicle.station_client import (
    StationClient,
    VehicleOutcome,
    order,
    reports_by_vehicle,
    tell,
    tell_lines,
    tell_reply,
)
from tui_gcs.cli.vehicle_numbers import listed, only_one, vehicle_ids
from tui_gcs.core.base.float32 import shown
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

# ---------------------------------------------------------------- gains


def run_tune(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print gains, change one, or take changes back."""
    ids, group, name = vehicle_ids(arguments.ids), arguments.group or "", (arguments.name or "").upper()
    if arguments.undo:
        if group and not name:
            raise CommandError("--undo takes back all changes, or (GROUP NAME --undo) the last one of one gain")
        return order(station, arguments, UndoGains(ids, name))
    if name and arguments.value is None:
        raise CommandError(f"{name}: which value?")
    read = station.carry_out(ReadGains(ids, group))
    if name:
        good = tuple(one.vehicle for one in read if one.ok)
        request = SetGain(
            good, name, number_argument(arguments.value), sure=arguments.yes, beyond_range=arguments.beyond_range
        )
        ended = carry_out_sure(station, request, f"set {name} = {arguments.value}") if good else []
        second = {one.vehicle: one for one in ended}
        return tell([second.get(one.vehicle, one) for one in read], arguments)
    return tell_lines(read, _gain_lines, arguments, "gains")


def _gain_lines(one: VehicleOutcome) -> Iterator[str]:
    for row in one.result.gains:
        was = f"  was {', '.join(map(shown, row.former))}" if row.former else ""
        yield f"{one.vehicle:>4} {row.group:<9} {row.name:<16} {shown(row.value)}{was}"
    if one.result.missing:
        yield f"vehicle {one.vehicle} has no {', '.join(one.result.missing)}"


# ---------------------------------------------------------------- airframe


def run_airframe(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print a vehicle's airframe and the possible ones, or set another."""
    ids = vehicle_ids(arguments.ids)
    if arguments.act == "list":
        return _choices(station, ids, arguments)
    if arguments.act == "set":
        return _choose(station, ids, arguments)
    if arguments.words:
        raise CommandError("say `list`, or `set` and what it is")
    ended = station.carry_out(ReadAirframe(ids))
    return tell_lines(
        ended,
        lambda one: (_airframe_line(one.vehicle, row) for row in one.result.airframe),
        arguments,
        "airframe",
    )


def _airframe_line(vehicle: int, row: AirframeRow) -> str:
    choice = "not known" if row.value is None else f"{row.value} {row.choices.get(row.value, '(no name here)')}"
    return f"{vehicle:>4} {row.label:<9} {choice}  ({row.param})"


def _choices(station: StationClient, ids: tuple[int, ...], arguments: argparse.Namespace) -> int:
    reply = station.ask(GetAirframes(ids))
    lines = (
        f"{row.vehicle:>4} {row.label:<9} {value:>6} {name}"
        for row in reply.airframes
        for value, name in sorted(row.choices.items())
    )
    entries = reports_by_vehicle(
        reply, ids, lambda vehicle: {"airframes": [row for row in reply.airframes if row.vehicle == vehicle]}
    )
    return tell_reply(arguments, reply, lines, entries)


def _choose(station: StationClient, ids: tuple[int, ...], arguments: argparse.Namespace) -> int:
    if not arguments.words:
        raise CommandError("which airframe? `list` shows the choices, with their labels")
    warnings = dict.fromkeys(row.warning for row in station.ask(GetAirframes(ids)).airframes)
    act = f"airframe {' '.join(arguments.words)} for {listed(ids)}" + "".join(f" ({words})" for words in warnings)
    return order(station, arguments, ChooseAirframe(ids, tuple(arguments.words)), act)


# ---------------------------------------------------------------- motors


def run_motor_test(station: StationClient, arguments: argparse.Namespace) -> int:
    """Turn one motor of one vehicle; Ctrl-C stops it."""
    vehicle = only_one(arguments.ids, "for one motor")
    known = station.ask(GetVehicles((vehicle,))).vehicles
    motor = motor_word(known[0].autopilot if known else "", arguments.motor)
    turn = f"turn {motor} of vehicle {vehicle} with {arguments.throttle:g} % for {arguments.seconds:g} s"
    request = TestMotor((vehicle,), arguments.motor, arguments.throttle / 100, arguments.seconds, props_removed=True)
    return order(station, arguments, request, f"{turn}: are ALL its propellers OFF", PromptGuide(station))
