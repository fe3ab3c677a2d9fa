"""Keys that come all at once, as a slow link delivers them, mean what they mean one by one."""

from textual.events import Key

from tests.screens.rigs.console import NARROW, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.protocol import common as m
from tui_gcs.screens.orders.order_dialog import OrderDialog
from tui_gcs.terminal.key_queue import KeyQueue


def flight(station: FakeStation) -> None:
    station.fly()


async def burst(c: Console, *keys: str) -> None:
    """All of them before the app has looked at one."""
    characters = {"enter": "\r", "space": " ", "exclamation_mark": "!"}
    for key in keys:
        c.app.post_message(Key(key, characters.get(key, key)))
    await c.settle()
    await c.settle()


def test_what_waits_for_a_screen_that_ended_goes_on() -> None:
    turns = KeyQueue()
    first, second = (Key("a", "a"), 1.0), (Key("b", "b"), 1.1)
    turns.add(first)
    turns.add(second)
    assert turns.next() == first
    turn = turns.begin()
    assert turns.next() is None
    assert turns.held_up_by == turn
    assert turns.end(turn)
    assert not turns.end(turn), "told twice, by the screen and by the clock"
    assert turns.next() == second
    assert turns.held_up_by == 0


async def test_letters_behind_the_one_that_opens_the_menu_go_to_the_menu_and_its_question() -> None:
    async with console(NARROW, flight) as c:
        await c.press("s", *"2", "enter")
        await burst(c, "c", "u", "4", "5", "enter")
        dialog = c.app.screen
        assert isinstance(dialog, OrderDialog)
        assert dialog.order.id == "climb"
        assert "[45" in dialog.text()
        assert c.app.feed.selection.ids == (2,)


async def test_a_number_behind_the_one_that_asks_for_a_round_is_that_round() -> None:
    async with console(NARROW, flight) as c:
        await burst(c, "o", "3", "y")
        assert c.station.commands() == [m.SwitchRound(index=2)]
        assert c.app.feed.selection.ids == ()


async def test_yes_goes_to_the_question_and_what_comes_behind_it_to_the_screen() -> None:
    async with console(NARROW, flight) as c:
        await burst(c, "2", "enter", "r", "enter", "v")
        assert [type(request).__name__ for request in c.station.commands()] == ["Return"]
        assert c.app.current_mode == "vehicles"


async def test_hold_all_overtakes_what_waits() -> None:
    async with console(NARROW, flight) as c:
        await burst(c, "2", "enter", "c", "u", "9", "9", "exclamation_mark", "h")
        assert c.station.commands() == [m.Hold()]
