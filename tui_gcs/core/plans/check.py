"""Plan check: whether a plan is fit to be sent at all: values, jumps, fence geometry.

Threats: docs/threats.md B.6-59, B.6-61, B.6-63. What one autopilot does not take is `PlanDialect.problems` in
`core/firmware/plan_dialects.py`.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.plans.model import (
    ARDUPILOT_HERE,
    CIRCLES,
    DELAY,
    FENCE_COMMANDS,
    JUMP,
    NAV_LAST,
    PLAIN_FRAME,
    POLYGONS,
    RALLY_POINT,
    FenceShape,
    Plan,
    PlanItem,
    PlanKind,
    fence_shapes,
)

MAX_ITEMS = 2000
"""Items of one plan: bounds what geometry costs, and what a vehicle may make us download (docs/threats.md B.6-52)."""
MAX_PROBLEMS = 20
"""Problems returned of one plan."""
MIN_HEIGHT_M, MAX_HEIGHT_M = -10_000.0, 83_000.0
"""Heights: below the Dead Sea, and what ArduPilot can store."""
MAX_PARAM = 3.4e38
"""The largest number that a float32 can hold: parameters travel as float32."""
# x and y of MISSION_ITEM_INT are int32.
MIN_INT32 = -(2**31)
NEEDS_NUMBERS = FENCE_COMMANDS | {JUMP}
"""Commands that need numbers as their first two parameters."""
# Nearer to a pole a degree of longitude is shorter than the flat local frame can bear.
POLE_DEG = 89.9
MAX_RADIUS_M = 1_000_000.0
METRES_PER_DEG = 111_195.0
"""Metres per degree of a great circle, mean earth radius 6371 km."""


@dataclass(frozen=True, slots=True)
class PlanProblem:
    """Why a plan must not be sent; `item` is the index of the item concerned, None for the whole plan."""

    item: int | None
    text: str

    def __str__(self) -> str:
        """One line; items are counted from 1 as operators do."""
        return self.text if self.item is None else f"item {self.item + 1}: {self.text}"


def check(plan: Plan) -> list[PlanProblem]:
    """Return what is wrong with `plan`, the first `MAX_PROBLEMS`; [] if nothing is."""
    if len(plan.items) > MAX_ITEMS:
        return [PlanProblem(None, f"{len(plan.items)} items, at most {MAX_ITEMS} are allowed")]
    found = [PlanProblem(i, text) for i, item in enumerate(plan.items) if (text := item_problem(plan.kind, item))]
    if not found and plan.kind is PlanKind.MISSION:
        found = _jumps(plan.items)
    if not found and plan.kind is PlanKind.FENCE:
        for shape in fence_shapes(plan.items):
            found += _shape(shape)
    return found[:MAX_PROBLEMS]


def item_problem(kind: PlanKind, item: PlanItem) -> str:
    """Return what is wrong with one item alone, or ""."""
    return _command(kind, item) or _numbers(item) or _place(item)


def _command(kind: PlanKind, item: PlanItem) -> str:
    if not 0 < item.command <= 0xFFFF:
        return f"command {item.command} does not exist"
    if kind is not _kind_of(item.command):
        return f"command {item.command} does not belong into a {kind.word}"
    return "" if item.frame in PLAIN_FRAME else f"frame {item.frame} is not for plans"


def _kind_of(command: int) -> PlanKind:
    if command in FENCE_COMMANDS:
        return PlanKind.FENCE
    return PlanKind.RALLY if command == RALLY_POINT else PlanKind.MISSION


def _numbers(item: PlanItem) -> str:
    one, two, three, four = item.params
    most = MAX_PARAM
    is_large = abs(one) > most or abs(two) > most or abs(three) > most or abs(four) > most  # False for NaN
    if (is_large or item.command in NEEDS_NUMBERS) and (problem := _params(item)):
        return problem
    if not (MIN_INT32 <= item.x < -MIN_INT32 and MIN_INT32 <= item.y < -MIN_INT32):
        return "x or y do not fit 32 bits"
    return "z is infinite" if abs(item.z) > MAX_PARAM else ""


def _params(item: PlanItem) -> str:
    """Return the problem of parameters that are no numbers or too large, or ""."""
    needed = item.command in NEEDS_NUMBERS
    for number, value in enumerate(item.params, 1):
        if math.isnan(value):
            if needed and number <= 2:
                return f"param {number} is no number"
        elif abs(value) > MAX_PARAM:
            return f"param {number} is infinite"
    return ""


def _place(item: PlanItem) -> str:
    if not item.is_place:
        return ""
    if abs(item.x) > 900_000_000:
        return f"latitude {item.lat_deg:.7f} is beyond a pole"
    if abs(item.y) > 1_800_000_000:
        return f"longitude {item.lon_deg:.7f} is not on earth"
    if item.x == 0 and item.y == 0 and item.command not in ARDUPILOT_HERE:
        return "has no place (0, 0)"
    if not MIN_HEIGHT_M <= item.z <= MAX_HEIGHT_M:  # True for NaN, too
        return f"height {item.z:.6g} m is impossible"
    return ""


def _jumps(items: tuple[PlanItem, ...]) -> list[PlanProblem]:
    """Return jumps to items that do not exist, and those that go round without flying anywhere."""
    found = []
    jumps = [(i, item) for i, item in enumerate(items) if item.command == JUMP]
    for i, item in jumps:
        target, repeat = item.params[:2]
        if target != int(target) or not 0 <= target < len(items):
            found.append(PlanProblem(i, f"jumps to item {target + 1:g} of {len(items)}"))
        elif target == i:
            found.append(PlanProblem(i, "jumps to itself"))
        elif repeat != int(repeat) or repeat < -1:
            found.append(PlanProblem(i, f"jumps {repeat:g} times"))
    if found or not jumps:
        return found
    return [PlanProblem(i, "jumps in a circle without flying anywhere") for i in _idle_circles(items)]


def _idle_circles(items: tuple[PlanItem, ...]) -> list[int]:
    """Return the indices of jumps that lie on a circle of items none of which takes any time.

    An item is followed by exactly one item (a jump is taken), so each is looked at once.
    """
    done: set[int] = set()
    circles = []
    for start in range(len(items)):
        way: dict[int, None] = {}
        at = start
        while at < len(items) and at not in done and at not in way and not _takes_time(items[at]):
            way[at] = None
            at = int(items[at].params[0]) if items[at].command == JUMP else at + 1
        if at in way:
            circle = list(way)[list(way).index(at) :]
            circles += [i for i in circle if items[i].command == JUMP]
        done.update(way)
    return sorted(circles)


def _takes_time(item: PlanItem) -> bool:
    return item.command < NAV_LAST or item.command == DELAY or item.command in (112, 113, 114)


def _shape(shape: FenceShape) -> list[PlanProblem]:
    if shape.command in CIRCLES:
        return _circle(shape.first, shape.items[0])
    return _polygon(shape) if shape.command in POLYGONS else []


def _circle(first: int, item: PlanItem) -> list[PlanProblem]:
    radius_m = item.params[0]
    if not 0 < radius_m <= MAX_RADIUS_M:
        return [PlanProblem(first, f"a circle of {radius_m:g} m")]
    reach_deg = radius_m / METRES_PER_DEG
    if abs(item.lat_deg) + reach_deg > POLE_DEG:
        return [PlanProblem(first, "the circle reaches over a pole")]
    if abs(item.lon_deg) + reach_deg / math.cos(math.radians(abs(item.lat_deg) + reach_deg)) > 180:
        return [PlanProblem(first, "the circle reaches over the antimeridian")]
    return []


def _polygon(shape: FenceShape) -> list[PlanProblem]:
    points = [(item.lon_deg, item.lat_deg) for item in shape.items]
    count, stated = len(points), {item.params[0] for item in shape.items}
    if count < 3:
        return [PlanProblem(shape.first, f"a polygon of {count} point{'s'[: count - 1]}: it needs 3")]
    if stated != {float(count)}:
        return [
            PlanProblem(
                shape.first, f"its {count} points give as their number {', '.join(f'{n:g}' for n in sorted(stated))}"
            )
        ]
    if max(abs(lat) for _, lat in points) > POLE_DEG:
        return [PlanProblem(shape.first, "the polygon reaches over a pole")]
    if any(abs(a[0] - b[0]) > 180 for a, b in zip(points, points[1:] + points[:1], strict=True)):
        return [PlanProblem(shape.first, "the polygon reaches over the antimeridian")]
    # Imported here: loading takes 0.1 s, which plans without a valid polygon need not wait.
    import shapely
    from shapely.validation import explain_validity

    polygon = shapely.Polygon(points)
    if polygon.convex_hull.area == 0:
        return [PlanProblem(shape.first, "the polygon has no area")]
    if not shapely.is_valid(polygon):
        return [PlanProblem(shape.first, f"the polygon crosses itself {_where(explain_validity(polygon))}".rstrip())]
    return []


def _where(reason: str) -> str:
    """Return the place in a text of GEOS, "Self-intersection[8.5 47.4]", latitude first; "" if there is none."""
    lon, _, lat = reason.partition("[")[2].rstrip("]").partition(" ")
    return f"near {lat}, {lon}" if lat else ""
