"""Flown tracks as files of other programs: CSV for analysis, KML for Google Earth, GPX 1.1 for map programs.

Numbers that are unknown are left empty. Heights in KML and GPX are above mean sea level, times are UTC.
"""

import html
import math
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.csv_table import csv_lines
from tui_gcs.core.records.flight_points import FlightPoint

MAX_TITLE_CELLS = 200
MAX_WALL_S = 253_402_300_799.0
"""The end of the year 9999, beyond which ISO 8601 has no dates."""
CSV_COLUMNS = (
    "time_utc",
    "time_s",
    "source",
    "vehicle",
    "lat_deg",
    "lon_deg",
    "amsl_m",
    "above_home_m",
    "north_m_s",
    "east_m_s",
    "up_m_s",
    "heading_deg",
    "mode",
    "armed",
    "battery_pct",
)
"""`time_s` counts from the first point of the file; `source` is the log that a point is from."""
_KML_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">\n<Document>\n'
)
_GPX_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<gpx version="1.1" creator="tui-gcs" xmlns="http://www.topografix.com/GPX/1/1">\n'
)

SourcePoint = tuple[str, FlightPoint]
"""The name of the log, and a point of it."""


def csv_text(points: Iterable[SourcePoint]) -> Iterator[str]:
    """Yield the lines of a CSV file, one for each point, in the order given."""
    return csv_lines(CSV_COLUMNS, _csv_rows(points))


def _csv_rows(points: Iterable[SourcePoint]) -> Iterator[tuple[object, ...]]:
    first_s: float | None = None
    for source, point in points:
        first_s = point.wall_s if first_s is None else first_s
        yield (
            _utc(point.wall_s),
            round(point.wall_s - first_s, 3),
            source,
            point.vehicle,
            round(point.lat_deg, 7),
            round(point.lon_deg, 7),
            *(round(value, 2) if math.isfinite(value) else "" for value in point[4:10]),
            point.mode,
            "" if point.armed is None else int(point.armed),
            round(point.battery_pct, 1) if math.isfinite(point.battery_pct) else "",
        )


def kml_text(points: Iterable[SourcePoint], title: str) -> str:
    """Return a KML document with one track over time for each source and vehicle."""
    tracks = []
    for (source, vehicle), track in _by_vehicle(points).items():
        whens = "".join(f"<when>{_utc(point.wall_s)}</when>" for point in track)
        coords = "".join(
            f"<gx:coord>{p.lon_deg:.7f} {p.lat_deg:.7f} {_number(p.amsl_m) or 0}</gx:coord>" for p in track
        )
        mode = "<altitudeMode>absolute</altitudeMode>" if math.isfinite(track[0].amsl_m) else ""
        name = f"<name>{_escaped(f'vehicle {vehicle}, {source}')}</name>"
        tracks.append(f"<Placemark>{name}<gx:Track>{mode}{whens}{coords}</gx:Track></Placemark>\n")
    return f"{_KML_HEAD}<name>{_escaped(title)}</name>\n{''.join(tracks)}</Document>\n</kml>\n"


def gpx_text(points: Iterable[SourcePoint], title: str) -> str:
    """Return a GPX document with one track for each source and vehicle."""
    tracks = []
    for (source, vehicle), track in _by_vehicle(points).items():
        rows = "".join(
            f'<trkpt lat="{point.lat_deg:.7f}" lon="{point.lon_deg:.7f}">'
            f"{f'<ele>{_number(point.amsl_m)}</ele>' if math.isfinite(point.amsl_m) else ''}"
            f"<time>{_utc(point.wall_s)}</time></trkpt>\n"
            for point in track
        )
        name = f"<name>{_escaped(f'vehicle {vehicle}, {source}')}</name>"
        tracks.append(f"<trk>{name}<trkseg>\n{rows}</trkseg></trk>\n")
    return f"{_GPX_HEAD}<metadata><name>{_escaped(title)}</name></metadata>\n{''.join(tracks)}</gpx>\n"


def _by_vehicle(points: Iterable[SourcePoint]) -> dict[tuple[str, int], list[FlightPoint]]:
    found: dict[tuple[str, int], list[FlightPoint]] = {}
    for source, point in points:
        found.setdefault((source, point.vehicle), []).append(point)
    return found


def _utc(wall_s: float) -> str:
    """Format a time; one that no calendar has, in a damaged log, becomes the year 1970."""
    wall_s = wall_s if 0 <= wall_s < MAX_WALL_S else 0.0
    return datetime.fromtimestamp(wall_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else ""


def _escaped(text: str) -> str:
    return html.escape(clean(text, MAX_TITLE_CELLS), quote=False)
