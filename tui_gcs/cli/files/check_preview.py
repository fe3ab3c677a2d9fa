"""`tui-gcs check SCENARIO --preview`: what its planners would achieve in each round, as on the plan screen."""

import math
from collections.abc import Iterator

from msgspec.structs import replace

from tui_gcs.cli.files.bounded import TimeUsedUp, bounded
from tui_gcs.cli.files.check_lines import AUTOPILOTS, NOTE, WORDS, FindingLine
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.registry import off_course_m
from tui_gcs.core.flight.planner_tasks import crewed, crews
from tui_gcs.core.geometry.zones import area_m2
from tui_gcs.core.judging.team_separation import findings, summary
from tui_gcs.core.mavlink.enum_names import autopilot_name
from tui_gcs.core.missions.scenario_findings import ScenarioFinding, preview_findings
from tui_gcs.core.protocol.common import FleetFrame, PlannerTask, PreviewResult, PreviewTask
from tui_gcs.core.scenario.model import Round, Scenario
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.preview import preview

MAX_S, MAX_BYTES = 20.0, 400_000_000
"""Processor time and memory for one team's preview."""
MAX_FOOTPRINTS = 2000
"""Footprints that fill a zone. A patrol with 1600 needs about 4 s and 230 MB, one with 24,000 12 s and 820 MB."""


def preview_lines(scenario: Scenario, autopilot: str) -> list[FindingLine]:
    """Return the preview of every round, with all vehicles at their take-off places.

    Teams with an unknown planner are left out. `autopilot` is a key of `AUTOPILOTS`: the better it keeps to its course,
    the wider apart a patrol's lanes may be.
    """
    number = AUTOPILOTS[autopilot]
    off_m = off_course_m(number)
    lines = [
        FindingLine(WORDS[finding.level], round_.name, ": ".join(filter(None, (finding.text, finding.detail))))
        for round_ in scenario.rounds
        for finding in _round(scenario, round_, off_m)
    ]
    told = f"planned for {autopilot_name(number)}, up to {off_m:g} m beside its course (--autopilot)"
    return [*lines, FindingLine(NOTE, "preview", told)]


def _round(scenario: Scenario, round_: Round, off_m: float) -> Iterator[ScenarioFinding]:
    crew_of, nobody = crews(scenario), FleetFrame(seq=0, t_s=0.0, wall_s=0.0, kind=RunKind.SIM)
    starts_m = {vehicle: place.place_m for crew in crew_of.values() for vehicle, place in crew.items()}
    ways = {}
    for team in scenario.teams:
        if team.planner not in registry.names():
            continue
        task = replace(crewed(scenario, round_, team, crew_of[team.name]), off_course_m=off_m)
        found = _preview(PreviewTask(0, task, nobody, starts_m=starts_m), task)
        yield from preview_findings(found)
        if found.ways is not None:
            ways[team.name] = found.ways
    yield from summary(findings(ways, scenario.limits))


def _preview(ask: PreviewTask, task: PlannerTask) -> PreviewResult:
    """The preview of one team, within limits; a failed one with what is too fine."""
    area = area_m2(task.zone.shape)
    smallest_m = math.sqrt(area / (math.pi * MAX_FOOTPRINTS))
    fine = f"a footprint of {task.footprint_radius_m:g} m radius in a zone of {area:.0f} m2"
    if task.footprint_radius_m < smallest_m:
        text = f"{fine} is too fine to plan: {math.ceil(100 * smallest_m) / 100:g} m at least"
        return PreviewResult(task.team, ask.number, "failed", text=text)
    try:
        with bounded(MAX_S, MAX_BYTES):
            return preview(ask, {})
    except TimeUsedUp:
        text = f"not planned within {MAX_S:.0f} s of computing: {fine} may be too fine"
    except MemoryError:
        text = f"not planned with {MAX_BYTES // 1_000_000} MB: {fine} may be too fine"
    return PreviewResult(task.team, ask.number, "failed", text=text)
