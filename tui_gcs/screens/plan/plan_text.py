"""What the plan screen reports about a plan: where a zone lies, what a team can reach there. Independent of Textual."""

from collections.abc import Sequence

from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.missions.scenario_findings import (
    ScenarioFinding,
    area_finding,
    preview_findings,
    team_findings,
    unserved,
    zone_finding,
)
from tui_gcs.core.protocol.common import PreviewResult
from tui_gcs.core.scenario.model import Team
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.forms.form_findings import Remark
from tui_gcs.widgets.plan.plan_draft import PlanDraft
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor

INKS = {FindingLevel.NOTE: Ink.TEXT, FindingLevel.CAUTION: Ink.CAUTION, FindingLevel.ERROR: Ink.WARNING}


def _remarks(found: list[ScenarioFinding]) -> list[Remark]:
    """Return the findings as they are shown: details stand below, in a fainter colour."""
    lines = []
    for finding in found:
        lines.append(Remark(finding.text, Ink.NORMAL if finding.is_ok else INKS[finding.level]))
        lines += [Remark(finding.detail, Ink.MUTED)] * bool(finding.detail)
    return lines


WAIT_SHOWN_S = 3
"""From this time on the operator sees how long a planner has been working: it is not stuck."""


def preview_remarks(team: Team, found: PreviewResult | None, idleness_s: float, waited_s: int = 0) -> list[Remark]:
    """Return what the planner would make of the round, or that it has worked on it for `waited_s`.

    `idleness_s` is above 0 if the request was how many vehicles reach this worst idleness.
    """
    if found is None:
        return []
    if found.state == "running":
        what = f"how many for {idleness_s:g} s?" if idleness_s else "planning"
        so_long = f" {waited_s} s" if waited_s >= WAIT_SHOWN_S else ""
        return [Remark(f"{team.name}: {what} ...{so_long}", Ink.MUTED)]
    lines = _remarks(preview_findings(found))
    if idleness_s and found.state == "done":
        more = found.vehicles - team.size
        words = "as it has" if not more else f"{abs(more)} {'more' if more > 0 else 'fewer'} than it has"
        lines.insert(0, Remark(f"{team.name}: {found.vehicles} vehicles for {idleness_s:g} s, {words}", Ink.BOLD))
    return lines


def meeting_remarks(found: Sequence[ScenarioFinding]) -> list[Remark]:
    """Return where a team and others come near each other: all grave findings, else the first, which is the nearest."""
    grave = [finding for finding in found if finding.level > FindingLevel.NOTE]
    return _remarks(grave or list(found[:1]))


def remarks(
    model: ScenarioEditor, draft: PlanDraft, refusal: str, glyphs: GlyphSet, previewed: Sequence[Remark] = ()
) -> list[Remark]:
    """Return all remarks about the edited zone and team, the most urgent first; `previewed` follow what is wrong."""
    scenario, current = model.scenario, model.current_round
    if scenario is None or current is None:
        return []
    lines = [Remark(f"! refused: {line}", Ink.WARNING) for line in refusal.splitlines()]
    if draft.problems:
        return [*lines, *(Remark(f"! {line}", Ink.CAUTION) for line in draft.problems)]
    zone, team = draft.zone, draft.team
    found = [zone_finding(zone, current.area) if zone is not None else area_finding(current)]
    found += unserved(scenario, zone) if zone is not None else []
    found += team_findings(scenario, current, team, glyphs.times) if team is not None else []
    found.sort(key=lambda finding: -finding.level)
    wrong = [finding for finding in found if finding.level > FindingLevel.NOTE]
    return [*lines, *_remarks(wrong), *previewed, *_remarks(found[len(wrong) :])]


def state_remark(model: ScenarioEditor) -> Remark:
    """Return how far the copy is from what the station flies, and from the file."""
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
