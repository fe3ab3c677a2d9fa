"""Orders to selected vehicles: asked as gravely as they may harm, sent once, followed to each vehicle's result."""

import math

from tests.screens.rigs.console import NARROW, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.actions.orders import ORDERS
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.feed.order_tracker import OrderState, VehicleProgress
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.manual_control_screen import ManualControlScreen
from tui_gcs.screens.orders.order_dialog import OrderDialog
from tui_gcs.screens.orders.order_menu import OrderMenu
from tui_gcs.screens.orders.vehicle_words import brief_words, now_words, rows_of


def flight(station: FakeStation) -> None:
    station.fly()


async def select(c: Console, text: str) -> None:
    await c.press("s", *text, "enter")


async def order(c: Console, letter: str, *more: str) -> None:
    """From the menu."""
    await c.press("c")
    assert isinstance(c.app.screen, OrderMenu)
    await c.press(letter, *more)


async def test_nothing_selected_nothing_is_commanded() -> None:
    async with console(prepare=flight) as c:
        await c.press("c")
        assert isinstance(c.app.screen, FlyScreen)
        assert "no vehicle is selected" in c.told()
        await c.press("r")
        assert "no vehicle is selected" in c.told()
        assert c.station.commands() == []


async def test_a_hold_takes_enter_names_its_target_and_is_followed_until_it_shows() -> None:
    async with console(NARROW, flight) as c:
        await select(c, "3-4")
        await order(c, "h")
        assert "hold: 2 vehicles: 3-4" in c.text()
        assert c.station.commands() == []
        await c.press("enter")
        assert c.station.commands() == [m.Hold(vehicles=(3, 4))]
        assert "waiting for 3-4" in c.result()
        await c.tick()
        assert "hold 3-4: done for all 2" in c.result()
        assert "now: holding" in c.result()


async def test_arrows_in_the_menu_tell_all_of_an_order_and_enter_takes_it() -> None:
    async with console(NARROW, flight) as c:
        await select(c, "3")
        await c.press("c", "enter")
        assert isinstance(c.app.screen, OrderMenu), "nothing is marked: Enter alone takes nothing"
        await c.press("down", "down")
        assert "return: return on their layers and land in turn" in c.text()
        await c.press("enter")
        assert isinstance(c.app.screen, OrderDialog)
        assert c.app.screen.order.id == "return"
        assert c.station.commands() == []


async def test_behind_a_letter_that_the_menu_refuses_no_other_counts_until_an_arrow() -> None:
    """`t`, a height, Enter: who is in the air takes off no more, and none of it may choose something else."""
    async with console(NARROW, flight) as c:
        await select(c, "3")
        await c.press("c", "t", "h", "enter", "y", "l", "enter")
        menu = c.app.screen
        assert isinstance(menu, OrderMenu)
        assert "take off: is in the air" in c.text()
        assert "an arrow, then choose again; what follows is not taken" in c.text()
        assert c.station.commands() == []
        await c.press("down", "h")
        assert isinstance(c.app.screen, OrderDialog)
        assert c.app.screen.order.id == "hold"


async def test_behind_a_letter_that_is_none_escape_leaves_the_menu() -> None:
    async with console(NARROW, flight) as c:
        await select(c, "3")
        await c.press("c", "7", "h")
        assert "no order has that letter" in c.text()
        await c.press("escape")
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []


async def test_what_the_station_refused_as_a_whole_is_no_success_in_the_table() -> None:
    """Seen in the demo: round 2 was refused while the fleet started, and the table said `done for all 0`."""
    async with console(NARROW, flight) as c:
        await c.press("!", "h")
        await c.tick()
        assert "HOLD ALL" in c.result()
        refusal = m.Reply(ok=False, text="not while the fleet is starting")
        c.station._reply = lambda _request: refusal  # type: ignore[method-assign]
        await c.press("o", "2", "y")
        await c.tick()
        assert "round 2 NOT DONE: not while the fleet is starting" in c.line(1)
        assert "done for all 0" not in c.text()
        assert "HOLD ALL" in c.result()


async def test_what_has_only_begun_is_never_called_done() -> None:
    """On its way home or to a place: begun. Who stands disarmed on the ground already: done."""
    async with console(NARROW, flight) as c:
        await c.press("!", "r")
        await c.tick()
        assert "RETURN ALL: begun for all 8" in c.result()
        c.station.changes[4] = {"phase": m.Phase.GROUND, "armed": False}
        await c.tick()
        await c.press("!", "l")
        c.station.changes |= {v: {"phase": m.Phase.LANDING} for v in range(1, 9) if v != 4}
        await c.tick_until(lambda: "LAND ALL: begun" in c.result())
        lines = {line.split()[0]: line for line in c.result().splitlines() if "now:" in line}
        assert "LAND ALL: begun for all 8" in c.result()
        assert "done" in lines["4"] and "begun" in lines["5"]


async def test_a_return_has_begun_when_telemetry_shows_it() -> None:
    """The phase is what the station wants: a vehicle that flies on as before has not begun to return."""
    async with console(NARROW, flight) as c:
        row = c.station.frame().rows()[0]
        ahead = tuple(here + 10.0 * speed for here, speed in zip(row.position_m, row.velocity_m_s, strict=True))
        c.station.changes |= {1: {"velocity_m_s": row.velocity_m_s}}
        await c.press("!", "r")
        await c.tick()
        assert "RETURN ALL: waiting for 1" in c.result()
        c.station.changes |= {1: {"velocity_m_s": row.velocity_m_s, "goal_m": ahead}}
        await c.tick()
        assert "RETURN ALL: begun for all 8" in c.result()


async def test_a_goto_counts_as_begun_when_the_station_reports_it() -> None:
    async with console(NARROW, flight) as c:
        await select(c, "3")
        await order(c, "g", *"home +50 0", "enter", "enter", "y")
        c.station.end_task(1, "done", "on its way")
        c.app.results.follow()
        await c.settle()
        assert "go to 3: begun" in c.result()
        assert "on its way" in c.result()


async def test_what_is_still_to_come_of_an_older_order_stays_in_the_table() -> None:
    """A take-off that the next order supersedes must not lose its line; one that failed must not be hidden by it."""
    async with console(NARROW, flight) as c:
        await select(c, "3-4")
        await order(c, "g", *"+50 0", "enter", "enter", "y")
        await select(c, "5")
        await order(c, "u", *"50", "enter", "y")
        c.station.end_task(3, "done", "on its way")
        c.app.results.follow()
        await c.settle()
        assert "altitude 5: begun" in c.result()
        assert "go to 3-4: waiting for 3-4" in c.result()
        c.station.end_task(1, "done", "on its way")
        c.station.end_task(2, "failed", "superseded")
        c.app.results.follow()
        await c.settle()
        assert "go to 3-4: 1 of 2 good, FAILED 4" in c.told()
        lines = c.result().splitlines()
        assert any(line.startswith("4   FAILED    superseded") for line in lines)
        assert not any(line.startswith("3 ") for line in lines), "of older orders only what is not well"
        await c.press("escape")
        assert c.result() == ""
        await c.press("!", "h")
        assert "go to" not in c.result()


async def test_a_question_shows_distance_time_and_the_layer_it_leads_to() -> None:
    """Before it is asked for: the guard would stop it only on the way."""
    async with console(NARROW, flight) as c:
        await select(c, "3")
        await order(c, "u", *"60", "enter")
        assert "0 m away, up 19 m: about 6 s" in c.text()
        assert "! 3 on the layer of 6 (62 m); 6 is" in c.text()
        assert "! 3 passes the layer of 4 (48 m); 4 is" in c.text()
        await c.press("escape")
        await order(c, "g", *"450 900", "enter", "enter")
        assert "outside the area, or in a no-fly zone: the guard stops vehicle 3" in c.text()


async def test_no_word_of_the_menu_of_orders_is_cut_at_80_columns() -> None:
    assert [one.name for one in ORDERS if len(one.brief or one.does) > 20 or len(one.name) > 11] == []
    async with console(NARROW, flight) as c:
        await select(c, "3")
        await c.press("c")
        assert "n  nudge       move by arrow keys" in c.text()
        assert "t  take off    (is in the air)" in c.text()


async def test_what_telemetry_does_not_show_is_never_shown_as_success() -> None:
    async with console(prepare=flight) as c:
        await select(c, "3-4")
        c.station.changes[4] = {"phase": m.Phase.FLYING}
        c.station.changes[3] = {"freshness": Freshness.LOST, "heard_age_s": 9.0}
        await order(c, "h", "enter")
        await c.tick()
        assert "waiting for 3-4" in c.result()
        c.clock.advance(16.0)
        c.app.results.follow()
        await c.settle()
        assert "0 of 2 good, NOT SEEN 3-4" in c.result()


async def test_arming_several_takes_their_number_and_three_seconds() -> None:
    async with console() as c:
        c.station.changes[3] = {"armed": True}
        await c.tick()
        await select(c, "1-3")
        await order(c, "a")
        dialog = c.app.screen
        assert isinstance(dialog, OrderDialog)
        assert "left out: 3  already armed" in dialog.text()
        await c.press("y", "enter")
        assert "type 2, then Enter" in dialog.text()
        await c.press("backspace", "2", "enter")
        assert "Esc = STOP THIS" in dialog.text()
        assert c.station.commands() == []
        c.clock.advance(3.1)
        dialog.tick()
        await c.settle()
        assert c.station.commands() == [f.Arm((1, 2))]
        await c.tick()  # the station is heard: what is told reaches its journal
        assert "left out 3" in c.result()
        c.station.end_task(1, "done", "armed")
        c.station.end_task(2, "failed", "refused: compass not calibrated")
        c.app.results.follow()
        await c.settle()
        assert "1 of 3 good, FAILED 2; left out 3" in c.told()
        assert "compass not calibrated" in c.result().splitlines()[1], "bad news first"


async def test_escape_in_the_last_seconds_sends_nothing() -> None:
    async with console() as c:
        await select(c, "1-2")
        await order(c, "a", "2", "enter", "escape")
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []
        assert "nothing sent: cancelled" in c.told()


async def test_a_question_expires_and_is_void_when_a_vehicle_changed() -> None:
    async with console() as c:
        await select(c, "2")
        await order(c, "a")
        c.clock.advance(10.1)
        c.app.screen.tick()
        await c.settle()
        assert "arm: nothing sent: it was not answered in time" in c.told()
        await c.tick(1.0)  # keys are kept back behind a question that closed by itself, see `test_key_guard`
        await order(c, "a")
        dialog = c.app.screen
        c.station.changes[2] = {"freshness": Freshness.STALE}
        await c.tick()
        if c.app.screen is dialog:  # its own timer may have been faster
            await c.press("y")
        await c.settle()
        assert "vehicle 2 changed meanwhile" in c.told()
        assert c.station.commands() == []


async def test_a_console_that_stood_still_sends_nothing_that_was_asked_before() -> None:
    async with console() as c:
        await select(c, "2")
        await order(c, "a")
        c.clock.advance(10.1)
        await c.press("y")  # read after a SIGCONT, before any timer
        assert "arm: nothing sent: it was not answered in time" in c.told()
        await c.tick(1.0)  # keys are kept back behind a question that closed by itself, see `test_key_guard`
        await select(c, "1-2")
        await order(c, "a", "2", "enter")
        c.clock.advance(8.0)
        c.app.screen.tick()
        await c.settle()
        assert "stood still" in c.told()
        assert c.station.commands() == []


async def test_a_question_below_the_tiny_screen_is_over_and_gone() -> None:
    async with console(NARROW, flight) as c:
        await select(c, "2")
        await order(c, "h")
        dialog = c.app.screen
        await c.pilot.resize_terminal(40, 10)
        c.clock.advance(10.1)
        dialog.tick()
        await c.settle()
        assert c.app.screen is not dialog, "the tiny screen stays"
        await c.pilot.resize_terminal(*NARROW)
        await c.settle()
        assert isinstance(c.app.screen, FlyScreen)
        assert c.station.commands() == []


async def test_the_enter_of_a_question_that_just_closed_resumes_nothing() -> None:
    async with console(prepare=flight) as c:
        c.station.run = m.RunPhase.HOLD
        await c.tick()
        await select(c, "2")
        await order(c, "r")
        c.clock.advance(10.1)
        c.app.screen.tick()
        await c.press("enter")
        assert c.station.commands() == []
        await c.tick(2.0)
        await c.press("enter")
        assert c.station.commands() == [m.Resume()]


async def test_values_are_typed_judged_and_sent_as_they_were_shown() -> None:
    async with console(NARROW, flight) as c:
        await select(c, "2")
        await order(c, "g", *"nowhere", "enter", "enter")
        assert "no such place" in c.app.screen.text()
        await c.press("tab", *["backspace"] * 7, *"450 200 35", "enter", *"4", "enter")
        assert "y = do it" in c.app.screen.text()
        await c.press("y")
        assert c.station.commands() == [f.GoTo((2,), ((450.0, 200.0, 35.0),), 4.0)]
        await order(c, "u", *"30", "enter", "y")
        climb = c.station.commands()[-1]
        assert isinstance(climb, f.GoTo) and climb.points_m[0][2] == 30.0 and math.isnan(climb.points_m[0][0])
        await order(c, "m", *"RTL", "enter", "y")
        assert c.station.commands()[-1] == s.SetMode((2,), "RTL", sure=True)


async def test_the_modes_that_can_be_typed_are_those_of_the_vehicle() -> None:
    async with console(NARROW, flight) as c:
        c.station.modes = ("AUTO", "GUIDED", "RTL", "ACRO")
        await select(c, "3")
        await order(c, "m")
        await c.tick()
        c.app.screen.tick()  # type: ignore[attr-defined]
        await c.settle()
        assert "AUTO, GUIDED, RTL  " in c.text() and "ACRO" not in c.text()


async def test_motors_take_a_reason_and_the_words_typed() -> None:
    async with console(prepare=flight) as c:
        await select(c, "2-3")
        await order(c, "K")
        assert "one at a time" in c.app.screen.text()
        await c.press("escape")
        await select(c, "2")
        await order(c, "K", "enter")
        assert "say why" in c.app.screen.text()
        await c.press(*"burns", "enter", *"KILL 3", "enter")
        assert "type KILL 2" in c.app.screen.text()
        await c.press("backspace", "2", "enter")
        assert c.station.commands() == []
        c.clock.advance(3.1)
        c.app.screen.tick()
        await c.settle()
        assert c.station.commands() == [f.KillMotors((2,), "burns")]


async def test_orders_that_make_no_sense_now_are_grey_and_say_why() -> None:
    async with console() as c:
        await select(c, "2")
        await c.press("c", "g")
        assert "go to: take off first" in c.app.screen.text()
        await c.press("down", "5")
        assert "no order has that letter" in c.app.screen.text()
        await c.press("escape", "colon", *"orbit", "enter")
        assert "not now: take off first" in c.app.screen.text()


async def test_nudging_moves_while_keys_are_pressed_and_space_holds() -> None:
    async with console(prepare=flight) as c:
        await select(c, "2")
        await order(c, "n", "y")
        assert isinstance(c.app.screen, ManualControlScreen)
        c.clock.advance(1.0)
        await c.press("up", "up")
        c.clock.advance(1.0)
        await c.press("right_square_bracket", "minus")
        moves = [r.velocity_m_s for r in c.station.commands() if isinstance(r, f.Nudge)]
        assert moves == [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)], "no faster than a link should carry"
        await c.press("space")
        assert c.station.commands()[-1] == m.Hold(vehicles=(2,))
        assert isinstance(c.app.screen, FlyScreen)


async def test_land_all_takes_two_keys_from_anywhere() -> None:
    async with console(prepare=flight) as c:
        await select(c, "2")
        await c.press("c", "!", "l")
        assert c.station.commands() == [f.Land()]


async def test_read_only_looks_and_commands_nothing() -> None:
    async with console(prepare=flight, read_only=True) as c:
        await select(c, "2")
        await c.press("c", "r", "space", "!", "h")
        assert c.station.commands() == []
        assert "read-only" in c.line(-1)
        await c.press("question_mark")
        assert "not now: read-only" in "".join(text for line in c.app.screen.all_lines() for text, _ in line)


async def test_the_table_never_calls_vehicles_better_that_it_has_no_room_for() -> None:
    def crowd(station: FakeStation) -> None:
        station.count = 40
        station.fly()
        station.refuse = tuple(range(6, 41))

    async with console(NARROW, crowd) as c:
        await select(c, "1-40")
        await order(c, "h", "enter")
        await c.tick()
        assert "REFUSED 6-40" in c.result()
        shown = sum("REFUSED  " in line for line in c.result().splitlines())
        assert f"and {40 - shown} more: {35 - shown} REFUSED, 5 done" in c.result()


async def test_ids_of_four_digits_stand_apart_and_a_long_reason_is_read_to_its_end() -> None:
    why = "in no team, or without a take-off place"

    async with console(NARROW, flight) as c:
        panel = c.app.results.panel()
        results = [VehicleProgress(1001, OrderState.REFUSED, why), VehicleProgress(3, OrderState.DONE, "holds")]
        await c.settle()
        panel.show(("hold 3 1001", results), [], rows_of(c.app.feed).get, now_words, brief_words)
        await c.settle()
        assert f"1001 REFUSED   {why}" in c.result()
        assert "3    done" in c.result()


async def test_results_on_a_screen_that_is_hardly_there_wait_until_it_is_larger() -> None:
    """On 20 columns a reason ended the console."""
    async with console((20, 5), flight) as c:
        panel = c.app.results.panel()
        results = [VehicleProgress(3, OrderState.REFUSED, "in no team, or without a take-off place")]
        panel.show(("hold 3", results), [], rows_of(c.app.feed).get, now_words, brief_words)
        await c.settle()
        await c.pilot.resize_terminal(*NARROW)
        await c.settle()
        assert "REFUSED   in no team, or without a take-off place" in c.result()


async def test_how_a_vehicle_is_now_is_never_cut_for_a_reason() -> None:
    """Seen at 80 columns: `now: transfer GUIDED A` beside a reason that was read to its end."""
    why = "asked, but telemetry does not show it"
    async with console(NARROW, flight) as c:
        panel = c.app.results.panel()
        await c.settle()
        for vehicles, words in (((2, 3), now_words), (tuple(range(1, 9)), brief_words)):
            results = [VehicleProgress(v, OrderState.NOT_SEEN, f"{why} of vehicle {v}") for v in vehicles]
            panel.show(("hold", results), [], rows_of(c.app.feed).get, now_words, brief_words)
            await c.settle()
            shown = rows_of(c.app.feed)
            assert [v for v in vehicles if f"now: {words(shown[v])}\n" not in c.result()] == []


async def test_a_reason_that_many_share_is_read_once_and_they_stand_together() -> None:
    why = "would come within 10 m of another vehicle: nothing was sent, so that it flies on as it did"
    async with console(NARROW, flight) as c:
        panel = c.app.results.panel()
        await c.settle()
        results = [
            VehicleProgress(v, OrderState.REFUSED, why if v % 2 else "LOST: cannot be reached") for v in range(1, 7)
        ]
        panel.show(("hold", results), [], rows_of(c.app.feed).get, now_words, brief_words)
        await c.settle()
        rows = [line.split() for line in c.result().splitlines() if line[:1].isdigit()]
        assert [row[0] for row in rows] == ["1", "3", "5", "2", "4", "6"]
        assert " ".join(c.result().split()).count(why) == 1
        assert c.result().count("as above") == 4


def test_in_brief_a_vehicle_that_does_not_move_shows_whether_it_is_armed() -> None:
    station = FakeStation(MemoryBus())
    station.changes = {2: {"armed": True}, 3: {"freshness": Freshness.LOST, "heard_age_s": 9.0}}
    one, two, three, *_ = station.frame().rows()
    assert [brief_words(row) for row in (one, two, three, None)] == [
        f"ground {one.mode} disarmed",
        f"ground {two.mode} ARMED",
        "LOST 9 s",
        "never heard",
    ]


def test_height_and_speed_of_an_old_position_are_not_shown() -> None:
    """After a reboot a real ArduCopter had no position for 9 s: `now: ground STABILIZE disarmed 0 m 0.0 m/s`."""
    station = FakeStation(MemoryBus())
    station.fly()
    station.changes = {2: {"freshness": Freshness.STALE, "age_s": 9.0, "phase": m.Phase.TAKEN_OUT}}
    row = station.frame().rows()[1]
    assert now_words(row) == "by itself GUIDED ARMED no position for 9 s"
    assert brief_words(row) == "by itself GUIDED no position for 9 s"


async def test_reasons_in_the_menu_fit_their_cells() -> None:
    """Of an armed one on the ground, and of several that hold."""

    def scenes(station: FakeStation) -> None:
        station.fly()
        station.changes = {3: {"phase": m.Phase.GROUND}, 4: {"phase": m.Phase.HOLDING}, 5: {"phase": m.Phase.HOLDING}}

    async with console(NARROW, scenes) as c:
        for chosen, reasons in (
            ("3", ("p  to planner  (take off first)", "b  reboot      (is armed)")),
            ("4-5", ("v  speed       (is not on its way)", "K  KILL MOTORS (one at a time)")),
        ):
            await select(c, chosen)
            await c.press("c")
            assert [reason for reason in reasons if reason not in c.text()] == []
            assert "..)" not in c.text() and ".. " not in c.text()
            await c.press("escape")
