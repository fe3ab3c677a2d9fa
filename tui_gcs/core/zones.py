"""Zones: named regions on the ground with a role, a shape and an optional altitude band.

Positions are ENU metres about the scenario origin (x east, y north).
"""

from enum import StrEnum

import msgspec


class Role(StrEnum):
    """What a zone is for."""

    DEFEND = "defend"
    ATTACK = "attack"
    NO_FLY = "no-fly"


class Circle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="shape", tag="circle"):
    """A disc."""

    centre_m: tuple[float, float]
    radius_m: float


class Rectangle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="shape", tag="rectangle"):
    """`width_m` along east and `height_m` along north at heading 0, then turned clockwise by `heading_deg`."""

    centre_m: tuple[float, float]
    width_m: float
    height_m: float
    heading_deg: float = 0.0


class Polygon(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="shape", tag="polygon"):
    """A simple polygon, at least three vertices, not closed (the last is not the first again)."""

    vertices_m: tuple[tuple[float, float], ...]


Shape = Circle | Rectangle | Polygon


class Zone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A named region with a role."""

    name: str
    role: Role
    shape: Shape
    alt_min_m: float | None = None
    alt_max_m: float | None = None
