"""The checks of a team by what its planner is for: idleness, coverage, points of interest, intruders."""

import msgspec

from tui_gcs.core.geometry.idleness_bounds import gate_reference
from tui_gcs.core.judging.flight_result import RoundResult
from tui_gcs.core.judging.incursions import IntruderResult
from tui_gcs.core.judging.result_check import ResultCheck, at_least, at_most
from tui_gcs.core.protocol.common import PointOfInterest
from tui_gcs.core.protocol.metric_names import seen_pct
from tui_gcs.core.scenario.model import ResultLimits


def idleness_checks(where: str, r: RoundResult, limits: ResultLimits, why: str) -> list[ResultCheck]:
    """The checks of a planner by which each place is seen again and again."""
    checks = [
        at_most(f"{where}: all on slot, s", r.on_slot_after_s, limits.on_slot_max_s, why),
        at_least(f"{where}: coverage", r.coverage, limits.coverage_min),
        _worst_check(where, r, limits, why),
    ]
    # A planner without slots publishes no place to be at: no intent said where to be when.
    if r.off_slot_max_m is not None or not r.measured_s:
        checks.append(at_most(f"{where}: off slot, m", r.off_slot_max_m, limits.slot_error_max_m, why))
    if (r.off_slot_max_m is not None and not r.stands) or not r.measured_s:
        checks.append(at_most(f"{where}: early or late, s", r.lag_max_s, limits.slot_lag_max_s, why))
    return checks


def _worst_check(where: str, r: RoundResult, limits: ResultLimits, why: str) -> ResultCheck:
    """Worst idleness over the ideal, or over the bound in a zone so narrow that no plan comes near the ideal."""
    reference_s, name = gate_reference(r.ideal_s or 0.0, r.bound_s or 0.0)
    ratio = r.ratio
    if name == "bound" and r.worst_idleness_s is not None:
        ratio = round(r.worst_idleness_s / reference_s, 2)
    return at_most(f"{where}: worst / {name}", ratio, limits.worst_ratio_max, why)


def coverage_checks(where: str, r: RoundResult, limits: ResultLimits) -> list[ResultCheck]:
    """The checks of a planner by which the zone is seen whole once."""
    ratio = r.covered_s / max(r.cover_bound_s, 1.0) if r.covered_s is not None and r.cover_bound_s is not None else None
    why = f"only {seen_pct(r.coverage):.1f} % was seen"
    return [
        at_least(f"{where}: coverage", r.coverage, limits.coverage_min),
        at_most(f"{where}: seen whole after, x bound", ratio, limits.cover_ratio_max, why),
    ]


def task_checks(team: str, points: list[PointOfInterest], tasks_done_min: float) -> list[ResultCheck]:
    """The share of a team's points of interest that was visited in time; none where there was none."""
    points = [point for point in points if point.team in ("", team) and point.state != "cancelled"]
    if not points:
        return []
    done = sum(point.state == "done" for point in points)
    check = at_least(f"{team}: tasks done in time", done / len(points), tasks_done_min)
    return [msgspec.structs.replace(check, why=f"{done} of {len(points)}")]


def intruder_checks(
    rounds: list[RoundResult], counted: list[IntruderResult], intruders_met_min: float
) -> list[ResultCheck]:
    """The share of intruders that was met, of every zone that a planner guards, over all rounds."""
    checks = []
    for zone in dict.fromkeys(r.zone for r in rounds if r.judged_by == "intruders" and not r.cut_short):
        came, met = (sum(getattr(i, what) for i in counted if i.zone == zone) for what in ("came", "met"))
        if came:
            why = f"{met} of {came}"
            share = at_least(f"{zone}: intruders met", met / came, intruders_met_min)
            checks.append(msgspec.structs.replace(share, why=why))
    return checks
