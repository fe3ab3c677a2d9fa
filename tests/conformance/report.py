"""Checks and what they print: one line each, with the measured value."""

import json
import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field

from tests.conformance.field import MAX_AT_ONCE, Failed, Field, NotApplicable
from tests.conformance.tidy import tidy
from tests.conformance.turns import Stopped, TimeUp

Body = Callable[[Field, int], str]
"""A check of one vehicle: gives the measured value, or raises `Failed` or `NotApplicable`."""

LIMIT_SHARE, LIMIT_LEAST_S = 4.0, 90.0
"""A check may take so many times as long as is expected, and so long at least."""


@dataclass(frozen=True)
class Check:
    """One thing that a vehicle and the station must do together."""

    name: str
    body: Body
    takes_s: float
    """How long it takes as a rule."""
    fleet: bool = False
    """Judged once for the fleet (the body gets the first id), not for a vehicle."""

    @property
    def limit_s(self) -> float:
        """How long it may take."""
        return max(LIMIT_LEAST_S, LIMIT_SHARE * self.takes_s)


CHECKS: list[Check] = []


def check(name: str, *, takes_s: float = 5.0, fleet: bool = False) -> Callable[[Body], Body]:
    """Register a check under a name; checks run in the order of their modules."""

    def add(body: Body) -> Body:
        CHECKS.append(Check(name, body, takes_s, fleet))
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
    took_s: float = 0.0

    def __str__(self) -> str:
        """One line for the terminal."""
        return f"{self.verdict:4} {self.name:44} vehicle {self.vehicle:<3} {self.text}"


@dataclass
class Run:
    """Which checks are made, on whom, and what came of it."""

    field: Field
    checks: Sequence[Check]
    tell: Callable[[Line], None]
    at_once: int = MAX_AT_ONCE
    lines: list[Line] = field(default_factory=list)

    @property
    def expected_s(self) -> tuple[float, float]:
        """How long it takes as a rule, and at most."""
        groups = -(-len(self.field.ids) // self.at_once)
        turns = [(entry, 1 if entry.fleet else groups) for entry in self.checks]
        return sum(entry.takes_s * n for entry, n in turns), sum(entry.limit_s * n for entry, n in turns)

    def all(self) -> list[Line]:
        """Make them."""
        ids = self.field.ids
        for entry in self.checks:
            vehicles = ids[:1] if entry.fleet else ids
            for first in range(0, len(vehicles), self.at_once):
                if not self.field.turns.stopping:
                    self.one(entry, vehicles[first : first + self.at_once])
        return self.lines

    def one(self, entry: Check, vehicles: Sequence[int]) -> list[Line]:
        """One check on some vehicles at the same time."""
        before = len(self.lines)
        self.field.turns.together([lambda v=v: self._judge(entry, v) for v in vehicles])
        return self.lines[before:]

    def _judge(self, entry: Check, vehicle: int) -> None:
        """As one of several: make it, tidy up, tell."""
        field, began_s = self.field, self.field.clock.now()
        verdict, text = _made(field, entry, vehicle)
        took_s = field.clock.now() - began_s
        left = [why for v in (field.ids if entry.fleet else (vehicle,)) for why in _tidied(field, v)]
        if left:
            verdict, text = "FAIL", "; ".join([text, *left])
        line = Line(verdict, entry.name, vehicle, text, round(took_s, 2))
        self.lines.append(line)
        self.tell(line)


def _made(field: Field, entry: Check, vehicle: int) -> tuple[str, str]:
    field.turns.limit(entry.limit_s)
    try:
        return "PASS", entry.body(field, vehicle)
    except (Failed, TimeUp, Stopped) as failed:
        return "FAIL", str(failed)
    except NotApplicable as why:
        return "N/A", str(why)
    except Exception as error:  # noqa: BLE001 - a fault of this program is the line of one check, not the end of all
        return "FAIL", _fault(error)
    finally:
        field.turns.limit(None)


def _tidied(field: Field, vehicle: int) -> list[str]:
    try:
        return tidy(field, vehicle)
    except (Failed, TimeUp, Stopped) as failed:
        return [f"vehicle {vehicle} is not as it was before: {failed}"]
    except Exception as error:  # noqa: BLE001 - as above
        return [_fault(error)]


def _fault(error: Exception) -> str:
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"the check itself is at fault: {error!r} in {place.name}, line {place.lineno}"


def chosen(words: Iterable[str]) -> list[Check]:
    """Checks whose name contains one of the words; all, if there are none."""
    wanted = [word.casefold() for word in words]
    return [entry for entry in CHECKS if not wanted or any(word in entry.name.casefold() for word in wanted)]


def counts(lines: Sequence[Line]) -> dict[str, int]:
    """How many ended how."""
    return {verdict: sum(1 for line in lines if line.verdict == verdict) for verdict in ("PASS", "FAIL", "N/A")}


def summary(lines: Sequence[Line]) -> str:
    """What is said in the end: what failed once more, and the counts."""
    count = counts(lines)
    failed = [str(line) for line in lines if line.verdict == "FAIL"]
    last = f"{count['PASS']} passed, {count['FAIL']} failed, {count['N/A']} not applicable"
    return "\n".join((["", "failed:", *failed] if failed else []) + ["", last])


def as_json(lines: Sequence[Line], vehicles: Sequence[dict[str, object]], took_s: float) -> str:
    """For scripts."""
    whole = {
        "format": 1,
        "took_s": round(took_s, 1),
        "counts": counts(lines),
        "vehicles": list(vehicles),
        "lines": [asdict(line) for line in lines],
    }
    return json.dumps(whole, indent=1)
