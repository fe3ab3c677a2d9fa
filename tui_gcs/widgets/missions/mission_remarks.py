"""The remarks below the lists of the missions screen: problems, conflicts of paths, and the state of the file."""

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


def mission_remarks(editor: MissionEditor, problem: str, report: Sequence[Remark]) -> list[Remark]:
    """Return the remarks about the edited vehicle, the most urgent first, then those about other vehicles.

    `report` is the outcome of the last transfer or comparison.
    """
    lines = [Remark(f"! {problem}", Ink.CAUTION)] if problem else []
    lines += report
    look, vehicle = editor.forecast, editor.vehicle
    own = of_vehicle(look.conflicts, vehicle)
    others = [conflict for conflict in look.conflicts if conflict not in own]
    lines += [Remark(f"! {conflict_text(c)}", Ink.WARNING) for c in own if c.together]
    for finding in look.findings(vehicle):
        sign, ink = _SIGNS[finding.level]
        lines.append(Remark(sign + str(finding), ink))
    lines += [Remark(f"^ {conflict_text(c)}", Ink.CAUTION) for c in own if not c.together]
    lines += [Remark(conflict_text(c), Ink.WARNING if c.together else Ink.TEXT) for c in others]
    path = look.path(vehicle)
    # "ok" stands only where nothing else does.
    if not path.is_empty and not lines:
        left = look.battery_left_pct(vehicle)
        text = f"ok: {distance(path.length_m)} in {clock(path.duration_s)}, battery {left:.0f} % at the end"
        lines.append(Remark(text, Ink.NORMAL))
    if not path.is_empty:
        craft = look.performance
        assumed = f"assumed: {craft.speed_m_s:g} m/s, no wind, {craft.endurance_s / 60:g} min on a full battery"
        east_m, north_m = look.vehicle(vehicle).home.place_m
        home = f"home E {east_m:.0f} N {north_m:.0f} m, {look.vehicle(vehicle).home.amsl_m:.0f} m above the sea"
        lines.append(Remark(f"{assumed}; all begin together; {home}", Ink.MUTED))
    return lines


def state_remark(history: MissionHistory) -> Remark:
    """Return whether the draft is saved."""
    if history.draft.is_empty and not history.unsaved:
        return Remark("nothing planned", Ink.MUTED)
    if history.unsaved:
        return Remark("missions not saved", Ink.CAUTION)
    return Remark("missions saved", Ink.MUTED)
