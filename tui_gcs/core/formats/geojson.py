"""GeoJSON (RFC 7946): features with points, paths and areas; `[longitude, latitude, height]`.

The format has no word for what heights are above; our own files give it as a property.
"""

from collections.abc import Iterator
from typing import Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.bounded import json_text
from tui_gcs.core.formats.content import Drawing, FormatError, Heights, Place
from tui_gcs.core.formats.drawing_common import HEIGHTS, MAX_NAME_CELLS, MAX_POINTS, checked, number, points_of, ring

# Real drawings nest a few levels deep; Python itself gives up at a depth of 1,000.
MAX_DEPTH = 32
SINGLE = {"Point": "point", "LineString": "line", "Polygon": "area"}
MANY = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
KINDS = frozenset({*SINGLE, *MANY, *COLLECTIONS, "Feature"})
_HEIGHTS: dict[str, Heights] = {"home": "home", "ground": "ground", "amsl": "amsl"}
DECIMALS = 9
"""Decimals of a degree: 0.1 mm."""


def is_geojson(document: dict[str, Any]) -> bool:
    """Whether a JSON document is GeoJSON."""
    return document.get("type") in KINDS


def read_geojson(document: dict[str, Any]) -> tuple[Drawing, ...]:
    """Return all drawings of a document. Raises FormatError."""
    found: list[Drawing] = []
    points = 0
    for drawing in _any(document, "", {}, MAX_DEPTH):
        found.append(drawing)
        points += points_of(drawing)
        if points > MAX_POINTS:
            raise FormatError(f"more than {MAX_POINTS} points")
    return tuple(found)


def _any(node: Any, name: str, facts: dict[str, str], depth: int) -> Iterator[Drawing]:
    if not isinstance(node, dict) or depth == 0:
        raise FormatError("nested too deeply" if depth == 0 else "an object was expected")
    kind = node.get("type")
    if kind in COLLECTIONS:
        for part in _list(node.get(COLLECTIONS[kind])):
            yield from _any(part, name, facts, depth - 1)
    elif kind == "Feature":
        if node.get("geometry") is not None:
            own = node.get("properties")
            own = own if isinstance(own, dict) else {}
            properties: dict[str, str] = {
                clean(str(key), MAX_NAME_CELLS): clean(_word(value), MAX_NAME_CELLS) for key, value in own.items()
            }
            yield from _any(node["geometry"], properties.pop("name", "") or name, properties, depth - 1)
    elif kind in MANY:
        for part in _list(node.get("coordinates")):
            yield _geometry(MANY[kind], part, name, facts)
    elif kind in SINGLE:
        yield _geometry(kind, node.get("coordinates"), name, facts)
    else:
        raise FormatError(f"type {clean(str(kind), 40)!r} is not GeoJSON")


def _geometry(kind: str, raw: Any, name: str, facts: dict[str, str]) -> Drawing:
    heights = _HEIGHTS.get(facts.get(HEIGHTS, ""), "none")
    facts = {key: value for key, value in facts.items() if key != HEIGHTS}
    if kind == "Polygon":
        rings = [ring([_place(place) for place in _list(each)]) for each in _list(raw)]
        if not rings:
            raise FormatError("an area with 0 points")
        return checked(Drawing("area", name, rings[0], tuple(rings[1:]), heights, facts))
    places = tuple(_place(place) for place in ([raw] if kind == "Point" else _list(raw)))
    return checked(Drawing("point" if kind == "Point" else "line", name, places, heights=heights, facts=facts))


def _place(raw: Any) -> Place:
    values = _list(raw)
    if len(values) < 2:
        raise FormatError("a place needs two numbers")
    # GeoJSON has longitude first.
    return number(values[1]), number(values[0]), number(values[2]) if len(values) > 2 else None


def _list(raw: Any) -> list[Any]:
    if not isinstance(raw, list):
        raise FormatError(f"{clean(str(raw), 20)!r} is no list of coordinates")
    return raw


def _word(value: object) -> str:
    return value if isinstance(value, str) else "" if value is None else str(value)[: 2 * MAX_NAME_CELLS]


def write_geojson(drawings: tuple[Drawing, ...]) -> bytes:
    """Write a collection with one feature for each drawing."""
    features = [_feature(drawing) for drawing in drawings]
    return json_text({"type": "FeatureCollection", "features": features}).encode()


def _feature(drawing: Drawing) -> dict[str, Any]:
    properties = {"name": drawing.name, **drawing.facts}
    if drawing.heights != "none":
        properties[HEIGHTS] = drawing.heights
    kind = next(key for key, value in SINGLE.items() if value == drawing.kind)
    coordinates: Any
    if drawing.kind == "area":
        coordinates = [_coordinates((*places, places[0])) for places in (drawing.places, *drawing.holes)]
    else:
        coordinates = _coordinates(drawing.places)
        coordinates = coordinates[0] if drawing.kind == "point" else coordinates
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def _coordinates(places: tuple[Place, ...]) -> list[list[float]]:
    return [
        [round(lon, DECIMALS), round(lat, DECIMALS), *([] if height is None else [height])]
        for lat, lon, height in places
    ]
