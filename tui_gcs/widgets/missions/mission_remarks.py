"""What the missions screen says below its lists: what is wrong, where ways meet, how far the draft is from its file."""

from collections.abc import Sequence

from tui_gcs.core.missions.draft import MissionHistory
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_text import clock, conflict_text, distance, of_vehicle

_SIGNS = {
    FindingLevel.ERROR: ("! ", Ink.WARNING),
    FindingLevel.CAUTION: ("^ ", Ink.CAUTION),
    FindingLevel.NOTE: ("", Ink.TEXT),
}


def mission_remarks(editor: MissionEditor, problem: str, told: Sequence[Remark]) -> list[Remark]:
    """All there is to say of the edited vehicle, the most urgent first; then of the others."""
    said = [Remark(f"! {problem}", Ink.CAUTION)] if problem else []
    said += told
    look, vehicle = editor.forecast, editor.vehicle
    own = of_vehicle(look.conflicts, vehicle)
    others = [conflict for conflict in look.conflicts if conflict not in own]
    said += [Remark(f"! {conflict_text(c)}", Ink.WARNING) for c in own if c.together]
    for finding in look.findings(vehicle):
        sign, ink = _SIGNS[finding.level]
        said.append(Remark(sign + str(finding), ink))
    said += [Remark(f"^ {conflict_text(c)}", Ink.CAUTION) for c in own if not c.together]
    said += [Remark(conflict_text(c), Ink.WARNING if c.together else Ink.TEXT) for c in others]
    way = look.way(vehicle)
    if not way.is_empty and not said:
        left = look.battery_left_pct(vehicle)
        text = f"ok: {distance(way.length_m)} in {clock(way.duration_s)}, battery {left:.0f} % at the end"
        said.append(Remark(text, Ink.NORMAL))
    if not way.is_empty:
        craft = look.performance
        assumed = f"assumed: {craft.speed_m_s:g} m/s, no wind, {craft.endurance_s / 60:g} min on a full battery"
        east_m, north_m = look.member(vehicle).home.place_m
        home = f"home E {east_m:.0f} N {north_m:.0f} m, {look.member(vehicle).home.amsl_m:.0f} m above the sea"
        said.append(Remark(f"{assumed}; all begin together; {home}", Ink.MUTED))
    return said


def state_remark(history: MissionHistory) -> Remark:
    """How far the draft is from its file."""
    if history.draft.is_empty and not history.unsaved:
        return Remark("nothing planned", Ink.MUTED)
    if history.unsaved:
        return Remark("missions not saved", Ink.CAUTION)
    return Remark("missions saved", Ink.MUTED)
