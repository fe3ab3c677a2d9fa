"""`tui-gcs vehicle params save`, `load` and `diff`: parameters of vehicles and files of all three dialects."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from tui_gcs.cli.command_report import VehicleReport, finish, of_vehicles
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.files.file_access import read_any
from tui_gcs.cli.vehicle.files import write_here
from tui_gcs.cli.vehicle.station_client import (
    StationClient,
    VehicleOutcome,
    confirmed,
    not_sent,
    say,
    say_failed,
    tell,
)
from tui_gcs.cli.vehicle_numbers import listed, only_one, vehicle_ids
from tui_gcs.core.base.float32 import shown
from tui_gcs.core.formats.content import Content, FormatError, counted
from tui_gcs.core.formats.parameter_files import holds, parameter_file, values_to_set
from tui_gcs.core.protocol.services import (
    MAX_VALUES,
    MEANT,
    FetchParams,
    GetParams,
    GetVehicles,
    ParamRow,
    SetParams,
)

MAX_UNKNOWN_NAMES = 10
"""A vehicle that lacks more names of a file than this, and more than half of them, runs another autopilot."""


# ---------------------------------------------------------------- from a vehicle


def save(station: StationClient, arguments: argparse.Namespace) -> int:
    """Save all parameters of one vehicle in the dialect that the file's ending names."""
    vehicle = only_one(arguments.ids, "for one file")
    ended = station.carry_out(FetchParams((vehicle,)))
    if not ended[0].ok:
        return tell(ended, arguments)
    reply, info = station.ask(GetParams(vehicle)), station.ask(GetVehicles((vehicle,))).vehicles
    if not reply.complete:
        return tell([VehicleOutcome(vehicle, False, "not all of its parameters came")], arguments)
    who = f"{info[0].autopilot} {info[0].firmware}".strip() if info else ""
    data = parameter_file(arguments.file, vehicle, who, reply.params)
    if not write_here(Path(arguments.file), data, yes=arguments.yes):
        return not_sent(arguments)
    text = f"{len(reply.params)} parameters written to {arguments.file}"
    return tell([VehicleOutcome(vehicle, True, text)], arguments)


# ---------------------------------------------------------------- to vehicles


@dataclass
class ParameterDifference:
    """The differences between one vehicle and a file."""

    vehicle: int
    held: dict[str, ParamRow] = field(default_factory=dict)
    """The vehicle's values of the parameters that differ."""
    wanted: dict[str, int | float] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    """The parameters that the vehicle does not have."""


def diff(station: StationClient, arguments: argparse.Namespace) -> int:
    """Print where vehicles differ from a file; the exit code is 0 if they do not."""
    wanted, _ = _wanted(arguments)
    found, failed = _differences(station, vehicle_ids(arguments.ids), wanted)
    if not arguments.json:
        for one in found:
            _show(one)
        say_failed(failed)
    entries = [*(_report(one) for one in found), *(one.report() for one in failed)]
    return finish(arguments, of_vehicles(sorted(entries, key=lambda entry: entry.vehicle)))


def load(station: StationClient, arguments: argparse.Namespace) -> int:
    """Set on vehicles what differs from a file. Values that a vehicle computes, and its identity, stay."""
    wanted, left_out = _wanted(arguments)
    found, failed = _differences(station, vehicle_ids(arguments.ids), wanted)
    foreign = [one for one in found if len(one.missing) > max(MAX_UNKNOWN_NAMES, len(wanted) // 2)]
    ended = [VehicleOutcome(one.vehicle, False, _of_another(one, len(wanted))) for one in foreign]
    found = [one for one in found if one not in foreign]
    ended += [VehicleOutcome(one.vehicle, not one.missing, _untouched(one)) for one in found if not one.wanted]
    changed = [one for one in found if one.wanted]
    if not arguments.json:
        for text in left_out:
            say(f"{arguments.file}: {text}")
        for one in changed:
            _show(one)
    if changed:
        ids = tuple(one.vehicle for one in changed)
        most = counted(max(len(one.wanted) for one in changed), "parameter")
        act = f"set {'up to ' * (len(ids) > 1)}{most} of {listed(ids)}"
        if not confirmed(act, yes=arguments.yes, vehicles=len(ids)):
            return not_sent(arguments)
    ended += [_set(station, one, beyond_range=arguments.beyond_range) for one in changed]
    return tell(sorted([*failed, *ended], key=lambda one: one.vehicle), arguments)


def _of_another(one: ParameterDifference, names: int) -> str:
    return f"it has no {len(one.missing)} of the file's {names} parameters: a file of another autopilot; none was set"


def _untouched(one: ParameterDifference) -> str:
    return f"it has no {_names(one.missing)}" if one.missing else "holds all of it already"


def _names(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more


def _set(station: StationClient, one: ParameterDifference, *, beyond_range: bool) -> VehicleOutcome:
    """Set a vehicle's parameters a few at a time; failures are reported, and the others go on."""
    bad: list[str] = []
    remark, done = "", 0
    for values in _portions(one.wanted):
        ended = station.carry_out(SetParams((one.vehicle,), values, beyond_range=beyond_range))[0]
        done += len(ended.result.params) if not ended.ok else len(values)
        remark = remark or (ended.text if ended.ok else "")
        if not ended.ok:
            bad.append(ended.text.removesuffix(f": {MEANT}") or "no reason was given")
            if not ended.result.params:
                break  # it does not take any: in the air, or silent
    text = f"{done} of {counted(len(one.wanted), 'parameter')} set"
    missing = [f"it has no {_names(one.missing)}"] * bool(one.missing)
    return VehicleOutcome(one.vehicle, not bad and not missing, "; ".join(filter(None, [text, remark, *bad, *missing])))


def _portions(values: dict[str, int | float]) -> Iterator[dict[str, int | float]]:
    left = iter(values.items())
    while portion := dict(islice(left, MAX_VALUES)):
        yield portion


def _wanted(arguments: argparse.Namespace) -> tuple[dict[str, int | float], tuple[str, ...]]:
    """Return values by name, and the names in the file that are not meant for vehicles. Raises `CommandError`."""
    content = read_any(Path(arguments.file))
    if not isinstance(content, Content):
        raise CommandError(f"{arguments.file}: holds no parameters")
    try:
        return values_to_set(content)
    except FormatError as error:
        raise CommandError(f"{arguments.file}: {error}") from None


def _differences(
    station: StationClient, ids: tuple[int, ...], wanted: dict[str, int | float]
) -> tuple[list[ParameterDifference], list[VehicleOutcome]]:
    """Return the differences of the vehicles that sent all parameters, and the results of those that did not."""
    fetched = station.carry_out(FetchParams(ids))
    found = []
    for one in fetched:
        if not one.ok:
            continue
        reply = station.ask(GetParams(one.vehicle))
        if not reply.complete:
            one.ok, one.text = False, "not all of its parameters came"
            continue
        held = {row.name: row for row in reply.params}
        differing = {name: value for name, value in wanted.items() if name in held and not holds(held[name], value)}
        missing = tuple(name for name in wanted if name not in held)
        found.append(ParameterDifference(one.vehicle, {name: held[name] for name in differing}, differing, missing))
    return found, [one for one in fetched if not one.ok]


def _show(one: ParameterDifference) -> None:
    for name, value in one.wanted.items():
        say(f"{one.vehicle:>4} {name:<16} {shown(one.held[name].value)} -> {shown(value)}")
    if one.missing:
        say(f"{one.vehicle:>4} it has no {_names(one.missing)}")
    if not one.wanted and not one.missing:
        say(f"{one.vehicle:>4} holds all of it")


def _report(one: ParameterDifference) -> VehicleReport:
    values = {name: {"held": one.held[name].value, "file": value} for name, value in one.wanted.items()}
    same = not (one.wanted or one.missing)
    text = "holds all of it" if same else f"{len(one.wanted)} differ, {len(one.missing)} are missing"
    data = {"differ": values, "missing": one.missing}
    return VehicleReport(one.vehicle, same, ReportCode.NONE if same else ReportCode.FAILED, text, data)
