"""Whether a vehicle holds the plan that was sent: which numbers count as equal, and how differences are reported."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.plan_designs import missions
from tests.core.rigs.plan_peers import circle, fence, square, waypoint
from tui_gcs.core.firmware.plan_dialects import ARDUPILOT, GENERIC, PX4, PlanDialect
from tui_gcs.core.missions.plan_compare import begins_alike, compare
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind

PLACE = waypoint(0, z=100.0)


def of(*items: PlanItem) -> Plan:
    return Plan(PlanKind.MISSION, items)


def told(sent: PlanItem, held: PlanItem, dialect: PlanDialect = GENERIC) -> str:
    """What is different about the only item."""
    found = compare(of(sent), of(held), dialect).differences
    return found[0].removeprefix("item 1: ") if found else ""


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"command": 17}, "command 17 instead of 16"),
        ({"frame": 0}, "frame 0 instead of 3"),
        ({"x": PLACE.x + 1}, ""),
        ({"x": PLACE.x + 2}, "is at 47.3977002, 8.5456000 instead of 47.3977000, 8.5456000"),
        ({"y": PLACE.y - 1}, ""),
        ({"y": PLACE.y - 2}, "is at 47.3977000, 8.5455998 instead of 47.3977000, 8.5456000"),
        ({"z": 100.0009}, ""),
        ({"z": 100.002}, "height 100.002 m instead of 100 m"),
        ({"z": math.nan}, "height nan m instead of 100 m"),
        ({"autocontinue": False}, "stops there, or does not"),
        ({"params": (1.0, 0.0, 0.0, 0.0)}, "param 1 is 1 instead of 0"),
        ({"params": (0.0, 0.0, 1e-4, 0.0)}, "param 3 is 0.0001 instead of 0"),
        ({"params": (0.0, 0.0, 1e-7, 0.0)}, ""),
        ({"params": (0.0, 0.0, 0.0, math.nan)}, "param 4 is nan instead of 0"),
        ({"params": (0.0, 0.0, 0.0, 359.9995)}, ""),
        ({"params": (0.0, 0.0, 0.0, 359.99)}, "param 4 is 359.99 instead of 0"),
        ({"params": (0.0, 0.0, 0.0, -360.0)}, "param 4 is -360 instead of 0"),
        ({"params": (0.0, 0.0, 0.0, 720.0)}, "param 4 is 720 instead of 0"),
        ({"params": (0.0, 0.0, 360.0, 0.0)}, "param 3 is 360 instead of 0"),
    ],
    ids=str,
)
def test_differences_are_reported(changed: dict[str, object], why: str) -> None:
    assert told(PLACE, replace(PLACE, **changed)) == why


def test_large_numbers_may_differ_by_what_float32_and_radians_lose() -> None:
    high = replace(PLACE, z=50_000.0, params=(1000.0, 0.0, 0.0, 0.0))
    assert told(high, replace(high, z=50_000.04, params=(1000.009, 0.0, 0.0, 0.0))) == ""
    assert told(high, replace(high, z=50_000.2)) == "height 50000.2 m instead of 50000 m"
    assert told(high, replace(high, params=(1000.02, 0.0, 0.0, 0.0))) == "param 1 is 1000.02 instead of 1000"


def test_an_ardupilot_cuts_heights_to_centimetres() -> None:
    assert told(PLACE, replace(PLACE, z=99.99), ARDUPILOT) == ""
    assert told(PLACE, replace(PLACE, z=99.98), ARDUPILOT) == "height 99.98 m instead of 100 m"


def test_what_an_autopilot_is_not_known_to_keep_may_come_back_as_nothing_but_not_as_something_else() -> None:
    unknown = PlanItem(3000, 2, (4.0, 5.0, 0.0, 0.0))
    assert told(unknown, replace(unknown, params=(0.0, 5.0, 0.0, 0.0)), PX4) == ""
    assert told(unknown, replace(unknown, params=(3.0, 5.0, 0.0, 0.0)), PX4) == "param 1 is 3 instead of 4"
    hold = replace(PLACE, params=(4.0, 0.0, 0.0, 0.0))
    assert told(hold, PLACE, PX4) == "param 1 is 0 instead of 4"


def test_longer_and_shorter_plans_are_others() -> None:
    two, three = of(PLACE, waypoint(1)), of(PLACE, waypoint(1), waypoint(2))
    assert compare(two, three, PX4).differences == ("3 items instead of 2",)
    assert compare(three, two, PX4).differences == ("2 items instead of 3",)
    assert begins_alike(two, three, PX4) == begins_alike(three, two, PX4) == 2
    assert begins_alike(three, of(), PX4) == 0
    assert begins_alike(three, of(PLACE, waypoint(5), waypoint(2)), PX4) == 1


def test_the_first_ten_differences_are_reported() -> None:
    sent, held = of(*map(waypoint, range(30))), of(*(waypoint(i, z=5.0) for i in range(30)))
    found = compare(sent, held, PX4).differences
    assert found == tuple(f"item {i}: height 5 m instead of 20 m" for i in range(1, 11))
    many, none = fence(*(circle(float(i)) for i in range(1, 20))), Plan(PlanKind.FENCE)
    assert compare(many, none, PX4).differences == ("exclusion circle is missing",) * 10


@pytest.mark.parametrize(
    ("held", "why"),
    [
        ((circle(50.0), circle(50.0)), ("exclusion circle is not ours",)),
        ((circle(50.1),), ("exclusion circle is missing", "exclusion circle is not ours")),
        ((circle(50.0, 5003),), ("exclusion circle is missing", "inclusion circle is not ours")),
        ((replace(circle(50.0), x=1),), ("exclusion circle is missing", "exclusion circle is not ours")),
        ((replace(circle(50.0), y=1),), ("exclusion circle is missing", "exclusion circle is not ours")),
        ((circle(50.0), *square()), ("inclusion polygon of 4 points is not ours",)),
        ((), ("exclusion circle is missing",)),
    ],
)
def test_each_shape_of_a_fence_is_there_once(held: tuple[PlanItem, ...], why: tuple[str, ...]) -> None:
    assert compare(fence(circle(50.0)), Plan(PlanKind.FENCE, held), PX4).differences == why


def test_what_is_not_stored_is_noted_for_each_parameter() -> None:
    plan = of(
        replace(PLACE, params=(7.9, 2.0, 0.0, -90.0)),
        replace(PLACE, params=(3.0, 2.0, 0.0, math.nan)),
    )
    assert compare(plan, plan, ARDUPILOT).notes == (
        "ArduPilot does not keep param 1 of command 16 (1 x)",
        "ArduPilot does not keep param 2 of command 16 (2 x)",
        "ArduPilot does not keep param 4 of command 16 (1 x)",
    )
    assert compare(plan, plan, PX4).notes == compare(plan, plan, GENERIC).notes == ()


@settings(max_examples=15)
@given(missions(), st.sampled_from([ARDUPILOT, PX4, GENERIC]))
def test_a_plan_is_the_same_as_what_is_kept_of_it(plan: Plan, dialect: PlanDialect) -> None:
    kept = Plan(plan.kind, tuple(dialect.stored(plan.kind, item) for item in plan.items))
    assert compare(plan, kept, dialect).same and begins_alike(plan, kept, dialect) == len(plan.items)
