"""Checks and what they print: one line each, with the measured value."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tests.conformance.field import Failed, Field, NotApplicable

Body = Callable[[Field, int], str]
"""A check of one vehicle: gives the measured value, or raises `Failed` or `NotApplicable`."""


@dataclass(frozen=True)
class Check:
    """One thing that a vehicle and the station must do together."""

    name: str
    body: Body
    fleet: bool = False
    """Judged once for the fleet (the body gets the first id), not for a vehicle."""


CHECKS: list[Check] = []


def check(name: str, *, fleet: bool = False) -> Callable[[Body], Body]:
    """Register a check under a name; checks run in the order of their modules."""

    def add(body: Body) -> Body:
        CHECKS.append(Check(name, body, fleet))
        return body

    return add


@dataclass(frozen=True)
class Line:
    """How one check ended."""

    verdict: str
    """PASS, FAIL or N/A."""
    name: str
    vehicle: int
    text: str
    took_s: float

    def __str__(self) -> str:
        """One line for the terminal."""
        return f"{self.verdict:4} {self.name:34} vehicle {self.vehicle:<3} {self.text}"


def run_check(field: Field, entry: Check, vehicle: int) -> Line:
    """Run one check on one vehicle."""
    began_s = time.monotonic()
    try:
        verdict, text = "PASS", entry.body(field, vehicle)
    except Failed as failed:
        verdict, text = "FAIL", str(failed)
    except NotApplicable as why:
        verdict, text = "N/A", str(why)
    return Line(verdict, entry.name, vehicle, text, time.monotonic() - began_s)


def run_all(field: Field, names: Iterable[str], tell: Callable[[Line], None]) -> list[Line]:
    """All checks whose name contains one of `names` (all, if empty), on the vehicles of the field."""
    wanted = list(names)
    lines = []
    for entry in CHECKS:
        if wanted and not any(name in entry.name for name in wanted):
            continue
        for vehicle in field.ids[:1] if entry.fleet else field.ids:
            line = run_check(field, entry, vehicle)
            tell(line)
            lines.append(line)
    return lines


def summary(lines: list[Line]) -> str:
    """The last line."""
    count = {v: sum(1 for line in lines if line.verdict == v) for v in ("PASS", "FAIL", "N/A")}
    return f"{count['PASS']} passed, {count['FAIL']} failed, {count['N/A']} not applicable"
