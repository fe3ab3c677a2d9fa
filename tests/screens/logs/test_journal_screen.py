"""The journal screen: follow, filters, older lines from the station's journal."""

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import WALL_START_S, FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.common import EventClass, JournalEvent
from tui_gcs.core.protocol.event_scope import concerns


def told(station: FakeStation) -> None:
    """Three hundred lines of an earlier start, and a few of this one."""
    station.fly()
    station.old_events = [
        JournalEvent(
            seq=seq,
            t_s=1.0 * seq,
            wall_s=WALL_START_S - 1000.0 + seq,
            cls=EventClass.VEHICLE,
            severity=4 if seq % 100 == 7 else 6,
            source=f"vehicle {seq % 8 + 1}",
            text=f"old line {seq}",
        )
        for seq in range(300)
    ]
    station.event("GPS glitch", source="vehicle 3", severity=4, cls="sensor")
    station.event("Round 1 started", source="console-test", cls="operator")
    station.event("a longer story of [b]markup[/b] \u241b", source="vehicle 2", severity=2, cls="vehicle")


def shown(c: Console) -> list[str]:
    """The lines, without frame and time."""
    return [
        line.split(maxsplit=1)[1].strip() for line in c.app.screen.journal_lines.text().splitlines() if line.strip()
    ]


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_picture(size: tuple[int, int]) -> None:
    async with console(size, told) as c:
        await c.press("J", "/", *"vehicle 3", "enter")
        assert same_as_snapshot(f"journal-{size[0]}x{size[1]}", c.text())


async def test_newest_at_the_end_and_followed_and_you_are_you() -> None:
    async with console(WIDE, told) as c:
        await c.press("J")
        assert "vehicle    vehicle 2            a longer story of [b]markup[/b] ␛" in c.text()
        assert "operator   you                  Round 1 started" in c.text()
        c.station.event("landed", source="vehicle 1", cls="vehicle")
        await c.settle()
        assert shown(c)[-1].endswith("landed")


async def test_going_up_pages_older_lines_in_and_new_ones_do_not_move_them() -> None:
    async with console(NARROW, told) as c:
        await c.press("J")
        for _ in range(20):
            await c.press("pageup")
        assert shown(c)[0].endswith("old line 0")
        assert "from its beginning" in c.text()
        before = shown(c)
        c.station.event("landed", source="vehicle 1", cls="vehicle")
        await c.settle()
        assert shown(c) == before
        await c.press("end")
        assert shown(c)[-1].endswith("landed")


async def test_a_clock_that_was_set_back_does_not_hide_what_is_new() -> None:
    """Seen: after a step of an hour new lines were somewhere in the middle, for an hour."""

    def ahead(station: FakeStation) -> None:
        told(station)
        old = [msgspec.structs.replace(event, wall_s=event.wall_s + 4600.0) for event in station.old_events]
        station.old_events = [*old, *station.events]  # the file has what the feed has, too

    async with console(WIDE, ahead) as c:
        await c.press("J")
        c.station.event("landed", source="vehicle 1", cls="vehicle")
        await c.settle()
        assert [line.split()[-1] for line in shown(c)][-5:] == ["299", "glitch", "started", "␛", "landed"]
        for _ in range(20):
            await c.press("pageup")
        assert shown(c)[0].endswith("old line 0")


async def test_filters_by_severity_class_vehicle_and_words() -> None:
    async with console(WIDE, told) as c:
        await c.press("J", "w", "w")
        assert [line.split()[-1] for line in shown(c)] == ["7", "107", "207", "glitch", "␛"]
        await c.press("escape", *"tt")
        assert [line.split()[-1] for line in shown(c)] == ["glitch"]
        assert "class sensor" in c.text()
        await c.press("escape", "/", *"round START", "enter")
        assert len(shown(c)) == 1 and "Round 1 started" in shown(c)[0]
        await c.press("escape")
        c.app.feed.selection.set((3,))
        await c.press("e")
        assert {line.split("vehicle")[-1].split()[0] for line in shown(c) if "old" in line} == {"3"}
        assert "vehicle 3" in c.text()
        assert c.station.commands() == []


@pytest.mark.parametrize(
    ("source", "text", "passes"),
    [
        ("console-1", "land: vehicle 7", True),
        ("console-1", "return: 7 of 8: vehicles 1-4 6-8", True),
        ("station", "round 1 started: 3 vehicles 6, 7, 8", True),
        ("console-1", "land: vehicle 17", False),
        ("alarm", "LOST in the air: vehicles 1-6 8", False),
        ("vehicle 7", "take-off: confirmed", True),
        ("console-1", "Round 1 started: 3 vehicles (5, 6, 7)", True),
        ("console-1", "Round 1 started: 3 vehicles (8-9)", False),
        ("vehicle 5", "I am vehicle 7", False),
        ("console-1", "vehicles 1-999999999 " + "9" * 60, True),
        ("station", "7 m above home", False),
        ("console-1", "all hold", True),
    ],
)
def test_the_filter_of_a_vehicle_passes_events_of_others_about_it(source: str, text: str, passes: bool) -> None:
    cls = EventClass.OPERATOR if source.startswith("console") else EventClass.MISSION
    event = JournalEvent(seq=1, t_s=0.0, wall_s=0.0, cls=cls, severity=6, source=source, text=text)
    assert concerns(event, {7}) is passes


async def test_what_had_no_room_in_its_line_is_read_whole_in_the_journal() -> None:
    def refused(station: FakeStation) -> None:
        station.fly()
        why = "; ".join(f"vehicle {v}: reason number {v}" for v in range(1, 9))
        station.event(f"go to refused: {why}", source="console-22419", severity=4, cls="operator")

    async with console(NARROW, refused) as c:
        await c.press("J")
        assert "console-22419" in c.text()
        for vehicle in range(1, 9):
            assert f"number {vehicle}" in c.text()


async def test_a_text_of_blanks_takes_one_line() -> None:
    """A STATUSTEXT of fifty spaces ended the console."""
    async with console(NARROW) as c:
        c.station.event(" " * 50, source="vehicle 3")
        await c.press("J")
        assert shown(c)[-1].endswith("vehicle 3")


async def test_paging_through_long_events_passes_none_by() -> None:
    def long_ones(station: FakeStation) -> None:
        station.fly()
        for number in range(60):
            station.event(f"story {number}. " + "and so on " * 10, source="vehicle 2", severity=6, cls="vehicle")

    async with console(NARROW, long_ones) as c:
        await c.press("J")
        seen = set()
        for _ in range(20):
            seen |= {number for number in range(60) if f"story {number}." in c.text()}
            await c.press("pageup")
        assert seen == set(range(60))
        assert "story 0." in shown(c)[0]
