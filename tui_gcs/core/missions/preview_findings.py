"""What is to be said of a preview: how often a team would see its zone, how near its vehicles would come."""

from math import isfinite

from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.missions.scenario_findings import ScenarioFinding
from tui_gcs.core.protocol.common import PreviewResult


def previewed(found: PreviewResult) -> list[ScenarioFinding]:
    """Of one team's preview that is over."""
    team = found.team
    if found.state == "failed":
        return [ScenarioFinding(FindingLevel.CAUTION, f"{team}: no plan: {found.text}")]
    seen = f"{found.worst_s:.1f} s worst, {found.ratio:.2f} x bound" if isfinite(found.worst_s) else "not all is seen"
    apart = f", separation {found.separation:.2f} x" if isfinite(found.separation) else ""
    said = [ScenarioFinding(FindingLevel.NOTE, f"{team}: {found.vehicles} planned: {seen}{apart}")]
    if found.separation < 1.0:
        said.append(
            ScenarioFinding(FindingLevel.CAUTION, f"^ {team}: two would come too near; the guard would stop them")
        )
    return said
