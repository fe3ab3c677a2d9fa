"""`tui-gcs check missions.json`: the findings of the missions screen's own file, and where missions come too close."""

import argparse
from dataclasses import replace
from pathlib import Path

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.check_lines import AUTOPILOTS, CAUTION, ERROR, NOTE, WORDS, FindingLine
from tui_gcs.cli.files.file_access import round_of
from tui_gcs.core.formats.conversion import BaseScenario
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink.enum_names import autopilot_name
from tui_gcs.core.missions.draft import MissionDraft
from tui_gcs.core.missions.draft_file import DraftFileError, from_bytes
from tui_gcs.core.missions.forecast import Forecast
from tui_gcs.core.missions.planned_vehicles import PlannedVehicle, planned_vehicles
from tui_gcs.core.missions.timed_path import HomePosition
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.widgets.missions.mission_text import clock, conflict_text, distance


def missions_lines(
    path: Path, data: bytes, base: BaseScenario | None, arguments: argparse.Namespace, elevation: Elevation | None
) -> list[FindingLine]:
    """Return the findings, the gravest first.

    `base` is where they are flown. Raises `CommandError` if it cannot be read.
    """
    try:
        saved = from_bytes(data)
    except DraftFileError as error:
        raise CommandError(f"{path.name}: {error}") from None
    look = Forecast()
    look.draft, look.elevation = saved.draft, elevation
    look.performance = saved.performance or look.performance
    notes = _site(look, saved.draft, base, arguments)
    if arguments.autopilot is not None:
        name = autopilot_name(AUTOPILOTS[arguments.autopilot])
        look.vehicles = {v: replace(look.vehicle(v), autopilot=name) for v in saved.draft.vehicles}
    found = [
        FindingLine(WORDS[finding.level], f"vehicle {vehicle}", str(finding))
        for vehicle in saved.draft.vehicles
        for finding in look.findings(vehicle)
    ]
    look.compare_paths()
    found += [FindingLine(ERROR if met.together else CAUTION, "", conflict_text(met)) for met in look.conflicts]
    for vehicle in saved.draft.vehicles:
        way = look.path(vehicle)
        if not way.is_empty:
            left = look.battery_left_pct(vehicle)
            text = f"{distance(way.length_m)} in {clock(way.duration_s)}, battery {left:.0f} % at the end"
            found.append(FindingLine(NOTE, f"vehicle {vehicle}", text))
    return sorted([*found, *notes], key=lambda line: -WORDS.index(line.level))


def _site(
    look: Forecast, draft: MissionDraft, base: BaseScenario | None, arguments: argparse.Namespace
) -> list[FindingLine]:
    """Return the site of the missions: the scenario's area, places and limits, or only where each mission begins."""
    index = round_of(base, arguments.round)
    if base is not None:
        scenario = base.scenario
        look.frame, look.limits = LocalFrame(scenario.origin), scenario.limits
        look.current, look.vehicles = scenario.rounds[index or 0], planned_vehicles(scenario, ())
        return []
    placed = {v: place for v in draft.vehicles if (place := _first(draft, v)) is not None}
    if not placed:
        return []
    first = next(iter(placed.values()))
    look.frame = LocalFrame(Origin(min(max(first.lat_deg, -89.0), 89.0), first.lon_deg, 0.0))
    look.vehicles = {
        v: PlannedVehicle(HomePosition(look.frame.to_enu(p.lat_deg, p.lon_deg))) for v, p in placed.items()
    }
    return [FindingLine(NOTE, "", "where each starts is not known: taken for its first place (--scenario FILE.toml)")]


def _first(draft: MissionDraft, vehicle: int) -> PlanItem | None:
    items = (item for kind in PlanKind for item in draft.of(vehicle).items(kind))
    return next((item for item in items if item.is_place and (item.x or item.y)), None)
