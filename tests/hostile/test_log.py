"""Log lines about attacks: each cause seldom, with its count; nothing suppressed is lost."""

from tests.hostile.test_intake import PLACE, Anybody
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.fleet.rejection_report import RejectionReporter
from tui_gcs.core.fleet.status_text import MAX_BURST_TEXTS, TEXTS_PER_S, TextRateLimiter
from tui_gcs.core.mavlink.intake import Intake
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import EventLog


def test_suppressed_messages_are_counted_in_the_next_one() -> None:
    clock = VirtualClock()
    log = EventLog(clock)
    for _ in range(81):
        log.report(EventClass.VEHICLE, "vehicle 1", "again", every_s=5.0)
        clock.advance(0.125)
    assert [event.text for event in log.since(0)] == ["again", "again … (39 more)", "again … (39 more)"]
    clock.advance(60.0)
    assert log.report(EventClass.VEHICLE, "vehicle 1", "again", every_s=5.0)
    clock.advance(60.0)
    log.report(EventClass.VEHICLE, "vehicle 1", "again", every_s=5.0)
    assert [event.text for event in log.since(3)] == ["again", "again"]


def test_refusals_are_reported_per_cause_every_half_minute() -> None:
    clock = VirtualClock()
    log, dropped, intake = EventLog(clock), RejectionCounter(), Intake("", Anybody())
    teller = RejectionReporter(log, dropped, [intake])
    for second in range(62):
        dropped["system id 0"] += 2
        dropped["not a vehicle"] += 1  # ordinary on a link
        if second == 40:
            intake.datagrams("radio", [(bytes(7), PLACE)], clock.now())
        teller.tick(clock.now())
        clock.advance(1.0)
    reported = [(round(event.t_s), event.source, event.text) for event in log.since(0)]
    assert reported == [
        (0, "station", "frames not taken: system id 0 (2)"),
        (30, "station", "frames not taken: system id 0 (60 more)"),
        (40, "link radio", "frames not taken: junk bytes (7)"),
        (60, "station", "frames not taken: system id 0 (60 more)"),
    ]


def test_a_refusal_names_the_vehicles_since_the_last_report() -> None:
    clock = VirtualClock()
    log, dropped = EventLog(clock), RejectionCounter()
    teller = RejectionReporter(log, dropped, [])
    for vehicles in ((3,), (3, 5, 6), (5,), ()):
        for vehicle in vehicles:
            dropped.count("invalid position", vehicle)
        dropped.count("system id 0", None)
        teller.tick(clock.now())
        clock.advance(31.0)
    reported = [(event.source, event.text) for event in log.since(0) if "position" in event.text]
    assert reported == [
        ("vehicle 3", "frames not taken: invalid position (1)"),
        ("station", "frames not taken: invalid position (3 more): vehicles 3 5-6"),
        ("vehicle 5", "frames not taken: invalid position (1 more)"),
    ]
    assert {event.source for event in log.since(0) if "id 0" in event.text} == {"station"}


def test_texts_at_a_bearable_pace_and_urgent_ones_apart() -> None:
    pace = TextRateLimiter()
    reported = 0
    for number in range(1000):
        now = number / 100
        if pace.has_room(1, 6, now):
            pace.count(1, 6, now)
            reported += 1
    assert MAX_BURST_TEXTS <= reported <= MAX_BURST_TEXTS + 10 * TEXTS_PER_S + 1
    assert not pace.has_room(1, 4, 10.0)
    assert pace.has_room(1, 0, 10.0), "an emergency is heard through chatter"
    assert pace.has_room(2, 6, 10.0), "others, too"
    assert pace.has_room(1, 6, 20.0), "and so is who calms down"
