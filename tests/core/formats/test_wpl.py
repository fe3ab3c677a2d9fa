"""`QGC WPL 110` and our own JSON: what goes out comes back; home lines, jumps, and files of others."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.plan_designs import HOMES, RALLIES, fences, missions
from tests.core.rigs.plan_peers import circle, fence, mission, rally, square
from tui_gcs.core.formats.content import Content, FormatError, Home
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.formats.plan_json import write_plain
from tui_gcs.core.formats.wpl import HomeLine, WplPlan, read_wpl, write_wpl
from tui_gcs.core.plans.model import JUMP, Plan, PlanItem, PlanKind

JUMPING = Plan(PlanKind.MISSION, (*mission(4).items, PlanItem(JUMP, 2, (1.0, 3.0, 0.0, 0.0))))
PLANS = [mission(30), JUMPING, fence(*square(), circle(50.5)), rally(20.0, 33.3), Plan(PlanKind.MISSION)]
MISSION_PLANNER = (
    "QGC WPL 110\r\n"
    "0\t1\t0\t16\t0\t0\t0\t0\t-35.3632620\t149.1652370\t584.000000\t1\r\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1\r\n"
    "2\t0\t3\t16\t0\t0\t0\t0\t-35.3612620\t149.1652370\t30\t1\r\n"
    "3\t0\t2\t177\t2\t5\t0\t0\t0\t0\t0\t1\r\n"
)
QGC_PX4 = (
    "QGC WPL 110\n0\t1\t3\t22\t15\t0\t0\tnan\t47.3977\t8.5456\t10\t1\n1\t0\t3\t16\t0\t0\t0\tnan\t47.398\t8.546\t10\t1\n"
)


def plan_in(text: str, kind: PlanKind) -> Plan:
    found = read_file(text.encode(), kind).plan(kind)
    assert found is not None
    return found


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: f"{plan.kind.word}-{len(plan.items)}")
def test_a_plan_comes_back_as_it_was(plan: Plan) -> None:
    assert plan_in(write_wpl(plan), plan.kind).fingerprint == plan.fingerprint
    assert plan_in(write_wpl(plan, Home(47.5, -8.5, 488.0)), plan.kind).fingerprint == plan.fingerprint
    assert plan_in(write_plain(plan), plan.kind).fingerprint == plan.fingerprint


@settings(max_examples=20, deadline=None)
@given(missions() | fences() | RALLIES, HOMES)
def test_any_plan_comes_back_as_it_was(plan: Plan, home: Home) -> None:
    assert plan_in(write_wpl(plan, home), plan.kind).fingerprint == plan.fingerprint
    assert plan_in(write_plain(plan), plan.kind).fingerprint == plan.fingerprint


def test_a_file_of_mission_planner_has_home_in_its_first_line() -> None:
    read = read_wpl(MISSION_PLANNER)
    assert read.home == Home(-35.363262, 149.165237, 584.0) and [item.command for item in read.plan.items] == [
        22,
        16,
        177,
    ]
    assert read.plan.items[1].x == -353_612_620 and read.plan.items[1].y == 1_491_652_370
    assert read.plan.items[2].params[0] == 1.0, "line 2 of the file is the second item"


def test_a_file_of_qgc_for_px4_begins_with_an_item() -> None:
    read = read_wpl(QGC_PX4)
    assert read.home is None and [item.command for item in read.plan.items] == [22, 16]
    assert math.isnan(read.plan.items[0].params[3])


def test_the_kind_of_a_file_follows_from_its_commands() -> None:
    for plan in PLANS[:4]:
        assert read_wpl(write_wpl(plan)).plan.kind is plan.kind
    with pytest.raises(FormatError, match="it is a mission, not a fence"):
        read_wpl(QGC_PX4, PlanKind.FENCE)


def test_home_comes_back_from_the_first_line() -> None:
    home = Home(47.5000001, -8.5000001, 488.25)
    assert read_wpl(write_wpl(mission(5), home)).home == home
    assert read_wpl(write_wpl(mission(5))).home == Home(0.0, 0.0, 0.0), "nobody said where it is"


def test_a_first_line_with_another_index_is_an_item() -> None:
    """A place at 600 m above sea level that is flown to looks like a home line: only the index tells the difference."""
    text = "QGC WPL 110\n1\t0\t0\t16\t0\t0\t0\t0\t47.5\t8.5\t600\t1\n"
    read = read_wpl(text)
    assert len(read.plan.items) == 1 and read.home is None
    assert read.note == "its first line is an item: its index is 1 (--home-line yes: it is home)"


def test_index_0_is_home_in_any_frame_but_for_a_px4() -> None:
    """ArduPilot ignores the frame of item 0; the home of an autotest in frame 3 became a way-point 343 m up."""
    text = (
        "QGC WPL 110\n0\t0\t3\t16\t0\t0\t0\t0\t-27.27\t151.29\t343\t1\n1\t0\t3\t16\t0\t0\t0\t0\t-27.28\t151.3\t50\t1\n"
    )
    read = read_wpl(text)
    assert [item.z for item in read.plan.items] == [50.0]
    assert read.home is not None and math.isnan(read.home.amsl_m), "343 m above what, the frame does not say"
    assert "in frame 3, as ArduPilot takes it" in read.note
    read = read_wpl(text, home=HomeLine.AMSL)
    assert [item.z for item in read.plan.items] == [343.0, 50.0] and "PX4 has no home in a mission" in read.note
    assert [item.z for item in read_wpl(MISSION_PLANNER, home=HomeLine.AMSL).plan.items] == [20.0, 30.0, 0.0]


def test_a_first_line_that_is_no_way_point_is_an_item() -> None:
    read = read_wpl(QGC_PX4.replace("\t1\t3\t22", "\t1\t5\t22"))
    assert [item.command for item in read.plan.items] == [22, 16] and read.note == ""


@pytest.mark.parametrize("plan", [fence(*square(), circle(50.5)), rally(20.0, 33.3)], ids=lambda plan: plan.kind.word)
def test_mission_planner_puts_home_before_fences_and_rally_points(plan: Plan) -> None:
    head, *lines = write_wpl(plan).splitlines()
    for home in ("0\t1\t0\t16\t0\t0\t0\t0\t-35.36\t149.16\t584\t1", "0\t1\t0\t0\t0\t0\t0\t0\t0\t0\t0\t1"):
        numbered = [line.replace(line.split("\t")[0], str(i), 1) for i, line in enumerate(lines, 1)]
        read = read_wpl("\n".join([head, home, *numbered]))
        assert read.plan == plan and "home" in read.note


def test_the_meaning_of_the_first_line_can_be_given() -> None:
    assert len(read_wpl(MISSION_PLANNER, home=HomeLine.NO).plan.items) == 4
    assert len(read_wpl(QGC_PX4, home=HomeLine.YES).plan.items) == 1


def test_places_are_exact_to_the_last_digit() -> None:
    for x in (-1, 1, -9_999_999, 473_977_001, -899_999_999):
        plan = Plan(PlanKind.RALLY, (PlanItem(5100, 3, x=x, y=-x, z=1.25),))
        assert read_wpl(write_wpl(plan)) == WplPlan(plan)


def test_a_command_that_is_not_known_keeps_its_place() -> None:
    """DO_LAND_START at a place: its numbers are degrees by the frame, whatever the command."""
    start = PlanItem(189, 3, x=473_977_000, y=85_456_000, z=20.0)
    text = write_wpl(Plan(PlanKind.MISSION, (start,)))
    assert "47.3977000\t8.5456000" in text and read_wpl(text).plan.items == (start,)
    bare = PlanItem(203, 3, (0.0, 0.0, 0.0, 0.0), x=1, y=-5)
    assert "\t1\t-5\t" in write_wpl(Plan(PlanKind.MISSION, (bare,)))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "is empty"),
        ("hello", "none of the formats"),
        ("QGC WPL 110\n0 1 3 16 0 0 0 0 47 8 10", "line 2: 11 fields instead of 12"),
        ("QGC WPL 110\n\n# a remark\n0 1 3 16 0 0 0 0 x 8 10 1", "line 4: not the numbers"),
        ("QGC WPL 110\n0 1 3 16 0 0 0 0 1_0 8 10 1", "line 2: not the numbers"),
        ("QGC WPL 110\n0 1 3 16 0 0 0 0 inf 8 10 1", "line 2"),
        ("QGC WPL 110\n" + "0 1 3 16 0 0 0 0 47 8 10 1\n" * 2002, "more than 2000 items"),
        ("QGC WPL PB 110\n", "does not begin with"),
        ('{"kind": "mission"}', "items"),
        ('{"kind": "route", "items": []}', "neither mission, fence nor rally"),
        ('{"kind": "mission", "items": [{"command": 16, "frame": 3, "params": [1], "z": 0}]}', "item 1: 4 params"),
        ('{"kind": "mission", "kind": "fence", "items": []}', "'kind' is given twice"),
        ('{"kind": "mission", "items": [{"command": 16, "frame": 3, "params": [NaN], "z": 0}]}', "NaN is no number"),
        ('{"kind": ' + "9" * 5000 + "}", "digits"),
        ('{"kind": "\\ud800", "items": []}', "half of a character"),
        ("{" * 100_000, "line 1"),
    ],
)
def test_errors_of_a_plan_name_their_place(text: str, why: str) -> None:
    with pytest.raises(FormatError, match=why):
        read_file(text.encode())


@given(st.text(max_size=200).map(lambda rest: f"QGC WPL 110\n{rest}") | st.text(max_size=200).map(lambda t: "{" + t))
def test_any_text_is_a_plan_or_one_line_of_reason(text: str) -> None:
    try:
        assert isinstance(read_file(text.encode("utf-8", "replace")), Content)
    except FormatError as error:
        assert "\n" not in str(error)
