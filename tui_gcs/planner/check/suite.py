"""All checks that need no simulator, in the order in which they run."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from tui_gcs.planner.check.cost import memory, step_time
from tui_gcs.planner.check.declarations import declares, flies, parameters
from tui_gcs.planner.check.determinism import again, order, restart
from tui_gcs.planner.check.robustness import losses, points, sizes, telemetry, tracks, zones
from tui_gcs.planner.check.subject import CheckedPlanner, Finding, PlannerFailure, failed

Check = Callable[[CheckedPlanner], Iterator[Finding]]

CHECKS: dict[str, Check] = {
    "declares": declares,
    "flies": flies,
    "parameters": parameters,
    "same again": again,
    "restart": restart,
    "vehicle order": order,
    "fleet sizes": sizes,
    "loss and join": losses,
    "odd telemetry": telemetry,
    "tracks": tracks,
    "points": points,
    "odd zones": zones,
    "step time": step_time,
    "memory": memory,
}
FIRST = ("declares", "flies")
"""If one of these fails, the others are skipped, for they would fail for the same reason."""


def findings(check: Check, name: str, subject: CheckedPlanner) -> Iterator[Finding]:
    """Yield what `check` finds. A planner that raises fails the check, too."""
    try:
        for finding in check(subject):
            yield replace(finding, check=finding.check or name)
    except PlannerFailure as failure:
        yield failed(str(failure), failure.advice, check=name)
