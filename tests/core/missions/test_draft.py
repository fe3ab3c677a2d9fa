"""Drafts of missions: edits, undo, the walk over jumps, files."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.core.missions import draft_file as store
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import item_edits as edits
from tui_gcs.core.missions.autopilot_limits import differences
from tui_gcs.core.missions.command_reference import COMMANDS, MISSION_WORDS, with_command, word_of
from tui_gcs.core.missions.draft import MissionDraft, MissionHistory, VehicleDraft
from tui_gcs.core.missions.item_sequence import ItemWalk
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.plans.check import check
from tui_gcs.core.plans.model import JUMP, MISSION_FRAME, RELATIVE, WAYPOINT, Plan, PlanItem, PlanKind

MISSION, FENCE = PlanKind.MISSION, PlanKind.FENCE


def waypoint(number: int) -> PlanItem:
    return PlanItem(WAYPOINT, RELATIVE, x=520_000_000 + number, y=-6_000_000, z=30.0)


def jump(to: int, times: int = 1) -> PlanItem:
    return PlanItem(JUMP, MISSION_FRAME, (float(to), float(times), 0.0, 0.0))


def targets(items: tuple[PlanItem, ...]) -> list[PlanItem]:
    """What the jumps lead to."""
    return [items[int(item.params[0])] for item in items if item.command == JUMP]


# ---------------------------------------------------------------- edits


def test_jumps_lead_to_the_same_item_after_every_edit() -> None:
    items = (waypoint(0), waypoint(1), waypoint(2), jump(1))
    assert targets(edits.insert(items, 0, [waypoint(9)])) == [waypoint(1)]
    assert targets(edits.insert(items, 1, [waypoint(9)])) == [waypoint(1)]
    assert targets(edits.insert(items, 2, [waypoint(9)])) == [waypoint(1)]
    assert targets(edits.delete(items, 0)) == [waypoint(1)]
    assert targets(edits.delete(items, 1)) == [waypoint(2)], "to the one after what is gone"
    assert targets(edits.reorder(items, 1, 1)[0]) == [waypoint(1)]
    assert targets(edits.reorder(items, 3, -3)[0]) == [waypoint(1)]


def test_an_inserted_mission_keeps_its_own_jumps() -> None:
    pattern = (waypoint(5), waypoint(6), jump(0))
    items = edits.insert((waypoint(0), waypoint(1)), 1, pattern)
    assert targets(items) == [waypoint(5)]


@settings(max_examples=40)
@given(st.lists(st.integers(0, 9), min_size=1, max_size=8), st.integers(0, 7), st.integers(-9, 9))
def test_reordering_keeps_all_items_and_can_be_undone(numbers: list[int], at: int, by: int) -> None:
    items = tuple(waypoint(n) for n in numbers)
    at = min(at, len(items) - 1)
    new, to = edits.reorder(items, at, by)
    assert new[to] == items[at]
    assert edits.reorder(new, to, at - to)[0] == items


def test_places_are_shifted_and_others_stay() -> None:
    items = (PlanItem(178, MISSION_FRAME, (1.0, 5.0, 0.0, 0.0)), waypoint(1))
    assert edits.shifted(items, {0, 1}, 7, -3) == (
        items[0],
        PlanItem(WAYPOINT, RELATIVE, x=520_000_008, y=-6_000_003, z=30.0),
    )


def test_corners_of_a_fence_always_say_how_many_they_are() -> None:
    square = fences.polygon([(52.0, 0.0), (52.0, 0.1), (52.1, 0.1), (52.1, 0.0)])
    items = (*fences.circle((52.0, 0.0), 50.0, inside=False), *square)
    five = fences.add_corner(items, 1, (52.0, 0.05))
    assert len(five) == 6
    assert {item.params[0] for item in five[1:]} == {5.0}
    assert check(Plan(FENCE, five)) == []
    assert fences.delete_item(five, 2) == items
    assert check(Plan(FENCE, fences.delete_item(five, 3))) == []
    triangle = fences.delete_item(items, 1)
    assert fences.delete_item(triangle, 1) == items[:1], "less than a triangle is nothing"
    assert fences.delete_item(items, 0) == square
    assert {item.command for item in fences.other_side(items, 1)} == {5004, 5002}


# ---------------------------------------------------------------- undo


def test_undo_and_redo_go_through_the_same_drafts() -> None:
    history = MissionHistory(MissionDraft())
    drafts = [history.draft]
    for number in range(3):
        history.do(f"add {number}", history.draft.with_items(1, MISSION, [waypoint(number)]))
        drafts.append(history.draft)
    assert [step and step.label for step in (history.undo() for _ in range(4))] == ["add 2", "add 1", "add 0", None]
    assert history.draft == drafts[0]
    assert [step and step.label for step in (history.redo() for _ in range(4))] == ["add 0", "add 1", "add 2", None]
    assert history.draft == drafts[3]


def test_typing_in_one_field_is_one_step_until_it_is_left() -> None:
    history = MissionHistory(MissionDraft())
    for number in (1, 12, 123):
        history.do("height", history.draft.with_items(1, MISSION, [waypoint(number)]), "1 height")
    history.end_subject()
    history.do("height", history.draft.with_items(1, MISSION, [waypoint(4)]), "1 height")
    assert history.edits == 2
    history.undo()
    assert history.draft.of(1).mission == (waypoint(123),)


def test_a_draft_is_unsaved_until_it_is_as_in_the_file() -> None:
    history = MissionHistory(MissionDraft())
    history.do("add", history.draft.with_items(1, MISSION, [waypoint(1)]))
    assert history.unsaved
    history.saved()
    assert not history.unsaved
    history.undo()
    assert history.unsaved
    history.redo()
    assert not history.unsaved


# ---------------------------------------------------------------- commands


def test_every_command_becomes_every_other_and_is_valid() -> None:
    for word in MISSION_WORDS:
        for command in COMMANDS:
            item = with_command(PlanItem(command.command, RELATIVE, x=520_000_000, y=-6_000_000, z=30.0), word)
            problems = [p.text for p in check(Plan(MISSION, (waypoint(0), item)))]
            assert not problems or (item.command == JUMP), (command.word, word, problems)


def test_an_unknown_command_keeps_its_number_and_all_parameters() -> None:
    word = word_of(31337)
    assert (word.word, [index for index, _ in word.params]) == ("command 31337", [0, 1, 2, 3])


# ---------------------------------------------------------------- jumps


def test_a_jump_is_taken_as_often_as_it_demands() -> None:
    walk = ItemWalk((waypoint(0), waypoint(1), jump(0, 2), waypoint(2)))
    assert list(walk.steps()) == [0, 1, 0, 1, 0, 1, 3]
    assert not walk.endless


def test_a_jump_for_ever_is_followed_once() -> None:
    walk = ItemWalk((waypoint(0), waypoint(1), jump(0, -1), waypoint(2)))
    assert list(walk.steps()) == [0, 1, 0, 1]
    assert walk.endless


def test_jumps_within_jumps_end() -> None:
    items = (waypoint(0), *(jump(0, 1000) for _ in range(5)))
    walk = ItemWalk(items)
    assert len(list(walk.steps())) < 20_000
    assert walk.cut


def test_jumps_into_nowhere_are_stepped_over() -> None:
    walk = ItemWalk((jump(0), jump(99), PlanItem(JUMP, params=(math.nan, 1.0, 0.0, 0.0)), waypoint(1)))
    assert list(walk.steps()) == [3]


# ---------------------------------------------------------------- files


numbers = st.floats(allow_nan=True, allow_infinity=False, width=32)
items_of_plans = st.builds(
    PlanItem,
    st.integers(1, 0xFFFF),
    st.sampled_from((0, 2, 3, 10)),
    st.tuples(numbers, numbers, numbers, numbers),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(-(2**31), 2**31 - 1),
    st.floats(-1e4, 8e4),
    st.booleans(),
)
vehicles = st.builds(VehicleDraft, *(st.lists(items_of_plans, max_size=3).map(tuple) for _ in range(3)))


@settings(max_examples=15, deadline=None)
@given(st.dictionaries(st.integers(1, 254), vehicles, max_size=4))
def test_a_draft_comes_back_from_its_file(plans: dict[int, VehicleDraft]) -> None:
    draft = MissionDraft({number: each for number, each in sorted(plans.items()) if not each.is_empty})
    saved = store.SavedDraft(draft, Performance(endurance_s=900.0))
    assert repr(store.from_bytes(store.to_bytes(saved))) == repr(saved)  # by repr: NaN is like NaN


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"[]",
        b"\xff",
        b'{"missions": 2, "vehicles": {}}',
        b'{"missions": 1, "vehicles": {"0": {}}}',
        b'{"missions": 1, "vehicles": {}, "assumed": {"speed_m_s": 0, "climb_m_s": 1, "descent_m_s": 1,'
        b' "endurance_s": 900, "reserve_pct": 20}}',
        b'{"missions": 1, "vehicles": {"1": {"mission": [[16, 3, [0, 0, 0], 0, 0, 0, true]]}}}',
        b"[" * 100_000,
    ],
)
def test_what_is_no_draft_is_one_line(data: bytes) -> None:
    with pytest.raises(store.DraftFileError) as caught:
        store.from_bytes(data)
    assert "\n" not in str(caught.value)


def test_differences_are_those_that_the_autopilot_would_keep() -> None:
    ours = Plan(MISSION, (PlanItem(WAYPOINT, RELATIVE, (0.0, 2.0, 0.0, 0.0), 520_000_000, 0, 30.0),))
    held = Plan(MISSION, (PlanItem(WAYPOINT, RELATIVE, (0.0, 0.0, 0.0, 0.0), 520_000_000, 0, 30.0),))
    assert differences(ours, held, "ArduCopter") == (), "it keeps no acceptance radius"
    assert differences(ours, held, "PX4") == ("item 1: param 2 is 0 instead of 2",)
