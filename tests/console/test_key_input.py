"""Keys that were meant for a question which closed by itself do nothing else, and the operator is told; stops pass."""

from tests.screens.rigs.console import NARROW, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.console.key_input import GUARD_S, MAX_GUARD_S, KeyGuard
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.flight import Arm
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.fly.manual_control_screen import ManualControlScreen
from tui_gcs.screens.fly.round_dialog import RoundDialog
from tui_gcs.screens.fly.start_dialog import StartDialog
from tui_gcs.screens.orders.order_dialog import OrderDialog
from tui_gcs.screens.orders.order_menu import OrderMenu


def flight(station: FakeStation) -> None:
    station.fly()


async def select(c: Console, text: str) -> None:
    await c.press("s", *text, "enter")


async def expire(c: Console, after_s: float = 10.1) -> None:
    """Time passes without a key; the station is heard all the while."""
    dialog = c.app.screen
    assert isinstance(dialog, OrderDialog | StartDialog | RoundDialog | ManualControlScreen)
    c.clock.advance(after_s)
    c.station.tick()
    await c.settle()
    dialog.tick()
    await c.settle()
    assert isinstance(c.app.screen, FlyScreen)


def test_a_guard_lasts_a_moment_longer_with_every_key_it_keeps_back_but_not_for_ever() -> None:
    guard = KeyGuard()
    assert not guard.keeps_back(0.0)
    guard.begin("it was not answered in time", 10.0)
    assert guard.keeps_back(9.9), "pressed before it closed, read behind it"
    assert guard.keeps_back(10.6) and guard.keeps_back(11.2)
    assert not guard.keeps_back(11.2 + GUARD_S)
    guard.begin("it was not answered in time", 20.0)
    held_down = [20.0 + 0.1 * n for n in range(100)]
    assert [t for t in held_down if guard.keeps_back(t)][-1] < 20.0 + MAX_GUARD_S


async def test_a_letter_behind_a_question_that_expired_opens_no_other_one() -> None:
    """`o` is a round for the dialog, and below it asks for one; `c` and `r` ask about orders."""
    async with console(NARROW, flight) as c:
        await select(c, "2")
        await c.press("r")
        await expire(c)
        for key in ("y", "c", "r", "o", "q", "2", "enter"):
            await c.press(key)
            assert isinstance(c.app.screen, FlyScreen)
            assert f"{key} NOT TAKEN, a question had just closed: it was not answered in time" in c.line(1)
        assert c.app.feed.selection.ids == (2,), "the digit selects nobody"
        assert c.station.commands() == []
        c.clock.advance(1.0)
        await c.press("r")
        assert isinstance(c.app.screen, OrderDialog), "a moment later keys are keys again"


async def test_an_enter_behind_a_question_about_those_in_hold_resumes_nobody() -> None:
    """A vehicle changes just before the operator says yes: without the guard Enter would send all others on."""
    async with console(prepare=flight) as c:
        await c.press("space")
        await c.tick()
        await select(c, "2-3")
        await c.press("c", "u", "5", "0", "enter")
        dialog = c.app.screen
        assert isinstance(dialog, OrderDialog)
        c.station.changes[2] = {"phase": m.Phase.FLYING}
        await c.tick()
        dialog.tick()
        await c.settle()
        await c.press("y", "enter")
        assert c.station.commands() == [m.Hold()]
        assert "enter NOT TAKEN, a question had just closed: vehicle 2 changed meanwhile" in c.told()


async def test_space_asks_a_silent_station_in_flight_to_hold_as_well() -> None:
    """It may be stalled for a moment only: it holds as soon as it hears, as with !h."""
    async with console(prepare=flight) as c:
        c.clock.advance(3.5)
        c.app.feed.check()
        await c.pilot.pause()
        assert c.app.feed.station_lost
        await c.press("space")
        assert c.station.commands() == [m.Hold()]


async def test_space_on_the_ground_starts_nobody_while_the_station_is_silent_and_says_so() -> None:
    async with console() as c:
        c.clock.advance(3.5)
        c.app.feed.check()
        await c.pilot.pause()
        await c.press("space")
        assert c.station.commands() == []
        assert "station silent for" in c.line(1) and "| start: nothing sent: the station is silent" in c.line(1)


async def test_stops_pass_at_once_behind_a_question_that_closed_by_itself() -> None:
    async with console(prepare=flight) as c:
        await select(c, "2")
        await c.press("r")
        await expire(c)
        await c.press("space")
        assert c.station.commands() == [m.Hold()], "Space holds in flight"
        await c.tick(1.0)
        await c.press("r")
        await expire(c)
        for stop in "hrl":
            await c.press("!", stop)
        assert [type(request).__name__ for request in c.station.commands()[1:]] == ["Hold", "Return", "Land"]


async def test_space_on_the_ground_is_no_stop_and_asks_for_no_start() -> None:
    async with console() as c:
        await c.press("space")
        await expire(c)
        await c.press("space", "enter")
        assert isinstance(c.app.screen, FlyScreen)
        assert "Space NOT TAKEN" in c.told()
        assert "start: nothing sent: it was not answered in time" in c.told()
        assert c.station.commands() == []


async def test_a_start_that_is_void_says_why_and_keeps_the_count_and_enter_back() -> None:
    async with console(kind=m.RunKind.LIVE) as c:
        await c.press("space")
        dialog = c.app.screen
        assert isinstance(dialog, StartDialog)
        c.station.changes[3] = {"freshness": m.Freshness.LOST, "heard_age_s": 9.0}
        await c.tick()
        dialog.tick()
        await c.settle()
        await c.press("8", "enter")
        await c.tick()
        assert "8 NOT TAKEN, a question had just closed: fleet, links or round changed meanwhile" in c.told()
        assert c.station.commands() == []
        assert c.app.feed.selection.ids == ()


async def test_the_question_for_a_round_keeps_back_the_yes_that_came_too_late() -> None:
    async with console(prepare=flight) as c:
        await c.press("o")
        c.clock.advance(10.1)
        await c.press("y", "y", "3", "enter")
        await c.tick()
        assert isinstance(c.app.screen, FlyScreen)
        assert "round: nothing sent: it was not answered in time" in c.told()
        assert "3 NOT TAKEN" in c.told()
        assert c.station.commands() == []
        assert c.app.feed.selection.ids == ()


async def test_an_escape_that_comes_too_late_is_told_that_it_was_sent() -> None:
    async with console() as c:
        await select(c, "1-2")
        await c.press("c", "a", "2", "enter")
        await expire(c, 3.05)
        await c.press("escape")
        assert c.station.commands() == [Arm((1, 2))]
        assert "escape NOT TAKEN, a question had just closed: it was just sent" in c.told()
        assert c.result() != "", "and the table of what comes of it stays"


async def test_keys_behind_flying_by_hand_move_nothing_else() -> None:
    """`j` and `k` moved a vehicle; `c` would open its menu."""
    async with console(prepare=flight) as c:
        await select(c, "2")
        await c.press("c", "n", "y")
        assert isinstance(c.app.screen, ManualControlScreen)
        await expire(c)
        await c.press("c")
        assert isinstance(c.app.screen, FlyScreen)
        assert "c NOT TAKEN, a question had just closed: flying by hand has ended" in c.told()


async def test_a_question_that_the_operator_closed_keeps_nothing_back() -> None:
    async with console(prepare=flight) as c:
        await select(c, "2")
        await c.press("r", "escape", "c")
        assert isinstance(c.app.screen, OrderMenu)
        assert "NOT TAKEN" not in c.told()
