"""What files hold, whatever their format: plans, drawings, parameters, and what was lost on the way.

Readers turn bytes into a `Content`, writers a `Content` into bytes. Two kinds of remarks go with it: a loss is
something that was in the file and is not in the result; a note is something to know. Both are one line each.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from tui_gcs.core.plans.model import Plan, PlanKind


class FormatError(Exception):
    """A file that cannot be read, or something that a format cannot hold at all: one line with what and where."""


@dataclass(frozen=True, slots=True)
class Home:
    """Where a vehicle is to start; `amsl_m` is NaN where a file does not say it."""

    lat_deg: float
    lon_deg: float
    amsl_m: float = math.nan


Place = tuple[float, float, float | None]
"""Latitude, longitude in degrees, height in metres or None."""
Heights = Literal["none", "home", "ground", "amsl"]
"""What the heights of a drawing are above."""


@dataclass(frozen=True)
class Drawing:
    """A point, a path or an area of a geographic file."""

    kind: Literal["point", "line", "area"]
    name: str
    places: tuple[Place, ...]
    """Of an area its border, not closed."""
    holes: tuple[tuple[Place, ...], ...] = ()
    heights: Heights = "none"
    facts: Mapping[str, str] = field(default_factory=dict)
    """What the file says of it by name, as far as it is known here (`drawings.FACTS`)."""


@dataclass(frozen=True, slots=True)
class ParamLine:
    """One parameter of a file; what only some formats say is None elsewhere."""

    name: str
    value: int | float
    type: int | None = None
    """MAV_PARAM_TYPE."""
    system: int | None = None
    component: int | None = None


@dataclass(frozen=True)
class QgcSource:
    """A `.plan` as it was read, so that writing it again keeps what is not understood here."""

    document: dict[str, Any]
    blocks: tuple[tuple[int, int], ...]
    """For each entry of its mission's `items`: index of its first item in the flat mission, and how many it became."""


@dataclass(frozen=True)
class Content:
    """What a file holds. A plan that a file cannot hold is None; one that it holds, empty, is empty."""

    mission: Plan | None = None
    fence: Plan | None = None
    rally: Plan | None = None
    home: Home | None = None
    drawings: tuple[Drawing, ...] = ()
    params: tuple[ParamLine, ...] = ()
    source: QgcSource | None = None
    autopilot: int | None = None
    """MAV_AUTOPILOT that a plan was made for."""
    left_out: tuple[str, ...] = ()
    """What is in the file and not in here."""
    notes: tuple[str, ...] = ()
    not_flown: tuple[str, ...] = ()
    """Parts of the mission that have no items: a mission without them is another one, and must not be flown."""

    def plan(self, kind: PlanKind) -> Plan | None:
        """One of the three."""
        return (self.mission, self.fence, self.rally)[kind]

    @property
    def plans(self) -> tuple[Plan, ...]:
        """Those with items, in the order in which they are uploaded: a fence first."""
        found = (self.fence, self.rally, self.mission)
        return tuple(plan for plan in found if plan is not None and plan.items)


@dataclass(frozen=True)
class Written:
    """A file to be written."""

    data: bytes
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def counted(count: int, one: str, many: str = "") -> str:
    """So many of them: 1 item, 3 items."""
    return f"{count} {one if count == 1 else many or one + 's'}"
