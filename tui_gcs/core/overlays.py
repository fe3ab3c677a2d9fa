"""Drawings for the map from GeoJSON and KML files: points, lines and areas with a name, and nothing else of them.

The files come from anywhere: their size, depth and number of points are limited, XML entities are refused, names are
cleaned, and what is wrong is one line with the file's name.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from tui_gcs.core.text import clean

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET

SIZE_MAX = 20_000_000
POINTS_MAX = 100_000
NAME_MAX = 40
DEPTH_MAX = 32
Kind = Literal["point", "line", "area"]


class OverlayError(Exception):
    """A file cannot be shown: one line with its name and why."""


class Overlay(msgspec.Struct, frozen=True):
    """One thing to draw: places are (latitude, longitude) in degrees."""

    kind: Kind
    name: str
    places_deg: tuple[tuple[float, float], ...]


def load_overlay(path: Path) -> tuple[Overlay, ...]:
    """All that a file draws, by the ending of its name.

    Raises:
        OverlayError: not readable, too large, not what its name says, or without anything to draw.
    """
    readers = {".kml": _kml, ".geojson": _geojson, ".json": _geojson}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise OverlayError(f"{path}: not an overlay: .geojson, .json or .kml")
    try:
        if path.stat().st_size > SIZE_MAX:
            raise OverlayError(f"{path}: larger than {SIZE_MAX // 1_000_000} MB")
        if path.exists() and not (path.is_file() or path.is_dir()):  # a pipe or a device never ends
            raise OverlayError(f"{path}: not a file")
        data = path.read_bytes()
    except OSError as error:
        raise OverlayError(f"{path}: {error.strerror}") from None
    try:
        overlays = tuple(reader(data))
    except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError, SyntaxError) as error:
        raise OverlayError(f"{path}: {_one_line(error)}") from None
    if not overlays:
        raise OverlayError(f"{path}: nothing to draw: no point, line or area")
    if sum(len(overlay.places_deg) for overlay in overlays) > POINTS_MAX:
        raise OverlayError(f"{path}: more than {POINTS_MAX} points")
    return overlays


def _one_line(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "nested too deeply"
    if isinstance(error, KeyError):
        return f"{error} is missing"
    if isinstance(error, IndexError):
        return "a place needs two numbers"
    return clean(str(error).splitlines()[0] if str(error) else type(error).__name__)[:120]


def _overlay(kind: Kind, name: object, places: list[tuple[float, float]]) -> Overlay:
    least = {"point": 1, "line": 2, "area": 3}[kind]
    if len(places) < least:
        raise ValueError(f"a {kind} with {len(places)} points")
    for lat_deg, lon_deg in places:
        if not (-90.0 <= lat_deg <= 90.0 and -180.0 <= lon_deg <= 180.0):  # NaN is not
            raise ValueError(f"latitude {lat_deg:g}, longitude {lon_deg:g}: no place on Earth")
    return Overlay(kind, clean(str(name or ""))[:NAME_MAX], tuple(places))


# ------------------------------------------------------------ GeoJSON (RFC 7946)


def _geojson(data: bytes) -> Iterator[Overlay]:
    yield from _feature(json.loads(data), "", DEPTH_MAX)


def _feature(node: Any, name: object, depth: int) -> Iterator[Overlay]:
    if not isinstance(node, dict) or depth == 0:
        raise ValueError("nested too deeply" if depth == 0 else "an object was expected")
    kind = node.get("type")
    if kind == "FeatureCollection":
        for part in node["features"]:
            yield from _feature(part, name, depth - 1)
    elif kind == "Feature":
        properties = node.get("properties") or {}
        own = properties.get("name", "") if isinstance(properties, dict) else ""
        if node.get("geometry") is not None:
            yield from _feature(node["geometry"], own or name, depth - 1)
    elif kind == "GeometryCollection":
        for part in node["geometries"]:
            yield from _feature(part, name, depth - 1)
    else:
        yield from _geometry(kind, node["coordinates"], name)


def _geometry(kind: object, coordinates: Any, name: object) -> Iterator[Overlay]:
    """The parts of one geometry; of an area each ring is one."""
    single: dict[object, Kind] = {"Point": "point", "LineString": "line"}
    many: dict[object, Kind] = {"MultiPoint": "point", "MultiLineString": "line", "Polygon": "area"}
    if kind in single:
        yield _overlay(single[kind], name, _places([coordinates] if kind == "Point" else coordinates))
    elif kind in many:
        for part in coordinates:
            yield _overlay(many[kind], name, _places([part] if kind == "MultiPoint" else part))
    elif kind == "MultiPolygon":
        for part in coordinates:
            yield from _geometry("Polygon", part, name)
    else:
        raise ValueError(f"type {str(kind)[:40]!r} is not GeoJSON")


def _places(coordinates: Any) -> list[tuple[float, float]]:
    return [(_number(place[1]), _number(place[0])) for place in coordinates]


def _number(value: object) -> float:
    number = float(value) if isinstance(value, int | float | str) else math.nan
    if not math.isfinite(number):
        raise ValueError(f"{str(value)[:20]!r} is no coordinate")
    return number


# ------------------------------------------------------------ KML (OGC 07-147r2)


def _kml(data: bytes) -> Iterator[Overlay]:
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data or b"\0" in data:  # UTF-16 could hide the words
        raise ValueError("declares entities or is not UTF-8: refused")
    import xml.etree.ElementTree as ET  # most consoles show no overlays, and start sooner without it

    for placemark in ET.fromstring(data).iter():  # noqa: S314 - without entities there is nothing to expand
        if _local(placemark) != "Placemark":
            continue
        name = next((child.text for child in placemark if _local(child) == "name"), "")
        for node in placemark.iter():
            if node is not placemark and _local(node) == "Placemark":  # thousands in each other take hours
                raise ValueError("a Placemark within a Placemark")
            yield from _kml_geometry(node, name)


def _kml_geometry(node: "ET.Element", name: object) -> Iterator[Overlay]:
    kinds: dict[str, Kind] = {"Point": "point", "LineString": "line", "LinearRing": "area"}
    kind = kinds.get(_local(node))
    if kind is None:
        return
    text = next((child.text or "" for child in node if _local(child) == "coordinates"), "")
    places = []
    for part in text.split():
        values = part.split(",")
        if len(values) < 2:
            raise ValueError(f"{part[:20]!r} is no coordinate")
        places.append((_number(values[1]), _number(values[0])))
    yield _overlay(kind, name, places)


def _local(node: "ET.Element") -> str:
    """The name of an element without its namespace; empty for comments."""
    return node.tag.rpartition("}")[2] if isinstance(node.tag, str) else ""
