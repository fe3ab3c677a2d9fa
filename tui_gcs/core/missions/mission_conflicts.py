"""Conflict detection between missions: paths too close at the same time, or in the same place at other times.

The first is a collision if both missions begin together. The second becomes one when a vehicle waits, is slower, or
starts later. Vehicles on the ground are left out.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.missions.timed_path import GROUND_HEIGHT_M, Floats, TimedPath

STEP_S = 1.0
"""Paths are straight within a step; the least distance within it is exact."""
MAX_STEPS = 7200
STILL_M = 1e-6


@dataclass(frozen=True)
class Conflict:
    """Two vehicles and where they are too close. Of two missions, `first` has the lower id."""

    first: int
    second: int
    place_m: tuple[float, float]
    """The point halfway between them, ENU metres."""
    horizontal_m: float
    vertical_m: float
    first_s: float
    """When the first is there, from the begin of its mission."""
    second_s: float
    """When the second is there; NaN if it flies a planner's tour, and is there again and again."""

    @property
    def on_tour(self) -> bool:
        """Whether the second flies a planner's tour."""
        return math.isnan(self.second_s)

    @property
    def together(self) -> bool:
        """Whether both are there at the same time."""
        return self.first_s == self.second_s


@dataclass(frozen=True)
class ComparablePath:
    """A path in the form in which it is compared with others; made once for each path."""

    sampled: Floats
    lines: "_PathLines"


def comparable(path: TimedPath) -> ComparablePath:
    """Prepare a path for comparison."""
    return ComparablePath(_sampled(path), _PathLines.of(path))


def comparable_loop(loop_m: Floats, height_m: float) -> ComparablePath:
    """Prepare a closed line, (n, 2), at one height: it is flown at unknown times."""
    return ComparablePath(np.empty((0, 3)), _PathLines.at(loop_m, height_m))


def conflict_between(
    first: int, second: int, a: ComparablePath, b: ComparablePath, horizontal_m: float, vertical_m: float
) -> Conflict | None:
    """Return the worst place where two paths are nearer than both distances; None if there is none.

    If they are too close at the same time, other crossings are not reported.
    """
    if not _may_meet(a.lines, b.lines, horizontal_m):
        return None
    at_once = _at_once(first, second, a.sampled, b.sampled, horizontal_m, vertical_m)
    return at_once or _in_place(first, second, a.lines, b.lines, horizontal_m, vertical_m)


def collision_between(
    first: int, second: int, a: ComparablePath, b: ComparablePath, horizontal_m: float, vertical_m: float
) -> Conflict | None:
    """Return where two paths that begin together are worst too close at the same time; None if they are not."""
    if not _may_meet(a.lines, b.lines, horizontal_m):
        return None
    return _at_once(first, second, a.sampled, b.sampled, horizontal_m, vertical_m)


def conflicts(paths: Mapping[int, TimedPath], horizontal_m: float, vertical_m: float) -> list[Conflict]:
    """Return one conflict for each pair that is too close, in the order of `worst_first`."""
    flown = {vehicle: comparable(path) for vehicle, path in sorted(paths.items()) if not path.is_empty}
    found = [conflict_between(a, b, flown[a], flown[b], horizontal_m, vertical_m) for a, b in combinations(flown, 2)]
    return worst_first(found)


def worst_first(found: Iterable[Conflict | None]) -> list[Conflict]:
    """Return the conflicts in the order in which they are reported: those at the same time first, then by ids."""
    return sorted((each for each in found if each is not None), key=lambda c: (not c.together, c.first, c.second))


def _sampled(path: TimedPath) -> Floats:
    """Sample a path every `STEP_S`, (n, 3); NaN while the vehicle stands on the ground."""
    count = min(int(path.duration_s / STEP_S) + 2, MAX_STEPS)
    points = path.at(np.arange(count, dtype=np.float64) * STEP_S)
    points[points[:, 2] < GROUND_HEIGHT_M] = np.nan
    return points


def _at_once(a: int, b: int, at_a: Floats, at_b: Floats, horizontal_m: float, vertical_m: float) -> Conflict | None:
    """Return the worst of the steps in which both are too close.

    The vehicle that flies longer meets the other at its end.
    """
    if not (len(at_a) and len(at_b)):  # a planner's tour has no times
        return None
    count = max(len(at_a), len(at_b))
    apart = _held(at_b, count) - _held(at_a, count)
    # Most pairs are on layers of their own, or far apart: what is never near in both is not looked at closely.
    reach_m = vertical_m + np.abs(np.diff(apart[:, 2], append=apart[-1:, 2]))
    if not (np.abs(apart[:, 2]) < reach_m).any():
        return None
    start, step = apart[:-1], np.diff(apart, axis=0)
    speed2 = (step[:, :2] ** 2).sum(axis=1)
    share = np.clip(-(start[:, :2] * step[:, :2]).sum(axis=1) / np.maximum(speed2, 1e-12), 0.0, 1.0)
    nearest = start + step * share[:, None]
    ground_m, height_m = np.hypot(nearest[:, 0], nearest[:, 1]), np.abs(nearest[:, 2])
    near = (ground_m < horizontal_m) & (height_m < vertical_m)  # NaN is not near
    if not near.any():
        return None
    i = int(np.argmin(np.where(near, ground_m, np.inf)))
    t_s = (i + float(share[i])) * STEP_S
    here = _held(at_a, count)[i] + nearest[i] / 2
    place = (float(here[0]), float(here[1]))
    return Conflict(a, b, place, float(ground_m[i]), float(height_m[i]), t_s, t_s)


def _held(points: Floats, count: int) -> Floats:
    """Extend the samples to `count` by repeating the last."""
    if len(points) >= count:
        return points
    return np.vstack([points, np.repeat(points[-1:], count - len(points), axis=0)])


@dataclass(frozen=True)
class _PathLines:
    """The legs of a path on the ground plane, with their heights and times."""

    ends_m: Floats
    shapes: NDArray[np.object_]
    low_m: Floats
    high_m: Floats
    begin_s: Floats
    end_s: Floats
    box: tuple[float, float, float, float]

    @classmethod
    def of(cls, path: TimedPath) -> "_PathLines":
        ends = np.stack([path.corners_m[:-1], path.corners_m[1:]], axis=1)
        flown = ends[:, :, 2].max(axis=1) >= GROUND_HEIGHT_M
        return cls._of(ends[flown, :, :2], ends[flown, :, 2], path.leg_times_s[flown, :2])

    @classmethod
    def at(cls, line_m: Floats, height_m: float) -> "_PathLines":
        """Make the legs of a line at one height, without times."""
        ends = np.stack([line_m[:-1], line_m[1:]], axis=1)
        return cls._of(ends, np.full((len(ends), 2), height_m), np.full((len(ends), 2), np.nan))

    @classmethod
    def _of(cls, ends: Floats, heights: Floats, times: Floats) -> "_PathLines":
        box = (
            (*ends.min(axis=(0, 1)).tolist(), *ends.max(axis=(0, 1)).tolist())
            if len(ends)
            else (np.inf, np.inf, -np.inf, -np.inf)
        )
        return cls(ends, _shapes(ends), heights.min(axis=1), heights.max(axis=1), times[:, 0], times[:, 1], box)


def _shapes(ends: Floats) -> NDArray[np.object_]:
    """Make the legs as shapes on the ground plane.

    A vertical leg is a point, because GEOS finds no line of length 0.
    """
    still = np.hypot(*(ends[:, 1] - ends[:, 0]).T) < STILL_M
    shapes: NDArray[np.object_] = np.where(still, shapely.points(ends[:, 0]), shapely.linestrings(ends))
    return shapes


def _boxes(ends_m: Floats, margin_m: float) -> NDArray[np.object_]:
    """Make the bounding box of each leg, enlarged by `margin_m`."""
    low, high = ends_m.min(axis=1) - margin_m, ends_m.max(axis=1) + margin_m
    boxes: NDArray[np.object_] = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    return boxes


def _may_meet(a: _PathLines, b: _PathLines, horizontal_m: float) -> bool:
    (ax0, ay0, ax1, ay1), (bx0, by0, bx1, by1) = a.box, b.box
    far = horizontal_m
    return ax0 - far < bx1 and bx0 - far < ax1 and ay0 - far < by1 and by0 - far < ay1


def _in_place(
    a: int, b: int, of_a: _PathLines, of_b: _PathLines, horizontal_m: float, vertical_m: float
) -> Conflict | None:
    """Return the nearest two legs that are too close in height, too. A climbing leg covers all heights in it."""
    first, second = shapely.STRtree(of_b.shapes).query(_boxes(of_a.ends_m, horizontal_m))
    gap_m = np.maximum(of_b.low_m[second] - of_a.high_m[first], of_a.low_m[first] - of_b.high_m[second])
    # Heights first: distances cost more, and layers leave few pairs.
    close = gap_m < vertical_m
    first, second, gap_m = first[close], second[close], gap_m[close]
    ground_m = shapely.distance(of_a.shapes[first], of_b.shapes[second])
    if not (ground_m < horizontal_m).any():
        return None
    i = int(np.argmin(ground_m))
    leg_a, leg_b = of_a.shapes[first[i]], of_b.shapes[second[i]]
    ends = shapely.get_coordinates(shapely.shortest_line(leg_a, leg_b))
    place = ends.mean(axis=0)
    t_a = _when(leg_a, ends[0], of_a.begin_s[first[i]], of_a.end_s[first[i]])
    t_b = _when(leg_b, ends[-1], of_b.begin_s[second[i]], of_b.end_s[second[i]])
    # Equal times would mark it as a collision (`Conflict.together`), which only `_at_once` may find.
    if t_a == t_b:
        t_b += 1e-3
    height_m = max(0.0, float(gap_m[i]))
    return Conflict(a, b, (float(place[0]), float(place[1])), float(ground_m[i]), height_m, t_a, t_b)


def _when(leg: shapely.LineString | shapely.Point, place: Floats, begin_s: float, end_s: float) -> float:
    """Estimate when a place on a leg is reached: as if it were flown evenly; the middle of a climb."""
    share = float(shapely.line_locate_point(leg, shapely.Point(place), normalized=True)) if leg.length else 0.5
    return float(begin_s + (end_s - begin_s) * share)
