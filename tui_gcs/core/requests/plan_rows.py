"""Conversion between plans and the rows in which they travel on the bus."""

from collections.abc import Iterable

from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol.services import PlanRow


def plan_rows(plan: Plan) -> tuple[PlanRow, ...]:
    """A plan as it travels."""
    return tuple(PlanRow(i.command, i.frame, i.params, i.x, i.y, i.z, i.autocontinue) for i in plan.items)


def plan_of(kind: PlanKind, rows: Iterable[PlanRow]) -> Plan:
    """What travelled; whether it makes sense is for `plan_check` to say."""
    return Plan(kind, tuple(PlanItem(r.command, r.frame, r.params, r.x, r.y, r.z, r.autocontinue) for r in rows))
