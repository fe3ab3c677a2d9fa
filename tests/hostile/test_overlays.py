"""Overlay files from anywhere: what is good is drawn, what is wrong is one line."""

import json
import os
from pathlib import Path

import pytest

from tui_gcs.core.formats.overlays import Overlay, OverlayError, load_overlay

KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document>
<Placemark><name>road\x9b</name><LineString><coordinates>-0.6,52.0,0 -0.59,52.01</coordinates></LineString></Placemark>
<Placemark><name>field</name><Polygon><outerBoundaryIs><LinearRing>
<coordinates>-0.6,52 -0.5,52 -0.5,52.1 -0.6,52</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
<Placemark><Point><coordinates>-0.6,52</coordinates></Point></Placemark>
</Document></kml>"""


def feature(kind: str, coordinates: object, name: object = "x") -> dict:
    return {"type": "Feature", "properties": {"name": name}, "geometry": {"type": kind, "coordinates": coordinates}}


def written(folder: Path, name: str, data: object) -> Path:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else json.dumps(data).encode())
    return path


def test_geojson(tmp_path: Path) -> None:
    ring = [[-0.6, 52.0], [-0.5, 52.0], [-0.5, 52.1], [-0.6, 52.0]]
    features = [
        feature("Point", [-0.6, 52.0, 7.0], "\x1b[31mmast"),
        feature("LineString", ring[:2]),
        feature("Polygon", [ring]),
        feature("MultiPolygon", [[ring], [ring]], None),
        {"type": "Feature", "properties": None, "geometry": None},
    ]
    found = load_overlay(written(tmp_path, "a.geojson", {"type": "FeatureCollection", "features": features}))
    assert [overlay.kind for overlay in found] == ["point", "line", "area", "area", "area"]
    assert found[0].places_deg == ((52.0, -0.6),)
    assert "\x1b" not in found[0].name


def test_kml(tmp_path: Path) -> None:
    found = load_overlay(written(tmp_path, "a.KML", KML.encode()))
    assert [(overlay.kind, len(overlay.places_deg)) for overlay in found] == [("line", 2), ("area", 3), ("point", 1)]
    assert "\x9b" not in found[0].name
    assert found[2] == Overlay("point", "", ((52.0, -0.6),))


@pytest.mark.parametrize(
    ("name", "data", "why"),
    [
        ("a.txt", b"", "is empty"),
        ("a.txt", b"RTL_ALT 1", "not an overlay"),
        ("a.json", b"{", "Expecting property name"),
        ("a.json", b'{"type": "\xe9"}', "not UTF-8"),
        pytest.param("a.json", b'{"a":' * 100_000, "nested too deeply", id="deep"),
        ("a.json", [], "none of the formats"),
        ("a.json", {"type": "FeatureCollection", "features": []}, "nothing is drawn"),
        ("a.json", {"type": "Topology"}, "no plan and no GeoJSON"),
        ("a.json", feature("Sphere", [[1, 2]]), "'Sphere' is not GeoJSON"),
        ("a.json", feature("Point", [1e999, 52]), "Infinity is no number"),
        ("a.json", feature("Point", [-0.6, 152]), "no place on earth"),
        ("a.json", feature("Point", [[], {}]), "no coordinate"),
        ("a.json", feature("Point", 7), "no list of coordinates"),
        ("a.json", feature("Point", [1]), "two numbers"),
        ("a.json", feature("MultiPolygon", [[[[1, 2], [3, 4], []]]]), "two numbers"),
        ("a.json", feature("Point", [int("9" * 400), 52]), "no coordinate"),
        ("a.json", feature("LineString", [[-0.6, 52]]), "a line with 1 points"),
        ("a.kml", b"<kml>", "no element found"),
        ("a.kml", b'<?xml version="1.0" encoding="nonsense"?><kml/>', "unknown encoding"),
        ("a.kml", b"<Placemark>" * 20_000 + b"</Placemark>" * 20_000, "nested too deeply"),
        ("a.kml", b'<!DOCTYPE x [<!ENTITY a "aaaa">]><kml>&a;</kml>', "entities"),
        ("a.kml", KML.encode("utf-16"), "UTF-16"),
        ("a.kml", KML.replace("-0.6,52.0,0", "north").encode(), "no coordinate"),
        ("missing.kml", None, "No such file"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path: Path, name: str, data: object, why: str) -> None:
    path = tmp_path / name if data is None else written(tmp_path, name, data)
    with pytest.raises(OverlayError) as error:
        load_overlay(path)
    assert why in str(error.value)
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def test_too_many_points_are_refused(tmp_path: Path) -> None:
    line = [[-0.6 + i * 1e-7, 52.0] for i in range(100_001)]
    with pytest.raises(OverlayError, match="more than 100000 points"):
        load_overlay(written(tmp_path, "a.json", feature("LineString", line)))


def test_a_pipe_is_no_file_to_wait_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.kml")
    with pytest.raises(OverlayError, match="not a file"):
        load_overlay(tmp_path / "a.kml")
