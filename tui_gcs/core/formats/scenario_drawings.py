"""Zones of a scenario as drawings and back, and the borders of a round as a fence for vehicles.

A circle and a rectangle are drawn with corners and give their dimensions as properties. If the corners were edited in
another program, the corners count.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tui_gcs.core.formats.content import Drawing, Place, counted, place_item
from tui_gcs.core.formats.drawings import (
    AREA,
    BORDER_TOLERANCE_M,
    PART,
    ROLE,
    ROUND,
    circle_facts,
    circle_of,
)
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, outline_m
from tui_gcs.core.plans.model import AMSL, CIRCLE_IN, CIRCLE_OUT, POLYGON_IN, POLYGON_OUT, Plan, PlanItem, PlanKind
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import MAX_VERTICES, MAX_ZONES, ScenarioError
from tui_gcs.core.scenario.model import OperatingArea, Round, Scenario

ZONE, START = "zone", "start"
ALT_MIN, ALT_MAX = "alt_min_m", "alt_max_m"
WIDTH, HEIGHT, HEADING = "width_m", "height_m", "heading_deg"
ROLES = {role.value: role for role in Role}
MAX_NAME = 32
"""The most characters of a zone's name."""


def draw_scenario(scenario: Scenario, rounds: Iterable[int] | None = None) -> tuple[Drawing, ...]:
    """Draw areas and zones of these rounds (None: all), and the take-off places."""
    frame = LocalFrame(scenario.origin)
    chosen = range(len(scenario.rounds)) if rounds is None else rounds
    found = [drawing for index in chosen for drawing in _draw_round(scenario.rounds[index], frame)]
    for number, place in enumerate(scenario.places, 1):
        whose = {"vehicle": str(place.vehicle)} if place.vehicle is not None else {}
        facts = {PART: START, "layer_m": f"{place.layer_m:g}", **whose}
        found.append(Drawing("point", f"take-off {number}", (_geodetic(frame, place.place_m),), facts=facts))
    return tuple(found)


def _draw_round(round_: Round, frame: LocalFrame) -> list[Drawing]:
    area = round_.area
    facts = {PART: AREA, ROUND: round_.name, ALT_MIN: f"{area.alt_min_m:g}", ALT_MAX: f"{area.alt_max_m:g}"}
    found = [_draw_shape(f"{round_.name}: area", area.shape, facts, frame)]
    for zone in round_.zones:
        band = {ALT_MIN: zone.alt_min_m, ALT_MAX: zone.alt_max_m}
        band_facts = {key: f"{value:g}" for key, value in band.items() if value is not None}
        found.append(
            _draw_shape(
                zone.name, zone.shape, {PART: ZONE, ROUND: round_.name, ROLE: zone.role.value} | band_facts, frame
            )
        )
    return found


def _draw_shape(name: str, shape: Shape, facts: dict[str, str], frame: LocalFrame) -> Drawing:
    border = tuple(_geodetic(frame, corner) for corner in outline_m(shape))
    if isinstance(shape, Circle):
        lat_deg, lon_deg, _ = _geodetic(frame, shape.centre_m)
        facts = facts | circle_facts(lat_deg, lon_deg, shape.radius_m)
    elif isinstance(shape, Rectangle):
        sizes = {WIDTH: shape.width_m, HEIGHT: shape.height_m, HEADING: shape.heading_deg}
        facts = facts | {key: f"{value:.9g}" for key, value in sizes.items()}
    return Drawing("area", name, border, facts=facts)


def _geodetic(frame: LocalFrame, point_m: tuple[float, float]) -> Place:
    lat_deg, lon_deg = frame.to_geodetic(*point_m)
    return lat_deg, lon_deg, None


def fence_of_round(scenario: Scenario, index: int) -> Plan:
    """Return the operating area and no-fly zones of a round as a fence."""
    frame = LocalFrame(scenario.origin)
    round_ = scenario.rounds[index]
    items = _fence_items(round_.area.shape, frame, CIRCLE_IN, POLYGON_IN)
    for zone in round_.no_fly:
        items += _fence_items(zone.shape, frame, CIRCLE_OUT, POLYGON_OUT)
    return Plan(PlanKind.FENCE, tuple(items))


def _fence_items(shape: Shape, frame: LocalFrame, circle: int, polygon: int) -> list[PlanItem]:
    if isinstance(shape, Circle):
        return [place_item(circle, AMSL, *frame.to_geodetic(*shape.centre_m), param1=shape.radius_m)]
    corners = outline_m(shape)
    places = (frame.to_geodetic(*corner) for corner in corners)
    return [place_item(polygon, AMSL, lat_deg, lon_deg, param1=float(len(corners))) for lat_deg, lon_deg in places]


@dataclass
class ZoneImport:
    """What became of the drawings of a file."""

    added: int = 0
    replaced: int = 0
    areas: int = 0
    other_rounds: int = 0
    closed: int = 0
    """Holes that became no-fly zones."""
    holes: int = 0
    """No-fly areas with holes, in which vehicles would be allowed."""
    no_zones: int = 0

    @property
    def left_out(self) -> tuple[str, ...]:
        """What is not in the scenario, one line each."""
        parts = (
            (self.no_zones, f"{counted(self.no_zones, 'drawing')} that {_are(self.no_zones)} no area"),
            (self.other_rounds, f"{counted(self.other_rounds, 'zone')} of other rounds"),
            (self.holes, f"holes of {counted(self.holes, 'no-fly area')}: a no-fly zone has none"),
        )
        return tuple(text for count, text in parts if count)

    @property
    def text(self) -> str:
        """What was changed, for the operator."""
        parts = ((self.added, "added"), (self.replaced, "replaced"))
        done = [f"{counted(count, 'zone')} {word}" for count, word in parts if count]
        done += [f"{counted(self.areas, 'operating area')} replaced"] * bool(self.areas)
        done += [f"{counted(self.closed, 'hole')} as no-fly zone{'s' * (self.closed > 1)}"] * bool(self.closed)
        return ", ".join(done) or "no area is in it"


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def put_drawings(
    document: ScenarioDocument,
    scenario: Scenario,
    drawn: Sequence[Drawing],
    index: int,
    role: Role,
    *,
    only: bool = False,
) -> ZoneImport:
    """Add the areas of a file to a scenario as zones with their own role, else `role`. Raises ScenarioError.

    A file of ours names the round of each area, and zones of the same name are replaced; other areas are added to round
    `index`. With `only`, zones of other rounds are left out. A hole becomes a no-fly zone.
    """
    put = ZoneImport()
    frame = LocalFrame(scenario.origin)
    names = [round_.name for round_ in scenario.rounds]
    used = [{zone.name for zone in round_.zones} for round_ in scenario.rounds]
    for drawing in drawn:
        named = drawing.facts.get(ROUND, "")
        at = names.index(named) if named in names else index
        if drawing.kind != "area":
            put.no_zones += 1
        elif only and at != index:
            put.other_rounds += 1
        elif drawing.facts.get(PART) == AREA:
            area = scenario.rounds[at].area
            # A drawing without altitudes leaves the area's own as they are.
            low, high = _fact(drawing, ALT_MIN), _fact(drawing, ALT_MAX)
            band = (area.alt_min_m if low is None else low, area.alt_max_m if high is None else high)
            document.set_area(at, OperatingArea(_shape(drawing, frame), *band))
            put.areas += 1
            _close_holes(document, at, drawing, "area", frame, used[at], put)
        else:
            # A file of another program may have any name: only our own zones are replaced.
            is_ours = drawing.facts.get(PART) == ZONE and named in names and drawing.name in used[at]
            name = drawing.name if is_ours else _free_name(drawing.name or ZONE, used[at])
            zone = _zone(drawing, name, frame, role)
            if is_ours:
                document.set_zone(at, name, zone)
            else:
                document.add_zone(at, zone)
            used[at].add(name)
            if zone.role is Role.NO_FLY:
                put.holes += bool(drawing.holes)
            else:
                _close_holes(document, at, drawing, name, frame, used[at], put)
            put.replaced, put.added = put.replaced + is_ours, put.added + (not is_ours)
        if len(used[at]) > MAX_ZONES:
            raise ScenarioError([f"{names[at]}: more than {MAX_ZONES} zones"])
    return put


def _close_holes(
    document: ScenarioDocument,
    at: int,
    drawing: Drawing,
    name: str,
    frame: LocalFrame,
    used: set[str],
    put: ZoneImport,
) -> None:
    """Add a no-fly zone for each hole of an area, as it is at every height."""
    for hole in drawing.holes:
        hole_name = _free_name(f"{name[: MAX_NAME - 9]} hole", used)
        if len(hole) > MAX_VERTICES:
            raise ScenarioError([f"a hole of {len(hole)} corners: a zone has {MAX_VERTICES} at most"])
        document.add_zone(at, Zone(hole_name, Role.NO_FLY, Polygon(tuple(_metres(frame, place) for place in hole))))
        used.add(hole_name)
        put.closed += 1


def needs_role(drawn: Sequence[Drawing]) -> bool:
    """Whether an area has no role."""
    return any(d.kind == "area" and d.facts.get(PART) != AREA and d.facts.get(ROLE) not in ROLES for d in drawn)


def _zone(drawing: Drawing, name: str, frame: LocalFrame, role: Role) -> Zone:
    named = ROLES.get(drawing.facts.get(ROLE, ""), role)
    return Zone(name, named, _shape(drawing, frame), _fact(drawing, ALT_MIN), _fact(drawing, ALT_MAX))


def _shape(drawing: Drawing, frame: LocalFrame) -> Shape:
    corners = tuple(_metres(frame, place) for place in drawing.places)
    circle = circle_of(drawing)
    # A circle has no vertices, however many corners its drawing has.
    if circle is None and len(corners) > MAX_VERTICES:
        raise ScenarioError([f"an area of {len(corners)} corners: a zone has {MAX_VERTICES} at most"])
    if circle is not None:
        return Circle(_metres(frame, (circle[0], circle[1], None)), circle[2])
    width_m, height_m, heading_deg = (_fact(drawing, key) for key in (WIDTH, HEIGHT, HEADING))
    if width_m and height_m and heading_deg is not None and len(corners) == 4:
        centre = (sum(x for x, _ in corners) / 4, sum(y for _, y in corners) / 4)
        # It counts as a rectangle only if its corners are still where its properties put them.
        rectangle = Rectangle((round(centre[0], 3), round(centre[1], 3)), width_m, height_m, heading_deg)
        if all(math.dist(a, b) <= BORDER_TOLERANCE_M for a, b in zip(outline_m(rectangle), corners, strict=True)):
            return rectangle
    return Polygon(corners)


def _metres(frame: LocalFrame, place: Place) -> tuple[float, float]:
    """Convert to metres, rounded to the millimetre: degrees of other programs are no more exact."""
    x_m, y_m = frame.to_enu(place[0], place[1])
    return round(x_m, 3) + 0.0, round(y_m, 3) + 0.0


def _fact(drawing: Drawing, key: str) -> float | None:
    try:
        value = float(drawing.facts[key])
    except (KeyError, ValueError):
        return None
    return value if math.isfinite(value) else None


def _free_name(name: str, used: set[str]) -> str:
    name = name[:MAX_NAME].strip() or ZONE
    tries = (name, *(f"{name[: MAX_NAME - 4]} {number}" for number in range(2, 1000)))
    return next(each for each in tries if each not in used)
