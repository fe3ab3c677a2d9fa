"""A corridor scan: a line with a width, flown in parallel lanes; several vehicles get equal lengths of it.

Places are ENU metres.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.ops import substring

from tui_gcs.core.missions.survey import MAX_LANES, MIN_SPACING_M, GeneratorError, Place

Path = tuple[Place, ...]


@dataclass(frozen=True)
class Corridor:
    """The corridor to be scanned."""

    line_m: tuple[Place, ...]
    width_m: float
    spacing_m: float
    backwards: bool = False
    """Whether it is flown from the end of the line."""


def paths(corridor: Corridor, vehicles: int = 1) -> list[Path]:
    """Return the path of each of `vehicles` over its part of the corridor, in their order. Raises GeneratorError."""
    line = shapely.LineString(corridor.line_m) if len(corridor.line_m) >= 2 else shapely.LineString()
    if line.length < 1.0:
        raise GeneratorError("the line is shorter than a metre")
    if not (corridor.width_m >= 0 and corridor.spacing_m >= MIN_SPACING_M):
        raise GeneratorError(f"a width from 0 and lanes at least {MIN_SPACING_M:g} m apart are needed")
    if corridor.backwards:
        line = line.reverse()
    offsets = _offsets(corridor)
    cuts = np.linspace(0.0, line.length, vehicles + 1)
    return [_to_and_fro(substring(line, a, b), offsets) for a, b in itertools.pairwise(cuts)]


def _offsets(corridor: Corridor) -> list[float]:
    """How far left of the line each lane lies, from right to left; a single lane lies in the middle."""
    # The small term keeps a width of exactly n spacings at n lanes.
    count = max(1, math.ceil(corridor.width_m / corridor.spacing_m - 1e-9))
    if count > MAX_LANES:
        raise GeneratorError(f"{count} lanes: at most {MAX_LANES}")
    step = corridor.width_m / count
    return [-corridor.width_m / 2 + (i + 0.5) * step for i in range(count)]


def _to_and_fro(line: shapely.LineString, offsets: Sequence[float]) -> Path:
    way: list[Place] = []
    for number, offset in enumerate(offsets):
        lane = _offset_line(line, offset)
        way += lane[::-1] if number % 2 else lane
    return tuple(way)


def _offset_line(line: shapely.LineString, left_m: float) -> list[Place]:
    """Return the line moved to its left. Raises GeneratorError if it bends so hard that nothing is left."""
    lane = line if abs(left_m) < 1e-6 else line.offset_curve(left_m, join_style="mitre")
    if lane.is_empty or lane.geom_type != "LineString":
        raise GeneratorError("the line bends too hard for so wide a corridor")
    return [(float(x), float(y)) for x, y in lane.coords]
