"""Texts of vehicles: chunks put together, bounded for each vehicle by itself (docs/threats.md B.6-82)."""

from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.fleet.status_text import (
    MAX_CHUNKS,
    MAX_FRAMES_PER_S,
    MAX_OPEN_TEXTS,
    URGENT,
    StatusTextReporter,
    TextAssembler,
    TextFrameLimiter,
)
from tui_gcs.core.records.event_log import EventLog

FULL = "x" * 50


def chunk(text: str, index: int, number: int = 7) -> dict[str, object]:
    return {"severity": 4, "text": text, "id": number, "chunk_seq": index}


def test_chunks_in_any_order_make_one_text() -> None:
    texts = TextAssembler()
    assert texts.add(1, chunk("end", 1), 0.0) is None
    assert texts.add(1, chunk(FULL, 0), 0.1) == FULL + "end"


def test_a_repeated_chunk_changes_nothing() -> None:
    texts = TextAssembler()
    assert texts.add(1, chunk(FULL, 0), 0.0) is None
    assert texts.add(1, chunk(FULL, 0), 0.1) is None
    assert texts.add(1, chunk("end", 1), 0.2) == FULL + "end"


def test_an_id_used_again_begins_a_new_text() -> None:
    texts = TextAssembler()
    texts.add(1, chunk(FULL, 0), 0.0)
    texts.add(1, chunk("y" * 50, 0), 0.5)
    assert texts.add(1, chunk("end", 1), 0.6) == "y" * 50 + "end"


def test_px4s_first_long_text_after_a_boot_has_chunks_with_id_0() -> None:
    texts = TextAssembler()
    assert texts.add(1, chunk(FULL, 0, 0), 0.0) is None
    assert texts.add(1, chunk("t", 1, 0), 0.01) == FULL + "t"


def test_a_whole_text_of_full_length_is_told_after_a_second_and_the_next_one_at_once() -> None:
    texts = TextAssembler()
    assert texts.add(1, chunk("short", 0, 0), 0.0) == "short"
    assert texts.add(1, chunk(FULL, 0, 0), 0.0) is None
    assert texts.add(1, chunk("y" * 50, 0, 0), 0.5) == "y" * 50
    assert list(texts.expired(1.1)) == [(1, 4, FULL)]


def test_what_is_missing_is_shown_as_missing_after_a_second() -> None:
    texts = TextAssembler()
    texts.add(1, chunk(FULL, 0), 0.0)
    texts.add(1, chunk("end", 2), 0.1)
    assert not list(texts.expired(0.9))
    assert list(texts.expired(1.1)) == [(1, 4, FULL + " ... " + "end")]
    assert not list(texts.expired(9.0))


def test_one_vehicles_flood_does_not_break_anothers_text() -> None:
    texts = TextAssembler()
    for number in range(1, 200):
        texts.add(1, chunk(FULL, 0, number), 0.0)
    assert texts.add(2, chunk(FULL, 0), 0.0) is None
    assert texts.add(2, chunk("end", 1), 0.0) == FULL + "end"
    assert len(list(texts.expired(2.0))) == MAX_OPEN_TEXTS


def test_a_chunk_beyond_the_tenth_is_ignored() -> None:
    texts = TextAssembler()
    assert texts.add(1, chunk("end", MAX_CHUNKS), 0.0) is None and not list(texts.expired(9.0))


def test_a_flood_is_not_even_read_and_hides_nothing_urgent() -> None:
    """Chatter and what is urgent are counted apart, and each vehicle by itself."""
    pace = TextFrameLimiter()
    assert sum(pace.has_room(1, 6, 0.0) for _ in range(10_000)) == MAX_FRAMES_PER_S
    assert pace.has_room(1, URGENT, 0.0) and pace.has_room(2, 6, 0.0)
    assert not pace.has_room(1, 6, 0.99)
    assert pace.has_room(1, 6, 1.0)


def test_what_is_said_every_five_seconds_for_ever_is_told_ever_more_seldom() -> None:
    """ArduPilot's "ODID: lost operator location"; what comes again later is told at once."""
    clock = VirtualClock()
    events = EventLog(clock)
    reporter = StatusTextReporter(clock, events, RejectionCounter())
    for _ in range(120):  # ten minutes
        reporter.take_status_text(a_vehicle(1), chunk("ODID: lost operator location", 0, 0))
        clock.advance(5.0)
    reported = [event.t_s for event in events.since(0)]
    assert reported[:5] == [0.0, 5.0, 15.0, 35.0, 75.0] and len(reported) == 13
    assert events.since(0)[-1].text == "ODID: lost operator location … (11 more)"
    clock.advance(200.0)
    reporter.take_status_text(a_vehicle(1), chunk("ODID: lost operator location", 0, 0))
    assert events.since(0)[-1].t_s == clock.now()
