"""The contents of a file of any format: plans, drawings, parameters, and what was lost on the way.

Readers turn bytes into a `Content`, writers turn a `Content` into bytes. Two kinds of remarks go with it: a loss is
something in the file that is not in the result, a note is something to know. Both are one line each.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind


class FormatError(Exception):
    """A file cannot be read, or a format cannot hold something; the message is one line with what and where."""


@dataclass(frozen=True, slots=True)
class Home:
    """The place where a vehicle is to start; `amsl_m` is NaN where a file does not give it."""

    lat_deg: float
    lon_deg: float
    amsl_m: float = math.nan


Place = tuple[float, float, float | None]
"""Latitude and longitude in degrees, height in metres or None."""
Heights = Literal["none", "home", "ground", "amsl"]
"""What the heights of a drawing are above."""


@dataclass(frozen=True)
class Drawing:
    """A point, a path or an area of a geographic file."""

    kind: Literal["point", "line", "area"]
    name: str
    places: tuple[Place, ...]
    """The places; of an area its border, not closed."""
    holes: tuple[tuple[Place, ...], ...] = ()
    heights: Heights = "none"
    facts: Mapping[str, str] = field(default_factory=dict)
    """Named properties from the file, as far as they are known here (`drawings`)."""


@dataclass(frozen=True, slots=True)
class ParamLine:
    """One parameter of a file. What only some formats hold is None elsewhere."""

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
    """For each entry of its mission's `items`: index of its first item in the flat mission, number of its items."""


@dataclass(frozen=True)
class Content:
    """The contents of a file. A plan that the format cannot hold is None; one that it holds may be empty."""

    mission: Plan | None = None
    fence: Plan | None = None
    rally: Plan | None = None
    home: Home | None = None
    drawings: tuple[Drawing, ...] = ()
    params: tuple[ParamLine, ...] = ()
    source: QgcSource | None = None
    autopilot: int | None = None
    """The MAV_AUTOPILOT that a plan was made for."""
    left_out: tuple[str, ...] = ()
    """What is in the file and not in here, one line each."""
    notes: tuple[str, ...] = ()
    not_flown: tuple[str, ...] = ()
    """Parts of the mission that have no items. Without them it is another mission, so it must not be flown."""

    def plan(self, kind: PlanKind) -> Plan | None:
        """The plan of one kind."""
        return (self.mission, self.fence, self.rally)[kind]

    @property
    def plans(self) -> tuple[Plan, ...]:
        """The plans with items, in the order in which they are uploaded: the fence first."""
        # A vehicle should have its fence before it gets a mission to fly.
        found = (self.fence, self.rally, self.mission)
        return tuple(plan for plan in found if plan is not None and plan.items)


@dataclass(frozen=True)
class Written:
    """A file to be written, with its losses and notes."""

    data: bytes
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def place_item(
    command: int, frame: int, lat_deg: float, lon_deg: float, height_m: float = 0.0, param1: float = 0.0
) -> PlanItem:
    """Return an item of a plan at a place in degrees; `param1` is the radius of a circle, or a border's corners."""
    x, y = round(lat_deg * 1e7), round(lon_deg * 1e7)
    return PlanItem(command, frame, (param1, 0.0, 0.0, 0.0), x, y, height_m)


def counted(count: int, one: str, many: str = "") -> str:
    """Format a count with its noun: 1 item, 3 items."""
    return f"{count} {one if count == 1 else many or one + 's'}"
