"""The keys of the map and of the display, and a terminal that stops reading."""

import asyncio
from pathlib import Path

import msgspec
import pytest
from rich.color import ColorSystem

from tests.rigs.base_maps import base_map_file, write_mbtiles
from tests.screens.rigs.console import NARROW, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.meter import metered
from tests.widgets.map.test_map_more import PLANE as ANYWHERE
from tui_gcs.core.formats.base_map_files import read_base_map
from tui_gcs.screens.common.layers_dialog import LayersDialog
from tui_gcs.terminal.private import diff_app
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_layers import Layer

PLANE = msgspec.structs.replace(ANYWHERE, lat_deg=52.0735, lon_deg=-0.6235)


def flight(station: FakeStation) -> None:
    station.fly()


async def test_keys_of_the_map_change_the_view_and_command_nothing() -> None:
    async with console(NARROW, flight) as c:
        view = c.fly.map_view
        await c.press("n", "x")
        before = view.cursor_m
        await c.press("right", "up", "X", "right")
        assert view.cursor_m[0] > before[0]
        assert view.cursor_m[1] > before[1]
        assert "from +:" in c.text()
        await c.press("x", "g", "D", "T", "ctrl+l")
        assert view.cursor_m is None
        assert Layer.GRID not in view.content.hidden
        assert view.glyphs.dots == "blocks"
        assert c.app.display_theme == "night"
        await c.press("L", "2", "9", "0")
        assert isinstance(c.app.screen, LayersDialog)
        assert Layer.TRAILS in view.content.hidden
        assert Layer.TEAMS not in view.content.hidden
        await c.press("escape")
        assert c.app.screen is c.fly
        assert c.station.commands() == []


async def test_a_base_map_is_switched_by_keys_and_stays_on_each_map_of_the_console(tmp_path: Path) -> None:
    async with console(NARROW, flight, base_map=read_base_map(base_map_file(tmp_path))) as c:
        fly = c.fly

        async def shown() -> set[int]:
            """The inks of the base map on the present screen, once all of its tiles are read."""
            view = c.app.screen.map_view
            while (thread := view.content.base_map._thread) is not None:
                await asyncio.to_thread(thread.join)
            await c.settle()
            return set(view._cells.inks.flat) & {Ink.WATER, Ink.ROAD, Ink.BUILDING, Ink.CONTOUR}

        assert Ink.WATER in await shown()
        await c.press("L")
        assert "b [x] base map  " in c.text()
        await c.press("b", "escape")
        assert await shown() == set()
        await c.press("L", "b", "escape")
        await c.press("p")
        assert c.app.screen is not fly and Ink.WATER in await shown()
        await c.press("f", "plus")
        assert c.app.screen is fly and Ink.WATER in await shown()
        assert c.station.commands() == []


async def test_the_layers_say_why_no_base_map_is_seen(tmp_path: Path) -> None:
    elsewhere = write_mbtiles(tmp_path / "elsewhere", b"", zooms=range(5, 6))
    async with console(NARROW, flight, base_map=read_base_map(elsewhere)) as c:
        while (thread := c.fly.map_view.content.base_map._thread) is not None:
            await asyncio.to_thread(thread.join)
        await c.settle()
        await c.press("L")
        assert "b [x] base map: nothing here" in c.text()


async def test_traffic_that_the_station_hears_of_comes_onto_the_map() -> None:
    async with console(NARROW, flight) as c:
        c.station.traffic = (PLANE,)
        await c.tick(2.5)
        await c.settle()
        assert "*KLM123 +120m" in c.text()
        assert c.station.commands() == []


async def test_a_terminal_that_does_not_read_gets_a_whole_picture_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    async with metered(8, ColorSystem.TRUECOLOR, size=NARROW) as meter:
        stalled = True
        monkeypatch.setattr(diff_app, "lagging", lambda driver: stalled)
        assert (await meter.fly(1.0))[0] == 0
        stalled = False
        meter.app._catch_up()
        await meter.painted()
        assert sum(map(len, meter.written)) > 0
        whole = "".join(meter.written[-2:])
        assert "swarm-challenge" in whole
        assert "GUIDED" in whole


async def test_a_picture_of_the_screen_has_the_colours_of_its_theme() -> None:
    async with console(NARROW) as c:
        assert "#101418" in c.app.export_screenshot()
        await c.press("T")
        picture = c.app.export_screenshot()
        assert "#101418" not in picture and "#d70000" in picture
