"""The edits of missions, without a screen."""

import pytest

from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.command_reference import MISSION_WORDS
from tui_gcs.core.plans.check import check
from tui_gcs.core.plans.model import CIRCLES, LAND, RETURN, TAKE_OFF, WAYPOINT, PlanKind, fence_shapes
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_edits import MissionEdits
from tui_gcs.widgets.missions.mission_text import item_text, to_item


@pytest.fixture
def editor() -> MissionEditor:
    """Of a mission of vehicle 1: take-off, two way-points, return; the second way-point is edited."""
    made = MissionEditor()
    made.vehicle = 1
    points = [build.waypoint(made.frame, place, 30.0) for place in ((50.0, 50.0), (50.0, -50.0))]
    mission = build.whole(made.frame, (0.0, 0.0), points, 30.0)
    made.take("planned", made.draft.with_items(1, PlanKind.MISSION, mission))
    made.choose(next(i for i, item in enumerate(mission) if item.command == WAYPOINT) + 1)
    return made


@pytest.fixture
def edits(editor: MissionEditor) -> MissionEdits:
    return MissionEdits(editor)


def choose(edits: MissionEdits, word: str) -> None:
    """As Left and Right in the field do."""
    item = edits.editor.item
    assert item is not None
    texts = item_text(edits.editor, item)
    edits.replace_item(to_item(edits, texts.__class__(word, *tuple(vars(texts).values())[1:]), item), "command")


def test_going_through_commands_that_have_no_place_loses_no_place(editor: MissionEditor, edits: MissionEdits) -> None:
    before = editor.item
    assert before is not None
    for word in MISSION_WORDS[1:]:
        choose(edits, word)
        item = editor.item
        assert item is not None
        if item.is_place:
            assert (item.x, item.y, item.z) == (before.x, before.y, before.z), word
    choose(edits, MISSION_WORDS[0])
    assert editor.item == before
    editor.undo()
    assert editor.item == before, "all of it was one edit"


def test_what_never_was_anywhere_comes_beyond_the_item_before_it(editor: MissionEditor, edits: MissionEdits) -> None:
    editor.choose(len(editor.items) - 1)
    assert editor.item is not None and editor.item.command == RETURN
    choose(edits, "waypoint")
    assert editor.place_m(editor.item) == pytest.approx((50.0, -70.0), abs=0.1)
    assert editor.item.z == 30.0, "not at 0 m"
    choose(edits, "spline")
    assert editor.place_m(editor.item) == pytest.approx((50.0, -70.0), abs=0.1), "not further with each key"
    choose(edits, "land")
    assert (editor.item.command, editor.item.x, editor.item.z) == (LAND, 0, 0.0)
    choose(edits, "take-off")
    assert (editor.item.command, editor.item.z) == (TAKE_OFF, 30.0)


def test_another_fence_beside_the_first_is_drawn_without_a_zone(editor: MissionEditor, edits: MissionEdits) -> None:
    editor.choose_kind(PlanKind.FENCE)
    edits.add_fence()
    edits.add_circle((10.0, 20.0))
    edits.add_fence((500.0, 0.0))
    shapes = fence_shapes(editor.items)
    assert [len(shape.items) for shape in shapes] == [4, 1, 4]
    assert [shape.command in CIRCLES for shape in shapes] == [False, True, False]
    assert editor.index == shapes[2].first, "the new one is edited"
    assert not check(editor.draft.of(1).plan(PlanKind.FENCE))
    editor.undo()
    assert len(fence_shapes(editor.items)) == 2
