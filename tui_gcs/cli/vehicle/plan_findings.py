"""The findings that are printed before `tui-gcs vehicle plan upload` sends plans, as on the missions screen."""

import math
import sys
from collections.abc import Iterator, Sequence

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.vehicle.station_client import LINE_CELLS, StationClient
from tui_gcs.cli.vehicle_numbers import listed
from tui_gcs.core.base.text import clean
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions.autopilot_limits import dialect_called
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.missions.mission_findings import FindingLevel, MissionFinding, MissionSite, findings
from tui_gcs.core.missions.plan_findings import PlanTarget, autopilot_findings
from tui_gcs.core.missions.timed_path import HomePosition, timed_path
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol.common import PROTOCOL, GetScenario, Hello
from tui_gcs.core.protocol.services import CompareMission, DownloadPlan, GetOnBoard, GetVehicles, PlanRow, VehicleInfo
from tui_gcs.core.requests.plan_rows import plan_of, plan_rows
from tui_gcs.core.scenario.model import Round

Items = tuple[PlanItem, ...]


def warnings(station: StationClient, ids: Sequence[int], plans: Sequence[Plan], *, may_meet: bool = False) -> int:
    """Print on stderr what speaks against these plans for these vehicles, and return the number of lines.

    A mission is judged against the operating area of the present round, its heights and no-fly zones, and against the
    vehicle's own fence: the one that comes with it, else the one on board. Raises `CommandError` for plans that cannot
    be flown, and without `may_meet` where it would bring one of these vehicles too close to another.
    """
    reply = station.ask(GetScenario())
    status = station.ask(Hello(PROTOCOL, "cli")).status
    origin, current = Origin(0.0, 0.0, 0.0), None
    if reply.scenario is not None and status is not None:
        rounds = reply.scenario.scenario.rounds
        origin, current = reply.scenario.scenario.origin, rounds[min(status.round_index, len(rounds) - 1)]
    whose: dict[str, list[int]] = {}
    fences = _fences(station, ids, plans)
    infos = station.ask(GetVehicles(tuple(ids))).vehicles
    met, not_compared = _meetings(station, ids, plans)
    if met and not may_meet:
        why, vehicles = next(iter(met.items()))
        raise CommandError(
            f"{listed(vehicles)}: {why}: put them at other heights or places; --meet uploads it all the same"
        )
    whose |= met
    if not_compared:
        whose[not_compared] = list(ids)
    for info in infos:
        for line in _finding_lines(info, plans, fences.get(info.id, ()), LocalFrame(origin), current):
            whose.setdefault(line, []).append(info.id)
    for line, vehicles in whose.items():
        sys.stderr.write(f"{listed(vehicles)}: {clean(line, LINE_CELLS)}\n")
    sys.stderr.flush()
    return len(whose)


def _meetings(station: StationClient, ids: Sequence[int], plans: Sequence[Plan]) -> tuple[dict[str, list[int]], str]:
    """Where vehicles with the mission of these plans come too close, by the reason, and what was not compared."""
    mission = next((plan for plan in plans if plan.kind is PlanKind.MISSION), None)
    if mission is None or not mission.items:
        return {}, ""
    reply = station.ask(CompareMission(tuple(ids), plan_rows(mission)))
    met: dict[str, list[int]] = {}
    for result in reply.results:
        if not result.ok:
            met.setdefault(result.text, []).append(result.vehicle)
    return met, reply.text


def _fences(station: StationClient, ids: Sequence[int], plans: Sequence[Plan]) -> dict[int, Items | str]:
    """Return the fence that will hold for each vehicle, or why it is unknown.

    unknown ones are read from the vehicle.
    """
    ours = next((plan.items for plan in plans if plan.kind is PlanKind.FENCE), None)
    if ours is not None or all(plan.kind is not PlanKind.MISSION for plan in plans):
        return dict.fromkeys(ids, ours or ())
    rows = {row.vehicle: row.fence for row in station.ask(GetOnBoard(tuple(ids))).on_board}
    fences: dict[int, Items | str] = {v: _items(held) for v in ids if (held := rows.get(v)) is not None}
    unread = tuple(v for v in ids if v not in fences)
    for one in station.carry_out(DownloadPlan(unread, "fence")) if unread else ():
        fences[one.vehicle] = _items(one.result.plan or ()) if one.ok else one.text
    return fences


def _items(rows: Sequence[PlanRow]) -> Items:
    return plan_of(PlanKind.FENCE, rows).items


def _finding_lines(
    info: VehicleInfo, plans: Sequence[Plan], fence: Items | str, frame: LocalFrame, current: Round | None
) -> Iterator[str]:
    if isinstance(fence, str):
        yield f"its own fence could not be read: {fence}"
        fence = ()
    by_kind = {PlanKind.FENCE: fence} | {plan.kind: plan.items for plan in plans}
    draft = VehicleDraft(*(by_kind.get(kind, ()) for kind in PlanKind))
    home_deg = info.home[:2] if info.home is not None else None
    target = PlanTarget(dialect_called(info.autopilot), frame, home_deg)
    amsl_m = info.home[2] if info.home is not None and math.isfinite(info.home[2]) else 0.0
    site = MissionSite(frame, current, autopilot=info.autopilot, home_deg=home_deg)
    found = findings(
        draft, timed_path(draft.mission, HomePosition(target.start_m, amsl_m), frame, site.performance), site
    )
    sent = {plan.kind for plan in plans}
    wrong = next((each for each in found if each.level is FindingLevel.ERROR and each.kind in sent), None)
    if wrong is not None:
        raise CommandError(f"vehicle {info.id}: {wrong}")
    if current is None:
        yield "not judged by an operating area: the station did not tell its scenario"
    if home_deg is None:
        yield "its home is not known: the way is reckoned from the scenario's origin"
    both: list[MissionFinding] = [*found, *autopilot_findings(draft, target)]
    yield from (str(each) for each in both if each.level > FindingLevel.NOTE and each.kind in sent)
