"""The vehicles screen: grid, table, filter, and all about the one that is looked at."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation, trouble
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.widgets.basics.glyphs import ASCII
from tui_gcs.widgets.basics.palette import Ink


def fleet_of(count: int) -> object:
    """So many in the air, a few in trouble."""

    def prepare(station: FakeStation) -> None:
        station.fly()
        station.count = count
        for vehicle in range(1, count + 1):
            station.changes[vehicle] = {"battery_pct": 80.0}
        station.changes[5] = {"freshness": Freshness.LOST, "heard_age_s": 12.4, "age_s": 12.4}
        station.changes[count] = {"battery_pct": 12.0}

    return prepare


async def opened(c: Console, *keys: str) -> list[str]:
    """The lines of the screen after v and these keys; who is looked at is told."""
    await c.press("v", *keys)
    c.app.screen.request_details()
    await c.settle()
    return c.text().splitlines()


async def test_250_vehicles_are_in_view_at_80x24_each_with_shape_and_level() -> None:
    async with console(NARROW, fleet_of(250)) as c:  # type: ignore[arg-type]
        lines = await opened(c)
        cells = "\n".join(line.ljust(80) for line in lines[2:18])
        assert all(f"{vehicle:>3}" in cells for vehicle in range(1, 251))
        assert "!×  5" in cells and "!▲250" in cells and " ▲  6" in cells
        assert lines[18].startswith(" !LST 5  !BAT 250")
        inks = {text.strip(): ink for line in c.app.screen.grid._lines for text, ink in line}
        assert (inks["▲  6"], inks["!▲250"]) == (Ink.TEXT, Ink.WARNING)


async def test_a_table_of_250_shows_that_more_lines_follow() -> None:
    async with console(NARROW, fleet_of(250)) as c:  # type: ignore[arg-type]
        await opened(c, "tab")
        assert "0 more above" in c.text() and "more below: arrows" in c.text()
        await c.press("N")
        table = c.app.screen.table.text().splitlines()
        assert "250 BAT" in table[-2] and table[-1].endswith("0 more below: arrows")


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(("name", "count"), [("table", 8), ("grid", 120)])
async def test_picture(size: tuple[int, int], name: str, count: int) -> None:
    async with console(size, fleet_of(count)) as c:  # type: ignore[arg-type]
        await opened(c, "n", "n", "n", "n", "n")
        assert same_as_snapshot(f"vehicles-{name}-{size[0]}x{size[1]}", c.text())


async def test_table_sorts_by_any_column_and_unknown_comes_last() -> None:
    async with console(WIDE, trouble) as c:
        c.station.changes[2] = {"battery_pct": float("nan")}
        await c.tick()
        lines = await opened(c)  # eight fit: a table at once
        assert "CAUSE" in lines[2]
        assert "LST" in lines[7] and "LOST 12s" in lines[7] and "55.0" not in lines[7]
        await c.press(*[">"] * 6)
        assert c.app.screen.table.ids() == (7, 8, 6, 5, 4, 3, 1, 2)
        await c.press("*")
        assert c.app.screen.table.ids() == (1, 3, 4, 5, 6, 8, 7, 2)
        await c.press(*["<"] * 5)  # by cause: the gravest first
        assert c.app.screen.table.ids()[:2] == (5, 7)
        await c.press("tab")
        assert "!×  5 LST" in c.text()


async def test_filter_takes_letters_that_are_keys_elsewhere_and_escape_ends_it() -> None:
    async with console(WIDE, trouble) as c:
        await opened(c, "/", *"attack s")
        assert "filter: attack s_" in c.text()
        assert c.station.commands() == []
        await c.press("backspace", "backspace", "enter", "n")
        assert c.app.screen.table.ids() == (5, 6, 7, 8)
        assert c.app.feed.selection.ids == (5,)
        await c.press("/", *" lst", "enter")
        assert c.app.screen.table.ids() == (5,)
        await c.press("escape")
        assert len(c.app.screen.table.ids()) == 8


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_all_details_of_the_selected_vehicle(size: tuple[int, int]) -> None:
    async with console(size, trouble) as c:
        text = "\n".join(await opened(c, "2", "enter"))
        for value in ("15.4 V", "81 %", "~11 min", "22.1 A", "3D12 ±0.8 m", "0.21 compass", "roll -2° pitch +5°"):
            assert value in text
        for value in ("m rel", "amsl", "8.0 m/s  hdg", "home", "mission 3/12", "slot", "wind --"):
            assert value in text
        if size == WIDE:
            assert "4.7.0-dev" in text and "0123456789abcdef01234567" in text and "rtt 12 ms" in text
        text = "\n".join(await opened(c, "5", "enter"))
        assert "LOST, last heard 12 s ago" in text and "15.4 V" not in text
        c.station.changes[3] = {"armed": False}
        await c.tick()
        text = "\n".join(await opened(c, "3", "enter"))
        assert "check PreArm: Compass not healthy" in text


async def test_values_of_another_vehicle_are_never_shown() -> None:
    async with console(WIDE, trouble) as c:
        await opened(c, "2", "enter")
        c.station.silent = True
        await c.press("n")  # the station does not tell of this one
        assert "vehicle 3" in c.text() and "0.21 compass" not in c.text()


async def test_nothing_is_known_of_a_silent_station() -> None:
    async with console(WIDE, trouble) as c:
        await opened(c, "2", "enter")
        c.station.silent = True
        c.clock.advance(4.0)
        c.app.feed.check()
        await c.pilot.pause()
        assert "GUIDED" not in c.text() and "no vehicle here" in c.text()


async def test_ascii_grid_has_only_ascii() -> None:
    async with console(NARROW, fleet_of(40), glyphs=ASCII) as c:  # type: ignore[arg-type]
        assert "\n".join(await opened(c)).isascii()


@pytest.mark.parametrize(("count", "shown"), [(8, True), (120, True), (240, True), (250, False)])
async def test_firmware_and_hardware_of_the_selected_vehicle_stand_below_the_cells(count: int, shown: bool) -> None:
    """They are the first to go where all vehicles would not be in view."""
    async with console(NARROW, fleet_of(count)) as c:  # type: ignore[arg-type]
        lines = await opened(c, "3", "enter", *["tab"] * (count == 8))
        assert any(line.startswith("loss 0.0 %") and "fw 4.7.0-dev" in line for line in lines) is shown
        cells = c.app.screen.grid.text()
        assert all(f"{vehicle:>3}" in cells for vehicle in range(1, count + 1))
        assert c.app.screen.grid.size.height == (16 if count == 250 else 15)
