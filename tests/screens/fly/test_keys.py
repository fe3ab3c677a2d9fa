"""Keys and dialogs: what is asked of the station, and what is not."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from textual.events import Key

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.console.groups import GroupFile
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.services import GetVehicles, decode_request
from tui_gcs.screens.common.help import HelpDialog
from tui_gcs.screens.common.palette_dialog import PaletteDialog
from tui_gcs.screens.common.screens_menu import ScreensMenu
from tui_gcs.screens.common.text_dialog import LINE_CELLS
from tui_gcs.screens.common.tiny_screen import TinyScreen
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.round_dialog import RoundDialog
from tui_gcs.screens.fly.start_dialog import StartDialog


def flight(station: FakeStation) -> None:
    station.fly()


async def test_space_asks_before_start_and_enter_starts_what_was_shown() -> None:
    async with console() as c:
        await c.press("space")
        assert isinstance(c.app.screen, StartDialog)
        assert c.station.commands() == []
        assert "8  (1-8)" in c.app.screen.text()
        assert "5-8" in c.app.screen.text()
        assert "patrol" in c.app.screen.text()
        await c.press("enter")
        assert c.station.commands() == [m.Start(vehicles=(1, 2, 3, 4, 5, 6, 7, 8))]


@pytest.mark.parametrize("key", ["escape"])
async def test_escape_cancels_the_start(key: str) -> None:
    async with console() as c:
        await c.press("space", key)
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []


async def test_start_is_cancelled_after_ten_seconds() -> None:
    async with console() as c:
        await c.press("space")
        c.clock.advance(10.1)
        c.app.screen.tick()
        await c.settle()
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []


async def test_start_is_cancelled_when_the_fleet_changes() -> None:
    async with console() as c:
        await c.press("space")
        dialog = c.app.screen
        assert isinstance(dialog, StartDialog)
        c.station.changes[3] = {"freshness": m.Freshness.LOST}
        await c.tick()
        if c.app.screen is dialog:  # its own timer may have been faster
            dialog.tick()
        await c.settle()
        assert isinstance(c.app.screen, FlyScreen)


async def test_vehicle_that_is_not_heard_is_named_and_left_out() -> None:
    async with console() as c:
        c.station.changes[3] = {"freshness": m.Freshness.LOST}
        await c.tick()
        await c.press("space")
        assert "not heard: 3" in c.app.screen.text()
        await c.press("enter")
        assert c.station.commands() == [m.Start(vehicles=(1, 2, 4, 5, 6, 7, 8))]


async def test_a_start_without_a_ready_vehicle_offers_no_start() -> None:
    async with console() as c:
        for vehicle in range(1, 9):
            c.station.changes[vehicle] = {"freshness": m.Freshness.LOST}
        await c.tick()
        await c.press("space")
        assert "fly: none" in c.app.screen.text()
        assert "no vehicle of these teams is heard and ready yet" in c.app.screen.text()
        assert "Enter = start" not in c.app.screen.text()
        await c.press("enter")
        assert c.station.commands() == []


async def test_live_start_wants_the_count_typed() -> None:
    async with console(kind=m.RunKind.LIVE) as c:
        await c.press("space", "enter")
        assert isinstance(c.app.screen, StartDialog)
        assert "REAL" in c.app.screen.text()
        await c.press("7", "enter")
        assert c.station.commands() == []
        await c.press("backspace", "8", "enter")
        assert "Esc = STOP THIS" in c.app.screen.text()
        assert c.station.commands() == []
        c.clock.advance(3.1)
        c.app.screen.tick()
        await c.settle()
        assert c.station.commands() == [m.Start(vehicles=(1, 2, 3, 4, 5, 6, 7, 8))]


async def test_a_console_that_stood_still_in_the_last_seconds_starts_nothing() -> None:
    async with console(kind=m.RunKind.LIVE) as c:
        await c.press("space", "8", "enter")
        dialog = c.app.screen
        c.clock.advance(60.0)
        dialog.tick()
        await c.settle()
        assert c.station.commands() == []


async def test_a_live_start_can_be_stopped_in_the_last_seconds() -> None:
    async with console(kind=m.RunKind.LIVE) as c:
        await c.press("space", "8", "enter", "escape")
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []
        assert "start: nothing sent: cancelled" in c.told()


async def test_refused_vehicle_is_listed() -> None:
    async with console() as c:
        c.station.refuse = (4,)
        await c.press("space", "enter")
        assert "7 of 8 good, REFUSED 4" in c.told()
        assert "4   REFUSED   prearm: compass" in c.result()
        await c.press("escape")
        assert c.result() == "", "Esc closes the table, and nothing else"


async def test_space_in_flight_holds_without_asking() -> None:
    async with console(prepare=flight) as c:
        await c.press("space")
        assert c.station.commands() == [m.Hold()]
        assert isinstance(c.app.screen, FlyScreen)
        await c.tick()
        assert "HOLD" in c.line(0)


async def test_space_in_a_hold_stops_vehicles_that_still_fly() -> None:
    """One was sent home meanwhile; where all stand already it says what goes on from there."""
    async with console(prepare=flight) as c:
        await c.press("space")
        c.station.changes = {v: {"phase": m.Phase.HOLDING} for v in range(1, 9)}
        await c.tick()
        await c.press("space")
        assert c.station.commands() == [m.Hold()]
        assert "all hold already: Enter goes on" in c.told()
        c.station.changes[7] = {"phase": m.Phase.RETURNING}
        await c.tick()
        await c.tick()
        assert "Space HOLD" in c.line(-1)
        await c.press("space")
        assert c.station.commands() == [m.Hold(), m.Hold()]


async def test_enter_resumes_only_in_hold() -> None:
    async with console(prepare=flight) as c:
        await c.press("enter")
        assert c.station.commands() == []
        await c.press("space")
        await c.tick()
        await c.press("enter")
        assert c.station.commands() == [m.Hold(), m.Resume()]


async def test_enter_resumes_those_that_hold_while_others_fly() -> None:
    """Whose planner failed, or who was lost and is back: the station knows who stays."""
    async with console(prepare=flight) as c:
        c.station.changes[3] = {"phase": m.Phase.HOLDING}
        await c.tick()
        await c.press("enter")
        assert c.station.commands() == [m.Resume()]
        c.station.run = m.RunPhase.RETURNING
        await c.tick()
        await c.press("enter")
        assert c.station.commands() == [m.Resume()], "nobody is taken into flight while the fleet goes home"
        assert "the others return: select who holds, then c p to planner or r return" in c.told()


async def test_vehicles_that_stay_when_all_are_resumed_are_named() -> None:
    async with console(prepare=flight) as c:
        c.station.stays = {1: "", 3: "was landing: resume it by name"}
        await c.press("space")
        await c.tick()
        await c.press("enter")
        assert "resume: 1 of 2 good, left out 3" in c.told()
        assert "3   left out  was landing: resume it by name" in c.result()


async def test_two_keys_return_all_from_a_hold() -> None:
    async with console(prepare=flight) as c:
        await c.press("space")
        await c.tick()
        await c.press("!", "r")
        assert c.station.commands() == [m.Hold(), m.Return()]


async def hold_all(c: Console) -> list[m.AnyRequest]:
    await c.press("!", "h")
    return c.station.commands()


EVERYWHERE = {
    "fly": "",
    "help": "question_mark",
    "rounds": "o",
    "a number": "1 2",
    "a selection": "s a",
    "the menu": "1 enter c",
    "a question": "1 enter c h",
    "a value": "1 enter c g 4",
    "the palette": "colon h",
    "alarms": "A",
    "layers": "L",
    "cursor": "x",
    "plan": "p",
    "a form": "p tab",
    "vehicles": "v",
    "a filter": "v slash a",
    "journal": "J",
    "words": "J slash a",
}


@pytest.mark.parametrize("before", EVERYWHERE.values(), ids=EVERYWHERE)
async def test_hold_all_works_from_everywhere(before: str) -> None:
    """And says so at once, on whatever screen."""
    async with console(prepare=flight) as c:
        await c.press(*before.split())
        assert c.station.commands() == []
        await c.press("!")
        assert "! ALL but piloted:  h HOLD" in c.text()
        await c.press("h")
        assert c.station.commands() == [m.Hold()]
        assert "HOLD ALL" in c.text()


async def test_hold_all_works_while_flying_by_hand() -> None:
    async with console(prepare=flight) as c:
        await c.press("1", "enter", "c", "n", "y", "!", "h")
        assert c.station.commands()[-1] == m.Hold()


async def test_a_terminal_that_reports_shift_does_not_break_the_chord() -> None:
    async with console(prepare=flight) as c:
        await c.press("left_shift", "!", "left_shift", "H")
        assert c.station.commands() == [m.Hold()]
        await c.press("1", "enter", "s", "left_shift", "plus", "3", "enter")
        assert c.app.feed.selection.ids == (1, 3)


async def test_two_keys_count_as_they_were_pressed_by_a_console_that_was_busy() -> None:
    async with console(prepare=flight) as c:
        bang, h = Key("exclamation_mark", "!"), Key("h", "h")
        await c.app.on_event(bang)
        c.clock.advance(60.0)
        h.time -= 59.0  # pressed a second after the other, handled a minute later
        await c.app.on_event(h)
        await c.settle()
        assert c.station.commands() == [m.Hold()]


async def test_a_hold_does_not_wait_for_an_open_question() -> None:
    async with console(prepare=flight) as c:
        open_questions: list[Callable[[bytes | None], None]] = []
        begin = c.app.feed._bus.begin

        def slow(key: str, payload: bytes, on_answer: Callable[[bytes | None], None], *rest: Any, **more: Any) -> None:
            if isinstance(decode_request(payload), GetVehicles):
                open_questions.append(on_answer)
            else:
                begin(key, payload, on_answer, *rest, **more)

        c.app.feed._bus.begin = slow  # type: ignore[method-assign]
        questions = [asyncio.create_task(c.app.feed.requests.send(GetVehicles((1,)))) for _ in range(40)]
        await asyncio.sleep(0)
        await c.pilot.press("!", "h")
        await c.app.workers.wait_for_complete()
        assert len(open_questions) == 40
        assert c.station.commands() == [m.Hold()]
        for on_answer in open_questions:
            on_answer(None)
        assert all(reply.code is m.ReplyCode.NO_ANSWER for reply in await asyncio.gather(*questions))


async def test_hold_all_works_in_the_start_dialog() -> None:
    async with console() as c:
        await c.press("space")
        assert await hold_all(c) == [m.Hold()]


async def test_hold_all_works_in_a_tiny_terminal() -> None:
    async with console((40, 10), flight) as c:
        assert isinstance(c.app.screen, TinyScreen)
        await c.press("!")
        assert "h HOLD" in c.text()
        await c.press("h")
        assert c.station.commands() == [m.Hold()]
        assert "HOLD ALL" in c.text()


async def test_space_in_a_tiny_terminal_holds_and_never_starts() -> None:
    async with console((40, 10), flight) as c:
        await c.press("space")
        assert c.station.commands() == [m.Hold()]
        assert "HOLD ALL" in c.text()
    async with console((40, 10)) as c:
        await c.press("space")
        assert c.station.commands() == [] and isinstance(c.app.screen, TinyScreen)


async def test_prefix_alone_does_nothing_and_is_shown() -> None:
    async with console(prepare=flight) as c:
        await c.press("!")
        assert "h HOLD" in c.line(1)
        await c.press("escape")
        assert "h HOLD" not in c.line(1)
        await c.press("h")
        assert c.station.commands() == []


async def test_an_unanswered_hold_is_reported() -> None:
    async with console(prepare=flight) as c:
        c.station.silent = True
        await c.press("!", "h")
        assert "HOLD ALL NOT DONE" in c.line(1)


async def test_round_is_chosen_by_number() -> None:
    async with console(prepare=flight) as c:
        await c.press("o")
        assert isinstance(c.app.screen, RoundDialog)
        assert "fly there at once: 1-8" in c.text()
        await c.press("3", "enter")
        assert "press y" in c.text()
        assert c.station.commands() == []
        await c.press("y")
        assert c.station.commands() == [m.SwitchRound(index=2)]


async def test_a_round_is_asked_for_ten_seconds_and_as_things_were() -> None:
    async with console(prepare=flight) as c:
        await c.press("o")
        c.clock.advance(10.1)
        await c.press("y")
        await c.tick(1.0)
        await c.press("o")
        dialog = c.app.screen
        c.station.run = m.RunPhase.HOLD  # by another console
        await c.tick()
        if c.app.screen is dialog:  # its own timer may have been faster
            await c.press("y")
        await c.settle()
        assert c.station.commands() == []
        assert "round: nothing sent" in c.told()


async def test_on_the_ground_a_round_takes_enter_and_the_next_one_is_offered() -> None:
    async with console() as c:
        await c.press("o", "enter")
        assert c.station.commands() == [m.SwitchRound(index=1)]
        await c.press("o", "escape")
        assert len(c.station.commands()) == 1
        assert "round: nothing sent" in c.told()


async def test_selection_by_steps_by_number_and_by_name() -> None:
    """It is in the footer of every screen; choosing and switching screens sends nothing."""
    async with console() as c:
        assert "none selected" in c.line(-1)
        await c.press("n")
        assert c.fly.selected == 1
        await c.press("N")
        assert c.fly.selected == 8
        await c.press("3")
        assert "select 3_" in c.line(1)
        await c.press("enter")
        assert c.fly.selected == 3
        await c.press(*"3-5,8", "enter")
        assert c.app.feed.selection.ids == (3, 4, 5, 8)
        assert "3-5,8" in c.line(-1)
        await c.press("n")
        assert c.fly.selected == 4, "of several the next is looked at, and all stay selected"
        assert c.app.feed.selection.ids == (3, 4, 5, 8)
        await c.press("9", "enter")
        assert "not selected: no vehicle 9" in c.line(1)
        await c.press("p", "s", *"t2", "enter")
        assert c.app.feed.selection.ids == (5, 6, 7, 8)
        assert "5-8" in c.line(-1), "on the plan screen, too"
        await c.press("s", *"lo=-8", "enter", "s", *"none", "enter", "s", *"lo", "enter")
        assert c.app.feed.selection.ids == (5, 6, 7)
        await c.press("s", "a", "escape")
        assert c.app.feed.selection.ids == (5, 6, 7)
        assert c.station.commands() == []


async def test_a_group_is_there_again_for_the_next_console(tmp_path: Path) -> None:
    file = GroupFile(tmp_path / "groups.json")
    async with console(groups=file) as c:
        await c.press("s", *"low=2-3", "enter")
        assert "low saved: selected 2-3" in c.told()
    async with console(groups=file) as c:
        await c.press("s", *"low", "enter")
        assert c.app.feed.selection.ids == (2, 3)
        (tmp_path / "groups.json").write_text("{")
        await c.press("s", *"4", "enter")
        assert c.app.feed.selection.ids == (4,), "vehicles can be chosen all the same"
        assert "is damaged" in c.told()


async def test_palette_finds_and_runs_actions_or_shows_why_not() -> None:
    async with console(NARROW) as c:
        await c.press("colon", *"resume", "enter")
        assert isinstance(c.app.screen, PaletteDialog)
        assert "not now: nothing holds" in c.app.screen.text()
        await c.press("escape", "ctrl+p", *"closer", "enter")
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []
        await c.press("colon", *"choose round", "enter")
        assert isinstance(c.app.screen, RoundDialog)


async def test_map_keys_move_the_view() -> None:
    async with console(prepare=flight) as c:
        start = c.fly.map_view.view
        await c.press("right")
        assert c.fly.map_view.view.centre_m[0] > start.centre_m[0]
        await c.press("k")
        assert c.fly.map_view.view.centre_m[1] > start.centre_m[1]
        await c.press("+")
        assert c.fly.map_view.view.m_per_dot < start.m_per_dot
        await c.press("z")
        assert c.fly.map_view.view == start
        await c.press("n", "F")
        assert c.fly.map_view.following


async def test_help_lists_every_action() -> None:
    async with console(NARROW) as c:
        await c.press("question_mark")
        assert isinstance(c.app.screen, HelpDialog)
        for word in ("HOLD", "start (asks)", "planners go on", "farther", "leave; station", "not now: nothing holds"):
            assert any(word in "".join(t for t, _ in line) for line in c.app.screen.all_lines())
        await c.press("escape")
        assert isinstance(c.app.screen, FlyScreen)


async def test_help_is_never_cut_and_ends_with_what_the_signs_mean() -> None:
    async with console(NARROW) as c:
        await c.press("question_mark")
        lines = ["".join(text for text, _ in line) for line in c.app.screen.all_lines()]
        assert max(map(len, lines)) <= LINE_CELLS
        assert "(asks). In flight:" in "\n".join(lines) and any(line.strip() == "HOLD ALL at once" for line in lines)
        for sign in ("slot off", "cov 4/4", "sep out", "veto", "ctl"):
            assert any(line[9:].startswith(sign) for line in lines), sign
        for _ in range(12):
            await c.press("pagedown")
        assert "brakes and holds" in c.text()


async def test_small_terminal_keeps_the_alarm_and_comes_back() -> None:
    async with console(WIDE, flight) as c:
        c.station.alarm = "vehicle 5 LOST in flight"
        await c.tick()
        await c.pilot.resize_terminal(50, 12)
        await c.settle()
        assert isinstance(c.app.screen, TinyScreen)
        assert "vehicle 5 LOST in flight" in c.text()
        assert "need 80x24, this is 50x12" in c.text()
        await c.pilot.resize_terminal(80, 24)
        await c.settle()
        assert isinstance(c.app.screen, FlyScreen)


async def test_detach_sends_nothing() -> None:
    async with console(prepare=flight) as c:
        await c.pilot.press("q")
        assert c.station.commands() == []
        assert c.app._exit


async def test_replay_commands_nothing() -> None:
    async with console(kind=m.RunKind.REPLAY, prepare=flight, replay=True) as c:
        await c.press("space", "!", "h", "r")
        assert c.station.commands() == []
        assert "REPLAY" in c.line(0)


@pytest.mark.parametrize(("kind", "replay"), [(m.RunKind.REPLAY, True), (m.RunKind.SIM, False)])
async def test_the_footer_offers_commands_where_there_are_any(kind: m.RunKind, replay: bool) -> None:
    """Not in a replay: what it shows can be looked at, and left."""
    async with console(kind=kind, prepare=flight, replay=replay) as c:
        keys = c.line(-1)
        assert all(word in keys for word in ("select", "help", "detach"))
        for command in ("HOLD", "round"):
            assert (command in keys) is not replay, keys


async def test_other_protocol_is_one_clear_line_and_read_only() -> None:
    def old(station: FakeStation) -> None:
        station.protocol_answer = "this station speaks protocol 2, this console 1"

    async with console(prepare=old) as c:
        assert "read-only: this station speaks protocol 2" in c.line(1)
        await c.press("space", "!", "h")
        assert c.station.commands() == []


async def test_console_for_sim_never_commands_a_live_station() -> None:
    def live(station: FakeStation) -> None:
        station.kind = m.RunKind.LIVE

    async with console(prepare=live) as c:
        await c.press("!", "h", "space")
        assert c.station.commands() == []
        assert "read-only" in c.line(1)


async def test_a_replay_has_no_plan_screen() -> None:
    async with console(replay=True) as c:
        await c.press("p")
        assert isinstance(c.app.screen, FlyScreen)


async def test_the_start_dialog_shows_what_each_kind_of_vehicle_does_without_a_link() -> None:
    async with console() as c:
        await c.press("space")
        text = c.app.screen.text()
        assert "  1-4  brakes after 3 s and holds" in text
        assert "  5-8  after 1-2 s without set-points: Position mode" in text
        assert "    SINKS (COM_OBL_RC_ACT)" in text
        assert max(map(len, text.splitlines())) <= 74, "fits 80 columns with its frame"


def added_tasks(c: Console) -> list[m.AddPoints]:
    return [request for request in c.station.requests if isinstance(request, m.AddPoints)]


async def test_the_smallest_terminal_names_the_key_of_all_other_screens() -> None:
    async with console(NARROW) as c:
        assert "S screens" in c.line(-1)


async def test_the_help_begins_with_what_a_key_does() -> None:
    """The text of a table alone has often no verb: `the chosen parameter on the compared vehicles; asks`."""
    async with console(WIDE) as c:
        await c.press("S", "p", "?")
        words = " ".join(c.app.screen.text().split())
        assert "set: the chosen parameter on the compared vehicles; asks" in words
        assert "copy all that is listed from the vehicle looked at to the others; asks" in words


async def test_a_task_for_planners_is_made_at_the_cursor() -> None:
    async with console(WIDE, flight) as c:
        await c.press("t")  # shows the cursor, and says what the next press does
        cursor = c.fly.cursor_m
        assert cursor is not None and "t again" in c.line(1) and added_tasks(c) == []
        await c.press("right", "t")
        assert "task: place; name; priority; seconds =" in c.text() and "cursor" in c.line(38)
        await c.press(*"; gate 7; 2".replace(" ", ""), "enter")
        (request,) = added_tasks(c)
        (point,) = request.points
        assert point.place_m == c.fly.cursor_m != cursor
        assert (point.name, point.priority) == ("gate7", 2.0)
        assert "S a, then Tab, lists and cancels it" in c.line(1)
        await c.press("t", "enter")  # the same question again, for another one
        assert len(added_tasks(c)) == 2


@pytest.mark.parametrize("size", [NARROW, WIDE])
async def test_the_footer_names_the_keys_of_the_cursor_while_it_is_shown(size: tuple[int, int]) -> None:
    async with console(size, flight) as c:
        before = c.line(-1)
        await c.press("x")
        for key in ("!h HOLD ALL", "Space HOLD", "t task", "X measure", "Esc hide", "? help"):
            assert key in c.line(-1)
        await c.press("escape")
        assert c.line(-1) == before


async def test_a_read_only_console_is_not_offered_a_task_at_the_cursor() -> None:
    async with console(WIDE, flight, read_only=True) as c:
        await c.press("x")
        assert "X measure" in c.line(-1) and "task" not in c.line(-1)


@pytest.mark.parametrize("ends", ["enter", "escape"])
async def test_the_question_for_a_task_takes_no_keys_when_the_screen_is_shown_again(ends: str) -> None:
    async with console(NARROW) as c:
        await c.press("t", "t", ends)
        await c.press("S", "l")
        await c.press("f", "n")
        assert c.app.feed.selection.ids == (1,), "the hidden field had the cursor, and took n"
        await c.press("S")
        assert isinstance(c.app.screen, ScreensMenu)


async def test_escape_makes_no_task_and_what_is_none_is_refused() -> None:
    async with console(WIDE, flight) as c:
        await c.press("t", "t", "escape")
        assert added_tasks(c) == []
        await c.press("t", *";;x", "enter")
        assert "'x' is no priority" in c.line(1) and added_tasks(c) == []


async def test_a_read_only_console_makes_no_task() -> None:
    async with console(WIDE, flight, read_only=True) as c:
        await c.press("t", "t")
        assert "read-only" in c.line(1) and c.fly.cursor_m is None and added_tasks(c) == []


@pytest.mark.parametrize("letter", ["p", "i", "s", "l", "g", "o", "a"])
async def test_a_number_selects_on_every_screen_of_vehicles(letter: str) -> None:
    async with console(WIDE, flight) as c:
        await c.press("S", letter, "3", "comma", "5", "enter")
        assert c.app.feed.selection.ids == (3, 5)


async def test_the_menu_of_screens_is_not_cut() -> None:
    async with console(NARROW, flight) as c:
        await c.press("S")
        lines = c.app.screen.text().splitlines()
        assert sum(line.strip().startswith(tuple("pislgofat")) for line in lines) >= 9
        assert not any(line.rstrip(" ┃│").endswith("..") for line in lines)
