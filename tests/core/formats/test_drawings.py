"""KML, KMZ, GeoJSON: plans and zones as drawings, and back."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.plan_designs import HEIGHTS, LAT, LON, RALLIES, fences
from tests.core.rigs.plan_peers import circle, fence, mission, rally, square, waypoint
from tui_gcs.core.formats import geojson, kml
from tui_gcs.core.formats.content import Content, Drawing, FormatError, Heights, Home
from tui_gcs.core.formats.conversion import BaseScenario, ConversionOptions, convert
from tui_gcs.core.formats.drawings import draw, planned
from tui_gcs.core.formats.file_types import BY_NAME, read_file
from tui_gcs.core.formats.scenario_drawings import put_drawings
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Zone, outline_m
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import parse

SCENARIO = (Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml").read_text()
DRAWN = ("kml", "kmz", "geojson")
PLACES_M = st.tuples(st.integers(220, 380).map(float), st.integers(100, 300).map(float))
EARTH = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Document><Folder>
<Placemark><name>field</name><Polygon><tessellate>1</tessellate><outerBoundaryIs><LinearRing><coordinates>
  8.54,47.39,0 8.55,47.39,0 8.55,47.40,0 8.54,47.39,0 </coordinates></LinearRing></outerBoundaryIs>
  <innerBoundaryIs><LinearRing><coordinates>8.543,47.392 8.546,47.392 8.546,47.395 8.543,47.392</coordinates>
  </LinearRing></innerBoundaryIs></Polygon></Placemark>
<Placemark><name>way</name><LineString><altitudeMode>{mode}</altitudeMode>
  <coordinates>8.541,47.391,20 8.542,47.392,25</coordinates></LineString></Placemark>
<Placemark><name>mast</name><Point><coordinates>8.545,47.395,0</coordinates></Point></Placemark>
</Folder></Document></kml>"""


def as_file(drawings: tuple[Drawing, ...], name: str) -> bytes:
    if name == "geojson":
        return geojson.write_geojson(drawings)
    return (kml.write_kmz if name == "kmz" else kml.write_kml)(drawings, "test")


@pytest.mark.parametrize("name", DRAWN)
def test_a_path_a_fence_and_rally_points_come_back(name: str) -> None:
    plan = Content(
        Plan(PlanKind.MISSION, mission(9).items[1:-1]),
        fence(*square(), circle(50.5)),
        rally(20.0),
        Home(47.3, 8.5, 488),
    )
    out = draw(plan)
    back = planned(read_file(as_file(out.drawings, name)).drawings, None)
    assert out.left_out == () and back.left_out == ()
    assert (back.mission, back.rally, back.home) == (plan.mission, plan.rally, plan.home)
    assert back.fence is not None and back.fence.fingerprint == plan.fence.fingerprint


@pytest.mark.parametrize("name", DRAWN)
def test_what_a_drawing_cannot_hold_is_reported(name: str) -> None:
    jump = PlanItem(177, 2, (0.0, 3.0, 0.0, 0.0))
    held = replace(mission(3).items[1], params=(5.0, 0.0, 0.0, math.nan))
    out = convert(
        Content(Plan(PlanKind.MISSION, (mission(3).items[0], held, jump, jump))), BY_NAME[name], ConversionOptions()
    )
    assert out.left_out == (
        "2 items without a place (2 x jump)",
        "what 1 item does (1 x take-off): drawn as places only",
        "parameters of 1 way-point (hold times, radii, headings)",
    )


@pytest.mark.parametrize(("mode", "frame"), [("relativeToGround", 10), ("absolute", 0)])
def test_heights_are_above_what_the_file_gives(mode: str, frame: int) -> None:
    content = planned(read_file(EARTH.format(mode=mode).encode()).drawings, None)
    assert [(item.frame, item.z) for item in content.mission.items] == [(frame, 20.0), (frame, 25.0)]
    assert content.left_out == ("1 point that says not what of",)


def test_heights_that_are_above_nothing_known_must_be_given() -> None:
    drawings = read_file(EARTH.format(mode="clampToGround").encode()).drawings
    with pytest.raises(FormatError, match="path 'way' does not say how high: --height"):
        planned(drawings, None)
    content = planned(drawings, 30.0)
    assert [(item.frame, item.z) for item in content.mission.items] == [(3, 30.0), (3, 30.0)]


def test_an_area_with_a_hole_is_a_fence_with_an_exclusion() -> None:
    content = planned(read_file(EARTH.format(mode="absolute").encode()).drawings, None)
    assert [item.command for item in content.fence.items] == [5001] * 3 + [5002] * 3
    assert content.fence.items[0].x == 473_900_000 and content.fence.items[0].params[0] == 3.0


def test_a_closed_line_that_is_a_ring_is_an_area() -> None:
    ring = "<LinearRing><coordinates>8.54,47.39 8.55,47.39 8.55,47.40 8.54,47.39</coordinates></LinearRing>"
    text = f'<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><name>field</name>{ring}</Placemark></kml>'
    (area,) = read_file(text.encode()).drawings
    assert (area.kind, area.name) == ("area", "field")
    assert [place[:2] for place in area.places] == [(47.39, 8.54), (47.39, 8.55), (47.40, 8.55)]


def test_heights_above_home_become_heights_above_the_sea_only_where_home_is_known() -> None:
    mixed = Plan(PlanKind.MISSION, (mission(3).items[1], replace(mission(3).items[1], frame=0, z=520.0)))
    with pytest.raises(FormatError, match="above different things"):
        draw(Content(mixed))
    path = draw(Content(mixed, home=Home(47.0, 8.0, 488.0))).drawings[0]
    assert path.heights == "amsl" and [height for _, _, height in path.places] == [508.0, 520.0]


def test_a_circle_that_was_moved_in_another_program_is_what_was_drawn_there() -> None:
    area = draw(Content(fence=fence(circle(50.0)))).drawings[0]
    moved = replace(area, places=tuple((lat + 0.001, lon, None) for lat, lon, _ in area.places))
    content = planned((moved,), None)
    assert {item.command for item in content.fence.items} == {5002} and len(content.fence.items) == 64


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.tuples(LAT, LON, HEIGHTS), min_size=2, max_size=6),
    st.sampled_from([0, 3, 10]),
    fences(),
    RALLIES.filter(lambda plan: bool(plan.items)),
    st.sampled_from(DRAWN),
)
def test_any_path_and_fence_comes_back_as_it_was(
    places: list[tuple[int, int, float]], frame: int, fence_: Plan, rally_: Plan, name: str
) -> None:
    path = Plan(PlanKind.MISSION, tuple(PlanItem(16, frame, x=x, y=y, z=z) for x, y, z in places))
    back = planned(read_file(as_file(draw(Content(path, fence_, rally_)).drawings, name)).drawings, None)
    found = (back.mission, back.fence, back.rally)
    assert [plan.fingerprint for plan in found] == [plan.fingerprint for plan in (path, fence_, rally_)]


# ---------------------------------------------------------------- what is drawn, and what is not


def test_a_place_on_the_equator_is_drawn_and_the_present_place_is_not() -> None:
    here, speed = PlanItem(22, 3, z=10.0), PlanItem(178, 2, (1.0, 5.0, -1.0, 0.0))
    equator, greenwich = waypoint(0, x=0), waypoint(1, y=0)
    out = draw(Content(Plan(PlanKind.MISSION, (here, equator, speed, greenwich))))
    way, first, second = out.drawings
    assert [place[:2] for place in way.places] == [(0.0, 8.5456), (greenwich.lat_deg, 0.0)]
    assert (first.name, second.name) == ("2 waypoint", "4 waypoint"), "as they are counted in the mission"
    assert out.left_out == ("2 items without a place (1 x take-off, 1 x speed)",)


@pytest.mark.parametrize("home", [None, Home(47.3, 8.5, 488.0)])
def test_a_mission_without_places_is_reported_and_not_drawn(home: Home | None) -> None:
    out = draw(Content(Plan(PlanKind.MISSION, (PlanItem(22, 3, z=10.0),)), home=home))
    assert [d.kind for d in out.drawings] == ["point"] * (home is not None)
    assert out.left_out == ("1 item without a place (1 x take-off)",) and out.notes == ()


def test_one_place_is_no_path() -> None:
    assert [d.kind for d in draw(Content(Plan(PlanKind.MISSION, (waypoint(0),)))).drawings] == ["point"]


@pytest.mark.parametrize("frames", [(10, 0), (3, 10), (3, 0, 10)])
def test_heights_above_the_ground_are_never_turned_into_others(frames: tuple[int, ...]) -> None:
    mixed = Plan(PlanKind.MISSION, tuple(waypoint(i, frame=frame) for i, frame in enumerate(frames)))
    with pytest.raises(FormatError, match="above different things"):
        draw(Content(mixed, home=Home(47.0, 8.0, 488.0)))


def test_without_the_height_of_home_heights_above_it_stay_what_they_are() -> None:
    mixed = Plan(PlanKind.MISSION, (waypoint(0), waypoint(1, frame=0)))
    with pytest.raises(FormatError, match="above different things"):
        draw(Content(mixed, home=Home(47.0, 8.0)))
    written_so = Plan(PlanKind.MISSION, (waypoint(0, frame=6), waypoint(1)))
    out = draw(Content(written_so))
    assert out.drawings[0].heights == "home" and "above home, and are written as above ground" in out.notes[0]


@pytest.mark.parametrize(
    ("frame", "heights"), [(0, "amsl"), (5, "amsl"), (3, "home"), (6, "home"), (10, "ground"), (11, "ground")]
)
def test_a_rally_point_and_home_say_what_they_are_above(frame: int, heights: str) -> None:
    point = Plan(PlanKind.RALLY, (PlanItem(5100, frame, x=470_000_000, y=80_000_000, z=20.0),))
    drawn, home = draw(Content(rally=point, home=Home(47.0, 8.0))).drawings
    assert (drawn.name, drawn.heights, drawn.places) == ("rally 1", heights, ((47.0, 8.0, 20.0),))
    assert (home.heights, home.places) == ("none", ((47.0, 8.0, None),))


@pytest.mark.parametrize(("command", "least", "most"), [(5003, 49.9, 50.0), (5004, 50.0, 50.1)])
def test_the_corners_of_a_circle_are_on_the_safe_side(command: int, least: float, most: float) -> None:
    """On the rim of what is to be stayed in, and no edge cuts what is to be kept out of."""
    item = circle(50.0, command)
    (area,) = draw(Content(fence=fence(item))).drawings
    frame = LocalFrame(Origin(item.lat_deg, item.lon_deg, 0.0))
    corners = np.array([frame.to_enu(lat, lon) for lat, lon, _ in area.places])
    edges = (corners + np.roll(corners, 1, axis=0)) / 2
    found = [*np.hypot(*corners.T), *np.hypot(*edges.T)]
    assert least - 1e-6 <= min(found) and max(found) <= most + 1e-6


# ---------------------------------------------------------------- what is taken


def way(*heights: float | None, above: Heights = "home", **facts: str) -> Drawing:
    places = tuple((47.0 + i / 1e4, 8.0, height) for i, height in enumerate(heights))
    return Drawing("line", "way", places, heights=above, facts=facts)


def area(*, holes: int = 0, corners: int = 4, **facts: str) -> Drawing:
    turns = [math.tau * i / corners for i in range(corners)]
    border = tuple((47.0 + 0.001 * math.cos(a), 8.0 + 0.001 * math.sin(a), None) for a in turns)
    hole = tuple((47.0 + (lat - 47.0) / 4, 8.0 + (lon - 8.0) / 4, None) for lat, lon, _ in border)
    return Drawing("area", "field", border, holes=(hole,) * holes, facts=facts)


def point(height: float | None = None, above: Heights = "none", **facts: str) -> Drawing:
    return Drawing("point", "mast", ((47.0, 8.0, height),), heights=above, facts=facts)


@pytest.mark.parametrize(
    ("path", "given_m", "otherwise_m", "flown"),
    [
        (way(20.0, 30.0), None, None, [(3, 20.0), (3, 30.0)]),
        (way(20.0, 30.0, above="amsl"), None, 7.0, [(0, 20.0), (0, 30.0)]),
        (way(20.0, 30.0, above="amsl"), 7.0, None, [(3, 7.0), (3, 7.0)]),
        (way(20.0, 0.0, above="ground"), None, None, [(10, 20.0), (10, 0.0)]),
        (way(20.0, None), None, 7.0, [(3, 7.0), (3, 7.0)]),
        (way(20.0, 30.0, above="none"), None, 7.0, [(3, 7.0), (3, 7.0)]),
        (way(20.0, None), 0.0, 7.0, [(3, 0.0), (3, 0.0)]),
    ],
)
def test_a_path_has_its_own_height_or_the_given_one(
    path: Drawing, given_m: float | None, otherwise_m: float | None, flown: list[tuple[int, float]]
) -> None:
    content = planned((path,), given_m, otherwise_m)
    assert [(item.frame, item.z) for item in content.mission.items] == flown
    is_assumed = given_m is None and flown[0] == (3, 7.0)
    assert content.notes == ("the path does not say how high: 7 m above home",) * is_assumed


def test_a_rally_point_that_does_not_say_how_high_is_refused_as_one() -> None:
    with pytest.raises(FormatError, match="rally point 'mast' does not say how high"):
        planned((point(part="rally"),), None)
    assert planned((point(part="rally"),), None, 15.0).rally.items[0].z == 15.0


def test_only_what_is_meant_so_becomes_a_mission_or_a_fence() -> None:
    drawings = (way(5.0, 5.0, part="track"), way(20.0, 20.0), way(30.0, 30.0), area(part="zone"), area())
    content = planned(drawings, None)
    assert [item.z for item in content.mission.items] == [20.0, 20.0] and len(content.fence.items) == 4
    assert content.left_out == (
        "path 'way': a mission is one path, the first",
        "1 zone to fly in: no part of a fence",
    )
    assert planned((), None) == Content()


def test_points_of_a_known_part_are_not_lost_and_not_reported() -> None:
    marks = (point(part="waypoint"), point(part="home"), point(500.0, "amsl", part="fence return"))
    content = planned(marks, None)
    assert content.left_out == () and content.mission is None
    assert [(item.command, item.x, item.y) for item in content.fence.items] == [(5000, 470_000_000, 80_000_000)]
    assert planned((point(), point(part="tree")), None).left_out == ("2 points that say not what of",)


@pytest.mark.parametrize(
    ("height", "above", "amsl_m"),
    [(488.0, "amsl", 488.0), (488.0, "ground", math.nan), (None, "amsl", math.nan), (0.0, "amsl", 0.0)],
)
def test_home_keeps_its_height_above_the_sea(height: float | None, above: Heights, amsl_m: float) -> None:
    home = planned((point(height, above, part="home"),), None).home
    assert (home.lat_deg, home.lon_deg) == (47.0, 8.0) and home.amsl_m == pytest.approx(amsl_m, nan_ok=True)


def test_what_is_kept_out_of_has_no_holes() -> None:
    commands = [item.command for item in planned((area(holes=1),), None).fence.items]
    assert commands == [5001] * 4 + [5002] * 4
    for facts in ({"role": "no-fly"}, {"inclusion": "false"}):
        assert {item.command for item in planned((area(**facts),), None).fence.items} == {5002}
        with pytest.raises(FormatError, match="no-fly area with holes"):
            planned((area(holes=1, **facts),), None)


def test_more_than_a_vehicle_holds_is_refused_before_it_is_made() -> None:
    most = way(*[5.0] * 2000)
    assert len(planned((most,), None).mission.items) == 2000
    assert len(planned((area(corners=2000),), None).fence.items) == 2000
    rallies = (point(5.0, "home", part="rally"),) * 2000
    assert len(planned(rallies, None).rally.items) == 2000
    for drawings in (
        (way(*[5.0] * 2001),),
        (area(corners=2001),),
        (area(corners=1990), point(part="fence return")) + (area(),) * 3,
        (area(corners=1000, holes=1), area()),
        rallies + rallies[:1],
    ):
        with pytest.raises(FormatError, match="more than 2000 items"):
            planned(drawings, None)
    circles = draw(Content(fence=fence(*(circle(20.0 + i) for i in range(40))))).drawings
    assert len(planned(circles, None).fence.items) == 40, "2560 corners, 40 items"


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius_m": "0"},
        {"radius_m": "-50"},
        {"radius_m": "inf"},
        {"radius_m": "50 m"},
        {"centre_lat": "90"},
        {"centre_lat": "nan"},
        {"centre_lon": "181"},
    ],
    ids=str,
)
def test_a_border_without_valid_circle_properties_is_what_was_drawn(wrong: dict[str, str]) -> None:
    (whole,) = draw(Content(fence=fence(circle(50.0)))).drawings
    assert len(planned((whole,), None).fence.items) == 1
    broken = replace(whole, facts={**whole.facts, **wrong})
    assert [item.command for item in planned((broken,), None).fence.items] == [5002] * 64


# ---------------------------------------------------------------- zones


@pytest.mark.parametrize("name", DRAWN)
def test_zones_of_a_scenario_come_back_to_the_letter(name: str) -> None:
    base = BaseScenario(parse(SCENARIO), SCENARIO)
    out = convert(base, BY_NAME[name], ConversionOptions())
    back = convert(read_file(out.data), BY_NAME["scenario"], ConversionOptions(base=base))
    assert back.data.decode() == SCENARIO, "comments and all"
    assert back.notes == ("6 zones replaced, 3 operating areas replaced",)


def test_zones_of_another_program_are_added_with_the_role_that_is_given() -> None:
    base = BaseScenario(parse(SCENARIO), SCENARIO)
    lat, lon = base.scenario.origin.lat_deg, base.scenario.origin.lon_deg
    corners = [(lat, lon, None), (lat + 2e-4, lon, None), (lat + 2e-4, lon + 2e-4, None), (lat, lon + 2e-4, None)]
    content = read_file(kml.write_kml((Drawing("area", "the field", tuple(corners)),), "x"))
    with pytest.raises(FormatError, match="--role"):
        convert(content, BY_NAME["scenario"], ConversionOptions(base=base))
    out = convert(content, BY_NAME["scenario"], ConversionOptions(base=base, role=Role.NO_FLY, round_index=1))
    zone = parse(out.data.decode()).rounds[1].zones[-1]
    assert (zone.name, zone.role, len(zone.shape.vertices_m)) == ("the field", Role.NO_FLY, 4)
    more = BaseScenario(parse(out.data.decode()), out.data.decode())
    again = convert(content, BY_NAME["scenario"], ConversionOptions(base=more, role=Role.NO_FLY, round_index=1))
    assert parse(again.data.decode()).rounds[1].zones[-1].name == "the field 2"


def test_a_rectangle_and_a_circle_stay_what_they_are_until_their_corners_move() -> None:
    text = SCENARIO
    scenario = parse(text)
    document = ScenarioDocument(text)
    zone = scenario.rounds[0].zones[0]
    turned = Rectangle(zone.shape.centre_m, 30.0, 20.0, 30.0)
    document.set_zone(0, zone.name, type(zone)(zone.name, zone.role, turned))
    scenario = parse(document.text)
    drawn = read_file(
        convert(BaseScenario(scenario, document.text), BY_NAME["geojson"], ConversionOptions()).data
    ).drawings
    target = ScenarioDocument(text)
    put_drawings(target, scenario, drawn, 0, Role.DEFEND)
    assert parse(target.text).rounds[0].zones[0].shape == turned
    moved = tuple(
        replace(d, places=tuple((lat + 1e-4, lon, h) for lat, lon, h in d.places)) if d.name == zone.name else d
        for d in drawn
    )
    put_drawings(target, scenario, moved, 0, Role.DEFEND)
    assert isinstance(parse(target.text).rounds[0].zones[0].shape, Rectangle), "moved as a whole"
    bent = tuple(replace(d, places=(d.places[0], *d.places[2:])) if d.name == zone.name else d for d in drawn)
    put_drawings(target, scenario, bent, 0, Role.DEFEND)
    assert isinstance(parse(target.text).rounds[0].zones[0].shape, Polygon)


@pytest.mark.long
@settings(max_examples=15, deadline=None)
@given(
    st.builds(Circle, PLACES_M, st.integers(5, 60).map(float))
    | st.builds(Rectangle, PLACES_M, st.integers(5, 60).map(float), st.integers(5, 60).map(float), st.floats(0, 359)),
    st.sampled_from(list(Role)),
    st.sampled_from(DRAWN),
)
def test_any_zone_comes_back_as_it_was(shape: Circle | Rectangle, role: Role, name: str) -> None:
    document = ScenarioDocument(SCENARIO)
    document.add_zone(0, Zone("new", role, shape, 20.0, None))
    base = BaseScenario(parse(document.text), document.text)
    file = read_file(convert(base, BY_NAME[name], ConversionOptions()).data)
    back = convert(file, BY_NAME["scenario"], ConversionOptions(base=BaseScenario(parse(SCENARIO), SCENARIO)))
    zone = parse(back.data.decode()).rounds[0].zones[-1]
    assert (zone.name, zone.role, zone.alt_min_m) == ("new", role, 20.0) and type(zone.shape) is type(shape)
    found, wanted = np.array(outline_m(zone.shape)), np.array(outline_m(shape))
    assert np.abs(found - wanted).max() < 0.002, "to the millimetre"


def test_a_fence_is_of_one_round_and_keeps_out_of_its_no_fly_zones() -> None:
    document = ScenarioDocument(SCENARIO)
    document.add_zone(0, Zone("mast", Role.NO_FLY, Circle((300.0, 200.0), 20.0)))
    base = BaseScenario(parse(document.text), document.text)
    drawn = read_file(convert(base, BY_NAME["kml"], ConversionOptions(round_index=0)).data).drawings
    assert [item.command for item in planned(drawn, None).fence.items] == [5001] * 4 + [5004]
    direct = json.loads(convert(base, BY_NAME["plan"], ConversionOptions(round_index=0)).data)["geoFence"]
    assert [circle_["inclusion"] for circle_ in direct["circles"]] == [False]
    with pytest.raises(FormatError, match="areas of several rounds are in it"):
        planned(read_file(convert(base, BY_NAME["kml"], ConversionOptions()).data).drawings, None)


def test_a_round_as_a_fence_for_vehicles() -> None:
    base = BaseScenario(parse(SCENARIO), SCENARIO)
    out = convert(base, BY_NAME["plan"], ConversionOptions(round_index=0))
    made = json.loads(out.data)["geoFence"]
    assert len(made["polygons"]) + len(made["circles"]) == 1 and made["polygons"][0]["inclusion"] is True
    assert "as a fence" in out.notes[0]


def test_holes_of_an_area_become_no_fly_zones() -> None:
    """They were left out: a lake was searched across its island."""
    scenario = parse(SCENARIO)
    frame = LocalFrame(scenario.origin)
    corners = ((-1.0, -1.0), (1.0, -1.0), (0.0, 1.0))
    lake, island = (
        tuple((*frame.to_geodetic(300.0 + x * size_m, 200.0 + y * size_m), None) for x, y in corners)
        for size_m in (60.0, 10.0)
    )
    document = ScenarioDocument(SCENARIO)
    put = put_drawings(document, scenario, [Drawing("area", "lake", lake, holes=(island, island))], 0, Role.ATTACK)
    assert (put.text, put.left_out) == ("1 zone added, 2 holes as no-fly zones", ())
    zones = {zone.name: zone for zone in parse(document.text).rounds[0].zones}
    assert zones["lake"].role is Role.ATTACK
    assert [zone.name for zone in zones.values() if zone.role is Role.NO_FLY] == ["lake hole", "lake hole 2"]
    assert np.allclose(outline_m(zones["lake hole"].shape), [(290.0, 190.0), (310.0, 190.0), (300.0, 210.0)], atol=0.01)

    document = ScenarioDocument(SCENARIO)
    put = put_drawings(document, scenario, [Drawing("area", "lake", lake, holes=(island,))], 0, Role.NO_FLY)
    assert put.left_out == ("holes of 1 no-fly area: a no-fly zone has none",)
