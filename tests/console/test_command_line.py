"""Lines after `:` in a console: what they select, show and ask, and where they end."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.common import Hold, Note, RunPhase
from tui_gcs.core.protocol.flight import GoTo, Land
from tui_gcs.screens.common.palette_dialog import PaletteDialog
from tui_gcs.screens.orders.order_dialog import OrderDialog
from tui_gcs.screens.plan.plan_screen import PlanScreen

OWN = {
    "low": "select 2-3; altitude",
    "stay": "select all; hold",
    "draw": "plan; fit",
    "halt": "hold all",
    "wrong": "select t77; hold",
    "tour": "select 1-3; show vehicles; show journal; show plan; show fly; select 5-7; altitude 45",
}


def flight(station: FakeStation) -> None:
    station.fly()


async def test_an_own_command_asks_the_same_question_as_typed_words() -> None:
    shown = []
    for line in ("low 40", "select 2-3; altitude 40"):
        async with console(prepare=flight, own_commands=OWN) as c:
            await c.press("colon", *line, "enter")
            assert c.app.feed.selection.ids == (2, 3)
            assert isinstance(c.app.screen, OrderDialog)
            assert c.station.commands() == [], "nothing is sent before the answer"
            shown.append(c.app.screen.text())
            await c.press("y")
            (sent,) = c.station.commands()
            assert isinstance(sent, GoTo) and sent.vehicles == (2, 3)
    assert shown[0] == shown[1]


async def test_without_its_value_the_order_asks_for_it_and_a_wrong_one_is_refused() -> None:
    async with console(prepare=flight, own_commands=OWN) as c:
        await c.press("colon", *"low", "enter")
        assert "[_ " in c.app.screen.text()
        await c.press("escape", "colon", *"low high", "enter")
        assert "height: 'high' is no number" in c.app.screen.text()
        await c.press("enter", "y")
        assert c.station.commands() == []


async def test_a_stop_is_asked_about_in_flight_and_refused_on_the_ground() -> None:
    async with console(prepare=flight, own_commands=OWN) as c:
        await c.press("colon", *"stay", "enter")
        assert isinstance(c.app.screen, OrderDialog) and c.station.commands() == []
        await c.press("enter")
        (sent,) = c.station.commands()
        assert isinstance(sent, Hold) and len(sent.vehicles) == 8
    async with console(own_commands=OWN) as c:
        await c.press("colon", *"stay", "enter")
        assert not isinstance(c.app.screen, OrderDialog)
        assert "stay: ended at 'hold': " in c.told()


async def test_a_selection_that_fails_ends_the_line() -> None:
    async with console(prepare=flight, own_commands=OWN) as c:
        await c.press("1", "enter", "colon", *"wrong", "enter")
        assert "wrong: nothing done: " in c.told()
        assert c.app.feed.selection.ids == (1,)
        assert not isinstance(c.app.screen, OrderDialog), "hold was meant for others than vehicle 1"


async def test_a_screen_is_shown_before_the_next_step() -> None:
    async with console(prepare=flight, own_commands=OWN) as c:
        await c.press("colon", *"draw", "enter")
        assert isinstance(c.app.screen, PlanScreen)


async def test_keys_typed_ahead_wait_for_the_steps() -> None:
    async with console(prepare=flight, own_commands=OWN) as c:
        await c.press("colon", *"low 40", "enter", "y")
        assert [type(request) for request in c.station.commands()] == [GoTo]


async def test_a_read_only_console_selects_but_commands_nothing() -> None:
    async with console(prepare=flight, own_commands=OWN, read_only=True) as c:
        await c.press("colon", *"low 40", "enter")
        assert c.app.feed.selection.ids == (2, 3)
        assert not isinstance(c.app.screen, OrderDialog)
        assert c.station.commands() == []
        await c.press("colon", *"halt", "enter")
        assert isinstance(c.app.screen, PaletteDialog) and "not now: read-only" in c.app.screen.text()


async def test_hold_all_goes_at_once_while_a_command_is_typed() -> None:
    async with console(prepare=flight, own_commands=OWN) as c:
        await c.press("colon", *"low 4", "!", "h")
        assert [type(request) for request in c.station.commands()] == [Hold]


async def test_return_without_a_selection_is_refused_and_never_returns_all() -> None:
    async with console(prepare=flight) as c:
        await c.press("colon", *"return", "enter")
        assert isinstance(c.app.screen, PaletteDialog) and "no vehicle is selected" in c.app.screen.text()
        assert c.station.commands() == []


@pytest.mark.parametrize("typed", ["la", "land", "LAND A"])
async def test_a_part_of_a_name_never_commands_every_vehicle(typed: str) -> None:
    async with console(prepare=flight) as c:
        await c.press("colon", *typed, "enter")
        assert isinstance(c.app.screen, PaletteDialog) and c.station.commands() == []
        assert "land all: every vehicle, at once; Enter again does it" in c.app.screen.text()
        await c.press("enter")
        assert [type(request) for request in c.station.commands()] == [Land]


async def test_a_line_changed_since_its_check_is_refused() -> None:
    """The action string of an entry is all that the palette hands over: it is judged when it is run."""
    async with console(prepare=flight) as c:
        await c.app.run_action("app.command_line('hold; return')")
        await c.settle()
        assert "hold; return: nothing done: 'hold' must be the last step" in c.told()
        await c.app.run_action("app.command_line('add zone')")
        await c.settle()
        assert "add zone: nothing done: this screen has no such action" in c.told()


async def test_a_replay_shows_no_plan() -> None:
    def over(station: FakeStation) -> None:
        station.run = RunPhase.IDLE

    async with console(prepare=over, own_commands=OWN, replay=True) as c:
        await c.press("colon", *"draw", "enter")
        assert not isinstance(c.app.screen, PlanScreen)
        told = [request.text for request in c.station.requests if isinstance(request, Note)]
        assert "draw: nothing done: it is not shown" in told


@pytest.mark.parametrize("size", [NARROW, WIDE], ids=["80x24", "120x40"])
@pytest.mark.parametrize(("name", "typed"), [("own", "low 4"), ("own-long", "tour"), ("own-refused", "stay 3")])
async def test_pictures(name: str, typed: str, size: tuple[int, int]) -> None:
    async with console(size, flight, own_commands=OWN) as c:
        await c.press("colon", *typed)
        assert same_as_snapshot(f"box-palette-{name}-{size[0]}x{size[1]}", c.text())
