"""`tui-gcs check`: the problems of a scenario, a plan or another file, in the words of the plan screen."""

import argparse
import math
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.common import read_planners
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.files.check_lines import AUTOPILOTS, CAUTION, ERROR, NOTE, PREVIEW_S, WORDS, FindingLine
from tui_gcs.cli.files.file_access import MAX_CELLS, SCENARIO, elevation_of, missions_in, read_any, read_base, round_of
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import Content, counted

if TYPE_CHECKING:
    from tui_gcs.core.formats.conversion import BaseScenario
    from tui_gcs.core.geometry.elevation import Elevation
    from tui_gcs.core.missions.draft import VehicleDraft
    from tui_gcs.core.missions.mission_findings import MissionFinding, MissionSite
    from tui_gcs.core.missions.plan_findings import PlanTarget
    from tui_gcs.core.protocol.planning import PlannerInfo


def run(arguments: argparse.Namespace) -> int:
    """Check the file and print its findings; the exit code is 1 if one of them is an error."""
    path = Path(arguments.file)
    is_scenario = path.name.lower().endswith(SCENARIO)
    if arguments.preview and not is_scenario:
        raise CommandError("--preview is of a scenario (.toml): only planners are foretold")
    if is_scenario and (arguments.scenario or arguments.round):
        raise CommandError("--scenario and --round are of a plan: a scenario is looked at as a whole")
    if arguments.seconds is not None and not arguments.preview:
        raise CommandError("--seconds is of --preview")
    preview = (arguments.autopilot or "ardupilot") if arguments.preview else None
    seconds = PREVIEW_S if arguments.seconds is None else arguments.seconds
    if arguments.planner and not is_scenario:
        raise CommandError("--planner is of a scenario (.toml)")
    planners = read_planners(arguments.planner)
    elevation = elevation_of(arguments.terrain or os.environ.get("TUI_GCS_TERRAIN"))
    lines = (
        scenario_lines(path, preview, planners, elevation, seconds)
        if is_scenario
        else other_lines(path, arguments, elevation)
    )
    errors, cautions = (sum(line.level == level for line in lines) for level in (ERROR, CAUTION))
    counts = [counted(errors, "error")] * bool(errors) + [counted(cautions, "caution")] * bool(cautions)
    text = f"{clean(str(path), MAX_CELLS)}: {', '.join(counts) or 'nothing is wrong'}"
    if not arguments.json:
        _print(lines, text)
    found = [{"level": line.level.lower(), "where": line.where, "text": line.text} for line in lines]
    code = ReportCode.FAILED if errors else ReportCode.NONE
    return finish(arguments, CommandReport(not errors, code, text, {"file": str(path), "findings": found}))


def _print(lines: list[FindingLine], text: str) -> None:
    for line in lines:
        where = f"{clean(line.where, MAX_CELLS)}: " if line.where else ""
        sys.stdout.write(f"{line.level:<8}{where}{clean(line.text, MAX_CELLS)}\n")
    sys.stdout.write(f"\n{text}\n")


# ---------------------------------------------------------------- scenarios


def scenario_lines(
    path: Path,
    preview: str | None = None,
    planners: "dict[str, PlannerInfo] | None" = None,
    elevation: "Elevation | None" = None,
    seconds: float = PREVIEW_S,
) -> list[FindingLine]:
    """Return the findings of a scenario; with `preview` also what its planners would achieve, in so many `seconds`.

    `planners` are those in files, by name; with `elevation` the ground below is looked at, too.
    Raises `CommandError` if the file cannot be read at all.
    """
    from tui_gcs.core.scenario.load import ScenarioError, parse, read_text

    try:
        text = read_text(path)
    except ScenarioError as error:
        raise CommandError(error.problems[0]) from None
    try:
        scenario = parse(text, path.name)
    except ScenarioError as error:
        return [FindingLine(ERROR, "", problem.removeprefix(f"{path.name}: ")) for problem in error.problems]
    from tui_gcs.cli.flights.scenario_options import wrong_gates, wrong_parameters
    from tui_gcs.core.missions.ground_findings import ground_findings
    from tui_gcs.core.missions.scenario_findings import findings  # not for a scenario that cannot be read
    from tui_gcs.core.scenario.fields import nearest
    from tui_gcs.planner.runtime import registry

    found = [
        FindingLine(WORDS[finding.level], where, ": ".join(filter(None, (finding.text, finding.detail))))
        for where, finding in [*findings(scenario), *(ground_findings(scenario, elevation) if elevation else ())]
    ]
    for wrong in (wrong_parameters, wrong_gates):
        found += [FindingLine(ERROR, "", problem) for problem in wrong(scenario, text, planners or {})]
    known = {*registry.names(), *(planners or {})}
    for team in scenario.teams:
        if team.planner not in known:
            near = nearest(team.planner, known)
            unknown = f"planner {team.planner!r} is none of the known ones{near}"
            what = f"{unknown}: it needs --planner FILE.py where it flies"
            found.append(FindingLine(CAUTION, f"team {team.name}", what))
    if preview is not None:
        from tui_gcs.cli.files.check_preview import preview_lines

        found += preview_lines(scenario, preview, seconds)
    return sorted(found, key=lambda line: -WORDS.index(line.level))


# ---------------------------------------------------------------- plans and others


def other_lines(path: Path, arguments: argparse.Namespace, elevation: "Elevation | None") -> list[FindingLine]:
    """Return the findings of the missions screen's own file, or of a file with one plan. Raises `CommandError`."""
    base = read_base(Path(arguments.scenario)) if arguments.scenario is not None else None
    data = missions_in(path)
    if data is None:
        return file_lines(path, base, arguments, elevation)
    from tui_gcs.cli.files.check_missions import missions_lines

    return missions_lines(path, data, base, arguments, elevation)


def file_lines(
    path: Path, base: "BaseScenario | None", arguments: argparse.Namespace, elevation: "Elevation | None"
) -> list[FindingLine]:
    """Return the findings of a file that is not a scenario; `base` is the scenario in which a plan is flown.

    Raises `CommandError` if the file cannot be read at all.
    """
    content = read_any(path, arguments.kind, arguments.home_line, px4=arguments.autopilot == "px4")
    if not isinstance(content, Content):
        return []
    notes = [FindingLine(NOTE, "", text) for text in content.notes]
    lost = [FindingLine(CAUTION, "", f"not kept: {text}") for text in content.left_out]
    if content.drawings:
        return [*_area_lines(content), *lost, *notes, *_drawing_lines(content)]
    if content.params:
        return [*lost, *_param_lines(content), *notes]
    unflown = [FindingLine(ERROR, "mission", f"{part}: its way is not in the file") for part in content.not_flown]
    return [*unflown, *_plan_lines(content, base, arguments, elevation), *lost, *notes]


def _drawing_lines(content: Content) -> list[FindingLine]:
    kinds = {"point": "point", "line": "path", "area": "area"}
    counts = [(sum(d.kind == kind for d in content.drawings), word) for kind, word in kinds.items()]
    return [FindingLine(NOTE, "", ", ".join(counted(count, word) for count, word in counts if count))]


def _area_lines(content: Content) -> list[FindingLine]:
    """Return the problems of a drawing's areas, which may become fences or zones."""
    from tui_gcs.core.missions import fences
    from tui_gcs.core.plans.check import MAX_ITEMS, check
    from tui_gcs.core.plans.model import Plan, PlanKind

    areas = [each for each in content.drawings if each.kind == "area"]
    # A file of 14,000 areas took 1.2 s: how many there are is checked before they become items.
    if len(areas) > MAX_ITEMS:
        return [FindingLine(ERROR, "", f"{len(areas)} areas, at most {MAX_ITEMS} are allowed: none was checked")]
    found = []
    for number, area in enumerate(areas, 1):
        corners = [(place[0], place[1]) for place in area.places]
        where = f"area {number} {area.name}".rstrip()
        found += [
            FindingLine(ERROR, where, problem.text) for problem in check(Plan(PlanKind.FENCE, fences.polygon(corners)))
        ]
    return found


def _param_lines(content: Content) -> list[FindingLine]:
    from tui_gcs.core.formats.params import IDENTITIES, NOT_TO_WRITE

    found = [FindingLine(NOTE, "", counted(len(content.params), "parameter"))]
    for line in content.params:
        if line.name in IDENTITIES:
            text = f"{line.name} is part of a vehicle's identity: on a second one, two answer to one number"
            found.insert(0, FindingLine(CAUTION, "", text))
        elif line.name in NOT_TO_WRITE:
            found.append(FindingLine(NOTE, "", f"{line.name} is reckoned by the vehicle itself"))
    return found


def _plan_lines(
    content: Content, base: "BaseScenario | None", arguments: argparse.Namespace, elevation: "Elevation | None"
) -> list[FindingLine]:
    """Return the findings of a plan: where it leads, and what its autopilot would refuse."""
    from tui_gcs.core.missions.draft import VehicleDraft
    from tui_gcs.core.missions.mission_findings import FindingLevel, findings
    from tui_gcs.core.missions.plan_findings import autopilot_findings, summary
    from tui_gcs.core.missions.timed_path import HomePosition, timed_path
    from tui_gcs.core.plans.model import PlanKind

    items = [plan.items if (plan := content.plan(kind)) is not None else () for kind in PlanKind]
    draft = VehicleDraft(*items)
    if draft.is_empty:
        return [FindingLine(NOTE, "", "nothing is planned in it")]
    target, site = _who(content, draft, base, arguments)
    site = replace(site, elevation=elevation)
    amsl_m = content.home.amsl_m if content.home is not None and not math.isnan(content.home.amsl_m) else 0.0
    way = timed_path(draft.mission, HomePosition(target.start_m, amsl_m), target.frame, site.performance)
    found: list[MissionFinding] = findings(draft, way, site)
    # An autopilot is not asked about items that cannot be read: it would add a refusal for each of them.
    if not any(finding.level is FindingLevel.ERROR for finding in found):
        found = sorted([*found, *autopilot_findings(draft, target)], key=lambda finding: -finding.level)
    lines = [
        FindingLine(WORDS[finding.level], *_place_and_text(finding))
        for finding in (*found, *summary(draft, way, target))
    ]
    if target.home_deg is None:
        lines.append(FindingLine(NOTE, "", "where it starts is not known: taken for its first place (--home LAT,LON)"))
    return lines


def _place_and_text(finding: "MissionFinding") -> tuple[str, str]:
    where = finding.kind.word if finding.item is None else f"{finding.kind.word} {finding.item + 1}"
    return where, finding.text


def _who(
    content: Content, draft: "VehicleDraft", base: "BaseScenario | None", arguments: argparse.Namespace
) -> "tuple[PlanTarget, MissionSite]":
    """Return the vehicle that would fly the plan and the site in which the plan is judged."""
    from tui_gcs.core.firmware.plan_dialects import dialect_for
    from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
    from tui_gcs.core.missions.mission_findings import MissionSite
    from tui_gcs.core.missions.plan_findings import PlanTarget

    index = round_of(base, arguments.round)
    current = base.scenario.rounds[index or 0] if base is not None else None
    home_deg = _home(arguments.home)
    if home_deg is None and content.home is not None:
        home_deg = (content.home.lat_deg, content.home.lon_deg)
    placed = (item for item in (*draft.mission, *draft.fence, *draft.rally) if item.is_place and (item.x or item.y))
    first = next(((item.lat_deg, item.lon_deg) for item in placed), (0.0, 0.0))
    lat_deg, lon_deg = home_deg or first
    # The frame of a scenario ends a degree from the poles (`scenario/load.py`).
    origin = base.scenario.origin if base is not None else Origin(min(max(lat_deg, -89.0), 89.0), lon_deg, 0.0)
    frame = LocalFrame(origin)
    autopilot = AUTOPILOTS[arguments.autopilot] if arguments.autopilot is not None else content.autopilot
    return PlanTarget(dialect_for(autopilot), frame, home_deg), MissionSite(frame, current)


def _home(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        lat_deg, lon_deg = (float(part) for part in text.split(","))
    except ValueError:
        lat_deg = lon_deg = math.nan
    if not (abs(lat_deg) <= 89 and abs(lon_deg) <= 180):
        raise CommandError(f"--home {text[:40]}: LAT,LON in degrees")
    return lat_deg, lon_deg
