"""The `[remote_id]` table of a scenario, and the same place on a command line.

Limits are those of OPEN_DRONE_ID_* (MAVLink common): ASCII, 20 bytes for ids, 23 for a description.
"""

import re

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.fields import Point, Table, shown, shown_key
from tui_gcs.core.scenario.model import OperatorId

ID_CHARS, DESCRIPTION_CHARS = 20, 23
LOW_ALT_M, HIGH_ALT_M = -1000.0, 31_767.0
"""ASTM F3411's range of heights; -1000 itself means unknown."""
FAR_M = 20_000.0
"""Farther from the scenario's origin no operator stands."""
_EU_WITH_SECRET = re.compile(r"[A-Za-z]{3}[0-9A-Za-z]{13}-[0-9A-Za-z]{3}")
_SERIAL = re.compile(rf"[0-9A-Za-z-]{{1,{ID_CHARS}}}")


def read_remote_id(table: Table, frame: LocalFrame | None) -> OperatorId | None:
    """What is to be sent, or None where nothing is said or something is wrong (that is noted)."""
    operator_id = _text(table, "operator_id", ID_CHARS)
    if _EU_WITH_SECRET.fullmatch(operator_id):
        table.wrong(
            "operator_id", "its last three characters are secret", "leave them and their dash out: everybody hears it"
        )
    place = table.pair("operator_deg") if table.has("operator_deg") else None
    if place is not None and (why := why_no_place(place, frame)):
        table.wrong("operator_deg", why, "must be [latitude, longitude] of where the operator stands")
    alt_m = table.number("operator_alt_m", above=LOW_ALT_M, high=HIGH_ALT_M) if table.has("operator_alt_m") else None
    description = _text(table, "description", DESCRIPTION_CHARS)
    uas_ids = _uas_ids(table.table("uas_ids"))
    if alt_m is not None and place is None and table.ok:
        table.wrong("operator_alt_m", "is given without a place", "give operator_deg, too")
    table.done()
    if not table.ok or uas_ids is None or not table.data:
        return None
    lat_deg, lon_deg = place or (None, None)
    return OperatorId(operator_id, lat_deg, lon_deg, alt_m, description, uas_ids)


def why_no_place(place_deg: Point, frame: LocalFrame | None) -> str:
    """What is wrong with (latitude, longitude) as an operator's place, or ""."""
    if abs(place_deg[0]) > 90 or abs(place_deg[1]) > 180 or place_deg == (0.0, 0.0):
        return f"{list(place_deg)} is no place on the globe"
    if frame is not None:
        x_m, y_m = frame.to_enu(*place_deg)
        if not max(abs(x_m), abs(y_m)) <= FAR_M:
            return f"{list(place_deg)} is more than {FAR_M / 1000:g} km from the scenario's origin"
    return ""


def _text(table: Table, key: str, longest: int) -> str:
    text = table.name(key, longest) if table.has(key) else ""
    if not text.isascii():
        table.wrong(key, f"{shown(text)} has letters that Remote ID cannot send", "must be ASCII")
    return text


def _uas_ids(table: Table) -> dict[int, str] | None:
    """Serial numbers (ANSI/CTA-2063-A) by vehicle."""
    found: dict[int, str] = {}
    for key, value in table.data.items():
        table.has(key)
        if not (key.isascii() and key.isdigit() and 1 <= int(key[:5]) <= 9254):
            table.wrong(shown_key(key), "is not a vehicle's number", 'must be as in 3 = "1596A0000000001"')
        elif not (isinstance(value, str) and _SERIAL.fullmatch(value)):
            table.wrong(key, f"{shown(value)} is no serial number", f"must be 1 to {ID_CHARS} of A-Z a-z 0-9 -")
        else:
            found[int(key)] = value
    return found if table.ok else None
