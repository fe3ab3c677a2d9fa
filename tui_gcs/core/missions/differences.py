"""How what a vehicle holds differs from what is planned for it, item by item, as its autopilot keeps items."""

from tui_gcs.core.firmware.plans import ARDUPILOT, GENERIC, PX4, PlanDialect
from tui_gcs.core.plan import Plan
from tui_gcs.core.plan_compare import compare

_DIALECTS: dict[str, PlanDialect] = {"Ardu": ARDUPILOT, "PX4": PX4}


def differences(ours: Plan, theirs: Plan, autopilot: str) -> tuple[str, ...]:
    """What is different, one line each; none: it holds the plan. `autopilot` as in fleet frames."""
    dialect = next((d for name, d in _DIALECTS.items() if autopilot.startswith(name)), GENERIC)
    return compare(ours, theirs, dialect).differences
