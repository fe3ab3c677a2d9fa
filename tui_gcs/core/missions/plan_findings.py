"""Findings about a plan for one autopilot: what it would refuse, odd heights, odd distances.

`mission_findings` checks where the path leads. This module checks what the autopilot makes of the items, and numbers
that are easily wrong by a sign or a zero.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import shapely

from tui_gcs.core.firmware.plan_dialects import PlanDialect
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.command_reference import word_of
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.missions.mission_findings import FindingLevel, MissionFinding, caution, fence_regions
from tui_gcs.core.missions.timed_path import TimedPath
from tui_gcs.core.plans.model import (
    AMSL,
    HERE,
    LAND,
    PLAIN_FRAME,
    RELATIVE,
    TAKE_OFF,
    TERRAIN,
    VTOL_LAND,
    WAYPOINT,
    PlanItem,
    PlanKind,
)

FAR_M = 20_000.0
"""Farther from home than batteries last: a wrong sign, or two numbers in the wrong order."""
HIGH_M = 500.0
"""Higher above home than this, a height above sea level was probably taken for one above home."""
_ABOVE = {RELATIVE: "home", AMSL: "sea level", TERRAIN: "ground"}


@dataclass(frozen=True)
class PlanTarget:
    """The autopilot that is to fly a plan, and its start."""

    dialect: PlanDialect
    frame: LocalFrame
    home_deg: tuple[float, float] | None = None
    """Latitude and longitude; None if unknown: the frame's origin is used then."""

    @property
    def start_m(self) -> tuple[float, float]:
        """Home in the frame, ENU metres."""
        return self.frame.to_enu(*self.home_deg) if self.home_deg is not None else (0.0, 0.0)


def autopilot_findings(draft: VehicleDraft, target: PlanTarget) -> list[MissionFinding]:
    """Return what the autopilot does not take, and what is probably not meant, in plans without errors."""
    found = [
        MissionFinding(FindingLevel.ERROR, kind, None, text)
        for kind in PlanKind
        for text in target.dialect.problems(draft.plan(kind), target.home_deg)
    ]
    found += [*_commands(draft, target.dialect), *_no_places(draft, target.dialect), *_heights(draft)]
    return [*found, *_distances(draft, target), *_rally(draft, target)]


def _commands(draft: VehicleDraft, dialect: PlanDialect) -> Iterator[MissionFinding]:
    unknown: dict[int, list[int]] = {}
    for index, item in enumerate(draft.mission):
        if dialect.commands is not None and item.command not in dialect.commands:
            unknown.setdefault(item.command, []).append(index)
    for command, where in unknown.items():
        named = word_of(command).word
        what = named if named.endswith(str(command)) else f"{named} (command {command})"
        text = f"{dialect.name} takes no {what} in a mission{_more(where)}"
        yield MissionFinding(FindingLevel.ERROR, PlanKind.MISSION, where[0], text)


def _no_places(draft: VehicleDraft, dialect: PlanDialect) -> Iterator[MissionFinding]:
    """Find items at 0, 0, which ArduPilot does where the vehicle is then, and others perhaps at 0, 0."""
    nowhere = [i for i, item in enumerate(draft.mission) if item.has_no_place and item.command not in HERE]
    if nowhere:
        is_known = dialect.commands is not None
        level = FindingLevel.NOTE if is_known else FindingLevel.CAUTION
        who = dialect.name if is_known else "an ArduPilot"
        text = f"0, 0 is no place: {who} does it where it is then{_more(nowhere)}"
        yield MissionFinding(level, PlanKind.MISSION, nowhere[0], text)


def _heights(draft: VehicleDraft) -> Iterator[MissionFinding]:
    placed = [(i, item) for i, item in enumerate(draft.mission) if item.is_place]
    # Mixed frames are legal, but nearly always a mistake.
    frames = sorted({_frame(item) for _, item in placed})
    if len(frames) > 1:
        counts = [f"{sum(_frame(i) == frame for _, i in placed)} above {_ABOVE.get(frame, frame)}" for frame in frames]
        text = f"heights are above different things: {', '.join(counts)}"
        yield caution(None, text)
    low = [
        i
        for i, item in placed
        if _frame(item) != AMSL
        and item.z <= 0
        and item.command in (WAYPOINT, TAKE_OFF)
        # Without place and height it stays where it is.
        and not (item.has_no_place and item.command == WAYPOINT and item.z == 0)
    ]
    if low:
        yield caution(low[0], f"is at the height of home or below it{_more(low)}")
    high = [i for i, item in placed if _frame(item) == RELATIVE and item.z > HIGH_M]
    if high:
        z = draft.mission[high[0]].z
        yield caution(high[0], f"{z:g} m above home: meant above sea level?{_more(high)}")


def _more(indices: list[int]) -> str:
    return f" (and {len(indices) - 1} more)" if len(indices) > 1 else ""


def _frame(item: PlanItem) -> int:
    return PLAIN_FRAME.get(item.frame, item.frame)


def _distances(draft: VehicleDraft, target: PlanTarget) -> Iterator[MissionFinding]:
    for kind in PlanKind:
        far = [(i, away_m) for i, item in enumerate(draft.items(kind)) if (away_m := _away_m(item, target)) > FAR_M]
        if far:
            text = f"{far[0][1] / 1000:.0f} km from where it starts{_more([i for i, _ in far])}"
            yield caution(far[0][0], text, kind)


def _away_m(item: PlanItem, target: PlanTarget) -> float:
    """Return the distance from the start, 0 for an item without a place."""
    # 0, 0 means "where the vehicle is then".
    if not item.is_place or not (item.x or item.y):
        return 0.0
    return math.dist(target.frame.to_enu(item.lat_deg, item.lon_deg), target.start_m)


def _rally(draft: VehicleDraft, target: PlanTarget) -> Iterator[MissionFinding]:
    """Find rally points and landings where the fence forbids them."""
    regions = fence_regions(draft.fence, target.frame)
    inside = [region for keep_in, region in regions if keep_in]
    outside = [region for keep_in, region in regions if not keep_in]
    landings = [
        (PlanKind.MISSION, i, item) for i, item in enumerate(draft.mission) if item.command in (LAND, VTOL_LAND)
    ]
    points = [(PlanKind.RALLY, i, item) for i, item in enumerate(draft.rally)]
    for kind, index, item in (*landings, *points):
        if not (item.x or item.y):
            continue
        place = shapely.Point(target.frame.to_enu(item.lat_deg, item.lon_deg))
        if (inside and not any(region.covers(place) for region in inside)) or any(r.covers(place) for r in outside):
            yield MissionFinding(FindingLevel.ERROR, kind, index, "lies outside of what the fence allows")


def summary(draft: VehicleDraft, path: TimedPath, target: PlanTarget) -> list[MissionFinding]:
    """Return a summary: number of items, length, duration, height."""
    found = []
    if draft.mission:
        far_m = max((_away_m(item, target) for item in draft.mission), default=0.0)
        high = "" if path.is_empty else f", up to {path.corners_m[1:, 2].max():.0f} m above home"
        time = f"{path.length_m / 1000:.2f} km in {path.duration_s / 60:.1f} min"
        text = f"{len(draft.mission)} items: {time}{high}, at most {far_m:.0f} m from where it starts"
        found.append(MissionFinding(FindingLevel.NOTE, PlanKind.MISSION, None, text))
    for kind in (PlanKind.FENCE, PlanKind.RALLY):
        if count := len(draft.items(kind)):
            found.append(MissionFinding(FindingLevel.NOTE, kind, None, f"{count} item{'s' * (count != 1)}"))
    return found
