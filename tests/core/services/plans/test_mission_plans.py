"""Plans on our simulator, the uplink's word, and comparisons as each autopilot keeps things."""

import math
from collections.abc import Callable

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.core.rigs.plan_peers import circle, fence, mission, square, waypoint
from tests.core.rigs.rig import Rig
from tui_gcs.core.firmware.plan_dialects import ARDUPILOT, GENERIC, PX4, PlanDialect
from tui_gcs.core.missions.plan_compare import begins_alike, compare
from tui_gcs.core.plans.check import check
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.uplink.jobs import JobState

Make = Callable[..., Rig]
FLOATS = st.floats(allow_nan=True, allow_infinity=True, width=32)
ITEMS = st.builds(
    PlanItem,
    command=st.integers(0, 65535),
    frame=st.integers(0, 255),
    params=st.tuples(FLOATS, FLOATS, FLOATS, FLOATS),
    x=st.integers(-(2**31), 2**31 - 1),
    y=st.integers(-(2**31), 2**31 - 1),
    z=FLOATS,
    autocontinue=st.booleans(),
)
PLANS = st.builds(Plan, st.sampled_from(PlanKind), st.lists(ITEMS, max_size=8).map(tuple))
DIALECTS = st.sampled_from([ARDUPILOT, PX4, GENERIC])


def test_a_simulated_vehicle_takes_a_mission_and_gives_it_back(rig: Make) -> None:
    run = rig(1).ready()
    missions = run.station.services.missions
    plan = Plan(PlanKind.MISSION, tuple(waypoint(i) for i in range(6)))
    job = missions.upload(1, plan)
    run.until(lambda: job.over, 30.0)
    assert (job.state, job.error) == (JobState.DONE, "") and missions.holds(1, plan)


def test_a_region_of_interest_is_sent_as_the_autopilot_takes_it_and_comes_back_unchanged(rig: Make) -> None:
    """ArduCopter refuses a mission with DO_SET_ROI_LOCATION (195), so the same is sent as DO_SET_ROI (201)."""
    run = rig(1).ready()
    missions = run.station.services.missions
    look, ahead = PlanItem(195, 3, x=473_977_000, y=85_456_000, z=5.0), PlanItem(197, 2)
    plan = Plan(PlanKind.MISSION, (waypoint(0, command=22), look, waypoint(1), ahead, waypoint(2)))
    job = missions.upload(1, plan)
    run.until(lambda: job.over, 30.0)
    assert (job.state, job.error) == (JobState.DONE, "") and missions.holds(1, plan)
    assert [item.command for item in ARDUPILOT.to_wire(plan)] == [16, 22, 201, 16, 201, 16]
    assert [item.command for item in PX4.to_wire(plan)] == [22, 195, 16, 197, 16]
    held = missions.download(1, PlanKind.MISSION)
    run.until(lambda: held.over, 30.0)
    assert held.plan is not None and (held.plan.items[1], held.plan.items[3]) == (look, ahead)


def test_a_region_of_interest_of_another_kind_is_left_as_it_is() -> None:
    """DO_SET_ROI with MAV_ROI_NONE (0), as other stations write it."""
    other = PlanItem(201, 3, x=473_977_000, y=85_456_000)
    assert ARDUPILOT.from_wire(PlanKind.MISSION, ARDUPILOT.to_wire(Plan(PlanKind.MISSION, (other,)))).items == (other,)


def test_a_vehicle_that_is_not_ours_gets_nothing_and_the_job_has_the_reason(rig: Make) -> None:
    run = rig(1).ready()
    run.station.picture.fleet.vehicles[1].identity.firmware_token = "somebody else's"
    job = run.station.services.missions.upload(1, mission(5))
    run.run(0.2)
    assert (job.state, job.error) == (JobState.FAILED, "not one of our simulated vehicles")
    assert not run.sent_to(1, "MISSION_COUNT")


@given(PLANS, DIALECTS)
@example(Plan(PlanKind.MISSION, (waypoint(0, command=21, params=(0.0, 0.0, 0.0, -8.8e-32)),)), PX4)
def test_whatever_a_vehicle_holds_can_be_judged(plan: Plan, dialect: PlanDialect) -> None:
    check(plan)
    assert dialect.from_wire(plan.kind, dialect.to_wire(plan)).kind is plan.kind
    assert len(plan.fingerprint) == 16 and plan.fingerprint == Plan(plan.kind, plan.items).fingerprint
    for item in plan.items:
        assert repr(dialect.stored(plan.kind, dialect.stored(plan.kind, item))) == repr(dialect.stored(plan.kind, item))


@pytest.mark.parametrize("dialect", [ARDUPILOT, PX4, GENERIC], ids=lambda d: d.name)
@pytest.mark.parametrize(
    "change",
    [
        {"x": 473_977_005},
        {"y": 1},
        {"z": 20.5},
        {"frame": 0},
        {"command": 17},
        {"params": (3.0, 0.0, 0.0, 0.0)},
    ],
    ids=str,
)
def test_another_item_is_another_plan(dialect: PlanDialect, change: dict[str, object]) -> None:
    plan = Plan(PlanKind.MISSION, (waypoint(0), waypoint(1)))
    other = Plan(PlanKind.MISSION, (waypoint(0), waypoint(1, **change)))
    assert compare(plan, plan, dialect).same
    assert not compare(plan, other, dialect).same and begins_alike(plan, other, dialect) == 1


def test_the_same_direction_in_other_numbers() -> None:
    west = Plan(PlanKind.MISSION, (waypoint(0, params=(0.0, 0.0, 0.0, -90.0)),))
    held = Plan(PlanKind.MISSION, (waypoint(0, params=(0.0, 0.0, 0.0, 270.00003)),))
    none = Plan(PlanKind.MISSION, (waypoint(0, params=(0.0, 0.0, 0.0, math.nan)),))
    assert compare(west, held, PX4).same and not compare(west, none, PX4).same


def test_fence_shapes_may_change_places_but_not_points() -> None:
    a, b = square(), square(20_000, 5002, lat=473_990_000)
    assert compare(fence(*a, *b, circle(5.0)), fence(circle(5.0), *b, *a), PX4).same
    turned = compare(fence(*a), fence(a[0], a[2], a[1], a[3]), PX4)
    assert turned.differences == (
        "inclusion polygon of 4 points is missing",
        "inclusion polygon of 4 points is not ours",
    )
