"""KML (OGC 07-147r2) and KMZ: placemarks with points, paths and areas; `longitude,latitude,height`.

Links are never followed. Styles, folders and everything else are skipped.
"""

import html
from collections.abc import Iterator
from typing import TYPE_CHECKING

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.bounded import local, xml_of, zip_member, zip_of
from tui_gcs.core.formats.content import Drawing, FormatError, Heights, Place
from tui_gcs.core.formats.drawing_common import HEIGHTS, MAX_NAME_CELLS, MAX_POINTS, checked, number, points_of, ring

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET

MODES: dict[str, Heights] = {"relativeToGround": "ground", "absolute": "amsl"}
MODE_OF = {"ground": "relativeToGround", "home": "relativeToGround", "amsl": "absolute", "none": "clampToGround"}
ZIP_MAGIC = b"PK\x03\x04"


def read_kmz(data: bytes) -> tuple[Drawing, ...]:
    """Read the drawings in the first KML file of an archive. Raises FormatError."""
    return read_kml(zip_member(data, ".kml"))


def read_kml(data: bytes) -> tuple[Drawing, ...]:
    """Read the drawings of all placemarks. Raises FormatError."""
    found: list[Drawing] = []
    points = 0
    for placemark in xml_of(data).iter():
        if local(placemark.tag) == "Placemark":
            for drawing in _placemark(placemark):
                found.append(drawing)
                points += points_of(drawing)
                if points > MAX_POINTS:
                    raise FormatError(f"more than {MAX_POINTS} points")
    return tuple(found)


def _placemark(placemark: "ET.Element") -> Iterator[Drawing]:
    name = next((child.text or "" for child in placemark if local(child.tag) == "name"), "")
    facts: dict[str, str] = {}
    geometries: list[ET.Element] = []
    inside: set[int] = set()
    for node in placemark.iter():
        tag = local(node.tag)
        # Thousands of placemarks nested in each other would take hours.
        if tag == "Placemark" and node is not placemark:
            raise FormatError("a Placemark within a Placemark")
        if tag == "Data":
            value = next((child.text or "" for child in node if local(child.tag) == "value"), "")
            facts[clean(node.get("name", ""), MAX_NAME_CELLS)] = clean(value.strip(), MAX_NAME_CELLS)
        elif tag in ("Point", "LineString", "Polygon"):
            geometries.append(node)
            # A LinearRing within a polygon is its border, and no shape of its own.
            inside.update(map(id, node.iter()))
        elif tag == "LinearRing" and id(node) not in inside:
            geometries.append(node)
    for node in geometries:
        yield _drawing(node, clean(name.strip(), MAX_NAME_CELLS), facts)


def _drawing(node: "ET.Element", name: str, facts: dict[str, str]) -> Drawing:
    mode = next((child.text or "" for child in node if local(child.tag) == "altitudeMode"), "").strip()
    heights = MODES.get(mode, "none")
    if heights == "ground" and facts.get(HEIGHTS) == "home":
        heights = "home"
    facts = {key: value for key, value in facts.items() if key != HEIGHTS}
    tag = local(node.tag)
    if tag == "Point":
        return checked(Drawing("point", name, tuple(_coordinates(node)), heights=heights, facts=facts))
    if tag == "LineString":
        return checked(Drawing("line", name, tuple(_coordinates(node)), heights=heights, facts=facts))
    if tag == "LinearRing":
        return checked(Drawing("area", name, ring(_coordinates(node)), heights=heights, facts=facts))
    outer = _rings(node, "outerBoundaryIs")
    if len(outer) != 1:
        raise FormatError(f"a polygon with {len(outer)} outer borders")
    return checked(Drawing("area", name, outer[0], tuple(_rings(node, "innerBoundaryIs")), heights, facts))


def _rings(polygon: "ET.Element", which: str) -> list[tuple[Place, ...]]:
    borders = [child for child in polygon if local(child.tag) == which]
    return [ring(_coordinates(node)) for each in borders for node in each if local(node.tag) == "LinearRing"]


def _coordinates(node: "ET.Element") -> list[Place]:
    text = next((child.text or "" for child in node if local(child.tag) == "coordinates"), "")
    places: list[Place] = []
    for part in text.split():
        values = part.split(",")
        if len(values) not in (2, 3):
            raise FormatError(f"{clean(part, 20)!r} is no coordinate")
        lon, lat = (number(value) for value in values[:2])
        places.append((lat, lon, number(values[2]) if len(values) == 3 else None))
    return places


def write_kml(drawings: tuple[Drawing, ...], title: str) -> bytes:
    """Write a document with one placemark for each drawing."""
    body = "\n".join(_placemark_text(drawing) for drawing in drawings)
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2">\n<Document>\n'
    name = html.escape(clean(title, MAX_NAME_CELLS), quote=False)
    return f"{head}<name>{name}</name>\n{body}\n</Document>\n</kml>\n".encode()


def write_kmz(drawings: tuple[Drawing, ...], title: str) -> bytes:
    """Write the same document into an archive."""
    return zip_of("doc.kml", write_kml(drawings, title))


def _placemark_text(drawing: Drawing) -> str:
    facts = dict(drawing.facts) | ({HEIGHTS: "home"} if drawing.heights == "home" else {})
    data = "".join(
        f'<Data name="{html.escape(key)}"><value>{html.escape(value, quote=False)}</value></Data>'
        for key, value in facts.items()
    )
    extended = f"<ExtendedData>{data}</ExtendedData>" if data else ""
    name = html.escape(clean(drawing.name, MAX_NAME_CELLS), quote=False)
    return f"<Placemark><name>{name}</name>{extended}{_geometry_text(drawing)}</Placemark>"


def _geometry_text(drawing: Drawing) -> str:
    mode = f"<altitudeMode>{MODE_OF[drawing.heights]}</altitudeMode>"
    if drawing.kind == "area":
        rings = [("outerBoundaryIs", drawing.places), *(("innerBoundaryIs", hole) for hole in drawing.holes)]
        inside = "".join(
            f"<{which}><LinearRing>{_coordinates_text((*places, places[0]))}</LinearRing></{which}>"
            for which, places in rings
        )
        return f"<Polygon>{mode}{inside}</Polygon>"
    tag = "Point" if drawing.kind == "point" else "LineString"
    return f"<{tag}>{mode}{_coordinates_text(drawing.places)}</{tag}>"


def _coordinates_text(places: tuple[Place, ...]) -> str:
    parts = [
        ",".join(map(_decimal, (lon, lat) if height is None else (lon, lat, height))) for lat, lon, height in places
    ]
    return f"<coordinates>{' '.join(parts)}</coordinates>"


def _decimal(value: float) -> str:
    """Format a number without an exponent; 1e-9 degrees are 0.1 mm."""
    return f"{value:.9f}".rstrip("0").rstrip(".") if value else "0"
