"""The plots screen: values are found by words, plotted live, frozen, read at the cursor, and kept as views."""

import math
from pathlib import Path

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.inspection import GetValues, Inspection, MessageKey, MessageRow
from tui_gcs.feed.plots.plot_layout import MAX_PANES
from tui_gcs.screens.plots.live_plots_screen import LivePlotsScreen
from tui_gcs.widgets.basics.glyphs import ASCII


def flying(station: FakeStation) -> None:
    """Eight vehicles patrol; the first one sends ATTITUDE, and one of its parameters is known."""
    station.fly()
    key = MessageKey("", "udpin:127.0.0.1:14550", "127.0.0.1:40001", 1, 1, 30)
    row = MessageRow(key, "ATTITUDE", 1, 100, 0.1, 40, False, 2, True, True)
    station.inspection = Inspection(station.t_s, (row,), ())
    station.params = {1: {"WPNAV_SPEED": s.ParamRow("WPNAV_SPEED", 500.0, "REAL32", text="Speed", units="cm/s")}}
    station.values = {"ATTITUDE.roll": math.pi / 4, "WPNAV_SPEED": 500.0}


async def opened(c: Console, *keys: str, ticks: int = 0) -> None:
    await c.press("S", "g", *keys)
    for _ in range(ticks):
        await c.tick(1.0)
    if isinstance(c.app.screen, LivePlotsScreen):
        c.app.screen.draw_on()
    await c.settle()


def typed(words: str) -> list[str]:
    return ["slash", *("space" if letter == " " else letter for letter in words), "enter", "escape"]


def asked(c: Console) -> list[GetValues]:
    return [request for request in c.station.requests if isinstance(request, GetValues)]


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(
    ("view", "keys"),
    [("empty", []), ("two", [*typed("v1-4 battery %"), *typed("v2 heading")]), ("search", ["slash", *"idle"])],
)
async def test_pictures(view: str, keys: list[str], size: tuple[int, int]) -> None:
    async with console(size, flying) as c:
        await opened(c, *keys, ticks=40 if view == "two" else 1)
        assert same_as_snapshot(f"plots-{view}-{size[0]}x{size[1]}", c.text())


async def test_ascii_picture() -> None:
    async with console(NARROW, flying, glyphs=ASCII) as c:
        await opened(c, *typed("v1-4 battery %"), *typed("v2 heading"), ticks=40)
        assert c.text().isascii()
        assert same_as_snapshot("plots-ascii-80x24", c.text())


async def test_a_value_of_all_vehicles_is_found_by_words_and_unit() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("volt"), ticks=3)
        pane = c.app.screen.plan.pane
        assert [value.label for value in pane.values] == [f"v{v} voltage" for v in range(1, 9)]
        assert "15.4" in c.text() and "h v8" in c.text()


async def test_values_of_the_selected_vehicles_are_meant() -> None:
    async with console(WIDE, flying) as c:
        c.app.feed.selection.set((2, 5))
        await opened(c, *typed("altitude"))
        assert [value.subject for value in c.app.screen.plan.pane.values] == [2, 5]


async def test_vehicles_can_be_named_in_the_search() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v3,7 climb m/s"))
        assert [value.label for value in c.app.screen.plan.pane.values] == ["v3 climb", "v7 climb"]


async def test_the_same_choice_again_removes_it() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, "slash", *"v3", "space", *"climb", "enter", "enter")
        assert "climb is not shown any more" in c.text()
        await c.press("escape")
        assert not c.app.screen.plan.values


async def test_another_unit_gets_a_pane_of_its_own() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 altitude"), *typed("v1 voltage"), *typed("v2 altitude"))
        assert [[value.label for value in pane.values] for pane in c.app.screen.plan.panes] == [
            ["v1 altitude", "v2 altitude"],
            ["v1 voltage"],
        ]


async def test_fields_of_messages_are_asked_for_and_shown_in_usual_units() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 attitude.roll"))
        c.app.screen.ask()
        await c.settle()
        assert asked(c)[-1].keys[0].name == "ATTITUDE.roll"
        value = c.app.screen.plan.values[0]
        assert value.unit == "deg" and c.app.recorder.series(value).last == pytest.approx(45.0)


async def test_parameters_are_found_by_their_description() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 wpnav cm/s"))
        c.app.screen.ask()
        await c.settle()
        assert c.app.recorder.series(c.app.screen.plan.values[0]).last == 500.0


async def test_metrics_of_a_team_are_plotted() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("worst idleness"), ticks=3)
        value = c.app.screen.plan.values[0]
        assert value.unit == "s" and c.app.recorder.series(value).last == 24.1


async def test_a_plot_begins_before_it_was_asked_for() -> None:
    async with console(WIDE, flying) as c:
        for _ in range(20):
            await c.tick(1.0)
        await opened(c, *typed("v1 battery"))
        times_s, _ = c.app.recorder.series(c.app.screen.plan.values[0]).points()
        assert times_s[-1] - times_s[0] > 15.0


async def test_a_frozen_picture_stays_and_goes_on() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), "z", ticks=3)
        before = c.app.screen.span()
        for _ in range(70):
            await c.tick(1.0)
        c.app.screen.draw_on()
        assert c.app.screen.span() == before and "FROZEN" in c.text()
        await c.press("z")
        assert c.app.screen.span()[1] > before[1] and "FROZEN" not in c.text()


async def test_a_live_window_moves_by_a_quarter_at_once() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), ticks=2)
        ends = set()
        for _ in range(31):
            await c.tick(1.0)
            ends.add(c.app.screen.span()[1])
        assert len(ends) <= 4 and all(end % 15.0 == 0.0 for end in ends)


async def test_the_cursor_shows_the_values_at_its_time_and_freezes() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), ticks=5)
        c.station.changes[1] = {"battery_pct": 40.0}
        for _ in range(5):
            await c.tick(1.0)
        await c.press("x")
        assert "AT" in c.text() and "    40 " in c.text()
        await c.press(*["left"] * 12)
        assert "    82 " in c.text() and c.app.screen.is_frozen
        await c.press("escape")
        assert "AT    MIN" not in c.text()


async def test_the_window_is_made_longer_and_shorter() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), "left_square_bracket", ticks=2)
        from_s, to_s = c.app.screen.span()
        assert to_s - from_s == 30.0
        await c.press(*["right_square_bracket"] * 20)
        assert "whole flight" in c.text()
        assert c.app.screen.span()[0] == pytest.approx(100.1)


async def test_pages_go_back_and_the_newest_comes_again() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), ticks=2)
        before = c.app.screen.span()
        await c.press("pageup")
        assert c.app.screen.span() == (before[0] - 30.0, before[1] - 30.0)
        await c.press("pagedown")
        assert c.app.screen.span() == before and c.app.screen.is_frozen
        await c.press("end")
        assert not c.app.screen.is_frozen


async def test_panes_are_added_chosen_enlarged_and_removed() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), "plus", *typed("v1 voltage"))
        screen = c.app.screen
        assert screen.plan.chosen == 1
        await c.press("up", "enter")
        assert [pane.display for pane in screen.panes][:2] == [True, False]
        await c.press("enter", "down", "delete")
        assert [pane.unit for pane in screen.plan.panes] == ["%"]
        await c.press(*["plus"] * 9)
        assert len(screen.plan.panes) == MAX_PANES and "Del removes one" in c.text()


async def test_a_view_is_saved_shown_again_and_removed(tmp_path: Path) -> None:
    async with console(WIDE, flying) as c:
        c.app.options = c.app.options.__class__(folder=tmp_path, glyphs=c.app.options.glyphs)
        await opened(c, *typed("v1-3 battery"), *typed("v2 heading"), "W", *"power", "enter")
        assert "view power is saved" in c.text()
        await c.press("delete", "delete", "i", "enter")
        assert [value.label for value in c.app.screen.plan.values][-1] == "v2 heading"
        assert (tmp_path / "plot-views.json").exists()
        await c.press("i", "delete")
        assert "no view is saved yet" in c.text()


async def test_nothing_to_save_is_said() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, "W")
        assert "there is nothing to save" in c.text()


async def test_numbers_are_copied() -> None:
    async with console(WIDE, flying) as c:
        copied: list[str] = []
        c.app.copy_to_clipboard = copied.append
        await opened(c, *typed("v1 battery"), ticks=2)
        await c.press("y")
        assert "battery" in copied[0] and "82" in copied[0]


async def test_nothing_is_asked_while_another_screen_is_shown() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 attitude.roll"))
        screen = c.app.screen
        await c.press("f")
        count = len(asked(c))
        screen.ask()
        await c.settle()
        assert len(asked(c)) == count


async def test_a_read_only_console_plots(tmp_path: Path) -> None:
    async with console(WIDE, flying, read_only=True) as c:
        await opened(c, *typed("v1 attitude.roll"))
        c.app.screen.ask()
        await c.settle()
        assert asked(c) and c.station.commands() == []


async def test_without_a_vehicle_it_says_so() -> None:
    def alone(station: FakeStation) -> None:
        station.count = 0

    async with console(WIDE, alone) as c:
        await opened(c, "slash", *"altitude", "enter")
        assert "there is no vehicle yet" in c.text()


async def test_a_silent_vehicle_leaves_a_gap() -> None:
    async with console(WIDE, flying) as c:
        await opened(c, *typed("v1 battery"), ticks=2)
        c.station.changes[1] = {"freshness": "lost"}
        await c.tick(1.0)
        assert math.isnan(c.app.recorder.series(c.app.screen.plan.values[0]).last)


async def test_hostile_numbers_and_names_are_shown_safely() -> None:
    def hostile(station: FakeStation) -> None:
        flying(station)
        station.metrics = {"\x1b[31mred\x07_m": 1e308, "[b]bold[/b]": -1e308, "inf": math.inf}
        station.changes[1] = {"battery_v": 3.4e38}
        station.changes[2] = {"battery_v": math.inf}

    async with console(NARROW, hostile) as c:
        await opened(c, *typed("v1,2 voltage"), *typed("red"), *typed("bold"), *typed("inf"), ticks=3)
        text = c.text()
        assert "\x1b" not in text and "\x07" not in text and "3.4e38" in text


async def test_the_palette_finds_the_screen() -> None:
    async with console(WIDE, flying) as c:
        await c.press(":", *"plots", "enter")
        assert c.app.current_mode == "plots"
