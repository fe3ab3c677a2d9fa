"""What the plan screen says about a plan: where a zone lies, what a team can reach there. Plain, no Textual."""

import shapely

from tui_gcs.core.idleness import sweep_bound_s
from tui_gcs.core.scenario import OperatingArea, Round, Scenario, Team
from tui_gcs.core.zones import Role, Zone, area_m2, polygon_of
from tui_gcs.widgets.edit_model import EditModel
from tui_gcs.widgets.glyphs import GlyphSet
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.plan_draft import PlanDraft
from tui_gcs.widgets.verdict import Remark


def place_remark(zone: Zone, area: OperatingArea) -> Remark:
    """Where a valid zone lies with regard to the operating area."""
    outline, border = polygon_of(zone.shape), polygon_of(area.shape)
    if not border.covers(outline):
        return Remark(f"ok: {area_m2(zone.shape):.0f} m2, reaches beyond the operating area", Ink.NORMAL)
    to_edge_m = shapely.distance(outline, border.exterior)
    return Remark(f"ok: {to_edge_m:.0f} m inside the operating area", Ink.NORMAL)


def area_remark(current: Round) -> Remark:
    """What there is in a valid operating area."""
    zones = len(current.zones)
    return Remark(f"ok: {area_m2(current.area.shape) / 1e4:.1f} ha around {zones} zone{'s' * (zones != 1)}", Ink.NORMAL)


def team_remarks(scenario: Scenario, current: Round, team: Team, times: str) -> list[Remark]:
    """What a team's vehicles can at best do in its zone."""
    zone = next((zone for zone in current.zones if zone.name == team.zone), None)
    vehicles = len(team.vehicles) or team.count
    if zone is None or zone.role is Role.NO_FLY or not vehicles:
        return []
    speed_m_s, radius_m = scenario.limits.speed_m_s, scenario.footprint_radius_m
    size_m2 = area_m2(zone.shape)
    bound_s = sweep_bound_s(size_m2, vehicles, speed_m_s, radius_m)
    flown_km = speed_m_s * current.duration_s / 1000.0
    return [
        Remark(f"{team.name}: bound {bound_s:.1f} s worst idleness"),
        Remark(
            f"= {size_m2:.0f} m2 / ({vehicles} {times} {speed_m_s:g} m/s {times} 2 {times} {radius_m:g} m)", Ink.MUTED
        ),
        Remark(f"{flown_km:.1f} km per vehicle in {current.duration_s:g} s"),
    ]


def remarks(model: EditModel, draft: PlanDraft, refusal: str, glyphs: GlyphSet) -> list[Remark]:
    """All there is to say, the most urgent first."""
    scenario, current = model.scenario, model.current_round
    if scenario is None or current is None:
        return []
    said = [Remark(f"! refused: {line}", Ink.WARNING) for line in refusal.splitlines()]
    if draft.problems:
        return [*said, *(Remark(f"! {line}", Ink.CAUTION) for line in draft.problems)]
    zone, team = draft.zone, draft.team
    said.append(place_remark(zone, current.area) if zone is not None else area_remark(current))
    return [*said, *(team_remarks(scenario, current, team, glyphs.times) if team is not None else [])]


def state_remark(model: EditModel) -> Remark:
    """How far the copy is from what the station flies, and from the file."""
    if model.scenario is None:
        return Remark("no scenario yet: waiting for the station", Ink.MUTED)
    if model.newer is not None:
        return Remark("^ based on an older revision: k keep this, d take the station's", Ink.CAUTION)
    if model.changes:
        plural = "s" if model.changes != 1 else ""
        return Remark(
            f"{model.changes} change{plural} not applied" + (", not saved" if model.unsaved else ""), Ink.CAUTION
        )
    return Remark("as flown" + (", not saved" if model.unsaved else ""), Ink.CAUTION if model.unsaved else Ink.MUTED)
