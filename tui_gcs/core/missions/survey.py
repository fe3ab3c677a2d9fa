"""A survey: parallel lanes over an area, flown back and forth, divided among vehicles into parts of similar length.

Concave areas are divided into pieces that one sweep covers. Between pieces the path may leave the area, which the
findings report. Places are ENU metres.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

Place = tuple[float, float]
Lane = tuple[Place, Place]

MIN_SPACING_M = 0.5
MAX_LANES = 1000
MIN_LANE_M = 0.5
"""Shorter lanes, at corners, are left out."""


class GeneratorError(ValueError):
    """Nothing can be generated; the message gives the reason in one line."""


@dataclass(frozen=True)
class Survey:
    """The survey to be flown."""

    outline_m: tuple[Place, ...]
    spacing_m: float
    """The distance between lanes: at most the width that a vehicle sees."""
    angle_deg: float = 0.0
    """The direction of the lanes, clockwise from north."""
    turn_m: float = 0.0
    """How much longer lanes are at both ends, so that vehicles turn outside of the area."""
    entry: int = 0
    """The corner of the sweep at which it begins, 0 to 3."""


def lanes(survey: Survey) -> list[Lane]:
    """Return the lanes in the order and direction in which one vehicle would fly them. Raises GeneratorError."""
    area = shapely.Polygon(survey.outline_m) if len(survey.outline_m) >= 3 else shapely.Polygon()
    if not area.is_valid or area.area <= 0:
        raise GeneratorError("the area crosses itself or is empty")
    if not survey.spacing_m >= MIN_SPACING_M:
        raise GeneratorError(f"lanes are at least {MIN_SPACING_M:g} m apart")
    if not (math.isfinite(survey.angle_deg) and 0 <= survey.turn_m <= 1000):
        raise GeneratorError("the angle or the way to turn is impossible")
    middle = area.centroid
    # Turned so that the lanes run north.
    upright = affinity.rotate(area, survey.angle_deg, origin=middle)
    pieces = _pieces(_rows(upright, survey.spacing_m))
    if survey.entry & 1:
        pieces = [piece[::-1] for piece in pieces[::-1]]
    swept = _swept(pieces, north_first=bool(survey.entry & 2), turn_m=survey.turn_m)
    turned = affinity.rotate(shapely.MultiLineString(swept), -survey.angle_deg, origin=middle)
    return [(_place(line.coords[0]), _place(line.coords[-1])) for line in turned.geoms]


def _rows(area: shapely.Polygon, spacing_m: float) -> list[list[tuple[float, float, float]]]:
    """Return (x, south, north) of the lanes, one row for each x from west to east, evenly over the whole width."""
    min_x, min_y, max_x, max_y = area.bounds
    # Evenly spread: the last lane must not lie outside of the area.
    count = max(1, math.ceil((max_x - min_x) / spacing_m - 1e-9))
    if count > MAX_LANES:
        raise GeneratorError(f"{count} lanes: at most {MAX_LANES}")
    step = (max_x - min_x) / count
    rows = []
    for i in range(count):
        x = min_x + (i + 0.5) * step
        cut = area.intersection(shapely.LineString([(x, min_y - 1), (x, max_y + 1)]))
        parts = cut.geoms if hasattr(cut, "geoms") else [cut]
        spans = sorted(part.bounds for part in parts if part.length >= MIN_LANE_M)
        rows.append(sorted((x, south, north) for _, south, _, north in spans))
    if not any(rows):
        raise GeneratorError("no lane fits into the area")
    return rows


def _pieces(rows: list[list[tuple[float, float, float]]]) -> list[list[tuple[float, float, float]]]:
    """Group lanes that follow each other without a gap: a piece ends where the area splits or joins."""
    pieces: list[list[tuple[float, float, float]]] = []
    open_pieces: list[list[tuple[float, float, float]]] = []
    for row in rows:
        touching = [[p for p in open_pieces if _overlap(p[-1], lane)] for lane in row]
        now = []
        for lane, before in zip(row, touching, strict=True):
            only = len(before) == 1 and sum(before[0] is p for ps in touching for p in ps) == 1
            if only:
                before[0].append(lane)
                now.append(before[0])
            else:
                pieces.append([lane])
                now.append(pieces[-1])
        open_pieces = now
    return pieces


def _overlap(a: tuple[float, float, float], b: tuple[float, float, float]) -> bool:
    return a[1] < b[2] and b[1] < a[2]


def _swept(pieces: list[list[tuple[float, float, float]]], *, north_first: bool, turn_m: float) -> list[Lane]:
    """Order all lanes back and forth, always on to the nearest end of a piece that is left."""
    flown: list[Lane] = []
    left = list(pieces)
    piece = left.pop(0)
    northward = not north_first
    while True:
        for x, south, north in piece:
            low, high = (x, south - turn_m), (x, north + turn_m)
            flown.append((low, high) if northward else (high, low))
            northward = not northward
        if not left:
            return flown
        here = flown[-1][1]
        # Each piece can be entered at either end.
        nearest = min(range(2 * len(left)), key=lambda k: _way_to(left[k // 2], here, backwards=bool(k % 2)))
        piece = left.pop(nearest // 2)
        piece = piece[::-1] if nearest % 2 else piece
        x, south, north = piece[0]
        northward = math.dist(here, (x, south)) <= math.dist(here, (x, north))


def _way_to(piece: list[tuple[float, float, float]], here: Place, *, backwards: bool) -> float:
    x, south, north = piece[-1 if backwards else 0]
    return min(math.dist(here, (x, south)), math.dist(here, (x, north)))


def _place(coordinates: Sequence[float]) -> Place:
    return float(coordinates[0]), float(coordinates[1])


def split(all_lanes: Sequence[Lane], homes_m: Sequence[Place], speed_m_s: float, turn_s: float) -> list[list[Lane]]:
    """Divide the lanes among the vehicles that start at `homes_m`, so that the longest part is as short as possible.

    What counts is the time from home over the lanes and back, with `turn_s` for each end of a lane. Each part is a run
    of neighbouring lanes. With fewer lanes than vehicles some get none. Runs are assigned so that the paths to them are
    short.
    """
    if not homes_m:
        return []
    count = len(homes_m)
    middle = (sum(x for x, _ in homes_m) / count, sum(y for _, y in homes_m) / count)

    def time_s(first: int, last: int) -> float:
        way = float(travelled[last] - travelled[first])
        way += math.dist(middle, all_lanes[first][0]) + math.dist(all_lanes[last][1], middle)
        way += math.dist(*all_lanes[first])
        return way / speed_m_s + 2 * turn_s * (last - first + 1)

    steps = [math.dist(a[1], b[0]) + math.dist(*b) for a, b in itertools.pairwise(all_lanes)]
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    low, high = 0.0, time_s(0, len(all_lanes) - 1)
    runs = [(0, len(all_lanes) - 1)]
    # Bisection for the shortest possible longest part: 40 steps are more exact than needed.
    for _ in range(40):
        most_s = (low + high) / 2
        found = _runs(len(all_lanes), count, time_s, most_s)
        if found is None:
            low = most_s
        else:
            runs, high = found, most_s
    return _assigned([list(all_lanes[first : last + 1]) for first, last in runs], homes_m)


def _runs(lanes: int, most: int, time_s: Callable[[int, int], float], most_s: float) -> list[tuple[int, int]] | None:
    """Return (first, last) of at most `most` runs, each as long as its time allows; None if that is impossible."""
    runs: list[tuple[int, int]] = []
    first = 0
    while first < lanes:
        last = first
        if time_s(first, last) > most_s or len(runs) == most:
            return None
        while last + 1 < lanes and time_s(first, last + 1) <= most_s:
            last += 1
        runs.append((first, last))
        first = last + 1
    return runs


def _assigned(runs: list[list[Lane]], homes_m: Sequence[Place]) -> list[list[Lane]]:
    """Assign runs to vehicles such that the paths to their begins and from their ends are shortest in total."""
    if len(homes_m) == len(runs) == 1:
        return runs
    costs = np.array([[math.dist(home, run[0][0]) + math.dist(run[-1][1], home) for run in runs] for home in homes_m])
    shares: list[list[Lane]] = [[] for _ in homes_m]
    # Imported here: it costs 40 MB and 0.4 s, and consoles need it only for this.
    from scipy.optimize import linear_sum_assignment

    for vehicle, run in zip(*linear_sum_assignment(costs), strict=True):
        shares[vehicle] = runs[run]
    return shares
