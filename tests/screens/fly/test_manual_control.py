"""Who is flown by hand is seen wherever vehicles are listed: its mode is that of those who fly for a planner."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.widgets.basics.glyphs import ASCII

HERE = (10.0, 20.0, 30.0)
BY_HAND = {"phase": Phase.BY_HAND, "slot": "", "position_m": HERE}


def some_by_hand(station: FakeStation) -> None:
    """3 is on its way, 4 orbits, 5 follows 1, 6 is nudged, 7 has come to where it was sent, 8 stands since take-off."""
    station.fly()
    station.changes = {
        3: BY_HAND | {"goal_m": (10.0, 60.0, 30.0)},
        4: BY_HAND | {"goal_m": (10.0, 60.0, 30.0), "goal_radius_m": 20.0},
        5: BY_HAND | {"slot": ">1"},
        6: BY_HAND | {"velocity_m_s": (1.0, 0.0, 0.0)},
        7: BY_HAND | {"goal_m": (11.0, 21.0, 30.0)},
        8: BY_HAND | {"velocity_m_s": (0.0, 0.0, 0.1)},
    }


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_the_roster_marks_and_counts_vehicles_under_manual_control(size: tuple[int, int]) -> None:
    async with console(size, some_by_hand) as c:
        roster = c.fly.roster.text().splitlines()
        assert ["by hand" in line for line in roster[1:9]] == [False, False, *[True] * 6]
        assert "GUIDED" in roster[1] and "GUIDED" not in roster[3]
        assert str(c.fly.roster.border_title) == "fleet  8   6 by hand"


async def test_a_narrow_title_has_room_for_both_counts() -> None:
    async with console(NARROW, some_by_hand) as c:
        c.app.feed.selection.set((3, 4))
        await c.settle()
        assert "6 by hand, 2 sel of 8" in c.text()


DOES = [(3, "40 m to go"), (4, "orbits"), (5, "follows 1"), (6, "nudged"), (7, "stays there"), (8, "stays there")]


@pytest.mark.parametrize(("vehicle", "does"), DOES)
async def test_the_panels_show_the_order_of_the_selected_vehicle(vehicle: int, does: str) -> None:
    async with console(WIDE, some_by_hand) as c:
        c.app.feed.selection.set((vehicle,))
        await c.settle()
        assert f"GUIDED  ARMED  by hand: {does}" in c.fly.selected_panel.text()
        await c.press("v")
        assert f"GUIDED  ARMED  by hand: {does}" in c.app.screen.beside.text()
    async with console(NARROW, some_by_hand) as c:
        c.app.feed.selection.set((vehicle,))
        await c.settle()
        assert f"GUIDED by hand, {does}" in c.text(), "not cut"
        await c.press("v")
        assert f"GUIDED  ARMED  by hand: {does}" in c.text()


async def test_the_table_and_the_cells_of_the_vehicles_screen_show_it_by_word_and_by_shape() -> None:
    async with console(NARROW, some_by_hand) as c:
        await c.press("v")
        assert c.app.screen.table.text().count("by hand") == 6
        await c.press("tab")
        cells = c.app.screen.grid.text()
        assert " ◉  3 by hand" in cells and " ▲  2 GUIDED" in cells
        assert "▲ flying  ◉ by hand  △ armed on ground  ◇ disarmed  × lost" in c.text()


async def test_among_250_and_without_unicode_the_shape_is_left() -> None:
    def many(station: FakeStation) -> None:
        some_by_hand(station)
        station.count = 250

    async with console(NARROW, many, glyphs=ASCII) as c:
        await c.press("v")
        assert " h  3 " in c.app.screen.grid.text() and " ^  2 " in c.app.screen.grid.text()


async def test_the_word_can_be_searched_and_sorted_by() -> None:
    async with console(WIDE, some_by_hand) as c:
        await c.press("v", "/", *"hand", "enter")
        assert c.app.screen.table.ids() == (3, 4, 5, 6, 7, 8)
        await c.press("escape", *[">"] * 3, "*")  # by mode, falling
        assert c.app.screen.table.ids() == (3, 4, 5, 6, 7, 8, 1, 2)


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_a_vehicle_on_its_mission_is_not_shown_as_holding(size: tuple[int, int]) -> None:
    """Flown on real autopilots: HOLD stood over two that flew their missions at 8 m/s, `taken out` by an order."""

    def on_board(station: FakeStation) -> None:
        station.fly()
        station.run = RunPhase.HOLD
        station.changes = {v: {"phase": Phase.TAKEN_OUT, "mode": "AUTO"} for v in range(1, 9)}

    async with console(size, on_board) as c:
        await c.tick()
        assert "HOLD" not in c.line(0) and "by hand" in c.line(0)
        c.app.feed.selection.set((3,))
        await c.settle()
        assert ("AUTO by itself" if size == NARROW else "AUTO  ARMED  by itself") in c.text()
        c.station.changes[4] = {"phase": Phase.HOLDING}
        await c.tick()
        assert "HOLD" in c.line(0)
