"""What an autopilot makes of plans: what it would refuse, and how what it holds differs from what is planned."""

from tui_gcs.core.firmware.plan_dialects import ARDUPILOT, GENERIC, PX4, PlanDialect
from tui_gcs.core.missions.plan_compare import compare
from tui_gcs.core.plans.model import Plan

_DIALECTS: dict[str, PlanDialect] = {"Ardu": ARDUPILOT, "PX4": PX4}


def differences(ours: Plan, theirs: Plan, autopilot: str) -> tuple[str, ...]:
    """What is different, one line each; none: it holds the plan. `autopilot` as in fleet frames."""
    return compare(ours, theirs, dialect_called(autopilot)).differences


def refusals(plan: Plan, autopilot: str, home_deg: tuple[float, float] | None) -> list[str]:
    """Why the autopilot would refuse or spoil a plan; `home_deg` is (latitude, longitude), None if unknown."""
    return dialect_called(autopilot).problems(plan, home_deg)


def dialect_called(autopilot: str) -> PlanDialect:
    """The dialect of an autopilot as it is called in fleet frames."""
    return next((dialect for name, dialect in _DIALECTS.items() if autopilot.startswith(name)), GENERIC)
