"""Conversion between plans and the rows in which they travel on the bus."""

from collections.abc import Iterable

from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol.services import PlanRow


def plan_rows(plan: Plan) -> tuple[PlanRow, ...]:
    """The rows in which a plan travels."""
    return tuple(PlanRow(i.command, i.frame, i.params, i.x, i.y, i.z, i.autocontinue) for i in plan.items)


def plan_of(kind: PlanKind, rows: Iterable[PlanRow]) -> Plan:
    """The plan in these rows; `core/plans` checks whether it makes sense."""
    return Plan(kind, tuple(PlanItem(r.command, r.frame, r.params, r.x, r.y, r.z, r.autocontinue) for r in rows))
