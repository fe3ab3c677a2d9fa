"""Uploads and downloads message by message: what the vehicle sends, what we answer, how it ends.

Time is set by hand.
"""

from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.uplink_rig import UplinkRig
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.core.services.plans.plan_download import DownloadDialogue
from tui_gcs.core.services.plans.plan_messages import PlanChannel, RetryTimer, fields_of
from tui_gcs.core.services.plans.plan_upload import UploadDialogue, UploadResult

ACCEPTED, ERROR, NO_SPACE, INVALID_LATITUDE, WRONG_SEQUENCE, DENIED, CANCELLED = 0, 1, 4, 10, 13, 14, 15
ITEMS = tuple(PlanItem(16, 3, x=470_000_000 + number, y=85_000_000, z=20.0) for number in range(3))


class Dialogue:
    """Vehicle 1 answers; `said` returns what was sent to it since the last call."""

    def __init__(self, folder: Path, home_items: int = 0) -> None:
        self.way = UplinkRig(folder)
        self.wire = PlanChannel(self.way.uplink, 1, PlanKind.MISSION, home_items=home_items)

    def upload(self, *, from_start: bool = True) -> UploadDialogue:
        sending = UploadDialogue(self.wire, ITEMS, RetryTimer(), patience_s=2.0, from_start=from_start)
        sending.begin(0.0)
        return sending

    def download(self, **options: Any) -> DownloadDialogue:
        reading = DownloadDialogue(self.wire, RetryTimer(), **options)
        reading.begin(0.0)
        return reading

    def said(self) -> list[tuple[str, int]]:
        """Message, and the count, number of item or result in it."""
        telling = {"MISSION_COUNT": "count", "MISSION_ACK": "type"}
        return [(name, fields.get(telling.get(name, "seq"), -1)) for name, fields, _ in self.way.sent()]


@pytest.fixture
def dialogue(tmp_path: Path) -> Dialogue:
    return Dialogue(tmp_path)


def ask(sending: UploadDialogue, seq: int, now: float) -> None:
    sending.on_message("MISSION_REQUEST_INT", {"seq": seq}, now)


def verdict(sending: UploadDialogue | DownloadDialogue, result: int, now: float, opaque_id: int = 0) -> None:
    sending.on_message("MISSION_ACK", {"type": result, "opaque_id": opaque_id}, now)


def item(reading: DownloadDialogue, seq: int, now: float) -> None:
    reading.on_message("MISSION_ITEM_INT", fields_of(ITEMS[seq], seq, PlanKind.MISSION, current=False), now)


# ---------------------------------------------------------------- uploads


def test_items_go_up_as_they_are_asked_for(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for seq in range(3):
        ask(sending, seq, 0.1 * seq)
    assert dialogue.said() == [("MISSION_COUNT", 3), *(("MISSION_ITEM_INT", seq) for seq in range(3))]
    assert sending.result is None
    verdict(sending, ACCEPTED, 0.4, opaque_id=77)
    assert (sending.result, sending.opaque_id, sending.error) == (UploadResult.ACCEPTED, 77, "")


@pytest.mark.parametrize("from_start", [True, False])
def test_a_mission_that_is_to_begin_anew_begins_with_its_first_item(dialogue: Dialogue, from_start: bool) -> None:
    sending = dialogue.upload(from_start=from_start)
    for seq in range(2):
        ask(sending, seq, 0.1)
    assert [fields["current"] for _, fields, _ in dialogue.way.sent()[1:]] == [int(from_start), 0]


def test_an_item_that_is_asked_for_again_is_the_same_item(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for seq in (0, 1, 0, 1, 2):
        ask(sending, seq, 0.1)
    items = [fields for name, fields, _ in dialogue.way.sent() if name == "MISSION_ITEM_INT"]
    assert [(fields["seq"], fields["x"] - 470_000_000) for fields in items] == [(0, 0), (1, 1), (0, 0), (1, 1), (2, 2)]
    assert sending.requested == 3


@pytest.mark.parametrize("seq", [2, 3, 60_000])
def test_what_is_not_its_turn_ends_it_with_a_word(dialogue: Dialogue, seq: int) -> None:
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    ask(sending, seq, 0.2)
    assert dialogue.said()[2:] == [("MISSION_ACK", CANCELLED)]
    assert (sending.result, sending.error) == (
        UploadResult.FAILED,
        f"the vehicle asks for item {seq + 1} of 3 after 1",
    )


def test_behind_the_last_item_there_is_none(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for seq in range(4):
        ask(sending, seq, 0.1)
    assert (sending.result, sending.error) == (UploadResult.FAILED, "the vehicle asks for item 4 of 3 after 3")


def test_endless_requests_for_one_item_are_not_answered_for_ever(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for _ in range(200):
        ask(sending, 0, 0.1)
    assert dialogue.said().count(("MISSION_ITEM_INT", 0)) == 100
    assert sending.error == "the vehicle asks for item 1 of 3 again and again"


def test_what_comes_after_the_end_changes_nothing(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for seq in range(3):
        ask(sending, seq, 0.1)
    verdict(sending, ACCEPTED, 0.2)
    dialogue.said()
    ask(sending, 1, 0.3)
    verdict(sending, INVALID_LATITUDE, 0.4)
    sending.tick(60.0)
    assert (sending.result, dialogue.said()) == (UploadResult.ACCEPTED, [])


def test_an_item_is_sent_again_after_the_patience_of_the_autopilot_not_before(dialogue: Dialogue) -> None:
    """This autopilot asks by itself within 2 s."""
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    sending.tick(2.0)
    assert dialogue.said() == [("MISSION_COUNT", 3), ("MISSION_ITEM_INT", 0)]
    sending.tick(2.1)
    assert dialogue.said() == [("MISSION_ITEM_INT", 0)]


def test_the_pace_is_what_an_answer_took(dialogue: Dialogue) -> None:
    pace = RetryTimer()
    sending = UploadDialogue(dialogue.wire, ITEMS, pace, patience_s=0.0, from_start=True)
    sending.begin(100.0)
    ask(sending, 0, 100.2)
    assert pace.wait_s == pytest.approx(0.6)


def test_too_many_items_are_refused_at_once(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    verdict(sending, NO_SPACE, 0.2)
    sending.tick(0.9)
    assert (sending.result, sending.error) == (UploadResult.FAILED, "refused: no space for so many items")


def test_a_question_of_an_upload_before_is_not_answered(dialogue: Dialogue) -> None:
    """ArduPilot goes on asking for a while, until it has heard of the new one."""
    sending = dialogue.upload()
    ask(sending, 7, 1.9)
    assert sending.result is None and dialogue.said() == [("MISSION_COUNT", 3)]
    ask(sending, 7, 2.1)
    assert sending.result is UploadResult.FAILED


def test_a_refused_item_is_named_once_its_texts_had_time_to_come(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    ask(sending, 1, 0.2)
    verdict(sending, INVALID_LATITUDE, 0.3)
    sending.tick(0.8)
    assert sending.result is None
    sending.tick(0.95)
    assert (sending.result, sending.error) == (UploadResult.FAILED, "item 2 of 3: refused: invalid latitude")


def test_who_asks_on_after_a_refusal_has_not_refused(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    verdict(sending, ERROR, 0.2)
    ask(sending, 1, 1.2)
    sending.tick(2.0)
    assert sending.result is None


def test_an_upload_that_the_vehicle_gave_up_begins_anew_twice(dialogue: Dialogue) -> None:
    """ArduPilot's 8 s of patience: the link may be better now."""
    sending = dialogue.upload()
    for now in (10.0, 20.0):
        ask(sending, 0, now - 9.0)
        ask(sending, 1, now - 8.5)
        dialogue.said()
        verdict(sending, CANCELLED, now)
        assert dialogue.said() == [("MISSION_COUNT", 3)] and sending.requested == 0
    ask(sending, 0, 21.0)
    verdict(sending, CANCELLED, 30.0)
    sending.tick(31.0)
    assert (sending.result, sending.error) == (UploadResult.FAILED, "item 1 of 3: the vehicle gave up waiting")


def test_a_busy_vehicle_is_asked_again_for_ten_seconds(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for now in (1.0, 4.0, 7.0):
        verdict(sending, ERROR, now)
        sending.tick(now + 1.6)
    assert sending.result is None and set(dialogue.said()) == {("MISSION_COUNT", 3)}
    verdict(sending, ERROR, 10.5)
    assert sending.error == "the vehicle is busy with another transfer (error)"


def test_accepted_too_early_is_no_success(dialogue: Dialogue) -> None:
    """It may be a late copy of another upload's ACK: it counts only if nothing more is requested."""
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    verdict(sending, ACCEPTED, 0.2)
    sending.tick(4.1)
    assert sending.result is None
    sending.tick(4.3)
    assert (sending.result, sending.error) == (UploadResult.FAILED, "the vehicle accepted it after 1 of 3 items")


def test_an_early_accepted_is_forgotten_when_it_asks_on(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    verdict(sending, ACCEPTED, 0.2)
    ask(sending, 1, 0.3)
    sending.tick(4.5)
    assert sending.result is None


def test_an_item_that_it_has_already_is_followed_by_the_next_once(dialogue: Dialogue) -> None:
    """Our item was sent again because nothing came: "wrong sequence" means that the request was lost, not the item."""
    sending = dialogue.upload()
    ask(sending, 0, 0.1)
    sending.tick(2.2)
    dialogue.said()
    verdict(sending, WRONG_SEQUENCE, 2.3)
    assert dialogue.said() == [("MISSION_ITEM_INT", 1)] and sending.requested == 2
    verdict(sending, WRONG_SEQUENCE, 2.4)
    assert dialogue.said() == []


def test_silence_ends_it_and_an_unanswered_last_item_leaves_a_doubt(dialogue: Dialogue) -> None:
    sending = dialogue.upload()
    for second in range(100):
        sending.tick(5.0 * second)
    assert (sending.result, sending.error) == (UploadResult.FAILED, "no answer") and len(dialogue.said()) == 12
    ends = {
        2: (UploadResult.FAILED, "no answer to item 2 of 3"),
        3: (UploadResult.DOUBTFUL, "no answer to the last item"),
    }
    for asked, end in ends.items():
        sending = dialogue.upload()
        for seq in range(asked):
            ask(sending, seq, 0.1)
        for second in range(100):
            sending.tick(5.0 * second)
        assert (sending.result, sending.error) == end


def test_home_is_no_item_of_the_plan(tmp_path: Path) -> None:
    sending = (dialogue := Dialogue(tmp_path, home_items=1)).upload()
    ask(sending, 0, 0.1)
    ask(sending, 1, 0.1)
    verdict(sending, INVALID_LATITUDE, 0.2)
    sending.tick(1.0)
    assert sending.error == "item 1 of 2: refused: invalid latitude"
    assert dialogue.said()[0] == ("MISSION_COUNT", 3)


# ---------------------------------------------------------------- downloads


def test_items_come_down_one_after_the_other(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": 2, "opaque_id": 9}, 0.1)
    item(reading, 0, 0.2)
    assert not reading.over and reading.received == 1
    item(reading, 1, 0.3)
    assert reading.over and reading.error == "" and (reading.items, reading.opaque_id) == (ITEMS[:2], 9)
    requests = [("MISSION_REQUEST_INT", 0), ("MISSION_REQUEST_INT", 1)]
    assert dialogue.said() == [("MISSION_REQUEST_LIST", -1), *requests, ("MISSION_ACK", ACCEPTED)]
    reading.on_message("MISSION_COUNT", {"count": 0}, 0.4)
    reading.tick(60.0)
    assert reading.items == ITEMS[:2] and dialogue.said() == [], "it is over"


def test_what_comes_out_of_order_is_put_in_order_and_what_is_missing_asked_for(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": 3}, 0.1)
    item(reading, 2, 0.2)
    item(reading, 0, 0.3)
    assert dialogue.said()[-1] == ("MISSION_REQUEST_INT", 1) and not reading.over
    item(reading, 1, 0.4)
    assert reading.over and reading.items == ITEMS


def test_an_accepted_of_something_else_ends_nothing(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": 2}, 0.1)
    item(reading, 0, 0.2)
    verdict(reading, ACCEPTED, 0.3)
    assert reading.received == 1 and not reading.over
    verdict(reading, ERROR, 0.4)
    assert reading.received == 0 and dialogue.said()[-1] == ("MISSION_REQUEST_LIST", -1), "begun anew"


def test_nothing_on_board_is_a_plan_without_items(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": 0}, 0.1)
    assert reading.over and (reading.error, reading.items, reading.count) == ("", (), 0)


def test_more_than_anybody_holds_is_not_read(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": MAX_ITEMS + 1}, 0.1)
    assert reading.over and f"the vehicle reports {MAX_ITEMS + 1} items" in reading.error
    assert dialogue.said()[-1] == ("MISSION_ACK", CANCELLED)


def test_how_many_there_are_can_be_all_that_is_asked(dialogue: Dialogue) -> None:
    reading = dialogue.download(count_only=True)
    reading.on_message("MISSION_COUNT", {"count": 60_000}, 0.1)
    assert reading.over and (reading.error, reading.count) == ("", 60_000)


def test_a_number_of_items_that_changes_is_begun_anew_once(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": 2}, 0.1)
    item(reading, 0, 0.2)
    reading.on_message("MISSION_COUNT", {"count": 3}, 0.3)
    assert reading.received == 0 and dialogue.said()[-1] == ("MISSION_REQUEST_INT", 0)
    item(reading, 0, 0.4)
    reading.on_message("MISSION_COUNT", {"count": 3}, 0.45)
    assert not reading.over and reading.received == 1, "a copy"
    reading.on_message("MISSION_COUNT", {"count": 2}, 0.5)
    assert reading.over and reading.error == "the number of its items changes: 3, then 2"


def test_items_that_were_not_requested_are_ignored(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    item(reading, 0, 0.1)
    reading.on_message("MISSION_COUNT", {"count": 1}, 0.2)
    item(reading, 1, 0.3)
    assert reading.received == 0 and not reading.over


def test_the_first_word_on_an_item_counts(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    reading.on_message("MISSION_COUNT", {"count": 2}, 0.1)
    item(reading, 0, 0.2)
    reading.on_message("MISSION_ITEM_INT", fields_of(ITEMS[2], 0, PlanKind.MISSION, current=False), 0.3)
    item(reading, 1, 0.4)
    assert reading.items == ITEMS[:2]


def test_who_denies_is_asked_again_for_twelve_seconds(dialogue: Dialogue) -> None:
    """ArduPilot believes for 8 s to be in an upload that was cut off."""
    reading = dialogue.download()
    for second in range(11):
        verdict(reading, DENIED, second + 0.1)
        dialogue.said()
        reading.tick(second + 1.0)
        assert dialogue.said() == []
        reading.tick(second + 1.2)
        assert dialogue.said() == [("MISSION_REQUEST_LIST", -1)]
    for _ in range(6):
        verdict(reading, DENIED, 13.0)
    assert reading.over and reading.error == "denied"


def test_silence_is_reported_with_the_missing_item(dialogue: Dialogue) -> None:
    reading = dialogue.download()
    for second in range(100):
        reading.tick(10.0 * second)
    assert reading.over and reading.error == "no answer" and len(dialogue.said()) == 12
    reading = dialogue.download()
    for second in range(2000):
        if reading.count is None:
            reading.on_message("MISSION_COUNT", {"count": 2}, 10.0 * second)
            item(reading, 0, 10.0 * second)
        reading.tick(10.0 * second)
    assert reading.over and reading.error == "item 2 of 2 does not come"
