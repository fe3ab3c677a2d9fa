"""`tui-gcs convert missions.json OUT`: the missions of several vehicles become one file for each vehicle."""

import argparse
import sys
from pathlib import Path

from tui_gcs.cli.command_report import VehicleReport, finish, of_vehicles
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.files.file_access import MAX_CELLS, may_write, options_for, put, tell, written_data, written_text
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import Content, FormatError, Written
from tui_gcs.core.formats.conversion import convert
from tui_gcs.core.formats.file_types import Family, Format
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.draft_file import DraftFileError, from_bytes
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.alarms import id_ranges


def convert_missions(arguments: argparse.Namespace, data: bytes, target_format: Format) -> int:
    """Write all files or, if one cannot be made, none; the exit code is 1 if something had to be left out.

    Raises `CommandError`.
    """
    source, target = Path(arguments.source), Path(arguments.target)
    chosen = _chosen(arguments.vehicle, data, source)
    if target_format.family not in (Family.PLAN, Family.DRAWING):
        raise CommandError(f"{source.name}: missions do not become {target_format.text}")
    files = {vehicle: target_for(target, vehicle, alone=len(chosen) == 1) for vehicle in chosen}
    for file in files.values():
        may_write(file, force=arguments.force)
    written = {vehicle: _written(vehicle, draft, arguments, target_format) for vehicle, draft in chosen.items()}
    entries = []
    for vehicle, each in written.items():
        put(files[vehicle], each.data, force=arguments.force)
        text = written_text(files[vehicle], each, target_format.text)
        if not arguments.json:
            tell(each, f"vehicle {vehicle}: ")
            sys.stdout.write(f"vehicle {vehicle}: {text}\n")
        code = ReportCode.FAILED if each.left_out else ReportCode.NONE
        entries.append(VehicleReport(vehicle, not each.left_out, code, text, written_data(files[vehicle], each)))
    return finish(arguments, of_vehicles(entries))


def target_for(target: Path, vehicle: int, *, alone: bool) -> Path:
    """Return `field.plan` for one vehicle, `field-3.plan` for vehicle 3 of several."""
    return target if alone else target.with_name(f"{target.stem}-{vehicle}{target.suffix}")


def _chosen(vehicle: int | None, data: bytes, source: Path) -> dict[int, VehicleDraft]:
    try:
        draft: MissionDraft = from_bytes(data).draft
    except DraftFileError as error:
        raise CommandError(f"{clean(str(source), MAX_CELLS)}: {clean(str(error), MAX_CELLS)}") from None
    if draft.is_empty:
        raise CommandError(f"{source.name}: nothing is planned in it")
    if vehicle is None:
        return dict(draft.vehicles)
    if vehicle not in draft.vehicles:
        there = id_ranges(sorted(draft.vehicles))
        raise CommandError(f"--vehicle {vehicle}: nothing is planned for it in {source.name}; there are: {there}")
    return {vehicle: draft.of(vehicle)}


def _written(vehicle: int, draft: VehicleDraft, arguments: argparse.Namespace, target_format: Format) -> Written:
    mission, fence, rally = (draft.plan(kind) if draft.items(kind) else None for kind in PlanKind)
    try:
        return convert(Content(mission, fence, rally), target_format, options_for(arguments, f"vehicle {vehicle}"))
    except FormatError as error:
        raise CommandError(f"vehicle {vehicle}: {clean(str(error), MAX_CELLS)}; nothing is written") from None
