"""Reads the `[remote_id]` table of a scenario, and checks an operator's place given on the command line.

Limits are those of OPEN_DRONE_ID_* (MAVLink common): ASCII, 20 bytes for ids, 23 for a description.
"""

import re

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.fields import Point, Table, shown, shown_key
from tui_gcs.core.scenario.model import OperatorId

# Lengths of OPEN_DRONE_ID_BASIC_ID, OPERATOR_ID and SELF_ID (ASTM F3411).
MAX_ID_CHARS, MAX_DESCRIPTION_CHARS = 20, 23
MIN_ALT_M, MAX_ALT_M = -1000.0, 31_767.0
"""The range of heights of ASTM F3411; -1000 itself means that the height is unknown."""
MAX_OPERATOR_DISTANCE_M = 20_000.0
"""An operator's place farther than this from the scenario's origin is a mistake."""
_EU_WITH_SECRET = re.compile(r"[A-Za-z]{3}[0-9A-Za-z]{13}-[0-9A-Za-z]{3}")
_SERIAL = re.compile(rf"[0-9A-Za-z-]{{1,{MAX_ID_CHARS}}}")


def read_remote_id(table: Table, frame: LocalFrame | None) -> OperatorId | None:
    """Return what Remote ID shall send, or None where the table is missing or has a problem, which is noted."""
    operator_id = _text(table, "operator_id", MAX_ID_CHARS)
    if _EU_WITH_SECRET.fullmatch(operator_id):
        table.wrong(
            "operator_id", "its last three characters are secret", "leave them and their dash out: the id is broadcast"
        )
    place = table.pair("operator_deg") if table.has("operator_deg") else None
    if place is not None and (why := place_problem(place, frame)):
        table.wrong("operator_deg", why, "must be [latitude, longitude] of where the operator stands")
    alt_m = table.number("operator_alt_m", above=MIN_ALT_M, high=MAX_ALT_M) if table.has("operator_alt_m") else None
    description = _text(table, "description", MAX_DESCRIPTION_CHARS)
    uas_ids = _uas_ids(table.table("uas_ids"))
    if alt_m is not None and place is None and table.ok:
        table.wrong("operator_alt_m", "is given without a place", "give operator_deg, too")
    table.done()
    if not table.ok or uas_ids is None or not table.data:
        return None
    lat_deg, lon_deg = place or (None, None)
    return OperatorId(operator_id, lat_deg, lon_deg, alt_m, description, uas_ids)


def place_problem(place_deg: Point, frame: LocalFrame | None) -> str:
    """Return why (latitude, longitude) cannot be an operator's place, or "" if it can."""
    if abs(place_deg[0]) > 90 or abs(place_deg[1]) > 180 or place_deg == (0.0, 0.0):
        return f"{list(place_deg)} is no place on the globe"
    if frame is not None:
        x_m, y_m = frame.to_enu(*place_deg)
        if not max(abs(x_m), abs(y_m)) <= MAX_OPERATOR_DISTANCE_M:
            return f"{list(place_deg)} is more than {MAX_OPERATOR_DISTANCE_M / 1000:g} km from the scenario's origin"
    return ""


def _text(table: Table, key: str, longest: int) -> str:
    text = table.name(key, longest) if table.has(key) else ""
    if not text.isascii():
        table.wrong(key, f"{shown(text)} has letters that Remote ID cannot send", "must be ASCII")
    return text


def _uas_ids(table: Table) -> dict[int, str] | None:
    """Return serial numbers (ANSI/CTA-2063-A) by vehicle, or None if one of them is wrong."""
    found: dict[int, str] = {}
    for key, value in table.data.items():
        table.has(key)
        if not (key.isascii() and key.isdigit() and 1 <= int(key[:5]) <= 9254):
            table.wrong(shown_key(key), "is not a vehicle's number", 'must be as in 3 = "1596A0000000001"')
        elif not (isinstance(value, str) and _SERIAL.fullmatch(value)):
            table.wrong(key, f"{shown(value)} is no serial number", f"must be 1 to {MAX_ID_CHARS} of A-Z a-z 0-9 -")
        else:
            found[int(key)] = value
    return found if table.ok else None
