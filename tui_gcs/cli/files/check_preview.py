"""`tui-gcs check SCENARIO --preview`: what its planners would achieve in each round, as on the plan screen."""

from collections.abc import Iterator

from msgspec.structs import replace

from tui_gcs.cli.files.check_lines import AUTOPILOTS, NOTE, WORDS, FindingLine
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.registry import off_course_m
from tui_gcs.core.flight.planner_tasks import crewed, crews
from tui_gcs.core.judging.team_separation import findings
from tui_gcs.core.mavlink.enum_names import autopilot_name
from tui_gcs.core.missions.scenario_findings import ScenarioFinding, preview_findings
from tui_gcs.core.protocol.common import FleetFrame, PreviewTask
from tui_gcs.core.scenario.model import Round, Scenario
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.preview import preview


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
    told = f"planned at once for {autopilot_name(number)}, up to {off_m:g} m beside its course (--autopilot)"
    return [*lines, FindingLine(NOTE, "preview", told)]


def _round(scenario: Scenario, round_: Round, off_m: float) -> Iterator[ScenarioFinding]:
    crew_of, nobody = crews(scenario), FleetFrame(seq=0, t_s=0.0, wall_s=0.0, kind=RunKind.SIM)
    starts_m = {vehicle: place.place_m for crew in crew_of.values() for vehicle, place in crew.items()}
    ways = {}
    for team in scenario.teams:
        if team.planner not in registry.names():
            continue
        task = replace(crewed(scenario, round_, team, crew_of[team.name]), off_course_m=off_m)
        found = preview(PreviewTask(0, task, nobody, starts_m=starts_m), {})
        yield from preview_findings(found)
        if found.ways is not None:
            ways[team.name] = found.ways
    yield from (each.finding for each in findings(ways, scenario.limits))
