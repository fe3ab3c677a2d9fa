"""Texts of the forms and what they mean; shapes changed as a whole."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.scenario import Team
from tui_gcs.core.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, area_m2
from tui_gcs.planner.api import Param
from tui_gcs.widgets.form_text import FieldError, ids_text, number_text, points_text, to_ids, to_number, to_points
from tui_gcs.widgets.shape_edit import KINDS, centre_of, converted, kind_of, moved, sized, turned
from tui_gcs.widgets.team_text import TeamText, team_text, to_team, to_value
from tui_gcs.widgets.zone_text import to_zone, zone_text

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
def test_parameter_that_is_not_allowed_says_what_is(name: str, text: str, allowed: str) -> None:
    param = next(param for param in PARAMS if param.name == name)
    with pytest.raises(FieldError, match=allowed):
        to_value(param, text)
