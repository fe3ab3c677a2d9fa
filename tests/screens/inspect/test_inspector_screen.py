"""The inspector: what is listed, fields with units and names, freeze, bytes, copy, rates, what was dropped."""

import pytest
from msgspec.structs import replace

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.inspection import (
    FieldRow,
    GetMessages,
    Inspection,
    MessageDetail,
    MessageKey,
    MessageRow,
    SetMessageRate,
    SourceRow,
)

LINK, ADDRESS = "udpin:127.0.0.1:14550", "127.0.0.1:40001"
NAMES = {0: "HEARTBEAT", 24: "GPS_RAW_INT", 30: "ATTITUDE", 33: "GLOBAL_POSITION_INT", 253: "STATUSTEXT"}
HERTZ = {0: 1, 24: 1, 30: 4, 33: 10, 253: 0}


def key(system: int, msgid: int, component: int = 1) -> MessageKey:
    return MessageKey("", LINK, ADDRESS, system, component, msgid)


def row(vehicle: int, msgid: int, **other: object) -> MessageRow:
    usual = MessageRow(
        key(vehicle, msgid), NAMES[msgid], vehicle, 100, 0.1, 40, signed=False, version=2, autopilot=True, used=True
    )
    return replace(usual, **other)


def heard(station: FakeStation) -> None:
    """Two vehicles, a camera, and a stranger; a sender of noise."""
    rows = [row(vehicle, msgid) for vehicle in (1, 2) for msgid in NAMES]
    rows[4] = replace(rows[4], age_s=73.0)
    rows.append(row(1, 0, key=key(1, 0, 100), autopilot=False))
    rows.append(row(0, 0, key=key(77, 0), used=False))
    source = SourceRow("", LINK, ADDRESS, 2, 1000, 40, 0, 3, ("ATTITUDE 3",), 0)
    station.inspection = Inspection(station.t_s, tuple(rows), (source,))
    station.dropped = {"our own system id": 7}
    station.details[24] = MessageDetail(
        key(1, 24),
        (
            FieldRow("time_usec", "uint64_t", 12_000_000),
            FieldRow("lat", "int32_t", 520_720_000),
            FieldRow("eph", "uint16_t", 65_535),
            FieldRow("fix_type", "uint8_t", 3),
        ),
        bytes.fromhex("fd1e0000070101180000") + bytes(range(32)),
    )
    station.details[0] = MessageDetail(
        key(1, 0), (FieldRow("base_mode", "uint8_t", 0x81), FieldRow("custom_mode", "uint32_t", 4)), b"\xfd\x09"
    )
    station.details[253] = MessageDetail(
        key(1, 253), (FieldRow("text", "char[50]", "␛]52;c;aGk=␇ [red]off[/]"),), b"\xfd\x02\x1b]"
    )


def grow(station: FakeStation, seconds: float) -> None:
    """Frames go on coming."""
    assert station.inspection is not None
    rows = tuple(replace(r, count=r.count + round(HERTZ[r.key.msgid] * seconds)) for r in station.inspection.rows)
    station.inspection = replace(station.inspection, rows=rows)


async def look(c: Console, seconds: float = 0.0) -> None:
    """Time passes, and the screen asks again."""
    grow(c.station, seconds)
    c.station.tick(seconds)
    c.clock.advance(seconds)
    c.app.screen.look()
    await c.settle()


async def opened(c: Console, *vehicles: int) -> None:
    await c.press("S", "i")
    c.app.feed.selection.set(vehicles)
    await look(c, 2.0)
    await look(c, 2.0)


async def choose(c: Console, name: str) -> None:
    """The first row of that message, by keys."""
    await c.press("escape", "/", *name, "enter", "home")
    await look(c)


def names(c: Console) -> list[tuple[int, str]]:
    return [(each.row.vehicle, each.row.name) for each in c.app.screen.message_list.rows]


def panel(c: Console) -> str:
    return " ".join(c.app.screen.panel.text().split())


def rates(c: Console) -> list[SetMessageRate]:
    return [request for request in c.station.requests if isinstance(request, SetMessageRate)]


def looks(c: Console) -> int:
    return sum(isinstance(request, GetMessages) for request in c.station.requests)


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_picture(size: tuple[int, int]) -> None:
    async with console(size, heard) as c:
        await opened(c)
        await choose(c, "gps")
        await c.press("escape")
        assert same_as_snapshot(f"inspector-{size[0]}x{size[1]}", c.text())


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_picture_of_what_was_dropped(size: tuple[int, int]) -> None:
    async with console(size, heard) as c:
        await opened(c)
        await c.press("tab")
        assert same_as_snapshot(f"inspector-dropped-{size[0]}x{size[1]}", c.text())


async def test_everything_is_listed_and_the_selection_narrows_it() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        assert len(names(c)) == 12
        assert names(c)[-1] == (0, "HEARTBEAT")  # the stranger, last
        c.app.feed.selection.set((2,))
        await look(c)
        assert {vehicle for vehicle, _ in names(c)} == {2}


async def test_rates_are_measured_from_two_answers() -> None:
    async with console(WIDE, heard) as c:
        await c.press("S", "i")
        await look(c)
        assert "--" in c.text()
        await look(c, 2.0)
        found = {each.row.name: each.rate_hz for each in c.app.screen.message_list.rows if each.row.vehicle == 2}
        assert found == {"HEARTBEAT": 1, "GPS_RAW_INT": 1, "ATTITUDE": 4, "GLOBAL_POSITION_INT": 10, "STATUSTEXT": 0}


async def test_fields_have_units_and_names() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await choose(c, "gps")
        assert "lat 520720000 degE7 52.0720000 deg" in panel(c)
        assert "fix_type 3 3D_FIX" in panel(c)
        assert "eph 65535" in panel(c)
        await choose(c, "heartbeat")
        assert "base_mode 129 CUSTOM_MODE_ENABLED | SAFETY_ARMED" in panel(c)


async def test_a_frame_as_bytes() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await choose(c, "gps")
        await c.press("x")
        assert "000 fd 1e 00 00 07 01 01 18" in panel(c)
        await c.press("x")
        assert "fix_type" in panel(c)


async def test_the_filter_takes_vehicle_component_and_link() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await c.press("/", *"v2 att", "enter")
        assert names(c) == [(2, "ATTITUDE")]
        await c.press("/", *["backspace"] * 9, *"c100", "enter")
        assert names(c) == [(1, "HEARTBEAT")]
        await c.press("escape", "/", *"stranger", "enter")
        assert names(c) == [(0, "HEARTBEAT")]
        await c.press("/", "escape")
        assert len(names(c)) == 12


async def test_nothing_is_asked_while_another_screen_is_shown_or_the_picture_is_frozen() -> None:
    async with console(WIDE, heard) as c:
        assert looks(c) == 0
        await opened(c)
        await c.press("z")
        frozen = looks(c)
        await look(c, 1.0)
        assert looks(c) == frozen and "FROZEN" in c.text()
        await c.press("z")
        assert looks(c) > frozen and "FROZEN" not in c.text()
        screen = c.app.screen
        await c.press("f")
        left = looks(c)
        screen.look()
        await c.settle()
        assert looks(c) == left


async def test_what_is_shown_goes_to_the_clipboard() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await choose(c, "gps")
        await c.press("y")
        assert "fix_type" in c.app.clipboard and "GPS_RAW_INT 24" in c.app.clipboard
        assert "235 bytes copied to the terminal's clipboard: 6 lines" in panel(c)
        await c.press("x", "y")
        assert c.app.clipboard.startswith("fd 1e 00")


async def test_the_fields_take_the_whole_screen_and_scroll() -> None:
    def long(station: FakeStation) -> None:
        heard(station)
        fields = tuple(FieldRow(f"field_{n}", "int8_t", n) for n in range(40))
        station.details[24] = replace(station.details[24], fields=fields)

    async with console(NARROW, long) as c:
        await opened(c)
        await choose(c, "gps")
        assert "field_39" not in panel(c)
        await c.press(*["right_square_bracket"] * 20)
        assert "field_39" in panel(c)
        await c.press("enter", *["left_square_bracket"] * 20)
        assert "field_15" in panel(c) and not c.app.screen.message_list.display
        await c.press("enter")
        assert c.app.screen.message_list.display


async def test_a_rate_is_asked_of_the_vehicle_of_the_row() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await choose(c, "att")
        await c.press("R", *"20", "enter")
        assert rates(c) == [SetMessageRate((1,), 30, 20.0)]
        assert "ATTITUDE at 20 Hz: agreed by vehicle 1" in panel(c)
        await c.press("R", *"auto", "enter")
        assert rates(c)[-1] == SetMessageRate((1,), 30, None)


async def test_a_rate_is_asked_of_all_selected_vehicles() -> None:
    async with console(WIDE, heard) as c:
        await opened(c, 1, 2)
        await choose(c, "att")
        await c.press("R", *"0", "enter")
        assert rates(c) == [SetMessageRate((1, 2), 30, 0.0)]


async def test_what_the_station_doubts_is_asked_again_and_left_by_esc() -> None:
    def doubtful(station: FakeStation) -> None:
        heard(station)
        station.doubts = "it needs 5000 B/s more, and 300 of 2822 B/s are left on radio"

    async with console(WIDE, doubtful) as c:
        await opened(c)
        await choose(c, "att")
        await c.press("R", *"100", "enter")
        assert "2822 B/s are left" in c.text()
        await c.press("enter", "escape")
        assert [request.sure for request in rates(c)] == [False]
        await c.press("R", *"100", "enter", "y")
        assert rates(c)[-1] == SetMessageRate((1,), 30, 100.0, sure=True)


async def test_a_refusal_is_shown_with_its_vehicle_and_reason() -> None:
    def refusing(station: FakeStation) -> None:
        heard(station)
        station.no_set = {1: "refused: unsupported"}

    async with console(WIDE, refusing) as c:
        await opened(c)
        await choose(c, "att")
        await c.press("R", *"20", "enter")
        assert "vehicle 1: NOT SET: refused: unsupported" in panel(c)


async def test_what_is_no_rate_and_other_senders_are_refused_here() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await choose(c, "att")
        for typed in ("fast", "-1", "nan", "500"):
            await c.press("R", *typed, "enter")
            assert "is no rate" in panel(c)
        await c.press("escape", "/", *"c100", "enter", "R")
        assert "only autopilots are asked" in panel(c)
        await c.press("escape", "/", *"stranger", "enter", "R")
        assert "no vehicle's" in panel(c)
        assert rates(c) == []


async def test_a_read_only_console_looks_and_asks_for_nothing() -> None:
    async with console(WIDE, heard, read_only=True) as c:
        await opened(c)
        await choose(c, "att")
        assert len(names(c)) == 2
        await c.press("R")
        assert "read-only" in panel(c)
        assert c.station.commands() == []


async def test_what_grows_is_marked_among_what_was_dropped() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await c.press("tab")
        assert "7" in c.text() and "our own system id" in c.text()
        assert "frames with a wrong CRC" in c.text() and "(ATTITUDE 3)" in c.text()
        c.station.dropped = {"our own system id": 17}
        await c.tick(1.0)
        await look(c, 1.0)
        first = c.app.screen.dropped_list.rows[0]
        assert first.reason == "our own system id" and first.per_s > 0


async def test_text_of_a_vehicle_is_text() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        await choose(c, "statustext")
        assert "[red]off[/]" in panel(c)
        assert "\x1b" not in c.text()


async def test_a_silent_station_is_said_and_not_asked() -> None:
    async with console(WIDE, heard) as c:
        await opened(c)
        c.station.silent = True
        c.clock.advance(5.0)
        c.app.feed.check()
        await c.settle()
        if c.app.feed.station_lost:
            asked = looks(c)
            await look(c, 0.5)
            assert looks(c) == asked
        assert c.app.feed.station_lost and "STATION SILENT" in c.text()


async def test_the_palette_finds_the_screen_by_its_name() -> None:
    async with console(WIDE, heard) as c:
        await c.press(":", *"inspector", "enter")
        assert c.app.current_mode == "inspector"
        await c.press(":", *"param", "enter")
        assert c.app.current_mode == "parameters"
