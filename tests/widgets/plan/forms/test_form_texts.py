"""Texts of the forms and what they mean; shapes changed as a whole."""

import math

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, area_m2, polygon_of
from tui_gcs.core.scenario.model import OperatingArea, Team
from tui_gcs.planner.api import Param
from tui_gcs.widgets.forms.form_text import (
    FieldError,
    ids_text,
    number_text,
    points_text,
    to_ids,
    to_number,
    to_points,
)
from tui_gcs.widgets.plan.forms.team_text import TeamText, team_text, to_team, to_value
from tui_gcs.widgets.plan.forms.zone_text import to_zone, zone_text
from tui_gcs.widgets.plan.shape_edit import (
    KINDS,
    Border,
    as_polygon,
    border_of,
    centre_of,
    converted,
    describe_corners,
    kind_of,
    moved,
    sized,
    turned,
)

NUMBERS = st.floats(-1e5, 1e5)
POINTS = st.tuples(NUMBERS, NUMBERS)
SHAPES: list[Shape] = [
    Circle((10.0, 20.0), 80.0),
    Rectangle((10.0, 20.0), 160.0, 120.0, 30.0),
    Polygon(((0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0))),
]


def test_numbers_read_well() -> None:
    assert [number_text(v) for v in (80.0, -12.5, 0.0, -0.0, 1 / 3, None)] == ["80", "-12.5", "0", "0", "0.333", ""]


@given(NUMBERS)
def test_untouched_number_keeps_its_exact_value(value: float) -> None:
    assert to_number(number_text(value), "x", value) == value


@pytest.mark.parametrize("text", ["", "abc", "nan", "inf", "1e999", "1_0", "80 m", "１2x"])
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(FieldError, match="must be a number"):
        to_number(text, "radius_m")


@given(st.lists(POINTS, max_size=20))
def test_untouched_corners_keep_their_exact_values(points: list[tuple[float, float]]) -> None:
    unique = list({points_text([point]): point for point in points}.values())
    assert to_points(points_text(unique), "vertices_m", tuple(unique)) == tuple(unique)


@pytest.mark.parametrize("text", ["1,2\n3,4", "1,2; 3,4", "  1,2   3,4 "])
def test_corners_are_separated_as_one_likes(text: str) -> None:
    assert to_points(text, "vertices_m") == ((1.0, 2.0), (3.0, 4.0))


def test_bad_corner_is_named() -> None:
    with pytest.raises(FieldError, match=r"vertices_m\[2\]: '3' is no corner"):
        to_points("1,2 3", "vertices_m")


@given(st.lists(st.integers(1, 254), max_size=30))
def test_ids_survive_their_text(ids: list[int]) -> None:
    assert to_ids(ids_text(ids), "vehicles") == tuple(ids)


@pytest.mark.parametrize("text", ["0", "255", "4-2", "1-", "x", "1.5", "-3", "999999999999", "²"])
def test_bad_ids_are_refused(text: str) -> None:
    with pytest.raises(FieldError, match="vehicles: "):
        to_ids(text, "vehicles")


@pytest.mark.parametrize("shape", SHAPES)
def test_zone_survives_its_text(shape: Shape) -> None:
    zone = Zone("a b", Role.NO_FLY, shape, None, 55.5)
    assert to_zone(zone_text(zone), zone) == zone


# ---------------------------------------------------------------- shapes


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", SHAPES)
def test_converted_shape_lies_where_the_old_one_was(shape: Shape, kind: str) -> None:
    new = converted(shape, kind)
    assert kind_of(new) == kind
    assert centre_of(new) == pytest.approx(centre_of(shape), abs=0.1)
    assert area_m2(new) == pytest.approx(area_m2(shape), rel=1.0)


@pytest.mark.parametrize("radius_m", [1.0, 7.0, 80.0, 1234.5])
def test_a_circle_with_corners_keeps_what_it_is_for(radius_m: float) -> None:
    """Nobody is let out of the area or into a no-fly zone, and a zone to be seen keeps its size."""
    circle = Circle((10.0, 20.0), radius_m)
    rim_m = {border: _reach_m(as_polygon(circle, border)) for border in Border}
    assert rim_m[Border.NOT_LARGER][1] <= radius_m
    assert rim_m[Border.NOT_SMALLER][0] >= radius_m
    if radius_m > 5.0:
        for border in Border:
            assert area_m2(as_polygon(circle, border)) == pytest.approx(area_m2(circle), rel=0.01)
        assert area_m2(as_polygon(circle)) == pytest.approx(area_m2(circle), rel=5e-4)


def _reach_m(polygon: Polygon) -> tuple[float, float]:
    """Of its border from the middle of the circle: least and most."""
    rim, middle = polygon_of(polygon).exterior, shapely.Point(10.0, 20.0)
    return rim.distance(middle), max(math.dist(corner, (10.0, 20.0)) for corner in polygon.vertices_m)


def test_which_border_counts_depends_on_what_it_is_for() -> None:
    circle = Circle((10.0, 20.0), 80.0)
    assert border_of(OperatingArea(circle, 20.0, 90.0)) is Border.NOT_LARGER
    assert border_of(Zone("a", Role.NO_FLY, circle)) is Border.NOT_SMALLER
    assert border_of(Zone("a", Role.DEFEND, circle)) is border_of(Zone("a", Role.ATTACK, circle)) is Border.AS_LARGE
    reported = {border: describe_corners(circle, as_polygon(circle, border)) for border in Border}
    assert "has 32 corners now, and is as large; u" in reported[Border.AS_LARGE]
    assert "0.7 % smaller" in reported[Border.NOT_LARGER] and "0.4 % larger" in reported[Border.NOT_SMALLER]
    assert describe_corners(Rectangle((0.0, 0.0), 4.0, 4.0), SHAPES[2]) == ""


@pytest.mark.parametrize("shape", SHAPES)
def test_moved_turned_and_sized_shapes(shape: Shape) -> None:
    x, y = centre_of(shape)
    assert centre_of(moved(shape, 5.0, -5.0)) == pytest.approx((x + 5.0, y - 5.0))
    assert area_m2(sized(shape, 2.0)) == pytest.approx(4.0 * area_m2(shape))
    assert area_m2(turned(shape, 33.0)) == pytest.approx(area_m2(shape), rel=1e-3)


def test_turning_is_clockwise() -> None:
    assert turned(SHAPES[1], 350.0) == Rectangle((10.0, 20.0), 160.0, 120.0, 20.0)
    square = Polygon(((-1.0, 9.0), (1.0, 9.0), (1.0, 11.0), (-1.0, 11.0)))
    # The north-west corner goes to the north-east.
    assert turned(square, 90.0).vertices_m[3] == (1.0, 11.0)  # type: ignore[union-attr]


# ---------------------------------------------------------------- teams

PARAMS = (
    Param("overlap", float, 0.05, minimum=0.0, maximum=0.5),
    Param("laps", int, 3, minimum=1),
    Param("quick", bool, False),
    Param("direction", str, "auto", choices=("auto", "cw")),
)
OLD = Team("attack", "field", "patrol", (5, 6, 7, 8), 0, {"overlap": 1 / 3, "theirs": 4})


def test_team_survives_its_text() -> None:
    assert to_team(team_text(OLD), OLD, PARAMS) == OLD


def test_empty_parameter_is_left_to_the_planner() -> None:
    texts = TeamText("attack", "5-8", "", "field", "patrol", {"overlap": " ", "laps": "4", "quick": "yes"})
    assert to_team(texts, OLD, PARAMS).parameters == {"theirs": 4, "laps": 4, "quick": True}


def test_another_planner_gets_only_its_own_parameters() -> None:
    texts = TeamText("attack", "5-8", "", "field", "other", {"laps": "4"})
    assert to_team(texts, OLD, PARAMS).parameters == {"laps": 4}


@pytest.mark.parametrize(("vehicles", "count"), [("", ""), ("1-4", "4"), ("", "0"), ("", "x"), ("", "9" * 50)])
def test_either_ids_or_a_count(vehicles: str, count: str) -> None:
    with pytest.raises(FieldError, match="count"):
        to_team(TeamText("attack", vehicles, count, "field", "patrol"), OLD, PARAMS)


@pytest.mark.parametrize(
    ("name", "text", "allowed"),
    [
        ("overlap", "0.6", "must be 0 to 0.5"),
        ("overlap", "x", "must be a number"),
        ("laps", "1.5", "must be at least 1"),
        ("direction", "up", "must be one of auto, cw"),
    ],
)
def test_parameter_that_is_not_allowed_shows_what_is(name: str, text: str, allowed: str) -> None:
    param = next(param for param in PARAMS if param.name == name)
    with pytest.raises(FieldError, match=allowed):
        to_value(param, text)
