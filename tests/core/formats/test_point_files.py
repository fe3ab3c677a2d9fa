"""Points of interest from files: CSV and GeoJSON as other programs write them, and mistakes in one line."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.formats.point_files import PointFileError, read_points
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin

FRAME = LocalFrame(Origin(52.0, -0.6, 110.0))


def geojson(*features: object) -> str:
    return json.dumps({"type": "FeatureCollection", "features": features})


def point(lon: object, lat: object, **properties: object) -> dict[str, object]:
    return {"type": "Feature", "geometry": {"type": "Point", "coordinates": [lon, lat]}, "properties": properties}


def test_a_table_with_some_columns() -> None:
    text = "\ufeffName,LAT,lon,priority,deadline_s,remark\nwell,52.001,-0.6,3,90,old\n,52.0,-0.599,,,\n"
    well, other = read_points(text, "points.csv", FRAME)
    assert (well.name, well.priority, well.within_s, well.team) == ("well", 3.0, 90.0, "")
    assert well.place_m == pytest.approx((0.0, 111.3), abs=0.5)
    assert (other.name, other.priority, other.within_s) == ("", 1.0, math.inf)
    assert other.place_m == pytest.approx((68.7, 0.0), abs=0.5)


def test_points_of_a_drawing_and_nothing_else_of_it() -> None:
    line = {"type": "Feature", "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}}
    (found,) = read_points(geojson(line, point(-0.6, 52.0, name="well", team="red")), "a.geojson", FRAME)
    assert (found.name, found.team, found.place_m) == ("well", "red", pytest.approx((0.0, 0.0), abs=1e-6))


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("a.csv", "", "there is no point in it"),
        ("a.csv", "x,y\n1,2\n", "line 2: lat is missing"),
        ("a.csv", "lat,lon\n1,zwei\n", "line 2: lon 'zwei' is no number"),
        ("a.csv", "lat,lon\n91,0\n", "line 2: 91, 0 is no place on earth"),
        ("a.csv", "lat,lon,priority\n1,1,nan\n", "line 2: priority 'nan' is no number"),
        ("a.csv", "lat,lon\n" + "1,1\n" * 300, "300 points, at most 200 are allowed"),
        ("a.json", "[" * 100_000, "is no JSON"),
        ("a.json", "[]", "is no GeoJSON FeatureCollection"),
        ("a.geojson", geojson(point("x", 1)), "feature 1: lon 'x' is no number"),
        ("a.geojson", geojson({"geometry": {"type": "Point", "coordinates": [1]}}), "feature 1: a point has two"),
    ],
)
def test_mistakes_are_one_line(name: str, text: str, why: str) -> None:
    with pytest.raises(PointFileError) as caught:
        read_points(text, name, FRAME)
    assert why in str(caught.value) and "\n" not in str(caught.value)


@given(st.text(max_size=200), st.sampled_from(["a.csv", "a.geojson"]))
def test_any_text_is_points_or_a_mistake(text: str, name: str) -> None:
    try:
        assert read_points(text, name, FRAME)
    except PointFileError as error:
        assert "\n" not in str(error)
