"""`tui-gcs vehicle plan …`: missions, fences, rally points."""

import argparse
from pathlib import Path

from tui_gcs.commands.vehicle_acts import carry_out_sure
from tui_gcs.commands.vehicle_files import read_here, write_here
from tui_gcs.commands.vehicle_station import (
    Ended,
    StationClient,
    confirmed,
    exit_code,
    listed,
    only_one,
    say,
    tell,
    tell_failed,
    vehicle_ids,
)
from tui_gcs.core.messages_services import ClearPlan, DownloadPlan, GetVehicles, UploadPlan
from tui_gcs.core.messages_setup import SetCurrentItem
from tui_gcs.core.plan import PlanItem, PlanKind
from tui_gcs.core.plan_check import check
from tui_gcs.core.plan_files import MOST_BYTES, HomeLine, PlanFileError, read_plan, write_json, write_wpl
from tui_gcs.core.plan_rows import plan_of, plan_rows
from tui_gcs.exits import FAILED, CommandError


def run(station: StationClient, arguments: argparse.Namespace) -> int:
    """Do one of the actions."""
    actions = {"show": _show, "clear": _clear, "upload": _upload, "download": _download, "current": _current}
    return actions[arguments.act](station, arguments)


def _kind(arguments: argparse.Namespace) -> PlanKind:
    return PlanKind[arguments.kind.upper()]


def _show(station: StationClient, arguments: argparse.Namespace) -> int:
    ended = station.carry_out(DownloadPlan(vehicle_ids(arguments.ids), arguments.kind))
    if arguments.json:
        return tell(ended, as_json=True)
    for one in ended:
        if one.ok:
            rows = one.result.plan or ()
            note = f" ({one.text})" if one.text else ""
            say(f"vehicle {one.vehicle}: {arguments.kind} of {len(rows)} items{note}")
            for index, item in enumerate(plan_of(_kind(arguments), rows).items, 1):
                say(_line(index, item))
    tell_failed(ended)
    return exit_code(ended)


def _line(index: int, item: PlanItem) -> str:
    params = " ".join(f"{value:g}" for value in item.params)
    place = f"{item.lat_deg:.7f} {item.lon_deg:.7f}" if item.is_place else f"{item.x} {item.y}"
    return f"{index:>5}  command {item.command:<5} frame {item.frame:<2}  {place}  z {item.z:g}  [{params}]"


def _clear(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    if not confirmed(f"clear the {arguments.kind} of {listed(ids)}", yes=arguments.yes, vehicles=len(ids)):
        return FAILED
    return tell(station.carry_out(ClearPlan(ids, arguments.kind)), as_json=arguments.json)


def _current(station: StationClient, arguments: argparse.Namespace) -> int:
    request = SetCurrentItem(vehicle_ids(arguments.ids), arguments.item, sure=arguments.yes)
    return tell(carry_out_sure(station, request, f"go on with item {arguments.item}"), as_json=arguments.json)


def _upload(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    raw = read_here(Path(arguments.file), MOST_BYTES)
    try:
        read = read_plan(raw.decode("utf-8", "replace"), _kind(arguments), HomeLine(arguments.home_line))
    except PlanFileError as error:
        raise CommandError(f"{arguments.file}: {error}") from None
    if problems := check(read.plan):
        raise CommandError(f"{arguments.file}: {problems[0]}")
    if read.left_out_home and not arguments.json:
        say(f"{arguments.file}: its first line is home, and is not sent (--home-line no: it is an item)")
    act = f"change the {arguments.kind} of {listed(ids)} also while it is flown"
    if arguments.in_flight and not confirmed(act, yes=arguments.yes):
        return FAILED
    request = UploadPlan(ids, arguments.kind, plan_rows(read.plan), in_flight=arguments.in_flight)
    return tell(station.carry_out(request), as_json=arguments.json)


def _download(station: StationClient, arguments: argparse.Namespace) -> int:
    vehicle = only_one(arguments.ids, "for one file")
    ended = station.carry_out(DownloadPlan((vehicle,), arguments.kind))
    if not ended[0].ok:
        return tell(ended, as_json=arguments.json)
    plan = plan_of(_kind(arguments), ended[0].result.plan or ())
    infos = station.ask(GetVehicles((vehicle,))).vehicles
    as_json = arguments.file.lower().endswith(".json")
    text = write_json(plan) if as_json else write_wpl(plan, infos[0].home if infos else None)
    if not write_here(Path(arguments.file), text.encode(), yes=arguments.yes):
        return FAILED
    text = f"{arguments.kind} of {len(plan.items)} items written to {arguments.file}"
    return tell([Ended(vehicle, True, text)], as_json=arguments.json)
