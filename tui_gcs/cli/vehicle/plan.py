"""`tui-gcs vehicle plan …`: missions, fences and rally points."""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec

from tui_gcs.cli.command_report import VehicleReport, finish, of_vehicles
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.file_access import read_any
from tui_gcs.cli.vehicle.files import write_here
from tui_gcs.cli.vehicle.mode_shell_reboot import carry_out_sure
from tui_gcs.cli.vehicle.plan_findings import warnings
from tui_gcs.cli.vehicle.station_client import (
    StationClient,
    VehicleOutcome,
    confirmed,
    not_sent,
    order,
    say,
    say_outcomes,
    tell,
    tell_lines,
)
from tui_gcs.cli.vehicle_numbers import listed, only_one, vehicle_ids
from tui_gcs.core.formats.content import Content, FormatError, Home
from tui_gcs.core.formats.conversion import ConversionOptions, convert
from tui_gcs.core.formats.file_types import BY_NAME, Family, family_of, format_of
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.plans.check import check
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol.services import ClearPlan, DownloadPlan, GetVehicles, UploadPlan
from tui_gcs.core.protocol.setup import SetCurrentItem
from tui_gcs.core.requests.plan_rows import plan_of, plan_rows


def run(station: StationClient, arguments: argparse.Namespace) -> int:
    """Run one of the actions on plans."""
    actions = {"show": _show, "clear": _clear, "upload": _upload, "download": _download, "current": _current}
    return actions[arguments.act](station, arguments)


def _kind(arguments: argparse.Namespace) -> PlanKind:
    return PlanKind[(arguments.kind or "mission").upper()]


def _show(station: StationClient, arguments: argparse.Namespace) -> int:
    ended = station.carry_out(DownloadPlan(vehicle_ids(arguments.ids), arguments.kind))
    return tell_lines(ended, partial(_lines, _kind(arguments)), arguments, "plan")


def _lines(kind: PlanKind, one: VehicleOutcome) -> Iterator[str]:
    if one.ok:
        rows = one.result.plan or ()
        note = f" ({one.text})" if one.text else ""
        yield f"vehicle {one.vehicle}: {kind.word} of {len(rows)} items{note}"
        yield from (_line(index, item) for index, item in enumerate(plan_of(kind, rows).items, 1))


def _line(index: int, item: PlanItem) -> str:
    params = " ".join(f"{value:g}" for value in item.params)
    place = f"{item.lat_deg:.7f} {item.lon_deg:.7f}" if item.holds_degrees else f"{item.x} {item.y}"
    return f"{index:>5}  command {item.command:<5} frame {item.frame:<2}  {place}  z {item.z:g}  [{params}]"


def _clear(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    return order(station, arguments, ClearPlan(ids, arguments.kind), f"clear the {arguments.kind} of {listed(ids)}")


def _current(station: StationClient, arguments: argparse.Namespace) -> int:
    request = SetCurrentItem(vehicle_ids(arguments.ids), arguments.item, sure=arguments.yes, meet=arguments.meet)
    return tell(carry_out_sure(station, request, f"go on with item {arguments.item}"), arguments)


def _upload(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    content = _read(arguments, px4=_all_px4(station, ids))
    plans = _chosen(content, arguments)
    if not arguments.json:
        for note in (*content.notes, *content.left_out):
            say(f"{arguments.file}: {note}")
    warned = warnings(station, ids, plans, may_meet=arguments.meet)
    act = f"replace the {' and the '.join(plan.kind.word for plan in plans)} of {listed(ids)}"
    act += " also while it is flown" * arguments.in_flight + " all the same" * bool(warned)
    if not confirmed(act, yes=arguments.yes, vehicles=len(ids)):
        return not_sent(arguments)
    ended: list[VehicleOutcome] = []
    for plan in plans:  # what failed to take its fence gets no mission
        left = tuple(v for v in ids if all(one.ok for one in ended if one.vehicle == v))
        if not left:
            break
        done = station.carry_out(UploadPlan(left, plan.kind.word, plan_rows(plan), in_flight=arguments.in_flight))
        if len(plans) > 1:
            for one in done:
                one.text = f"{plan.kind.word}: {one.text or ('done' if one.ok else 'no reason was given')}"
        ended += done
    if not arguments.json:
        say_outcomes(ended)
    notes = {"notes": [*content.notes, *content.left_out]}
    return finish(arguments, of_vehicles((_together(v, ended) for v in ids), data=notes))


def _together(vehicle: int, ended: Sequence[VehicleOutcome]) -> VehicleReport:
    """Return one result for the plans that were sent to a vehicle one after the other, with the code of the last."""
    reports = [one.report() for one in ended if one.vehicle == vehicle]
    text = "; ".join(filter(None, (report.text for report in reports)))
    return msgspec.structs.replace(reports[-1], text=text)


def _all_px4(station: StationClient, ids: tuple[int, ...]) -> bool:
    return {info.autopilot for info in station.ask(GetVehicles(ids)).vehicles} == {"PX4"}


def _read(arguments: argparse.Namespace, *, px4: bool) -> Content:
    """Return the plans of a file that can be flown as they are, by PX4s or by others. Raises `CommandError`."""
    content = read_any(Path(arguments.file), arguments.kind, arguments.home_line, px4=px4)
    if not isinstance(content, Content) or family_of(content) is not Family.PLAN:
        raise CommandError(f"{arguments.file}: holds no plan for a vehicle; `tui-gcs convert` may make one of it")
    return content


def _chosen(content: Content, arguments: argparse.Namespace) -> list[Plan]:
    """Return the plans to send, a fence first. Raises `CommandError`."""
    if arguments.kind is not None:
        one = content.plan(_kind(arguments))
        plans = [one] if one is not None else []
    else:  # an empty part of a file with several says nothing; one alone is meant
        alone = [plan for kind in PlanKind if (plan := content.plan(kind)) is not None]
        plans = list(content.plans) or (alone if len(alone) == 1 else [])
    if not plans:
        raise CommandError(f"{arguments.file}: there is no {arguments.kind or 'plan'} in it")
    for plan in plans:
        if plan.kind is PlanKind.MISSION and content.not_flown:
            what = f"{content.not_flown[0]}: its way is not in the file; save it as way-points in QGroundControl"
            raise CommandError(f"{arguments.file}: {what}")
        if problems := check(plan):
            raise CommandError(f"{arguments.file}: {plan.kind.word}: {problems[0]}")
    return plans


def _download(station: StationClient, arguments: argparse.Namespace) -> int:
    vehicle = only_one(arguments.ids, "for one file")
    target = format_of(arguments.file) or BY_NAME["wpl"]
    if target.family is not Family.PLAN:
        raise CommandError(f"{arguments.file}: .plan, .json or QGC WPL 110; `tui-gcs convert` makes others of them")
    kinds = list(PlanKind) if target.name == "plan" and arguments.kind is None else [_kind(arguments)]
    plans: dict[PlanKind, Plan] = {}
    for kind in kinds:
        ended = station.carry_out(DownloadPlan((vehicle,), kind.word))
        if not ended[0].ok:
            return tell(ended, arguments)
        plans[kind] = plan_of(kind, ended[0].result.plan or ())
    content = Content(plans.get(PlanKind.MISSION), plans.get(PlanKind.FENCE), plans.get(PlanKind.RALLY))
    infos = station.ask(GetVehicles((vehicle,))).vehicles
    if infos:
        home = Home(*infos[0].home) if infos[0].home is not None else None
        content = replace(content, home=home, autopilot=_AUTOPILOTS.get(infos[0].autopilot, 0))
    try:
        written = convert(content, target, ConversionOptions(kind=kinds[0] if len(kinds) == 1 else None))
    except FormatError as error:
        raise CommandError(f"{arguments.file}: {error}") from None
    if not write_here(Path(arguments.file), written.data, yes=arguments.yes):
        return not_sent(arguments)
    counts = " and ".join(f"{kind.word} of {len(plan.items)} items" for kind, plan in plans.items())
    lost = "".join(f"; left out: {text}" for text in written.left_out)
    return tell([VehicleOutcome(vehicle, not lost, f"{counts} written to {arguments.file}{lost}")], arguments)


_AUTOPILOTS = {"PX4": AUTOPILOT_PX4, "ArduCopter": AUTOPILOT_ARDUPILOT, "ArduPilot": AUTOPILOT_ARDUPILOT}
"""The autopilots' names on the command line, and their MAV_AUTOPILOT."""
