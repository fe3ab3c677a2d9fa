"""QGroundControl's `.plan`: what goes out comes back, and what is unknown here stays in the file."""

import copy
import json
import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.plan_designs import HOMES, RALLIES, fences, missions
from tests.core.rigs.plan_peers import circle, fence, mission, square, waypoint
from tui_gcs.core.formats.bounded import json_of
from tui_gcs.core.formats.content import Content, FormatError, Home
from tui_gcs.core.formats.qgc_plan import content_of
from tui_gcs.core.formats.qgc_write import write_qgc
from tui_gcs.core.plans.model import JUMP, Plan, PlanItem, PlanKind


def simple(number: int, command: int = 16, params: list[Any] | None = None, **more: Any) -> dict[str, Any]:
    """As QGroundControl writes it, with something of its own in it."""
    usual = [0, 0, 0, None, 47.3977 + number / 1e4, 8.5456, 20]
    return {
        "type": "SimpleItem", "command": command, "frame": 3, "autoContinue": True, "doJumpId": number,
        "params": params or usual, "AltitudeMode": 1, "Altitude": 20, "AMSLAltAboveTerrain": None, "myNote": number,
    } | more  # fmt: skip


def survey(first: int) -> dict[str, Any]:
    inside = {"version": 1, "CameraCalc": {"CameraName": "Mapper"}, "Items": [simple(first), simple(first + 1)]}
    return {
        "type": "ComplexItem", "complexItemType": "survey", "version": 5, "angle": 12,
        "polygon": [[47.1, 8.1], [47.2, 8.1], [47.2, 8.2]], "TransectStyleComplexItem": inside,
    }  # fmt: skip


def document(*items: dict[str, Any]) -> dict[str, Any]:
    """A plan of QGroundControl with a survey, a jump, and unknown keys."""
    mission_items = items or (
        simple(1, 22),
        survey(2),
        simple(4, JUMP, [1, 2, 0, 0, 0, 0, 0], frame=2),
        simple(5, 20, [0] * 7, frame=2),
    )
    return {
        "fileType": "Plan",
        "groundStation": "QGroundControl",
        "version": 1,
        "somethingNew": {"deep": [1, None, "ä"]},
        "mission": {
            "version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
            "plannedHomePosition": [47.3977419, 8.5455938, 488], "items": list(mission_items), "later": True,
        },
        "geoFence": {
            "version": 2,
            "circles": [{"circle": {"center": [47.4, 8.54], "radius": 50.5}, "inclusion": False, "version": 1, "n": 1}],
            "polygons": [{"polygon": [[47.4, 8.5], [47.4, 8.6], [47.3, 8.6]], "inclusion": True, "version": 1, "m": 2}],
            "breachReturn": [47.39, 8.55, 30],
        },
        "rallyPoints": {"version": 2, "points": [[47.397, 8.545, 50]], "extra": []},
    }  # fmt: skip


def read(raw: dict[str, Any]) -> Content:
    return content_of(json_of(json.dumps(raw)))


def written(content: Content) -> dict[str, Any]:
    made: dict[str, Any] = json.loads(write_qgc(content).data)
    return made


def test_a_survey_is_flown_as_way_points_and_a_jump_leads_to_its_item() -> None:
    content = read(document())
    assert content.mission is not None and content.fence is not None and content.rally is not None
    assert [item.command for item in content.mission.items] == [22, 16, 16, JUMP, 20]
    assert content.mission.items[3].params[0] == 0.0
    assert content.mission.items[1].x == 473_979_000 and math.isnan(content.mission.items[1].params[3])
    assert [item.command for item in content.fence.items] == [5001, 5001, 5001, 5004, 5000]
    assert content.rally.items[0].z == 50 and content.home == Home(47.3977419, 8.5455938, 488)
    assert content.notes == ("1 survey or scan flattened into way-points",)


def test_what_was_not_changed_is_written_as_it_was() -> None:
    assert written(read(document())) == document()


def test_numbers_that_are_not_in_order_stay_while_nothing_changes() -> None:
    raw = document(simple(7), simple(3), simple(5, JUMP, [7, 2, 0, 0, 0, 0, 0], frame=2))
    content = read(raw)
    assert written(content) == raw
    other_nan = [replace(item, params=(*item.params[:3], float("nan"))) for item in content.mission.items[:2]]
    again = Plan(PlanKind.MISSION, (*other_nan, content.mission.items[2]))
    assert written(replace(content, mission=again)) == raw


@pytest.mark.parametrize("at", range(5))
def test_what_is_before_and_after_a_changed_place_is_kept(at: int) -> None:
    content = read(document(*(simple(number) for number in range(1, 6))))
    items = list(content.mission.items)
    items[at] = replace(items[at], z=33.0)
    plan = Plan(PlanKind.MISSION, tuple(items))
    made = written(replace(content, mission=plan))
    assert content_of(made).mission == plan
    assert [entry.get("myNote") for entry in made["mission"]["items"]] == [
        None if index == at else index + 1 for index in range(5)
    ]


def test_an_item_added_before_a_survey_leaves_the_survey() -> None:
    content = read(document())
    items = content.mission.items
    new = replace(items[1], z=33.0)
    jump = replace(items[3], params=(0.0, 2.0, 0.0, 0.0))
    changed = Plan(PlanKind.MISSION, (items[0], new, *items[1:3], jump, items[4]))
    out = write_qgc(replace(content, mission=changed))
    made = json.loads(out.data)["mission"]["items"]
    assert out.notes == ()
    assert [entry["type"] for entry in made] == ["SimpleItem", "SimpleItem", "ComplexItem", "SimpleItem", "SimpleItem"]
    assert made[0]["myNote"] == 1 and "myNote" not in made[1] and made[1]["Altitude"] == 33
    assert [item["doJumpId"] for item in made[2]["TransectStyleComplexItem"]["Items"]] == [3, 4]
    assert [made[i]["doJumpId"] for i in (0, 1, 3, 4)] == [1, 2, 5, 6] and made[3]["params"][0] == 1
    assert read(document() | {"mission": document()["mission"] | {"items": made}}).mission == changed


def test_a_survey_with_a_moved_point_becomes_way_points_and_that_is_noted() -> None:
    content = read(document())
    items = list(content.mission.items)
    items[2] = replace(items[2], x=items[2].x + 10)
    out = write_qgc(replace(content, mission=Plan(PlanKind.MISSION, tuple(items))))
    assert all(entry["type"] == "SimpleItem" for entry in json.loads(out.data)["mission"]["items"])
    assert out.notes == ("1 survey, scan or landing changed: way-points now",)


def test_shapes_of_a_fence_keep_what_is_unknown_unless_they_change() -> None:
    content = read(document())
    moved = [replace(i, x=i.x + 5) if i.command == 5004 else i for i in content.fence.items if i.command != 5000]
    made = written(replace(content, fence=Plan(PlanKind.FENCE, tuple(moved))))["geoFence"]
    assert made["polygons"] == document()["geoFence"]["polygons"] and "breachReturn" not in made
    assert made["circles"][0] == {
        "version": 1, "inclusion": False, "circle": {"center": [47.4000005, 8.54], "radius": 50.5}
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["StructureScan", "fwLandingPattern", "vtolLandingPattern"])
def test_what_has_no_way_in_the_file_is_kept_and_not_flown(kind: str) -> None:
    raw = document(simple(1), {"type": "ComplexItem", "complexItemType": kind, "version": 3}, simple(2))
    content = read(raw)
    assert len(content.mission.items) == 2 and content.not_flown == (f"item 2, {kind}",)
    assert written(content) == raw


def test_a_new_file_is_complete_and_notes_what_was_assumed() -> None:
    out = write_qgc(Content(mission(3), autopilot=3))
    made = json.loads(out.data)
    assert (made["fileType"], made["version"], made["mission"]["version"]) == ("Plan", 1, 2)
    assert made["geoFence"] == {"version": 2, "polygons": [], "circles": []}
    assert made["rallyPoints"] == {"version": 2, "points": []}
    assert made["mission"]["firmwareType"] == 3 and made["mission"]["plannedHomePosition"] == [47.3977, 8.5456, 0.0]
    assert "home" in out.notes[0]


def test_new_parts_are_written_as_qgroundcontrol_reads_them() -> None:
    """It refuses a polygon or circle without its version, and reads the height by the mode beside it."""
    back = PlanItem(5000, 3, x=473_970_000, y=85_460_000, z=30.0)
    places = tuple(waypoint(i, frame=frame) for i, frame in enumerate((3, 6, 0, 5, 10, 11)))
    shapes = fence(*square()[:3], circle(50.0), circle(20.0, 5003), back)
    made = written(Content(Plan(PlanKind.MISSION, places), shapes))
    corners = [[47.3938, 8.5416], [47.4018, 8.5416], [47.4018, 8.5496]]
    assert made["geoFence"] == {
        "version": 2,
        "polygons": [{"version": 1, "inclusion": True, "polygon": corners}],
        "circles": [
            {"version": 1, "inclusion": False, "circle": {"center": [47.3979, 8.5457], "radius": 50.0}},
            {"version": 1, "inclusion": True, "circle": {"center": [47.3979, 8.5457], "radius": 20.0}},
        ],
        "breachReturn": [47.397, 8.546, 30.0],
    }
    usual = {"version": 2, "firmwareType": 0, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5}
    assert made["mission"].items() >= (usual | {"globalPlanAltitudeMode": 1}).items()
    assert [(item["frame"], item["AltitudeMode"]) for item in made["mission"]["items"]] == [
        (3, 1), (3, 1), (0, 2), (0, 2), (10, 4), (10, 4)
    ]  # fmt: skip
    assert [item["doJumpId"] for item in made["mission"]["items"]] == [1, 2, 3, 4, 5, 6]


def test_a_fence_return_point_without_a_height_is_at_home_s() -> None:
    made = written(Content(fence=fence(PlanItem(5000, 3, x=473_970_000, y=85_460_000, z=math.nan))))
    assert made["geoFence"]["breachReturn"] == [47.397, 8.546, 0.0]


@pytest.mark.parametrize("target", [0, 1, 2])
def test_a_jump_leads_to_the_same_item_in_a_new_file(target: int) -> None:
    jump = PlanItem(JUMP, 2, (float(target), 2.0, 0.0, 0.0))
    plan = Plan(PlanKind.MISSION, (waypoint(0), waypoint(1), jump, waypoint(2)))
    made = written(Content(plan))
    assert made["mission"]["items"][2]["params"][0] == target + 1 and content_of(made).mission == plan


def test_a_jump_that_is_kept_leads_where_it_leads_now() -> None:
    content = read(document(simple(1), simple(2), simple(3, JUMP, [2, 2, 0, 0, 0, 0, 0], frame=2), simple(4)))
    _, second, jump, last = content.mission.items
    shorter = Plan(PlanKind.MISSION, (second, replace(jump, params=(0.0, 2.0, 0.0, 0.0)), last))
    made = written(replace(content, mission=shorter))
    assert content_of(made).mission == shorter and made["mission"]["items"][-1]["myNote"] == 4


def test_one_of_two_equal_places_can_be_taken_out() -> None:
    content = read(document(simple(1), simple(1, doJumpId=2), simple(1, doJumpId=3)))
    for count in (2, 1, 0):
        fewer = Plan(PlanKind.MISSION, content.mission.items[:count])
        assert content_of(written(replace(content, mission=fewer))).mission == fewer


def test_home_that_was_not_given_is_drawn_at_the_first_place() -> None:
    """Not at an item at 0, 0, which means "here" and is a place off Africa."""
    here = PlanItem(22, 3, z=15.0)
    for place in (waypoint(0), waypoint(0, x=0), waypoint(0, y=0)):
        plan = Plan(PlanKind.MISSION, (PlanItem(178, 2, (1.0, 5.0, -1.0, 0.0), 7, 8), here, place))
        assert written(Content(plan))["mission"]["plannedHomePosition"] == [place.lat_deg, place.lon_deg, 0.0]
    nowhere = written(Content(Plan(PlanKind.MISSION, (here,))))
    assert nowhere["mission"]["plannedHomePosition"] == [0.0, 0.0, 0.0]


def test_home_of_a_kept_file_is_written_only_where_it_moved_or_was_missing() -> None:
    content = read(document())
    kept = document()["mission"]["plannedHomePosition"]
    moved = Home(47.1, 8.2, 300.0)
    for home, is_written in ((content.home, kept), (None, kept), (moved, [47.1, 8.2, 300.0])):
        out = write_qgc(replace(content, home=home))
        assert json.loads(out.data)["mission"]["plannedHomePosition"] == is_written and out.notes == ()
    missing = write_qgc(read(_without("mission.plannedHomePosition")))
    assert json.loads(missing.data)["mission"]["plannedHomePosition"] == [47.3978, 8.5456, 0.0]
    assert "home was not given" in missing.notes[0]


def test_an_endless_number_is_refused_with_its_command() -> None:
    endless = Plan(PlanKind.MISSION, (waypoint(0, params=(math.inf, 0.0, 0.0, 0.0)),))
    with pytest.raises(FormatError, match="command 16: an endless number"):
        write_qgc(Content(endless))


def test_heights_of_rally_points_are_never_guessed() -> None:
    high = Plan(PlanKind.RALLY, (PlanItem(5100, 0, x=473_977_000, y=85_456_000, z=500.0),))
    lost = write_qgc(Content(rally=high))
    assert json.loads(lost.data)["rallyPoints"]["points"] == [] and "1 rally point above sea level" in lost.left_out[0]
    known = write_qgc(Content(rally=high, home=Home(47.0, 8.0, 488.0)))
    assert json.loads(known.data)["rallyPoints"]["points"] == [[47.3977, 8.5456, 12.0]] and not known.left_out
    for frame, home in ((0, Home(47.0, 8.0)), (10, Home(47.0, 8.0, 488.0)), (11, Home(47.0, 8.0, 488.0))):
        two = Plan(PlanKind.RALLY, (replace(high.items[0], frame=frame),) * 2)
        out = write_qgc(Content(rally=two, home=home))
        assert json.loads(out.data)["rallyPoints"]["points"] == [] and "2 rally points above" in out.left_out[0]


def test_a_number_that_cannot_be_sent_is_reported() -> None:
    content = read(document(simple(1), simple(2, 205, [0, 0, 0, 0, -12.5, 0, 0], frame=2)))
    assert content.left_out == ("mission item 2: -12.5 of command 205 is sent as -12: no fractions there",)
    assert written(content)["mission"]["items"][1]["params"][4] == -12.5


def test_older_files_are_read() -> None:
    old = {"type": "missionItem", "command": 16, "frame": 3, "autoContinue": True, "param1": 5, "param2": 0}
    old |= {"param3": 0, "param4": 0, "coordinate": [47.4, 8.5, 12]}
    raw = document(old)
    raw["geoFence"] = {"version": 1, "polygon": [[47.4, 8.5], [47.4, 8.6], [47.3, 8.6]]}
    del raw["rallyPoints"]
    content = read(raw)
    assert content.mission.items == (PlanItem(16, 3, (5.0, 0.0, 0.0, 0.0), 474_000_000, 85_000_000, 12.0),)
    assert [item.params[0] for item in content.fence.items] == [3.0] * 3
    assert written(content)["geoFence"].keys() == {"version", "polygons", "circles"}


def test_a_fence_is_read_as_its_own_version_has_it() -> None:
    """A word of the old format that was left in a new file is not the fence of today."""
    corners = [[47.4, 8.5], [47.4, 8.6], [47.3, 8.6]]
    left_over = _with("geoFence.polygon", corners)
    assert read(left_over).fence.fingerprint == read(document()).fence.fingerprint


def _without(path: str) -> dict[str, Any]:
    return _with(path, None, drop=True)


def _with(path: str, value: Any, *, drop: bool = False) -> dict[str, Any]:
    raw = copy.deepcopy(document())
    *way, last = [int(step) if step.isdigit() else step for step in path.split(".")]
    at: Any = raw
    for step in way:
        at = at[step]
    if drop:
        del at[last]
    else:
        at[last] = value
    return raw


@pytest.mark.parametrize(
    ("raw", "why"),
    [
        (_without("mission"), "mission is missing"),
        (_with("fileType", "Fence"), "no plan of QGroundControl"),
        (_with("version", 3), "the plan: version 3 is not known"),
        (_with("mission.version", 7), "mission: version 7"),
        (_with("geoFence.version", 3), "geoFence: version 3"),
        (_with("mission.complexItems", [1]), "old QGroundControl"),
        (_with("mission.items", {}), "items is no list"),
        (_with("mission.items.0", 5), "mission item 1: an object"),
        (_with("mission.items.0.type", "Other"), "mission item 1: neither"),
        (_with("mission.items.0.command", "16"), "mission item 1: command: 16 is no number"),
        (_with("mission.items.0.command", 16.5), "no whole number"),
        (_with("mission.items.0.params", [1] * 6), "mission item 1: 6 params instead of 7"),
        (_with("mission.items.0.params.4", None), "no latitude or longitude"),
        (_with("mission.items.0.params.5", 181), "181 is no latitude or longitude"),
        (_with("mission.items.0.params.0", True), "True is no number"),
        (_with("mission.items.0.params.0", 10**400), "is no number"),
        (_with("mission.items.1.TransectStyleComplexItem.Items.1.params", [1]), "mission item 2: 1 params"),
        (_with("mission.items.2.params.0", 77), "item 4 jumps to number 77, which no item has"),
        (_with("mission.items.0.doJumpId", 5) | {}, "jumps to number 1, which no item has"),
        (_with("mission.plannedHomePosition", [47, 8]), "plannedHomePosition"),
        (_with("geoFence.polygons.0.polygon.0", [91, 8]), "fence polygon 1: 91, 8 is no place on earth"),
        (_with("geoFence.circles.0.circle", None), "fence circle 1"),
        (_with("geoFence.circles.0.inclusion", "yes"), "true or false"),
        (_with("rallyPoints.points.0", [47.1, 8.1]), "rally point 1"),
        (document(*[simple(1)] * 2001), "more than 2000 items"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_no_plan_is_one_line_with_its_place(raw: dict[str, Any], why: str) -> None:
    with pytest.raises(FormatError, match=why) as error:
        read(raw)
    assert "\n" not in str(error.value)


@settings(max_examples=15, deadline=None)
@given(missions(), fences(), RALLIES, HOMES)
def test_any_plan_comes_back_as_it_was(mission_: Plan, fence_: Plan, rally_: Plan, home: Home) -> None:
    fence_ = Plan(PlanKind.FENCE, tuple(sorted(fence_.items, key=lambda item: item.command in (5003, 5004))))
    out = write_qgc(Content(mission_, fence_, rally_, home))
    back = content_of(json.loads(out.data))
    found = (back.mission, back.fence, back.rally)
    assert [plan.fingerprint for plan in found] == [plan.fingerprint for plan in (mission_, fence_, rally_)]
    assert back.home == home and out.left_out == ()


@settings(max_examples=20, deadline=None)
@given(st.data())
def test_any_change_of_a_kept_file_is_what_comes_back(data: st.DataObject) -> None:
    content = read(document())
    items = list(content.mission.items)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(items)))
        if data.draw(st.booleans()) or not items:
            items.insert(at, waypoint(at))
        else:
            del items[min(at, len(items) - 1)]
    kept = tuple(item for item in items if item.command != JUMP)
    back = content_of(written(replace(content, mission=Plan(PlanKind.MISSION, kept))))
    assert back.mission.fingerprint == Plan(PlanKind.MISSION, kept).fingerprint
