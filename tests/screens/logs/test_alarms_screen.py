"""Alarms on the console: the second line, the list, the bell, the journal."""

import pytest
from textual.events import Key

from tests.screens.rigs.console import NARROW, WIDE, console
from tests.screens.rigs.fake_station import FakeStation, trouble
from tui_gcs.console.alarm_acknowledgement import AlarmBell
from tui_gcs.core.protocol.alarms import AlarmLevel
from tui_gcs.core.protocol.common import Acknowledge, Alarm, Freshness, Note, Shelve, Unshelve
from tui_gcs.feed.notices import NOTICE_S, Notice, Severity
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.logs.alarms_screen import AlarmScreen
from tui_gcs.widgets.basics.palette import Ink


def inks(c: object) -> set[Ink]:
    """Inks of the second line."""
    line = c.fly.top_lines.alarm_line  # type: ignore[attr-defined]
    return {ink for text, ink in line._lines[0] if text.strip()}


async def test_only_unacknowledged_alarms_flash_and_a_acknowledges() -> None:
    async with console(NARROW, trouble) as c:
        line = c.fly.top_lines.alarm_line
        assert "! WARN  LOST in the air: vehicle 5" in c.line(1)
        assert c.line(1).endswith("2 al  a ack")
        line._timer.pause()
        line._bright = True
        line.update_lines()
        before = inks(c)
        line.flash()
        assert {Ink.ALARM} == before - inks(c)
        line.flash()
        assert inks(c) == before
        await c.press("a")
        await c.tick()
        assert "! WARN  LOST in the air: vehicle 5" in c.line(1), "seen, and still the worst"
        assert c.line(1).endswith("NEW BAT 7   2 al  a ack"), "and what a is for now"
        steady = inks(c)
        line.flash()
        assert Ink.SELECTED_CAUTION in inks(c) ^ steady, "it flashes"
        await c.tick(1.0)
        await c.press("a")
        await c.tick()
        assert "! WARN  LOST in the air: vehicle 5" in c.line(1)  # seen, and still there
        assert "2 al  A list" in c.line(1)
        steady = inks(c)
        assert Ink.ALARM not in steady
        line.flash()
        assert inks(c) == steady
        assert [set(r.raised) for r in c.station.commands() if isinstance(r, Acknowledge)] == [
            {"lost"},
            {"battery-low"},
        ]
        c.station.changes.clear()
        await c.tick()
        assert c.line(1) == ""
        await c.press("a")
        assert "nothing to acknowledge" in c.line(1)


async def test_a_key_that_means_something_else_on_a_screen_is_not_offered_there() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("p")  # where a applies the plan
        assert "LOST in the air: vehicle 5" in c.line(1)
        assert c.line(1).endswith("2 al  f a ack")


async def test_an_alarm_that_is_over_before_it_was_seen_is_marked_over() -> None:
    async with console(WIDE, trouble) as c:
        c.station.changes.clear()
        await c.tick()
        assert "o OVER  LOST in the air: vehicle 5 " in c.line(1)
        await c.press("A", "s")
        assert "s shelve" not in c.text() and "a forgets it" in c.text()
        assert not any(isinstance(request, Shelve) for request in c.station.commands()), "nothing is there to put aside"


async def test_an_alarm_that_is_over_stands_beside_active_ones_until_a() -> None:
    for size, reported in (
        (NARROW, "over LST 5   2 al  a ack"),
        (WIDE, "over LST 5   2 alarms  a ack"),
    ):
        async with console(size, trouble) as c:
            await c.press("A", "down", "a", "escape")
            frame = c.station.changes.pop(5)
            await c.tick()
            assert "^ CAUT  battery low: vehicle 7  24 %" in c.line(1) and reported in c.line(1), c.line(1)
            await c.tick(1.0)
            await c.press("a")
            await c.tick()
            assert "battery low: vehicle 7" in c.line(1) and "over" not in c.line(1)
            c.station.changes[5] = frame


async def test_what_is_new_beside_the_worst_is_not_lost_behind_an_answer() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("a")
        await c.tick()
        c.app.notice("refused: vehicle 3 has no fix")
        await c.settle()
        assert "LOST in the air" in c.line(1) and "refused: vehicle 3 has no fix" in c.line(1)
        assert "NEW BAT 7" in c.line(1)


async def test_the_answer_to_a_key_is_not_hidden_by_an_alarm() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("exclamation_mark", "h")
        assert "LOST in the air: vehicle 5" in c.line(1)
        assert "| HOLD ALL: waiting for 1-8" in c.line(1)


async def test_an_alarm_that_comes_while_one_types_is_seen() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("s", "t", "2")
        assert c.line(1).startswith(" ! WARN  LOST in") and "select t2_" in c.line(1)
        await c.press("escape", "exclamation_mark")
        assert c.line(1).startswith(" ! WARN ") and c.line(1).endswith("l land here    (Esc: no)")
        await c.press("escape", "a")
        c.station.changes.pop(7)  # what is left was seen
        await c.tick()
        await c.press("s")
        assert c.line(1).startswith(" select _")


async def test_beside_a_notice_an_alarm_still_shows_what_is_wrong() -> None:
    def fallen(station: FakeStation) -> None:
        station.fly()
        station.alarm = "DISARMED, no landing was ordered"

    async with console(NARROW, fallen) as c:
        await c.press("2", "enter")
        assert "DISARMED, no landing was ordered  | selected 2" in c.line(1)
        c.app.notice("HOLD ALL: 3 of 8 good, NO ANSWER 1-5", Severity.WARNING)
        await c.settle()
        assert "DISARMED" in c.line(1) and "| HOLD ALL: 3 of 8 good" in c.line(1)


async def test_alarms_put_aside_are_still_counted() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("A", "s", "escape")
        await c.tick()
        assert "1 al +1 shelved" in c.line(1)
        await c.press("A", "s", "escape")
        await c.tick()
        assert c.line(1).endswith("2 shelved  A list")


async def test_a_failure_stays_beside_later_notices_until_a_success() -> None:
    async with console(NARROW, lambda station: station.fly()) as c:
        c.app.notice("land here 3 NOT DONE: the station does not answer", Severity.WARNING, "land here 3")
        await c.press("4", "enter")
        assert c.line(1).startswith(" land here 3 NOT DONE: the station does not answer  | selected 4")
        c.app.notice("land here 3: begun", about="land here 3")
        await c.settle()
        assert c.line(1) == " land here 3: begun"
        for number in range(1, 5):
            c.app.notice(f"shelve {number} NOT DONE", Severity.WARNING)
        await c.settle()
        assert c.line(1).startswith(" shelve 4 NOT DONE  | shelve 3 NOT DONE  | and 2 more like these: journal")
        for _ in range(4):
            await c.tick(NOTICE_S / 4)
        c.app.notice("all is well")
        await c.settle()
        assert c.line(1) == " all is well"


async def test_the_list_shows_what_to_do_and_shelves() -> None:
    async with console(NARROW, trouble) as c:
        c.app.commands.ask_quietly(Acknowledge(raised={"lost": 99}), "")
        await c.settle()
        await c.press("A")
        assert isinstance(c.app.screen, AlarmScreen)
        await c.tick()
        picture = c.text()
        assert "^ CAUT  NEW     battery low: vehicle 7  24 %" in picture
        assert "! WARN  seen    LOST in the air: vehicle 5" in picture
        assert "!h hold all" in picture and "by you" in picture
        await c.press("s")  # the mark has stayed with it
        await c.tick()
        assert next(r for r in c.station.commands() if isinstance(r, Shelve)).minutes == 5.0
        assert "! WARN  shelved LOST in the air: vehicle 5" in c.text()
        await c.press("x", "escape")
        await c.tick()
        assert "battery low" in c.line(1) and "A list" in c.line(1)


async def test_more_alarms_than_lines_are_all_reached_by_arrows_and_the_marked_one_is_in_view() -> None:
    async with console(NARROW, trouble) as c:
        many = tuple(
            Alarm(f"test-{n}", AlarmLevel.CAUTION, "TST", f"trouble {n}", "[hold_all] hold all", "new", n + 1, 1.0)
            for n in range(12)
        )
        c.station.alarms = lambda: many  # type: ignore[method-assign]
        await c.tick()
        await c.press("A")
        assert "1-8 of 12 alarms: arrows show the others" in c.text()
        for n in range(12):
            line = next(line for line in c.text().splitlines() if "▸" in line and "trouble" in line)
            assert f"trouble {n}" in line
            assert "y copy  Esc" in c.text()
            await c.press("down")


async def test_a_key_for_the_alarm_that_was_marked_before_is_refused() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("A")
        c.station.changes.pop(5)
        await c.tick()
        c.station.table.acknowledge("somebody", Acknowledge(raised={"lost": 1}))
        await c.tick()
        assert isinstance(c.app.screen, AlarmScreen)
        await c.press("a")
        assert "another alarm is marked now: look at it, then the key again" in c.text()
        assert not [r for r in c.station.commands() if isinstance(r, Acknowledge)]


async def test_an_alarm_put_aside_stays_marked_and_keys_that_mean_nothing_say_nothing() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("A", "s")
        await c.tick()
        line = next(line for line in c.text().splitlines() if "▸" in line and "vehicle 5" in line)
        assert "shelved LOST in the air" in line
        await c.press("question_mark")
        assert "another alarm is marked now" not in c.text()
        await c.press("s")
        await c.tick()
        assert any(isinstance(r, Unshelve) for r in c.station.commands())


async def test_the_vehicles_of_an_alarm_are_selected_by_one_key() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("A", "down", "v")
        assert c.app.feed.selection.ids == (7,)
        assert c.station.commands() == []


async def test_a_key_is_for_the_alarm_that_was_marked_and_not_for_one_that_comes_meanwhile() -> None:
    def one(station: FakeStation) -> None:
        station.fly()
        station.changes[7] = {"battery_pct": 24.0}

    async with console(NARROW, one) as c:
        await c.press("A")
        c.station.changes[5] = {"freshness": Freshness.LOST}  # worse: it goes to the top
        await c.tick()
        await c.press("a")
        assert [list(r.raised) for r in c.station.commands()] == [["battery-low"]]
        c.station.changes.pop(7)
        await c.tick()
        await c.tick()  # acknowledged and over: gone, and the mark goes to the other one
        await c.press("a")
        assert len(c.station.commands()) == 1, "that was meant for the one that is gone"
        await c.tick(1.0)
        await c.press("a")
        assert [list(r.raised) for r in c.station.commands()] == [["battery-low"], ["lost"]]


async def test_the_key_of_the_second_line_is_for_the_alarm_that_was_on_it() -> None:
    def one(station: FakeStation) -> None:
        station.fly()
        station.changes[7] = {"battery_pct": 24.0}

    async with console(NARROW, one) as c:
        c.station.changes[5] = {"freshness": Freshness.LOST}
        await c.tick()
        await c.press("a")
        assert c.station.commands() == []
        assert "another alarm is shown now" in c.told()
        await c.tick(1.0)
        await c.press("a")
        assert [list(r.raised) for r in c.station.commands()] == [["lost"]]


async def test_a_notice_follows_the_operator_to_other_screens_and_ends_on_all() -> None:
    async with console(NARROW) as c:
        c.app.notice("told once")
        await c.settle()
        for key in "vJf":
            assert "told once" in c.line(1)
            await c.press(key)
        c.app.feed.show_notice(Notice(""))
        await c.press("v")
        assert "told once" not in c.line(1)


async def test_every_notice_is_in_the_journal_also_after_silence() -> None:
    async with console(WIDE) as c:
        c.app.notice("while heard")
        await c.settle()
        c.station.silent = True
        c.app.notice("while silent")
        await c.settle()
        c.station.silent = False
        c.app.notice("after")
        await c.settle()
        assert [r.text for r in c.station.requests if isinstance(r, Note)] == ["while heard", "while silent", "after"]
        assert "while heard" not in c.fly.event_lines.text()


async def test_hostile_alarm_is_letters() -> None:
    def hostile(station: FakeStation) -> None:
        station.fly()
        station.changes[3] = {"problem": "NOT COMMANDED: [@click=app.detach]x[/] {0} %s"}

    async with console(WIDE, hostile) as c:
        assert "[@click=app.detach]x[/] {0} %s" in c.line(1)


def alarm(raised: int, level: AlarmLevel = AlarmLevel.WARNING, state: str = "new") -> Alarm:
    """One, of a number."""
    return Alarm("lost", level, "LST", "LOST", "", state, raised, 0.0)  # type: ignore[arg-type]


def test_the_bell_rings_once_for_each_new_alarm_and_again_for_an_unanswered_warning() -> None:
    bell = AlarmBell()
    assert bell.rings([alarm(1)], 0.0)
    assert not bell.rings([alarm(2)], 1.0)  # never twice in two seconds
    assert bell.rings([alarm(2)], 2.0)
    assert not bell.rings([alarm(2)], 5.0)
    assert bell.rings([alarm(2)], 12.0)
    assert not bell.rings([alarm(2, state="acknowledged")], 30.0)
    assert not bell.rings([alarm(3, AlarmLevel.ADVISORY)], 40.0)


def test_a_caution_rings_once_and_a_bell_that_is_off_never() -> None:
    bell = AlarmBell()
    assert bell.rings([alarm(1, AlarmLevel.CAUTION)], 0.0)
    assert not bell.rings([alarm(1, AlarmLevel.CAUTION)], 60.0)
    bell.is_on = False
    assert not bell.rings([alarm(2)], 70.0)


async def test_marks_and_colours_are_the_stations_alarms_and_nothing_else() -> None:
    async with console(WIDE, trouble) as c:
        assert "×!5" in c.text()
        c.station.alarms = lambda: ()  # type: ignore[method-assign]  # put aside, say
        await c.tick()
        assert "×x5" in c.text(), "not heard is grey"
        assert {line[0] for line in c.fly.roster.text().splitlines()[1:]} == {" ", "x"}
        await c.press("v")
        assert "!" not in c.app.screen.table.text()
        assert "^" not in c.app.screen.table.text()


@pytest.mark.parametrize("opener", ["A", "L"])
async def test_a_second_key_that_closes_comes_too_late_and_does_no_harm(opener: str) -> None:
    async with console() as c:
        await c.press(opener)
        for _ in range(3):  # at once, as a terminal that was held up sends them
            c.app.post_message(Key("escape", "\x1b"))
        await c.pilot.pause()
        assert c.app.is_running and isinstance(c.app.screen, FlyScreen)
