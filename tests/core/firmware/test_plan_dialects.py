"""How plans are said to each autopilot, and what is known to be left of them there. Items are examples, no vehicle."""

import math

import pytest

from tests.core.rigs.heard import Heard
from tui_gcs.core.firmware.plan_dialects import ARDUPILOT, ARDUPLANE, GENERIC, PX4, PlanDialect, dialect_of
from tui_gcs.core.mavlink.enum_names import NOT_VEHICLES
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind

MISSION, FENCE, RALLY = PlanKind.MISSION, PlanKind.FENCE, PlanKind.RALLY
LAT, LON = 470_000_000, 85_000_000


def at(command: int = 16, *params: float, frame: int = 3, z: float = 20.0, north: int = 0, east: int = 0) -> PlanItem:
    """An item at a place, `north` and `east` in 1e-7 degrees."""
    one, two, three, four = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
    return PlanItem(command, frame, (one, two, three, four), LAT + north, LON + east, z)


def do(command: int, *params: float) -> PlanItem:
    """An item that is nowhere."""
    one, two, three, four = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
    return PlanItem(command, 2, (one, two, three, four))


def polygon(command: int, half: int, north: int = 0) -> tuple[PlanItem, ...]:
    corners = ((-half, -half), (half, -half), (half, half), (-half, half))
    return tuple(at(command, 4.0, frame=0, z=0.0, north=north + a, east=b) for a, b in corners)


def circle(command: int, radius_m: float, north: int = 0) -> PlanItem:
    return at(command, radius_m, frame=0, z=0.0, north=north)


# ---------------------------------------------------------------- said


def test_only_a_mission_of_an_ardupilot_has_home_in_front() -> None:
    plan = Plan(MISSION, (at(22), at()))
    first, *rest = ARDUPILOT.to_wire(plan)
    assert (first.command, first.frame, len(rest), ARDUPILOT.wire_count(plan)) == (16, 0, 2, 3)
    assert (ARDUPILOT.index_of(0), ARDUPILOT.index_of(3), ARDUPILOT.seq_of(0)) == (-1, 2, 1)
    assert len(PX4.to_wire(plan)) == PX4.wire_count(plan) == 2 and PX4.index_of(0) == PX4.seq_of(0) == 0
    assert len(ARDUPILOT.to_wire(Plan(RALLY, (at(5100),)))) == ARDUPILOT.wire_count(Plan(RALLY, (at(5100),))) == 1


@pytest.mark.parametrize(("dialect", "said"), [(ARDUPILOT, 2.0), (PX4, 1.0), (GENERIC, 1.0)])
def test_a_jump_leads_to_the_same_item_with_and_without_home(dialect: PlanDialect, said: float) -> None:
    plan = Plan(MISSION, (at(22), at(), do(177, 1.0, 5.0)))
    sent = dialect.to_wire(plan)
    assert (sent[-1].params[0], sent[-1].params[1], sent[-1].frame) == (said, 5.0, 2)
    assert dialect.from_wire(MISSION, sent) == plan


@pytest.mark.parametrize(("written", "said"), [(5, 0), (6, 3), (11, 10), (0, 0), (3, 3), (10, 10)])
def test_frames_of_integers_are_the_plain_ones(written: int, said: int) -> None:
    """GLOBAL_INT and GLOBAL, GLOBAL_RELATIVE_ALT_INT and GLOBAL_RELATIVE_ALT, …: the same heights."""
    (sent,) = PX4.to_wire(Plan(MISSION, (at(frame=written),)))
    assert (sent.frame, sent.z) == (said, 20.0)


def test_what_is_nowhere_says_so_and_a_place_stays_one() -> None:
    delay, start = PlanItem(93, 3, (5.0, -1.0, -1.0, -1.0)), at(189)
    (said_delay, said_start) = PX4.to_wire(Plan(MISSION, (delay, start)))
    assert (said_delay.frame, said_start.frame, said_start.x) == (2, 3, LAT)


def test_polygons_of_a_fence_go_before_circles_and_have_no_heights() -> None:
    shapes = (circle(5003, 30.0), *polygon(5001, 1000))
    sent = PX4.to_wire(Plan(FENCE, tuple(PlanItem(i.command, 3, i.params, i.x, i.y, 50.0) for i in shapes)))
    assert [item.command for item in sent] == [5001] * 4 + [5003]
    assert {(item.frame, item.z) for item in sent} == {(0, 0.0)}


def test_ardupilot_is_never_told_nan() -> None:
    """It took it for a number."""
    take_off = at(22, 0.0, 0.0, 0.0, math.nan)
    assert ARDUPILOT.to_wire(Plan(MISSION, (take_off,)))[1].params == (0.0, 0.0, 0.0, 0.0)
    assert math.isnan(PX4.to_wire(Plan(MISSION, (take_off,)))[0].params[3])


def test_what_is_to_be_looked_at_is_said_to_ardupilot_by_the_old_command() -> None:
    plan = Plan(MISSION, (at(195), do(197)))
    _, look, end = ARDUPILOT.to_wire(plan)
    assert (look.command, look.params[0], look.x, end.command, end.params[0]) == (201, 3.0, LAT, 201, 0.0)
    assert ARDUPILOT.from_wire(MISSION, ARDUPILOT.to_wire(plan)) == plan
    assert [item.command for item in PX4.to_wire(plan)] == [195, 197]


# ---------------------------------------------------------------- kept


@pytest.mark.parametrize(
    ("turns", "kept"), [(0.5, 0.5), (0.3, 76 / 256), (1.0, 1.0), (2.7, 2.0), (254.9, 254.0), (300.0, 255.0)]
)
def test_ardupilot_counts_whole_turns_and_parts_of_one(turns: float, kept: float) -> None:
    assert ARDUPILOT.stored(MISSION, at(18, turns)).params[0] == kept


@pytest.mark.parametrize(
    ("radius_m", "kept"),
    [(30.9, 30.0), (-30.9, -30.0), (255.9, 250.0), (255.0, 255.0), (268.0, 260.0), (9000.0, 2550.0)],
)
def test_ardupilot_keeps_small_radii_in_metres_and_big_ones_in_tens(radius_m: float, kept: float) -> None:
    assert ARDUPILOT.stored(MISSION, at(18, 1.0, 0.0, radius_m)).params[2] == kept


def test_each_keeps_its_own_of_a_way_point() -> None:
    item = at(16, 7.9, 2.5, 3.5, -90.0)
    assert ARDUPILOT.stored(MISSION, item).params == (7.0, 0.0, 0.0, 0.0)
    assert ARDUPLANE.stored(MISSION, item).params == (0.0, 2.0, 3.0, 0.0)
    assert PX4.stored(MISSION, item).params == pytest.approx((7.9, 2.5, 0.0, 270.0))
    assert GENERIC.stored(MISSION, item).params == pytest.approx((7.9, 2.5, 3.5, -90.0))


def test_rally_points_of_an_ardupilot_are_whole_metres_high() -> None:
    assert ARDUPILOT.stored(RALLY, at(5100, z=20.9)).z == 20.0
    assert PX4.stored(RALLY, at(5100, z=20.5)).z == 20.5


def test_another_place_or_height_is_another_item_to_every_autopilot() -> None:
    for dialect in (ARDUPILOT, ARDUPLANE, PX4, GENERIC):
        kept = dialect.stored(MISSION, at())
        for other in (at(north=1), at(east=1), at(z=21.0), at(frame=0), at(17), at(16, 5.0)):
            assert dialect.stored(MISSION, other) != kept or (dialect is ARDUPLANE and other.params[0])


# ---------------------------------------------------------------- not taken


def test_who_holds_fewer_items_says_how_many() -> None:
    most = PlanDialect("Small", has_home=True, most=(3, None, 1))
    assert most.problems(Plan(MISSION, (at(), at())), None) == []
    assert most.problems(Plan(MISSION, (at(), at(), at())), None) == ["4 items, Small holds 3 (home is one of them)"]
    assert most.problems(Plan(RALLY, (at(5100), at(5100))), None) == ["2 items, Small holds 1"]
    assert most.problems(Plan(FENCE, polygon(5001, 10)), None) == []


@pytest.mark.parametrize("frame", [10, 11])
def test_heights_above_the_ground_are_for_who_knows_them(frame: int) -> None:
    plan = Plan(MISSION, (at(), at(frame=frame)))
    assert PX4.problems(plan, None) == ["PX4 knows no heights above the ground"]
    assert ARDUPILOT.problems(plan, None) == [] and ARDUPILOT.flies_blind(plan)
    assert not ARDUPILOT.flies_blind(Plan(MISSION, (at(),))) and not PX4.flies_blind(plan)


@pytest.mark.parametrize(
    ("shape", "kept"),
    [
        (polygon(5001, 1000), True),
        (polygon(5001, 1000, north=5000), False),
        (polygon(5002, 1000), False),
        (polygon(5002, 1000, north=5000), True),
        ((circle(5003, 30.0, north=2000),), True),  # 22 m away
        ((circle(5003, 20.0, north=2000),), False),
        ((circle(5004, 30.0, north=2000),), False),
        ((circle(5004, 20.0, north=2000),), True),
    ],
)
def test_px4_drops_a_fence_that_keeps_its_home_out(shape: tuple[PlanItem, ...], kept: bool) -> None:
    plan, home_deg = Plan(FENCE, shape), (LAT / 1e7, LON / 1e7)
    found = PX4.problems(plan, home_deg)
    assert (found == []) is kept and all(
        "home is outside of what it allows, PX4 would drop it" in text for text in found
    )
    assert PX4.problems(plan, None) == [] and ARDUPILOT.problems(plan, home_deg) == [], "not known; or not its way"


def test_east_and_west_of_a_circle_shrink_with_the_latitude() -> None:
    """2000e-7 degrees east at 47 N are 15 m."""
    here = at(5003, 16.0, frame=0)
    assert PX4.problems(Plan(FENCE, (here,)), (LAT / 1e7, (LON + 2000) / 1e7)) == []
    nearer = at(5003, 14.0, frame=0)
    assert PX4.problems(Plan(FENCE, (nearer,)), (LAT / 1e7, (LON + 2000) / 1e7)) != []


def test_a_polygon_of_too_many_corners_is_named() -> None:
    corners = tuple(at(5001, 256.0, frame=0, north=i) for i in range(256))
    (why,) = ARDUPILOT.problems(Plan(FENCE, corners), None)
    assert why.endswith("ArduPilot takes 255")


# ---------------------------------------------------------------- whose


@pytest.mark.parametrize(
    ("autopilot", "kind", "dialect"),
    [(3, 2, ARDUPILOT), (3, 1, ARDUPLANE), (3, 20, ARDUPLANE), (12, 1, PX4), (12, 2, PX4), (0, 2, GENERIC)],
)
def test_the_dialect_is_that_of_its_heartbeat(autopilot: int, kind: int, dialect: PlanDialect) -> None:
    assert dialect_of(Heard(autopilot=autopilot, type=kind).vehicle) is dialect


def test_whatever_has_wings_is_an_arduplane() -> None:
    """MAV_TYPE: fixed wing, airship, and all sorts of VTOL; no rotors alone, rovers, boats or submarines."""
    vehicles = set(range(45)) - NOT_VEHICLES
    found = {kind for kind in vehicles if dialect_of(Heard(autopilot=3, type=kind).vehicle) is ARDUPLANE}
    assert found == {1, 7, 16, 17, 19, 20, 21, 22, 23, 24, 25, 28}


def test_it_flies_its_mission_if_it_is_armed_and_in_that_mode() -> None:
    flies = Heard(custom_mode=3, base_mode=81 | 128).vehicle
    assert ARDUPILOT.flies_mission(flies)
    flies.telemetry.armed = False
    assert not ARDUPILOT.flies_mission(flies)
    assert not ARDUPILOT.flies_mission(Heard(custom_mode=4, base_mode=81 | 128).vehicle)
