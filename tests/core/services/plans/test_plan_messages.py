"""The messages about one kind of plan to one vehicle, and how its items are counted."""

import math
from pathlib import Path

import pytest

from tests.core.rigs.uplink_rig import UplinkRig
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.core.services.plans.plan_messages import PlanChannel, RetryTimer, fields_of, item_of, result_word

ITEM = PlanItem(16, 3, (1.0, 2.0, 3.0, math.pi), 473_977_000, -85_456_000, -12.5, autocontinue=False)


def test_an_item_is_encoded_field_by_field() -> None:
    fields = fields_of(ITEM, 7, PlanKind.RALLY, current=True)
    assert (fields["seq"], fields["frame"], fields["command"], fields["current"]) == (7, 3, 16, 1)
    assert [fields[f"param{number}"] for number in range(1, 5)] == [1.0, 2.0, 3.0, math.pi]
    assert (fields["x"], fields["y"], fields["z"], fields["autocontinue"]) == (473_977_000, -85_456_000, -12.5, 0)
    assert fields["mission_type"] == 2
    assert item_of(fields) == ITEM


def test_items_are_counted_as_the_plan_has_them(tmp_path: Path) -> None:
    """Item 0 of an ArduPilot's mission is home, which is no item of the plan."""
    uplink = UplinkRig(tmp_path).uplink
    ardupilot, px4 = PlanChannel(uplink, 1, PlanKind.MISSION, home_items=1), PlanChannel(uplink, 1, PlanKind.MISSION)
    assert [ardupilot.item(seq, 4) for seq in range(4)] == ["home", "item 1 of 3", "item 2 of 3", "item 3 of 3"]
    assert [px4.item(seq, 2) for seq in range(2)] == ["item 1 of 2", "item 2 of 2"]
    assert (ardupilot.own(0), ardupilot.own(1), ardupilot.own(5), px4.own(5)) == (0, 0, 4, 5)


def test_each_message_names_its_vehicle_and_its_kind_of_plan(tmp_path: Path) -> None:
    way = UplinkRig(tmp_path)
    wire = PlanChannel(way.uplink, 1, PlanKind.FENCE)
    assert wire.begin("upload", "MISSION_COUNT", count=1, opaque_id=0)
    assert wire.part(ITEM, 0, current=False)
    assert wire.ask("MISSION_REQUEST_LIST")
    wire.end(15)
    said = way.sent()
    assert [name for name, _, _ in said] == [
        "MISSION_COUNT",
        "MISSION_ITEM_INT",
        "MISSION_REQUEST_LIST",
        "MISSION_ACK",
    ]
    assert {(fields["target_system"], fields["mission_type"]) for _, fields, _ in said} == {(1, 1)}
    assert said[3][1]["type"] == 15 and wire.refused == ""


@pytest.mark.parametrize("lost", [False, True])
def test_a_message_that_did_not_leave_has_a_reason(tmp_path: Path, lost: bool) -> None:
    way = UplinkRig(tmp_path)
    wire = PlanChannel(way.uplink, 1, PlanKind.MISSION)
    if lost:
        way.heard.clock.advance(5.0)
    else:
        way.heard.vehicle.identity.blocked = "several vehicles use id 1"
    assert not wire.part(ITEM, 0, current=False) and wire.refused == "the items may not be sent any more"
    assert not wire.begin("upload", "MISSION_COUNT", count=1, opaque_id=0)
    assert wire.refused == ("mission upload: nothing has been heard of it" if lost else "several vehicles use id 1")
    assert way.sent() == []


def test_results_are_words_whatever_the_number() -> None:
    assert (result_word(0), result_word(4), result_word(15)) == ("accepted", "no space for so many items", "cancelled")
    assert (result_word(16), result_word(-1)) == ("result 16", "result -1")


@pytest.mark.parametrize(("trip_s", "wait_s"), [(0.01, 0.25), (0.2, 0.6), (0.8, 1.8), (9.0, 5.0)])
def test_an_answer_is_waited_for_three_round_trips_on_slow_links_one_and_a_second(trip_s: float, wait_s: float) -> None:
    pace = RetryTimer()
    assert pace.wait_s == 1.5, "before anything was measured"
    pace.add_sample(trip_s)
    assert pace.wait_s == pytest.approx(wait_s)


def test_a_link_that_gets_quicker_is_believed_sooner_than_one_that_gets_slower() -> None:
    quicker, slower = RetryTimer(), RetryTimer()
    for pace in (quicker, slower):
        pace.add_sample(0.4)
    quicker.add_sample(0.2)
    slower.add_sample(0.6)
    assert (quicker.wait_s, slower.wait_s) == (pytest.approx(0.9), pytest.approx(1.275))


def test_losses_by_chance_slow_nothing_down_a_silence_does() -> None:
    pace = RetryTimer()
    pace.add_sample(0.2)
    for _ in range(7):
        pace.add_loss()
    assert pace.wait_s == pytest.approx(0.6)
    for waits_s in (0.9, 1.0, 1.0):
        pace.add_loss()
        assert pace.wait_s == pytest.approx(waits_s)
    pace.add_sample(0.2)
    pace.add_loss()
    assert pace.wait_s == pytest.approx(0.6), "it answers again"


def test_who_never_answered_is_given_longer_but_not_for_ever() -> None:
    pace = RetryTimer()
    for waits_s in (2.25, 2.5, 2.5):
        pace.add_loss()
        assert pace.wait_s == waits_s
