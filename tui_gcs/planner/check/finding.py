"""What a check found: one line for the author of a planner."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "FAIL", "note"]
"""note: nothing that must hold, but worth knowing."""


@dataclass(frozen=True)
class Finding:
    """`value` is what was measured, `advice` what to do about it (empty where nothing is to be done)."""

    check: str
    verdict: Verdict
    value: str
    advice: str = ""


def passed(check: str, value: str) -> Finding:
    """It holds."""
    return Finding(check, "ok", value)


def failed(check: str, value: str, advice: str) -> Finding:
    """It does not hold."""
    return Finding(check, "FAIL", value, advice)


def noted(check: str, value: str, advice: str = "") -> Finding:
    """Worth knowing."""
    return Finding(check, "note", value, advice)
