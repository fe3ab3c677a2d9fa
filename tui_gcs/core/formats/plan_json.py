"""Our own JSON of one plan: nothing is lost in it, and NaN is null."""

import math
from typing import Any

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind


class _Item(msgspec.Struct, forbid_unknown_fields=True):
    command: int
    frame: int
    params: list[float | None]
    z: float
    lat: float | None = None
    lon: float | None = None
    x: int = 0
    y: int = 0
    autocontinue: bool = True


class _PlanFile(msgspec.Struct, forbid_unknown_fields=True):
    kind: str
    items: list[_Item]


def write_plain(plan: Plan) -> str:
    """Write `plan` with places in degrees."""
    items = [_to_json(item) for item in plan.items]
    return msgspec.json.format(msgspec.json.encode({"kind": plan.kind.word, "items": items})).decode() + "\n"


def _to_json(item: PlanItem) -> dict[str, Any]:
    place = {"lat": item.lat_deg, "lon": item.lon_deg} if item.holds_degrees else {"x": item.x, "y": item.y}
    # JSON has no NaN.
    params = [None if math.isnan(value) else value for value in item.params]
    row = {"command": item.command, "frame": item.frame, "params": params, **place, "z": item.z}
    return row if item.autocontinue else row | {"autocontinue": False}


def read_plain(document: dict[str, Any]) -> Plan:
    """Read the plan in a document. Raises FormatError."""
    try:
        file = msgspec.convert(document, type=_PlanFile)
    except msgspec.MsgspecError as error:
        raise FormatError(clean(str(error))) from None
    kind = next((kind for kind in PlanKind if kind.word == file.kind), None)
    if kind is None:
        raise FormatError(f"{clean(file.kind, 20)!r} is neither mission, fence nor rally")
    if len(file.items) > MAX_ITEMS:
        raise FormatError(f"more than {MAX_ITEMS} items")
    return Plan(kind, tuple(_item(number, row) for number, row in enumerate(file.items, 1)))


def _item(number: int, row: _Item) -> PlanItem:
    if len(row.params) != 4:
        raise FormatError(f"item {number}: 4 params are needed")
    p1, p2, p3, p4 = (math.nan if value is None else value for value in row.params)
    x, y = row.x, row.y
    if row.lat is not None and row.lon is not None:
        if abs(row.lat) > 90 or abs(row.lon) > 180:
            raise FormatError(f"item {number}: no place on earth")
        x, y = round(row.lat * 1e7), round(row.lon * 1e7)
    return PlanItem(row.command, row.frame, (p1, p2, p3, p4), x, y, row.z, row.autocontinue)
