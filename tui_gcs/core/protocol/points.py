"""Tasks from outside: points of interest that a planner sends vehicles to, and the requests about them.

A point is done when a vehicle of its team has had it within its footprint; the station decides that by where vehicles
were, not by what a planner reports.
"""

import math
from typing import Literal

from tui_gcs.core.protocol.base import Message, Request

MAX_POINTS = 200
"""Points of one station, also those that are done: each travels with every status."""
MAX_POINT_NAME = 32


class NewPoint(Message, frozen=True):
    """A point of interest as it is asked for."""

    name: str
    """Unique among the station's points; "" lets the station choose one."""
    place_m: tuple[float, float]
    """ENU metres."""
    priority: float = 1.0
    """How much it matters beside others, above 0."""
    within_s: float = math.inf
    """The time that is left for it, from when it is added."""
    team: str = ""
    """The team that is to visit it; "": any."""


class PointOfInterest(Message, frozen=True):
    """A point of interest and what has become of it."""

    name: str
    place_m: tuple[float, float]
    priority: float
    team: str
    added_s: float
    """Station time."""
    due_s: float
    """Station time until which it can be done; infinite without a deadline."""
    state: Literal["open", "done", "missed", "cancelled"] = "open"
    ended_s: float = math.nan
    vehicle: int = 0
    """The vehicle that has done it."""


class AddPoints(Request, frozen=True, tag="add-points"):
    """Add points of interest for planners, on the ground or in flight: all of them, or none."""

    points: tuple[NewPoint, ...]


class CancelPoints(Request, frozen=True, tag="cancel-points"):
    """Cancel open points of interest by name; without names all of them."""

    names: tuple[str, ...] = ()
