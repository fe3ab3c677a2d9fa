"""Writing QGroundControl's `.plan`; what was in the one that was read, and is unchanged, stays as it was.

The three parts of the old document are compared with what is to be written. Entries before the first change and after
the last one stay, surveys included; between them everything becomes simple items. A survey of which one way-point was
changed is no survey any more.
"""

import copy
import math
from typing import Any

from tui_gcs.core.formats.bounded import json_text
from tui_gcs.core.formats.content import Content, FormatError, Home, QgcSource, Written, counted
from tui_gcs.core.formats.qgc_plan import FILE_TYPE, circle_item, content_of, polygon_items, rally_item
from tui_gcs.core.plans.model import (
    AMSL,
    CIRCLE_IN,
    CIRCLES,
    FENCE_RETURN,
    JUMP,
    PLAIN_FRAME,
    POLYGON_IN,
    POLYGONS,
    RELATIVE,
    TERRAIN,
    FenceShape,
    Plan,
    PlanItem,
    PlanKind,
    fence_shapes,
)

GENERIC, QUADROTOR = 0, 2
"""MAV_AUTOPILOT and MAV_TYPE where none is given."""
CRUISE_M_S, HOVER_M_S = 15, 5
"""The speeds that QGroundControl itself assumes; it computes times with them."""
# QGroundControl's own enum of altitude modes, not a MAV_FRAME.
ALTITUDE_MODES = {RELATIVE: 1, AMSL: 2, TERRAIN: 4}
NO_MISSION, NO_FENCE, NO_RALLY = Plan(PlanKind.MISSION), Plan(PlanKind.FENCE), Plan(PlanKind.RALLY)


def write_qgc(content: Content) -> Written:
    """Write all of `content` as a `.plan`. Raises FormatError."""
    old = copy.deepcopy(content.source.document) if content.source is not None else {}
    notes: list[str] = []
    left_out: list[str] = []
    document = old or {"fileType": FILE_TYPE, "version": 1, "groundStation": "QGroundControl"}
    document["mission"] = _mission(content, _dict(old.get("mission")), notes)
    document["geoFence"] = _fence(content.fence or NO_FENCE, _dict(old.get("geoFence")))
    document["rallyPoints"] = _rally(content, _dict(old.get("rallyPoints")), left_out)
    return Written(json_text(document).encode(), tuple(left_out), tuple(notes))


def _dict(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _mission(content: Content, old: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    usual: dict[str, Any] = {"version": 2, "firmwareType": GENERIC if content.autopilot is None else content.autopilot}
    usual |= {"vehicleType": QUADROTOR, "cruiseSpeed": CRUISE_M_S, "hoverSpeed": HOVER_M_S, "globalPlanAltitudeMode": 1}
    mission = dict(old) if old else usual
    plan = content.mission or NO_MISSION
    was = content_of(content.source.document).home if content.source is not None else None
    # Home is rewritten only if it changed: otherwise the file's own form of it stays.
    if was is None or (content.home is not None and content.home != was):
        mission["plannedHomePosition"] = _home(content, plan, notes)
    mission["items"] = _items(plan, content.source, notes)
    return mission


def _home(content: Content, plan: Plan, notes: list[str]) -> list[float]:
    home = content.home
    if home is None:
        first = next((item for item in plan.items if item.is_place and (item.x or item.y)), None)
        home = Home(first.lat_deg, first.lon_deg) if first is not None else Home(0.0, 0.0)
        notes.append("home was not given: its first place is written, at height 0 (a drawing aid, not sent)")
    return [home.lat_deg, home.lon_deg, 0.0 if math.isnan(home.amsl_m) else home.amsl_m]


def _items(plan: Plan, source: QgcSource | None, notes: list[str]) -> list[dict[str, Any]]:
    """Return the entries of the old file before and after the change, simple items between, all renumbered."""
    entries: list[dict[str, Any]] = []
    blocks: tuple[tuple[int, int], ...] = ()
    before: tuple[PlanItem, ...] = ()
    if source is not None:
        entries, blocks = copy.deepcopy(source.document["mission"]["items"]), source.blocks
        before = (content_of(source.document).mission or NO_MISSION).items
    # Only the changed part is rewritten, so that surveys before and after it stay surveys.
    head, tail = _same_ends(before, plan.items)
    if head == len(before) == len(plan.items):
        return entries
    kept_head = sum(1 for first, count in blocks if first + count <= head)
    rest = [(first, count) for first, count in blocks[kept_head:] if first >= len(before) - tail]
    kept_tail = len(rest)
    start = blocks[kept_head - 1][0] + blocks[kept_head - 1][1] if kept_head else 0
    end = len(plan.items) - (len(before) - rest[0][0] if rest else 0)
    dropped = entries[kept_head : len(entries) - kept_tail]
    if lost := sum(1 for entry in dropped if entry.get("type") == "ComplexItem"):
        notes.append(
            f"{counted(lost, 'survey, scan or landing', 'surveys, scans or landings')} changed: way-points now"
        )
    middle = [simple_item(item) for item in plan.items[start:end]]
    made = [*entries[:kept_head], *middle, *entries[len(entries) - kept_tail :]]
    _number(made, plan)
    return made


def _same_ends(before: tuple[PlanItem, ...], now: tuple[PlanItem, ...]) -> tuple[int, int]:
    """Count the items that are equal from the first on, and from the last back; jumps are compared by target."""
    most = min(len(before), len(now))
    head = next((i for i in range(most) if not _same(before[i], now[i])), most)
    most -= head
    tail = next((i for i in range(most) if not _same(before[-1 - i], now[-1 - i])), most)
    return head, tail


def _same(a: PlanItem, b: PlanItem) -> bool:
    return _key(a) == _key(b)


def _key(item: PlanItem) -> tuple[object, ...]:
    """Return a key that is equal for equal items; every NaN is equal."""
    numbers = (None if math.isnan(value) else value for value in (*item.params, item.z))
    return (item.command, item.frame, item.x, item.y, item.autocontinue, *numbers)


def _number(entries: list[dict[str, Any]], plan: Plan) -> None:
    """Give every entry the number of its first item, and jumps the number of their target."""
    at = 0
    for entry in entries:
        inside = _dict(entry.get("TransectStyleComplexItem")).get("Items")
        simple = inside if isinstance(inside, list) else [entry] if entry.get("type") != "ComplexItem" else []
        for item in simple:
            # Jumps name items by this number, which counts from 1 over surveys, too.
            item["doJumpId"] = at + 1
            if item.get("command") == JUMP:
                item["params"][0] = int(plan.items[at].params[0]) + 1
            at += 1


def simple_item(item: PlanItem) -> dict[str, Any]:
    """Write one item as a SimpleItem; its number is given later. Raises FormatError."""
    # NaN becomes null; infinity has no place in JSON.
    if not all(math.isfinite(value) or math.isnan(value) for value in (*item.params, item.z)):
        raise FormatError(f"command {item.command}: an endless number, which JSON does not have")
    place = (item.lat_deg, item.lon_deg) if item.holds_degrees else (item.x, item.y)
    frame = PLAIN_FRAME.get(item.frame, item.frame)
    params = [None if math.isnan(value) else value for value in (*item.params, *place, item.z)]
    made: dict[str, Any] = {"type": "SimpleItem", "command": item.command, "frame": frame}
    made |= {"autoContinue": item.autocontinue, "doJumpId": 0, "params": params}
    if item.is_place:
        made |= {"AltitudeMode": ALTITUDE_MODES.get(frame, 0), "Altitude": item.z, "AMSLAltAboveTerrain": None}
    return made


def _fence(plan: Plan, old: dict[str, Any]) -> dict[str, Any]:
    fence: dict[str, Any] = old | {"version": 2}
    fence.pop("polygon", None)
    shapes = fence_shapes(plan.items)
    were = _known(old.get("polygons"), polygon_items)
    fence["polygons"] = [_polygon(shape, were) for shape in shapes if shape.command in POLYGONS]
    circles = _known(old.get("circles"), lambda raw, where: [circle_item(raw, where)])
    fence["circles"] = [_circle(shape, circles) for shape in shapes if shape.command in CIRCLES]
    returns = [shape.items[0] for shape in shapes if shape.command == FENCE_RETURN]
    fence.pop("breachReturn", None)
    if returns:
        z = 0.0 if math.isnan(returns[0].z) else returns[0].z
        fence["breachReturn"] = [returns[0].lat_deg, returns[0].lon_deg, z]
    return fence


OldShapes = list[tuple[list[PlanItem], dict[str, Any]]]


def _known(raw: Any, read: Any) -> OldShapes:
    """Return the shapes of the old file with what they were read as; they were read without error before."""
    return [(read(entry, ""), entry) for entry in raw] if isinstance(raw, list) else []


def _polygon(shape: FenceShape, were: OldShapes) -> dict[str, Any]:
    kept = _take(list(shape.items), were)
    corners = [[item.lat_deg, item.lon_deg] for item in shape.items]
    return kept or {"version": 1, "inclusion": shape.command == POLYGON_IN, "polygon": corners}


def _circle(shape: FenceShape, were: OldShapes) -> dict[str, Any]:
    item = shape.items[0]
    circle = {"center": [item.lat_deg, item.lon_deg], "radius": item.params[0]}
    return _take([item], were) or {"version": 1, "inclusion": shape.command == CIRCLE_IN, "circle": circle}


def _take(items: list[PlanItem], were: OldShapes) -> dict[str, Any] | None:
    """Return, and remove, the old entry that was read as these items; None if there is none."""
    for index, (old, entry) in enumerate(were):
        if old == items:
            del were[index]
            return entry
    return None


def _rally(content: Content, old: dict[str, Any], left_out: list[str]) -> dict[str, Any]:
    rally: dict[str, Any] = old | {"version": 2}
    points: list[Any] = []
    lost = 0
    known = [([rally_item(raw, "")], raw) for raw in old.get("points", [])]
    for item in (content.rally or NO_RALLY).items:
        height_m = _above_home(item, content.home)
        same = next((raw for read, raw in known if read == [item]), None)
        if same is not None:
            points.append(same)
        elif height_m is None:
            lost += 1
        else:
            points.append([item.lat_deg, item.lon_deg, height_m])
    rally["points"] = points
    if lost:
        what = counted(lost, "rally point")
        left_out.append(f"{what} above sea level or ground: a .plan has heights above home only, and home is not known")
    return rally


def _above_home(item: PlanItem, home: Home | None) -> float | None:
    """Return the height of a rally point above home, None if it cannot be computed."""
    frame = PLAIN_FRAME.get(item.frame)
    if frame == RELATIVE:
        return item.z
    if frame == AMSL and home is not None and not math.isnan(home.amsl_m):
        return item.z - home.amsl_m
    return None
