"""The parameters screen: search, compare, set, copy, take back, load, save."""

from pathlib import Path

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.services import FetchParams, ParamInfoRow, ParamRow, SetParams

ROWS = (
    ParamRow("ANGLE_MAX", 3000, "int16", 3000, "Maximum lean angle", "cdeg"),
    ParamRow("FENCE_ALT_MAX", 100.0, "real32", 100.0, "Fence maximum altitude", "m"),
    ParamRow("FENCE_ENABLE", 1, "int8", 0, "Fence enable"),
    ParamRow("SYSID_THISMAV", 1, "int16", 1, "MAVLink system id"),
    ParamRow("WPNAV_ACCEL", 250.0, "real32", 250.0, "Way-point acceleration", "cm/s/s"),
    ParamRow("WPNAV_SPEED", 700.0, "real32", 1000.0, "Way-point horizontal [b]speed[/b]", "cm/s"),
)


def known(station: FakeStation) -> None:
    """Eight vehicles on the ground; 3 and 5 have another speed, 7 another fence."""
    for vehicle in range(1, 9):
        rows = {row.name: row for row in ROWS}
        rows["SYSID_THISMAV"] = msgspec.structs.replace(rows["SYSID_THISMAV"], value=vehicle)
        station.params[vehicle] = rows
    for vehicle, name, value in ((3, "WPNAV_SPEED", 500.0), (5, "WPNAV_SPEED", 500.0), (7, "FENCE_ENABLE", 0)):
        rows = station.params[vehicle]
        rows[name] = msgspec.structs.replace(rows[name], value=value)


def names(c: Console) -> list[str]:
    """The names that are listed."""
    return [row.name for row in c.app.screen.parameter_list.rows]


def detail(c: Console) -> str:
    """The panel of the chosen parameter and of the last change, in one line."""
    return " ".join(c.app.screen.detail.text().split())


def sets(c: Console) -> list[SetParams]:
    """What was asked to be set."""
    return [request for request in c.station.requests if isinstance(request, SetParams)]


async def opened(c: Console, *vehicles: int) -> None:
    """The screen with these vehicles selected."""
    await c.press("S", "p")
    c.app.feed.selection.set(vehicles)
    await c.settle()


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_picture(size: tuple[int, int]) -> None:
    async with console(size, known) as c:
        await opened(c, *range(1, 9))
        await c.press("end")
        assert same_as_snapshot(f"parameters-{size[0]}x{size[1]}", c.text())


async def test_search_finds_names_and_meanings_and_keeps_what_was_chosen() -> None:
    async with console(WIDE, known) as c:
        await opened(c)
        await c.press("/", *"fence")
        assert names(c) == ["FENCE_ALT_MAX", "FENCE_ENABLE"]
        await c.press("enter", "down")
        assert c.app.screen.parameter_list.chosen_row.name == "FENCE_ENABLE"
        await c.press("escape")
        assert len(names(c)) == len(ROWS)
        assert c.app.screen.parameter_list.chosen_row.name == "FENCE_ENABLE"
        await c.press("/", *"lean angle", "enter")
        assert names(c) == ["ANGLE_MAX"]


async def test_the_fleet_is_compared_and_only_what_differs_is_listed() -> None:
    async with console(WIDE, known) as c:
        await opened(c)
        await c.press("tab")
        assert names(c) == ["FENCE_ENABLE", "SYSID_THISMAV", "WPNAV_SPEED"]
        await c.press("end")
        assert "3 5: 500" in c.text()
        assert "vehicles 1-2 4 6-8" in c.text()
        await c.press("tab")
        assert "SYSID_THISMAV" in names(c) and "ANGLE_MAX" not in names(c)


async def test_a_value_is_set_on_the_selected_vehicles_after_y_and_taken_back() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, 3, 5)
        await c.press("end", "enter")
        await c.press(*["backspace"] * 10, *"650", "enter")
        assert "700 -> 650" in c.text() and "500 -> 650" in c.text()
        assert sets(c) == []
        await c.press("enter")  # pressed by habit, does nothing
        assert sets(c) == []
        await c.press("y")
        assert sets(c) == [SetParams((1, 3, 5), {"WPNAV_SPEED": 650})]
        assert "set and confirmed on vehicles 1 3 5" in detail(c)
        await c.press("u", "y")
        assert {(r.vehicles, r.values["WPNAV_SPEED"]) for r in sets(c)[1:]} == {((1,), 700.0), ((3, 5), 500.0)}
        assert c.station.params[3]["WPNAV_SPEED"].value == 500.0


async def test_without_a_selection_nothing_is_set() -> None:
    async with console(WIDE, known) as c:
        await opened(c)
        await c.press("enter")
        assert "no vehicle is selected" in c.text()
        await c.press("V", "u")
        assert sets(c) == []


async def test_a_vehicle_that_refuses_is_named_with_its_reason() -> None:
    def refusing(station: FakeStation) -> None:
        known(station)
        station.no_set = {3: "WPNAV_SPEED: must be within 10 to 2000"}

    async with console(WIDE, refusing) as c:
        await opened(c, 1, 3)
        await c.press("end", "enter", *["backspace"] * 10, *"9000", "enter", "y")
        assert "vehicle 3: 0 of 1 set: WPNAV_SPEED: must be within" in detail(c)
        assert "set and confirmed on vehicle 1" in detail(c)


async def test_a_value_beyond_its_range_is_set_only_after_a_second_question() -> None:
    def ranged(station: FakeStation) -> None:
        known(station)
        station.greatest = {"WPNAV_SPEED": 2000}

    async with console(WIDE, ranged) as c:
        await opened(c, 1, 3)
        await c.press("end", "enter", *["backspace"] * 10, *"9000", "enter", "y")
        await c.settle()
        assert "BEYOND THE RANGE: WPNAV_SPEED = 9000: vehicles 1 3" in c.text()
        assert "must be within 0 to 2000" in c.text() and same_as_snapshot("parameters-beyond-range-120x40", c.text())
        await c.press("escape")
        assert "nothing was set" in detail(c) and len(sets(c)) == 1
        assert c.station.params[1]["WPNAV_SPEED"].value == 700.0
        await c.press("enter", *["backspace"] * 10, *"9000", "enter", "y")
        await c.settle()
        await c.press("y")
        assert sets(c)[-1] == SetParams((1, 3), {"WPNAV_SPEED": 9000}, beyond_range=True)
        assert "set and confirmed on vehicles 1 3" in detail(c)
        await c.press("u", "y")
        assert c.station.params[1]["WPNAV_SPEED"].value == 700.0 and sets(c)[-1].beyond_range


async def test_an_armed_vehicle_is_warned_about_and_the_request_says_that_it_is_meant() -> None:
    def flying(station: FakeStation) -> None:
        known(station)
        station.fly()

    async with console(WIDE, flying) as c:
        await opened(c, 2)
        await c.press("end", "enter", *["backspace"] * 10, *"650", "enter")
        assert "ARMED: 2: it takes effect in flight" in c.text()
        await c.press("y")
        assert sets(c) == [SetParams((2,), {"WPNAV_SPEED": 650}, in_flight=True)]


async def test_all_that_differs_is_copied_from_one_to_many_without_identities() -> None:
    async with console(WIDE, known) as c:
        await opened(c, *range(1, 9))
        await c.press("tab", "E", "y")
        assert {(r.vehicles, tuple(r.values.items())) for r in sets(c)} == {
            ((3, 5), (("WPNAV_SPEED", 700.0),)),
            ((7,), (("FENCE_ENABLE", 1),)),
        }
        assert names(c) == ["SYSID_THISMAV"]


async def test_parameters_are_read_from_vehicles_only_when_asked() -> None:
    def unread(station: FakeStation) -> None:
        known(station)
        station.unread, station.params = station.params, {}

    async with console(WIDE, unread) as c:
        await opened(c, 1, 2)
        assert "no parameter is known: R reads them" in c.text()
        await c.press("R")
        assert [r.vehicles for r in c.station.requests if isinstance(r, FetchParams)] == [(1, 2)]
        assert len(names(c)) == len(ROWS)


async def test_a_file_is_saved_and_loaded(tmp_path: Path) -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1)
        file = tmp_path / "one.param"
        await c.press("W", *["backspace"] * 40, *str(file), "enter")
        assert "6 parameters of vehicle 1 written" in detail(c)
        c.app.feed.selection.set((3, 7))
        await c.settle()
        await c.press("i", *str(file), "enter")
        assert "500 -> 700" in c.text() and "0 -> 1" in c.text()
        await c.press("y")
        assert c.station.params[3]["WPNAV_SPEED"].value == 700.0
        assert c.station.params[3]["SYSID_THISMAV"].value == 3


async def test_a_file_that_holds_no_parameters_is_refused_in_one_line(tmp_path: Path) -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1)
        file = tmp_path / "x.param"
        file.write_bytes(b"\x00\xff\x00")
        await c.press("i", *str(file), "enter")
        assert "x.param:" in c.text()
        assert sets(c) == []


async def test_limits_listed_values_and_reboot_are_shown_as_the_vehicle_says() -> None:
    def described(station: FakeStation) -> None:
        known(station)
        station.infos["FENCE_ENABLE"] = ParamInfoRow(
            "FENCE_ENABLE", "Keeps it inside.", least=0, most=1, reboot=True, choices=((0, "off"), (1, "on [/]"))
        )

    async with console(WIDE, described) as c:
        await opened(c)
        await c.press("down", "down")
        assert "1 (on [/]) vehicles 1-6 8 0 (off) vehicle 7" in detail(c)
        assert "from 0 to 1 takes effect after a reboot" in detail(c)
        await c.press("up")
        assert "reboot" not in detail(c)


async def test_favourites_are_listed_alone() -> None:
    async with console(WIDE, known) as c:
        await opened(c)
        await c.press("down", "asterisk", "tab", "tab", "tab")
        assert names(c) == ["FENCE_ALT_MAX"]


async def test_a_read_only_console_changes_nothing() -> None:
    async with console(WIDE, known, read_only=True) as c:
        await opened(c, 1)
        await c.press("enter", "V", "R", "u", "E")
        assert c.station.commands() == []


async def test_an_empty_list_names_what_hides_the_parameters() -> None:
    async with console(WIDE, known) as c:
        await opened(c)
        await c.press("/", *"lean", "enter", "tab")
        assert "none that is differing fits: Esc ends the search, Tab the view" in c.text()
        await c.press("escape", "tab", "tab")
        assert c.line(-1).endswith("Tab all")
        assert "no parameter is a favourite; * marks one: Tab shows others" in c.text()


async def test_a_refusal_for_want_of_a_selection_ends_with_a_selection() -> None:
    async with console(WIDE, known) as c:
        await opened(c)
        await c.press("enter")
        assert "no vehicle is selected" in detail(c)
        await c.press("3", "enter")
        assert "no vehicle is selected" not in detail(c)
        await c.press("enter")
        assert "Enter takes, Esc leaves" in c.text()


async def test_the_next_parameter_is_chosen_when_one_does_not_differ_any_more() -> None:
    async with console(NARROW, known) as c:
        await opened(c, *range(1, 9))
        await c.press("tab")
        assert names(c)[0] == "FENCE_ENABLE"
        await c.press("down", "up", "V", "y")
        assert names(c) == ["SYSID_THISMAV", "WPNAV_SPEED"]
        await c.press("down", "V", "y")
        assert names(c) == ["SYSID_THISMAV"]
        assert c.app.screen.parameter_list.chosen_row.name == "SYSID_THISMAV"
        await c.press("u", "y")
        assert "undo of WPNAV_SPEED = 700: set and confirmed" in detail(c)
