"""Items that no vehicle may be sent: places that are nowhere, heights and numbers that are none."""

import math
from dataclasses import replace
from typing import Any

import pytest

from tests.core.rigs.plan_peers import circle, fence, square, waypoint
from tui_gcs.core.plans.check import check
from tui_gcs.core.plans.model import JUMP, TAKE_OFF, Plan, PlanItem, PlanKind


def told(item: PlanItem) -> list[str]:
    return [problem.text for problem in check(Plan(PlanKind.MISSION, (item,)))]


@pytest.mark.parametrize(
    ("item", "why"),
    [
        ({"x": 900_000_001}, "latitude 90.0000001 is beyond a pole"),
        ({"x": -900_000_001}, "latitude -90.0000001 is beyond a pole"),
        ({"y": 1_800_000_001}, "longitude 180.0000001 is not on earth"),
        ({"y": -1_800_000_001}, "longitude -180.0000001 is not on earth"),
        ({"command": 195, "x": 0, "y": 0}, "has no place (0, 0)"),
        ({"z": 83_001.0}, "height 83001 m is impossible"),
        ({"z": -10_001.0}, "height -10001 m is impossible"),
        ({"z": math.nan}, "height nan m is impossible"),
        ({"z": math.inf}, "z is infinite"),
        ({"x": 2**31}, "x or y do not fit 32 bits"),
        ({"y": -(2**31) - 1}, "x or y do not fit 32 bits"),
        ({"z": -math.inf}, "z is infinite"),
        ({"x": -(2**31) - 1}, "x or y do not fit 32 bits"),
        ({"y": 2**31}, "x or y do not fit 32 bits"),
        ({"command": 0}, "command 0 does not exist"),
        ({"command": 0x10000}, "command 65536 does not exist"),
        ({"frame": 1}, "frame 1 is not for plans"),
        ({"command": 5100}, "command 5100 does not belong into a mission"),
        ({"command": 5004}, "command 5004 does not belong into a mission"),
        ({"params": (math.inf, 0.0, 0.0, 0.0)}, "param 1 is infinite"),
        ({"params": (0.0, math.inf, 0.0, 0.0)}, "param 2 is infinite"),
        ({"params": (0.0, 0.0, -math.inf, 0.0)}, "param 3 is infinite"),
        ({"params": (0.0, 0.0, 0.0, -math.inf)}, "param 4 is infinite"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_nowhere_or_no_number_is_refused(item: dict[str, Any], why: str) -> None:
    assert told(waypoint(0, **item)) == [why]


@pytest.mark.parametrize(
    "item",
    [
        {"x": 900_000_000},
        {"x": -900_000_000, "y": 1_800_000_000},
        {"y": -1_800_000_000},
        {"x": 0},
        {"y": 0},
        {"z": 83_000.0},
        {"z": -10_000.0},
        {"params": (math.nan, math.nan, math.nan, math.nan)},
        {"params": (3.4e38, -3.4e38, 3.4e38, -3.4e38)},
        {"command": 1},
        {"command": 0xFFFF},
    ],
    ids=str,
)
def test_the_last_that_is_somewhere_is_not(item: dict[str, Any]) -> None:
    assert told(waypoint(0, **item)) == []


def test_a_take_off_without_a_place_is_where_the_vehicle_is() -> None:
    assert told(waypoint(0, command=TAKE_OFF, x=0, y=0)) == []


@pytest.mark.parametrize("radius_m", [0.0, -1.0, math.nan])
def test_a_fence_of_no_size_is_refused(radius_m: float) -> None:
    why = "param 1 is no number" if math.isnan(radius_m) else f"a circle of {radius_m:g} m"
    assert [problem.text for problem in check(fence(circle(radius_m)))] == [why]
    assert check(fence(circle(0.5))) == []


def of_fence(*items: PlanItem) -> list[str]:
    return [problem.text for problem in check(fence(*items))]


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "why"),
    [
        (47.0, 8.0, []),
        (89.0, 0.0, ["the circle reaches over a pole"]),
        (-89.0, 0.0, ["the circle reaches over a pole"]),
        (60.0, 178.0, ["the circle reaches over the antimeridian"]),
        (60.0, -178.0, ["the circle reaches over the antimeridian"]),
        (60.0, 177.8, []),
        (0.0, 178.9, []),
    ],
)
def test_a_circle_lies_on_one_map(lat_deg: float, lon_deg: float, why: list[str]) -> None:
    """One of 111 km: 1 degree of latitude, and at 60 degrees north 2 of longitude."""
    place = {"x": round(lat_deg * 1e7), "y": round(lon_deg * 1e7)}
    assert of_fence(replace(circle(111_195.0), **place)) == why


def test_a_small_circle_may_be_near_a_pole() -> None:
    assert of_fence(replace(circle(50.0), x=898_990_000, y=0)) == []
    assert of_fence(replace(circle(50.0), x=898_999_000, y=0)) == ["the circle reaches over a pole"]


def test_no_fence_is_greater_than_the_greatest() -> None:
    assert of_fence(circle(1_000_000.0)) == []
    assert of_fence(circle(1_000_001.0)) == ["a circle of 1e+06 m"]


def test_a_polygon_has_three_points_that_say_so_and_lies_on_one_map() -> None:
    corners = square()
    three = [replace(item, params=(3.0, 0.0, 0.0, 0.0)) for item in corners[:3]]
    assert of_fence(*three) == []
    assert of_fence(*three[:2]) == ["a polygon of 2 points: it needs 3"]
    assert of_fence(three[0]) == ["a polygon of 1 point: it needs 3"]
    assert of_fence(*corners[:3]) == ["its 3 points give as their number 4"]
    assert of_fence(*(replace(item, y=3) for item in three)) == ["the polygon has no area"]
    (crossed,) = of_fence(corners[0], corners[2], corners[1], corners[3])
    assert crossed.startswith("the polygon crosses itself near 47.397")
    for sign in (1, -1):
        pole = [replace(item, x=sign * 899_000_001, y=1000 * i**2) for i, item in enumerate(three)]
        assert of_fence(*pole) == ["the polygon reaches over a pole"]
    assert of_fence(*square(100, lat=898_999_900)) == []
    wide = [replace(item, y=y) for item, y in zip(three, (-900_000_001, 900_000_000, 0), strict=True)]
    assert of_fence(*wide) == ["the polygon reaches over the antimeridian"]
    assert of_fence(*(replace(item, y=item.y + (item.y < 0)) for item in wide)) == []


def test_a_return_point_is_no_area() -> None:
    assert of_fence(*square(), PlanItem(5000, 0, x=473_978_000, y=85_456_000)) == []


# ---------------------------------------------------------------- jumps


def jump(target: float, times: float = 2.0) -> PlanItem:
    return PlanItem(JUMP, 2, (target, times, 0.0, 0.0))


def of_mission(*items: PlanItem) -> list[str]:
    return [str(problem) for problem in check(Plan(PlanKind.MISSION, items))]


@pytest.mark.parametrize(
    ("item", "why"),
    [
        (jump(0.0), ""),
        (jump(1.0), "jumps to itself"),
        (jump(2.0), ""),
        (jump(3.0), "jumps to item 4 of 3"),
        (jump(-1.0), "jumps to item 0 of 3"),
        (jump(0.5), "jumps to item 1.5 of 3"),
        (jump(0.0, -1.0), ""),
        (jump(0.0, 0.0), ""),
        (jump(0.0, -2.0), "jumps -2 times"),
        (jump(0.0, 1.5), "jumps 1.5 times"),
        (jump(math.nan), "param 1 is no number"),
        (jump(0.0, math.nan), "param 2 is no number"),
    ],
)
def test_a_jump_leads_to_an_item_that_is_there(item: PlanItem, why: str) -> None:
    assert of_mission(waypoint(0), item, waypoint(2)) == ([f"item 2: {why}"] if why else [])


SPEED = PlanItem(178, 2, (1.0, 5.0, -1.0, 0.0))


@pytest.mark.parametrize("command", [16, 93, 112, 113, 114])
def test_going_round_over_something_that_takes_time_is_flying(command: int) -> None:
    assert of_mission(SPEED, waypoint(0, command=command), jump(0.0), waypoint(1)) == []


@pytest.mark.parametrize("command", [95, 111, 115, 178])
def test_going_round_over_nothing_that_takes_time_is_not(command: int) -> None:
    nothing = PlanItem(command, 2)
    assert of_mission(SPEED, nothing, jump(0.0), waypoint(1)) == ["item 3: jumps in a circle without flying anywhere"]
    assert of_mission(waypoint(0), jump(2.0), nothing, jump(1.0), waypoint(1)) == [
        "item 2: jumps in a circle without flying anywhere",
        "item 4: jumps in a circle without flying anywhere",
    ]
    assert of_mission(jump(2.0), waypoint(0), nothing, waypoint(1)) == []


# ---------------------------------------------------------------- how much is told


def test_a_plan_may_have_2000_items_and_twenty_problems_are_told() -> None:
    items = tuple(waypoint(i) for i in range(2000))
    assert of_mission(*items) == []
    assert of_mission(*items, waypoint(0)) == ["2001 items, at most 2000 are allowed"]
    told_ = of_mission(*(waypoint(0, z=math.nan),) * 30)
    assert len(told_) == 20 and told_[-1] == "item 20: height nan m is impossible"
