"""What an autopilot makes of a plan: what it would refuse, and how the plan on board differs from ours."""

from tui_gcs.core.firmware.plan_dialects import ARDUPILOT, GENERIC, PX4, PlanDialect
from tui_gcs.core.missions.plan_compare import compare
from tui_gcs.core.plans.model import Plan

_DIALECTS: dict[str, PlanDialect] = {"Ardu": ARDUPILOT, "PX4": PX4}


def differences(ours: Plan, theirs: Plan, autopilot: str) -> tuple[str, ...]:
    """Return how the plan on board differs from ours, one line each; empty if it is the same.

    `autopilot` is a name as in fleet frames.
    """
    return compare(ours, theirs, dialect_called(autopilot)).differences


def refusals(plan: Plan, autopilot: str, home_deg: tuple[float, float] | None) -> list[str]:
    """Return why the autopilot would refuse or spoil a plan. `home_deg` is (latitude, longitude), None if unknown."""
    return dialect_called(autopilot).problems(plan, home_deg)


def dialect_called(autopilot: str) -> PlanDialect:
    """Return the dialect of an autopilot named as in fleet frames."""
    return next((dialect for name, dialect in _DIALECTS.items() if autopilot.startswith(name)), GENERIC)
