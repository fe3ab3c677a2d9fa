"""Places as an operator types them.

450 200          east and north in metres, as the plan has them; a third number is the height above home
52.0720N 0.6280W [30]
+30 -10 [+5]     from where each vehicle is (a height with a sign is relative, too)
v5 +10 0         from where vehicle 5 is
zone north field [+10 0]
cursor [+10 0]   where the map's cursor is
home [+10 0]     from each vehicle's own home
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.common import Vec3, VehicleRow

NAN = math.nan
_NUMBER = r"[+-]?[0-9]+(?:\.[0-9]+)?"
_DEGREES = re.compile(rf"([0-9.]+)([ns])[\s,]+([0-9.]+)([ew])(?:[\s,]+({_NUMBER}))?", re.IGNORECASE)
_OFFSETS = re.compile(rf"({_NUMBER})[\s,]+({_NUMBER})(?:[\s,]+({_NUMBER}))?")
HELP = (
    "metres east, north [height]: 450 200 [30]; from itself +30 -10; home +50 0; v5 +10 0; "
    "zone NAME; cursor; or 52.0720N 0.6280W"
)


class PlaceTextError(ValueError):
    """What was typed is no place; the text is one line for the operator."""


@dataclass(frozen=True)
class PlaceReferences:
    """What typed places can be relative to, at one moment."""

    rows: Mapping[int, VehicleRow]
    """The row of every vehicle, by id."""
    zones: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Centre of each zone of the round, ENU metres."""
    frame: LocalFrame | None = None
    cursor_m: tuple[float, float] | None = None


@dataclass(frozen=True)
class Destinations:
    """A place for each vehicle, ENU metres; NaN leaves a coordinate as it is."""

    points_m: Mapping[int, Vec3]
    from_home: bool = False
    """Whether the places are relative to each vehicle's own home."""


def destinations(text: str, vehicles: tuple[int, ...], around: PlaceReferences) -> Destinations:
    """Return where each of `vehicles` goes. Several that are sent to one place keep their formation about it.

    Raises:
        PlaceTextError: The text is no place, or what it is relative to is not known.
    """
    text = text.strip()
    if match := _DEGREES.fullmatch(text):
        return _formation(_by_degrees(match, around), vehicles, around)
    if match := _OFFSETS.fullmatch(text):
        if text[0] in "+-":
            return Destinations({v: _moved(_position(v, around), match) for v in vehicles})
        return _formation((float(match[1]), float(match[2]), _height(match[3])), vehicles, around)
    word, _, rest = text.partition(" ")
    word = word.casefold()
    if word == "home":
        east, north, up = _offset(rest)
        return Destinations(dict.fromkeys(vehicles, (east, north, up)), from_home=True)
    if word == "cursor":
        if around.cursor_m is None:
            raise PlaceTextError("the map has no cursor now")
        return _formation(_shifted(around.cursor_m, rest), vehicles, around)
    if word == "zone":
        return _formation(_by_zone(rest, around), vehicles, around)
    if re.fullmatch(r"v[0-9]{1,6}", word):
        x, y, _ = _position(int(word[1:]), around)
        return _formation(_shifted((x, y), rest), vehicles, around)
    raise PlaceTextError(f"no such place; {HELP}")


def _by_degrees(match: re.Match[str], around: PlaceReferences) -> Vec3:
    if around.frame is None:
        raise PlaceTextError("the scenario's origin is not known")
    try:
        lat_deg = float(match[1]) * (-1.0 if match[2] in "sS" else 1.0)
        lon_deg = float(match[3]) * (-1.0 if match[4] in "wW" else 1.0)
    except ValueError:
        raise PlaceTextError("degrees are numbers: 52.0720N 0.6280W") from None
    if abs(lat_deg) > 90 or abs(lon_deg) > 180:
        raise PlaceTextError("there is no such latitude or longitude")
    x, y = around.frame.to_enu(lat_deg, lon_deg)
    return float(x), float(y), _height(match[5])


def _by_zone(rest: str, around: PlaceReferences) -> Vec3:
    # The longest first: of the zones `north` and `north east` the second must not be read as the first.
    names = sorted(around.zones, key=len, reverse=True)
    name = next((n for n in names if rest.casefold().startswith(n.casefold())), None)
    if name is None:
        raise PlaceTextError(f"no such zone; there are: {', '.join(around.zones) or 'none'}")
    return _shifted(around.zones[name], rest[len(name) :])


def _position(vehicle: int, around: PlaceReferences) -> Vec3:
    row = around.rows.get(vehicle)
    if row is None or not all(map(math.isfinite, row.position_m)):
        raise PlaceTextError(f"the position of vehicle {vehicle} is not known")
    return row.position_m


def _height(text: str | None) -> float:
    if text is not None and text[0] in "+-":
        raise PlaceTextError("a height with a sign is relative: only after +E +N")
    return NAN if text is None else float(text)


def _offset(rest: str) -> Vec3:
    if not rest.strip():
        return 0.0, 0.0, NAN
    match = _OFFSETS.fullmatch(rest.strip())
    if match is None:
        raise PlaceTextError(f"{rest.strip()[:20]!r} is no offset: +EAST +NORTH in metres, and a height")
    return float(match[1]), float(match[2]), NAN if match[3] is None else float(match[3])


def _shifted(place_m: tuple[float, float], rest: str) -> Vec3:
    east, north, up = _offset(rest)
    return place_m[0] + east, place_m[1] + north, up


def _moved(here: Vec3, match: re.Match[str]) -> Vec3:
    up = match[3]
    height = NAN if up is None else here[2] + float(up) if up[0] in "+-" else float(up)
    return here[0] + float(match[1]), here[1] + float(match[2]), height


def _formation(place: Vec3, vehicles: tuple[int, ...], around: PlaceReferences) -> Destinations:
    """Send the middle of several to the place; each keeps its offset from it, so that they do not meet there."""
    if len(vehicles) == 1:
        return Destinations({vehicles[0]: place})
    here = {v: _position(v, around) for v in vehicles}
    middle = [sum(p[axis] for p in here.values()) / len(here) for axis in (0, 1)]
    return Destinations(
        {v: (place[0] + p[0] - middle[0], place[1] + p[1] - middle[1], place[2]) for v, p in here.items()}
    )
