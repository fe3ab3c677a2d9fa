"""The fields of the zone form as texts, and the zone or operating area that they mean. Independent of Textual."""

from dataclasses import dataclass

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.widgets.forms.form_text import FieldError, number_text, points_text, to_number, to_points
from tui_gcs.widgets.plan.shape_edit import kind_of

AREA_NAME = "operating area"
ROLES = tuple(role.value for role in Role)


@dataclass(frozen=True)
class ZoneText:
    """The texts in the fields; fields that the shape does not have are empty."""

    name: str = ""
    role: str = Role.DEFEND.value
    shape: str = "circle"
    east_m: str = ""
    north_m: str = ""
    radius_m: str = ""
    width_m: str = ""
    height_m: str = ""
    heading_deg: str = ""
    vertices_m: str = ""
    alt_min_m: str = ""
    alt_max_m: str = ""


def zone_text(zone: Zone | OperatingArea) -> ZoneText:
    """Return the fields of a zone, or of an operating area, which has neither name nor role."""
    shape = zone.shape
    texts = {
        "shape": kind_of(shape),
        "alt_min_m": number_text(zone.alt_min_m),
        "alt_max_m": number_text(zone.alt_max_m),
    }
    if isinstance(zone, Zone):
        texts |= {"name": zone.name, "role": zone.role.value}
    if isinstance(shape, Polygon):
        texts["vertices_m"] = points_text(shape.vertices_m)
    else:
        texts |= {"east_m": number_text(shape.centre_m[0]), "north_m": number_text(shape.centre_m[1])}
    if isinstance(shape, Circle):
        texts["radius_m"] = number_text(shape.radius_m)
    if isinstance(shape, Rectangle):
        texts |= {"width_m": number_text(shape.width_m), "height_m": number_text(shape.height_m)}
        texts["heading_deg"] = number_text(shape.heading_deg)
    return ZoneText(**texts)


def to_zone(texts: ZoneText, old: Zone) -> Zone:
    """Return the zone that the fields mean; `old` is what they were filled from. Raises FieldError."""
    alt_min_m = to_number(texts.alt_min_m, "alt_min_m", old.alt_min_m) if texts.alt_min_m.strip() else None
    alt_max_m = to_number(texts.alt_max_m, "alt_max_m", old.alt_max_m) if texts.alt_max_m.strip() else None
    if not texts.name.strip():
        raise FieldError("name: nothing; must be 1 to 32 printable characters")
    return Zone(texts.name, Role(texts.role), to_shape(texts, old.shape), alt_min_m, alt_max_m)


def to_area(texts: ZoneText, old: OperatingArea) -> OperatingArea:
    """Return the operating area that the fields mean. Raises FieldError."""
    alt_min_m = to_number(texts.alt_min_m, "alt_min_m", old.alt_min_m)
    alt_max_m = to_number(texts.alt_max_m, "alt_max_m", old.alt_max_m)
    return OperatingArea(to_shape(texts, old.shape), alt_min_m, alt_max_m)


def to_shape(texts: ZoneText, old: Shape) -> Shape:
    """Return the shape that the fields mean. Raises FieldError."""
    if texts.shape == "polygon":
        corners = old.vertices_m if isinstance(old, Polygon) else ()
        return Polygon(to_points(texts.vertices_m, "vertices_m", corners))
    old_centre = (None, None) if isinstance(old, Polygon) else old.centre_m
    centre = (
        to_number(texts.east_m, "centre_m E", old_centre[0]),
        to_number(texts.north_m, "centre_m N", old_centre[1]),
    )
    if texts.shape == "circle":
        return Circle(centre, to_number(texts.radius_m, "radius_m", getattr(old, "radius_m", None)))
    width_m = to_number(texts.width_m, "width_m", getattr(old, "width_m", None))
    height_m = to_number(texts.height_m, "height_m", getattr(old, "height_m", None))
    # A heading that is not given is 0 in the file, too.
    heading_deg = to_number(texts.heading_deg or "0", "heading_deg", getattr(old, "heading_deg", None))
    return Rectangle(centre, width_m, height_m, heading_deg)
