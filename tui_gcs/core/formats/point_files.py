"""Files of points of interest: CSV with columns lat and lon, or GeoJSON with points.

Columns or properties `name`, `priority`, `deadline_s` and `team` are optional; others are ignored.
"""

import csv
import io
import json
import math
from collections.abc import Mapping
from typing import Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.points import MAX_POINT_NAME, MAX_POINTS, NewPoint


class PointFileError(ValueError):
    """A file that holds no points of interest; one line."""


def read_points(text: str, name: str, frame: LocalFrame) -> list[NewPoint]:
    """Return the points in a file's text; the format follows from its name. Raises `PointFileError`."""
    found = _geojson(text) if name.lower().endswith((".geojson", ".json")) else _csv(text)
    if not found:
        raise PointFileError("there is no point in it")
    if len(found) > MAX_POINTS:
        raise PointFileError(f"{len(found)} points, at most {MAX_POINTS} are allowed")
    return [_point(where, fields, frame) for where, fields in found]


def _csv(text: str) -> list[tuple[str, Mapping[str, Any]]]:
    try:
        rows = list(csv.DictReader(io.StringIO(text.removeprefix("\ufeff")), restkey="more"))
    except csv.Error as error:
        raise PointFileError(f"is no CSV: {error}") from None
    # The heading is line 1.
    return [(f"line {n}", {str(k).strip().lower(): v for k, v in row.items()}) for n, row in enumerate(rows, 2)]


def _geojson(text: str) -> list[tuple[str, Mapping[str, Any]]]:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise PointFileError(f"is no JSON: {clean(str(error), 100)}") from None
    features = data.get("features") if isinstance(data, dict) else None
    if not isinstance(features, list):
        raise PointFileError("is no GeoJSON FeatureCollection")
    found = list[tuple[str, Mapping[str, Any]]]()
    for n, feature in enumerate(features, 1):
        geometry = feature.get("geometry") if isinstance(feature, dict) else None
        if not isinstance(geometry, dict) or geometry.get("type") != "Point":
            continue
        place, properties = geometry.get("coordinates"), feature.get("properties")
        if not isinstance(place, list) or len(place) < 2:
            raise PointFileError(f"feature {n}: a point has two coordinates")
        fields = properties if isinstance(properties, dict) else {}
        found.append((f"feature {n}", {**fields, "lat": place[1], "lon": place[0]}))
    return found


def _point(where: str, fields: Mapping[str, Any], frame: LocalFrame) -> NewPoint:
    lat_deg, lon_deg = (_number(where, fields, key, None) for key in ("lat", "lon"))
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
        raise PointFileError(f"{where}: {lat_deg:g}, {lon_deg:g} is no place on earth")
    return NewPoint(
        clean(str(fields.get("name") or ""), MAX_POINT_NAME),
        frame.to_enu(lat_deg, lon_deg),
        _number(where, fields, "priority", 1.0),
        _number(where, fields, "deadline_s", math.inf),
        clean(str(fields.get("team") or ""), MAX_POINT_NAME),
    )


def _number(where: str, fields: Mapping[str, Any], key: str, default: float | None) -> float:
    """Return the number under `key`; the default where there is none. Raises `PointFileError`."""
    value = fields.get(key)
    if value in (None, ""):
        if default is None:
            raise PointFileError(f"{where}: {key} is missing")
        return default
    try:
        number = float(value) if isinstance(value, (int, float, str)) and not isinstance(value, bool) else math.nan
    except (ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise PointFileError(f"{where}: {key} {clean(repr(value), 40)} is no number")
    return number
