"""Items that no vehicle may be sent: places that are nowhere, heights and numbers that are none."""

import math
from typing import Any

import pytest
from plan_peers import circle, fence, waypoint

from tui_gcs.core.plan import TAKE_OFF, Plan, PlanItem, PlanKind
from tui_gcs.core.plan_check import check


def told(item: PlanItem) -> list[str]:
    return [problem.text for problem in check(Plan(PlanKind.MISSION, (item,)))]


@pytest.mark.parametrize(
    ("item", "why"),
    [
        ({"x": 900_000_001}, "latitude 90.0000001 is beyond a pole"),
        ({"x": -900_000_001}, "latitude -90.0000001 is beyond a pole"),
        ({"y": 1_800_000_001}, "longitude 180.0000001 is not on earth"),
        ({"y": -1_800_000_001}, "longitude -180.0000001 is not on earth"),
        ({"x": 0, "y": 0}, "has no place (0, 0)"),
        ({"z": 83_001.0}, "height 83001 m is impossible"),
        ({"z": -10_001.0}, "height -10001 m is impossible"),
        ({"z": math.nan}, "height nan m is impossible"),
        ({"z": math.inf}, "z is infinite"),
        ({"x": 2**31}, "x or y do not fit 32 bits"),
        ({"y": -(2**31) - 1}, "x or y do not fit 32 bits"),
        ({"params": (math.inf, 0.0, 0.0, 0.0)}, "param 1 is infinite"),
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
        {"params": (0.0, 0.0, 0.0, math.nan)},
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
