"""Findings about a planned mission before it is sent: errors that forbid it, cautions, notes.

Geometry is that of the assumed path (`timed_path`). What no plan may contain is checked in `core/plans/check`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.missions.autopilot_limits import refusals
from tui_gcs.core.missions.draft import Items, VehicleDraft
from tui_gcs.core.missions.ground_clearance import lowest_points
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.timed_path import GROUND_HEIGHT_M, TimedPath
from tui_gcs.core.plans.check import MAX_RADIUS_M
from tui_gcs.core.plans.model import (
    CIRCLE_IN,
    CIRCLES,
    FENCE_COMMANDS,
    PLACES,
    PLAIN_FRAME,
    POLYGON_IN,
    POLYGONS,
    RALLY_POINT,
    RETURN,
    ROI_LOCATION,
    TAKE_OFF,
    TERRAIN,
    VTOL_TAKE_OFF,
    PlanKind,
    fence_shapes,
)
from tui_gcs.core.scenario.model import Round

TOUCH_M = 0.01
"""A border may be touched within this: places are rounded to 1e-7 degrees."""
CIRCLE_QUADRANT = 16
MIN_CLEARANCE_M = 5.0
"""The way of a mission without an operating area may come as near to the ground as this."""
TAKE_OFFS = frozenset({TAKE_OFF, VTOL_TAKE_OFF})
FLOWN = PLACES - FENCE_COMMANDS - {ROI_LOCATION, RALLY_POINT} | {RETURN}
"""Items that move a vehicle; the assumed path knows all of them."""


class FindingLevel(IntEnum):
    """How serious a finding is."""

    NOTE = 0
    CAUTION = 1
    ERROR = 2
    """The plan cannot be sent."""


class MissionFinding(NamedTuple):
    """One finding, and the index of its item; None if it is about the whole plan."""

    level: FindingLevel
    kind: PlanKind
    item: int | None
    text: str

    def __str__(self) -> str:
        """Format the finding for the operator: items count from 1."""
        which = "" if self.item is None else f" {self.item + 1}"
        return f"{self.kind.word}{which}: {self.text}"


def caution(item: int | None, text: str, kind: PlanKind = PlanKind.MISSION) -> MissionFinding:
    """Return a caution about a plan of `kind`."""
    return MissionFinding(FindingLevel.CAUTION, kind, item, text)


@dataclass(frozen=True)
class MissionSite:
    """The surroundings that a mission is checked against."""

    frame: LocalFrame
    current: Round | None = None
    """The round with its operating area, altitude band and no-fly zones."""
    performance: Performance = field(default_factory=Performance)
    battery_pct: float = 100.0
    """The charge at the start."""
    autopilot: str = ""
    """The autopilot as in fleet frames; empty if not known."""
    home_deg: tuple[float, float] | None = None
    elevation: Elevation | None = None
    """The heights of the ground, where the operator gave a terrain file."""


def findings(draft: VehicleDraft, path: TimedPath, site: MissionSite) -> list[MissionFinding]:
    """Return all findings, the most serious first, then in the order of the items."""
    found = [MissionFinding(FindingLevel.ERROR, kind, problem.item, problem.text) for kind, problem in draft.problems]
    found += [
        MissionFinding(FindingLevel.ERROR, kind, None, text)
        for kind in PlanKind
        # An autopilot's checks assume a plan without general errors.
        if draft.items(kind) and not found
        for text in refusals(draft.plan(kind), site.autopilot, site.home_deg)
    ]
    if draft.mission and not found:
        found += [
            *_shape(draft.mission, path),
            *_places(draft, path, site),
            *_ground(draft.mission, path, site),
            *_battery(path, site),
        ]
    return sorted(found, key=lambda each: (-each.level, each.kind, -1 if each.item is None else each.item))


def _shape(mission: Items, path: TimedPath) -> Iterator[MissionFinding]:
    """Check that it begins and ends as missions do."""
    places = [i for i, item in enumerate(mission) if item.is_place]
    if not places or mission[places[0]].command not in TAKE_OFFS:
        first = places[0] if places else None
        yield caution(first, "it does not begin with a take-off")
    if path.cut:
        yield caution(None, "its jumps make it too long to be foretold")
    elif path.endless:
        yield caution(None, "it never ends by itself")
    elif not path.lands:
        yield caution(None, "it neither lands nor returns")
    yield from _climbs(mission, path)
    yield from _never_reached(mission, path)
    terrain = next((i for i, item in enumerate(mission) if PLAIN_FRAME.get(item.frame) == TERRAIN), None)
    if terrain is not None:
        text = "heights above the ground: times and conflicts take the ground for level"
        yield MissionFinding(FindingLevel.NOTE, PlanKind.MISSION, terrain, text)


def _climbs(mission: Items, path: TimedPath) -> Iterator[MissionFinding]:
    """Find take-offs that leave the vehicle on the ground."""
    for index, item in enumerate(mission):
        if item.command in TAKE_OFFS:
            reached_m = path.corners_m[1:, 2][path.leg_items == index]
            if len(reached_m) and reached_m.max() <= GROUND_HEIGHT_M:
                text = f"a take-off to {reached_m.max():.0f} m above home"
                yield caution(index, text)


def _never_reached(mission: Items, path: TimedPath) -> Iterator[MissionFinding]:
    """Find items after a return, a landing or a stay without end."""
    if path.cut or not len(path.leg_items):
        return
    reached = set(path.leg_items.tolist())
    left = [i for i, item in enumerate(mission) if item.command in FLOWN and i not in reached]
    if left:
        more = f" (and {len(left) - 1} more)" if len(left) > 1 else ""
        text = f"comes after the mission's end, item {path.leg_items[-1] + 1}: not counted, not flown{more}"
        yield caution(left[0], text)


def _places(draft: VehicleDraft, path: TimedPath, site: MissionSite) -> Iterator[MissionFinding]:
    corners = path.corners_m
    tops = np.maximum(corners[:-1, 2], corners[1:, 2])
    is_flown = tops > GROUND_HEIGHT_M
    flown, tops = path.leg_items[is_flown], tops[is_flown]
    # All legs in one call: a mission may have thousands.
    lines = shapely.linestrings(np.stack([corners[:-1, :2], corners[1:, :2]], axis=1)[is_flown])
    if site.current is not None:
        area = polygon_of(site.current.area.shape)
        yield from _first(flown, ~_covers(area.buffer(TOUCH_M), lines), "leaves the operating area")
        for zone in site.current.no_fly:
            entered = _intersects(polygon_of(zone.shape).buffer(-TOUCH_M), lines)
            yield from _first(flown, entered, f"enters no-fly zone {zone.name}")
        high_m = site.current.area.alt_max_m
        if len(tops) and tops.max() > high_m + TOUCH_M:
            text = f"{tops.max():.0f} m is above the operating area ({high_m:g} m)"
            yield from _first(flown, tops > high_m + TOUCH_M, text)
    for inside, shape in fence_regions(draft.fence, site.frame):
        out = ~_covers(shape.buffer(TOUCH_M), lines) if inside else _intersects(shape, lines)
        yield from _first(flown, out, "leaves its own fence" if inside else "enters what its own fence excludes")


def _covers(region: shapely.Polygon, lines: NDArray[np.object_]) -> NDArray[np.bool_]:
    """Return which of many lines lie in the region."""
    shapely.prepare(region)
    return np.asarray(shapely.covers(region, lines))


def _intersects(region: shapely.Polygon, lines: NDArray[np.object_]) -> NDArray[np.bool_]:
    """Return which of many lines touch the region."""
    shapely.prepare(region)
    return np.asarray(shapely.intersects(region, lines))


def _first(flown: NDArray[np.int64], wrong: NDArray[np.bool_], what: str) -> Iterator[MissionFinding]:
    """Make one finding at the first of the wrong legs; `flown` are the items of the legs."""
    items = sorted(set(flown[wrong].tolist()))
    if items:
        more = f" (and {len(items) - 1} more)" if len(items) > 1 else ""
        yield caution(items[0], f"the way to it {what}{more}")


def fence_regions(fence: Items, frame: LocalFrame) -> list[tuple[bool, shapely.Polygon]]:
    """Return (whether to stay inside, the region in ENU metres) for each valid polygon and circle."""
    regions = []
    for shape in fence_shapes(fence):
        places = [frame.to_enu(item.lat_deg, item.lon_deg) for item in shape.items]
        if shape.command in CIRCLES:
            radius_m = shape.items[0].params[0]
            if 0 < radius_m <= MAX_RADIUS_M:
                region = shapely.Point(places[0]).buffer(radius_m, quad_segs=CIRCLE_QUADRANT)
                regions.append((shape.command == CIRCLE_IN, region))
        elif shape.command in POLYGONS and len(places) >= 3:
            region = shapely.Polygon(places)
            if region.is_valid:
                regions.append((shape.command == POLYGON_IN, region))
    return regions


def _ground(mission: Items, path: TimedPath, site: MissionSite) -> Iterator[MissionFinding]:
    """Find where the way comes nearer to the ground than the operating area allows, if the ground is known."""
    if site.elevation is None or path.is_empty:
        return
    points, unknown = lowest_points(mission, path, site.frame, site.elevation)
    if unknown:
        text = (
            f"the ground is unknown on {max(unknown, 0.01):.0%} of the way: {site.elevation.name} does not reach there"
        )
        yield caution(None, text)
    least_m = MIN_CLEARANCE_M if site.current is None else site.current.area.alt_min_m
    low = [point for point in points if point.clearance_m < least_m]
    if low:
        worst = min(low, key=lambda point: point.clearance_m)
        above = "above" if worst.clearance_m >= 0 else "below"
        more = f" (and {len(low) - 1} more)" if len(low) > 1 else ""
        text = (
            f"the way to it passes {abs(worst.clearance_m):.0f} m {above} the ground, {worst.along_m:.0f} m from home"
        )
        yield caution(worst.item, f"{text}{more}: {least_m:g} m are the least here")


def battery_left_pct(path: TimedPath, site: MissionSite) -> float:
    """Return the charge after the mission; below 0 the battery does not last."""
    return site.battery_pct - site.performance.energy_pct(path.duration_s)


def _battery(path: TimedPath, site: MissionSite) -> Iterator[MissionFinding]:
    left_pct, reserve_pct = battery_left_pct(path, site), site.performance.reserve_pct
    if left_pct >= reserve_pct:
        return
    arrivals = path.arrivals_s
    empty_s = (site.battery_pct - reserve_pct) / 100.0 * site.performance.endurance_s
    first = next((item for item, t_s in sorted(arrivals.items(), key=lambda each: each[1]) if t_s > empty_s), None)
    ends = "does not last" if left_pct < 0 else f"ends at {left_pct:.0f} %"
    text = f"the battery {ends}; reserve {reserve_pct:g} %, endurance {site.performance.endurance_s / 60:g} min"
    yield caution(first, text)
