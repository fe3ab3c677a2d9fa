"""Plans as drawings and back: what a map program can show of a mission, and what of its drawings can be flown.

Out: the path of a mission with a mark at each place, fence polygons (circles with many corners, and their radius as a
property), rally points, home. In: a path becomes way-points, areas become a fence. The property `part` names what a
drawing is of; a drawing of another program has none, and is taken by its kind.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from tui_gcs.core.formats.content import Content, Drawing, FormatError, Heights, Home, Place, counted, place_item
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions.command_reference import word_of
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import (
    AMSL,
    CIRCLE_IN,
    CIRCLE_OUT,
    CIRCLES,
    FENCE_RETURN,
    PLAIN_FRAME,
    POLYGON_IN,
    POLYGON_OUT,
    POLYGONS,
    RALLY_POINT,
    RELATIVE,
    TERRAIN,
    WAYPOINT,
    FenceShape,
    Plan,
    PlanItem,
    PlanKind,
    fence_shapes,
)

PART = "part"
PATH, MARK, FENCE, RALLY, RETURN_POINT, HOME = "mission", "waypoint", "fence", "rally", "fence return", "home"
INCLUSION, RADIUS, CENTRE_LAT, CENTRE_LON = "inclusion", "radius_m", "centre_lat", "centre_lon"
ROLE, NO_FLY, AREA, ROUND = "role", "no-fly", "area", "round"
CIRCLE_CORNERS = 64
HEIGHTS_OF: dict[int, Heights] = {RELATIVE: "home", TERRAIN: "ground", AMSL: "amsl"}
FRAME_OF = {heights: frame for frame, heights in HEIGHTS_OF.items()}
TOO_MANY = f"more than {MAX_ITEMS} items"
BORDER_TOLERANCE_M, BORDER_TOLERANCE_SHARE = 0.5, 0.01
"""A border that is farther than this from the circle in its properties was edited, and counts instead."""


@dataclass(frozen=True)
class DrawnPlan:
    """Drawings, and what could not be drawn."""

    drawings: tuple[Drawing, ...]
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def draw(content: Content) -> DrawnPlan:
    """Draw what can be shown of plans. Raises FormatError."""
    mission = _draw_mission(content.mission, content.home) if content.mission is not None else DrawnPlan(())
    fence = [_draw_shape(shape) for shape in fence_shapes(content.fence.items if content.fence is not None else ())]
    points = [_draw_rally(number, item) for number, item in enumerate(content.rally.items, 1)] if content.rally else []
    home = (_draw_home(content.home),) if content.home is not None else ()
    lost = tuple(f"{part}: its way is not in the file" for part in content.not_flown)
    return DrawnPlan((*mission.drawings, *fence, *points, *home), (*mission.left_out, *lost), mission.notes)


def _draw_mission(mission: Plan, home: Home | None) -> DrawnPlan:
    placed = [(i, item) for i, item in enumerate(mission.items, 1) if item.is_place and (item.x or item.y)]
    if not placed:
        return DrawnPlan((), _unplaced(mission))
    heights, places = _heights([item for _, item in placed], home)
    marks = [
        Drawing("point", f"{i} {word_of(item.command).word}", (place,), heights=heights, facts={PART: MARK})
        for (i, item), place in zip(placed, places, strict=True)
    ]
    path = [Drawing("line", "mission", tuple(places), heights=heights, facts={PART: PATH})] if len(places) > 1 else []
    what = "heights are above home, and are written as above ground: other programs cannot show anything else"
    return DrawnPlan((*path, *marks), _unplaced(mission), (what,) if heights == "home" else ())


def _unplaced(mission: Plan) -> tuple[str, ...]:
    """Report what of a mission is no place, or more than one."""
    without = Counter(i.command for i in mission.items if not (i.is_place and (i.x or i.y)))
    acts = Counter(i.command for i in mission.items if i.is_place and (i.x or i.y) and i.command != WAYPOINT)
    more = sum(1 for i in mission.items if i.command == WAYPOINT and any(v and not math.isnan(v) for v in i.params))
    lost = []
    if without:
        lost.append(f"{counted(without.total(), 'item')} without a place ({_commands(without)})")
    if acts:
        lost.append(f"what {counted(acts.total(), 'item')} does ({_commands(acts)}): drawn as places only")
    if more:
        lost.append(f"parameters of {counted(more, 'way-point')} (hold times, radii, headings)")
    return tuple(lost)


def _commands(found: Counter[int]) -> str:
    return ", ".join(f"{count} x {word_of(command).word}" for command, count in sorted(found.items()))


def _heights(items: Sequence[PlanItem], home: Home | None) -> tuple[Heights, list[Place]]:
    """Return places with heights above one thing: a path of a map program has no other. Raises FormatError."""
    frames = {PLAIN_FRAME.get(item.frame, item.frame) for item in items}
    if len(frames) == 1 and (heights := HEIGHTS_OF.get(next(iter(frames)))) is not None:
        return heights, [(item.lat_deg, item.lon_deg, item.z) for item in items]
    # With a known home all heights can be given above sea level.
    if frames <= {RELATIVE, AMSL} and home is not None and not math.isnan(home.amsl_m):
        low_m = {RELATIVE: home.amsl_m, AMSL: 0.0}
        return "amsl", [(i.lat_deg, i.lon_deg, i.z + low_m[PLAIN_FRAME[i.frame]]) for i in items]
    raise FormatError("its heights are above different things (home, sea, ground): one path cannot show that")


def _draw_shape(shape: FenceShape) -> Drawing:
    first = shape.items[0]
    facts = {PART: FENCE, INCLUSION: "true" if shape.command in (POLYGON_IN, CIRCLE_IN) else "false"}
    if shape.command in POLYGONS:
        return Drawing("area", shape.text, tuple((i.lat_deg, i.lon_deg, None) for i in shape.items), facts=facts)
    if shape.command in CIRCLES:
        facts |= circle_facts(first.lat_deg, first.lon_deg, first.params[0])
        return Drawing("area", shape.text, _circle_border(first), facts=facts)
    return Drawing("point", shape.text, ((first.lat_deg, first.lon_deg, None),), facts={PART: RETURN_POINT})


def circle_facts(lat_deg: float, lon_deg: float, radius_m: float) -> dict[str, str]:
    """Return the properties that mark a border as a circle."""
    return {RADIUS: f"{radius_m:.9g}", CENTRE_LAT: f"{lat_deg:.9f}", CENTRE_LON: f"{lon_deg:.9f}"}


def _circle_border(item: PlanItem) -> tuple[Place, ...]:
    """Approximate a circle by corners: inside of it for an inclusion, around it for an exclusion."""
    frame = LocalFrame(Origin(item.lat_deg, item.lon_deg, 0.0))
    # Corners on the circle would cut off segments of an area that must be avoided.
    reach_m = item.params[0] / (math.cos(math.pi / CIRCLE_CORNERS) if item.command == CIRCLE_OUT else 1.0)
    turns = (math.tau * i / CIRCLE_CORNERS for i in range(CIRCLE_CORNERS))
    corners = (frame.to_geodetic(reach_m * math.cos(turn), reach_m * math.sin(turn)) for turn in turns)
    return tuple((float(lat), float(lon), None) for lat, lon in corners)


def circle_of(drawing: Drawing) -> tuple[float, float, float] | None:
    """Return (latitude, longitude, radius in metres) if a border is a circle by its properties, and was not edited."""
    try:
        lat_deg, lon_deg, radius_m = (float(drawing.facts[key]) for key in (CENTRE_LAT, CENTRE_LON, RADIUS))
    except (KeyError, ValueError):
        return None
    if not (abs(lat_deg) < 89 and abs(lon_deg) <= 180 and 0 < radius_m < math.inf):
        return None
    frame = LocalFrame(Origin(lat_deg, lon_deg, 0.0))
    off_m = (abs(math.hypot(*frame.to_enu(lat, lon)) - radius_m) for lat, lon, _ in drawing.places)
    is_circle = max(off_m) <= BORDER_TOLERANCE_M + BORDER_TOLERANCE_SHARE * radius_m
    return (lat_deg, lon_deg, radius_m) if is_circle else None


def _draw_rally(number: int, item: PlanItem) -> Drawing:
    heights = HEIGHTS_OF.get(PLAIN_FRAME.get(item.frame, item.frame), "none")
    place = (item.lat_deg, item.lon_deg, item.z)
    return Drawing("point", f"rally {number}", (place,), heights=heights, facts={PART: RALLY})


def _draw_home(home: Home) -> Drawing:
    known = not math.isnan(home.amsl_m)
    place = (home.lat_deg, home.lon_deg, home.amsl_m if known else None)
    return Drawing("point", "home", (place,), heights="amsl" if known else "none", facts={PART: HOME})


def planned(drawings: Sequence[Drawing], height_m: float | None, otherwise_m: float | None = None) -> Content:
    """Return the mission, fence and rally points that drawings describe.

    `height_m` above home is for all paths and points, `otherwise_m` for those that give no height.

    Raises:
        FormatError: A path has no known height, and none was given.
    """
    paths = [d for d in drawings if d.kind == "line" and d.facts.get(PART, PATH) == PATH]
    areas = [d for d in drawings if d.kind == "area" and _is_fence(d)]
    points = [d for d in drawings if d.kind == "point"]
    rally_points = [d for d in points if d.facts.get(PART) == RALLY]
    # Counted first: making 100,000 items takes long.
    _few_enough(paths, areas, rally_points)
    rounds = sorted({d.facts[ROUND] for d in areas if ROUND in d.facts})
    if len(rounds) > 1:
        named = ", ".join(rounds)
        raise FormatError(f"areas of several rounds are in it ({named}): a fence is of one; --round for the scenario")
    # Which of several paths is the mission would be a guess.
    lost = [f"path {path.name!r}: a mission is one path, the first" for path in paths[1:]]
    mission = Plan(PlanKind.MISSION, _items(WAYPOINT, paths[0], height_m, otherwise_m)) if paths else None
    assumed = otherwise_m if paths and height_m is None and not _says_height(paths[0]) else None
    items = [item for area in areas for item in _fence_items(area)]
    items += [_point(FENCE_RETURN, AMSL, d.places[0]) for d in drawings if d.facts.get(PART) == RETURN_POINT]
    rally = [i for d in rally_points for i in _items(RALLY_POINT, d, height_m, otherwise_m)]
    homes = [d for d in points if d.facts.get(PART) == HOME]
    parts = (PATH, MARK, FENCE, RALLY, RETURN_POINT, HOME)
    unknown = sum(1 for d in points if d.facts.get(PART) not in parts)
    zones = sum(1 for d in drawings if d.kind == "area") - len(areas)
    if unknown:
        lost.append(f"{counted(unknown, 'point')} that say{'s' * (unknown == 1)} not what of")
    if zones:
        lost.append(f"{counted(zones, 'zone')} to fly in: no part of a fence")
    if len(items) > MAX_ITEMS:
        raise FormatError(TOO_MANY)
    return Content(
        mission=mission,
        fence=Plan(PlanKind.FENCE, tuple(items)) if items else None,
        rally=Plan(PlanKind.RALLY, tuple(rally)) if rally else None,
        home=_home_of(homes[0]) if homes else None,
        left_out=tuple(lost),
        notes=(f"the path does not say how high: {assumed:g} m above home",) if assumed is not None else (),
    )


def _few_enough(paths: Sequence[Drawing], areas: Sequence[Drawing], rally_points: Sequence[Drawing]) -> None:
    """Refuse too many points before items are made of them, which takes long. Raises FormatError.

    A circle is one item whatever its border, so areas may have more corners than items.
    """
    corners = sum(1 if RADIUS in area.facts else len(area.places) for area in areas)
    if max(corners, len(paths[0].places) if paths else 0, len(rally_points)) > MAX_ITEMS:
        raise FormatError(TOO_MANY)


def _is_fence(area: Drawing) -> bool:
    """Whether an area limits where vehicles may be; an area of another program without properties does."""
    return area.facts.get(ROLE) == NO_FLY or area.facts.get(PART, FENCE) in (FENCE, AREA)


def _says_height(drawing: Drawing) -> bool:
    return drawing.heights in FRAME_OF and all(height is not None for _, _, height in drawing.places)


def _items(command: int, drawing: Drawing, height_m: float | None, otherwise_m: float | None) -> tuple[PlanItem, ...]:
    """Return the places of a drawing at its own heights or at the given one. Raises FormatError."""
    if height_m is None and _says_height(drawing):
        return tuple(_point(command, FRAME_OF[drawing.heights], place) for place in drawing.places)
    given_m = height_m if height_m is not None else otherwise_m
    if given_m is None:
        what = "path" if drawing.kind == "line" else "rally point"
        raise FormatError(f"{what} {drawing.name!r} does not say how high: --height M gives metres above home")
    return tuple(_point(command, RELATIVE, (lat, lon, given_m)) for lat, lon, _ in drawing.places)


def _point(command: int, frame: int, place: Place) -> PlanItem:
    return place_item(command, frame, place[0], place[1], place[2] or 0.0)


def _fence_items(area: Drawing) -> list[PlanItem]:
    """Return one area as a fence shape: inside is allowed unless it is an exclusion; its holes are forbidden."""
    outside = area.facts.get(INCLUSION) == "false" or area.facts.get(ROLE) == NO_FLY
    circle = circle_of(area)
    if circle is not None:
        lat_deg, lon_deg, radius_m = circle
        return [place_item(CIRCLE_OUT if outside else CIRCLE_IN, AMSL, lat_deg, lon_deg, param1=radius_m)]
    # A hole would be an island in a forbidden area, which no fence protocol has.
    if outside and area.holes:
        raise FormatError(f"area {area.name!r}: a no-fly area with holes cannot be a fence")
    borders = [(POLYGON_OUT if outside else POLYGON_IN, area.places), *((POLYGON_OUT, hole) for hole in area.holes)]
    return [
        place_item(command, AMSL, *place[:2], param1=float(len(border)))
        for command, border in borders
        for place in border
    ]


def _home_of(drawing: Drawing) -> Home:
    lat_deg, lon_deg, height_m = drawing.places[0]
    known = drawing.heights == "amsl" and height_m is not None
    return Home(lat_deg, lon_deg, height_m if known and height_m is not None else math.nan)
