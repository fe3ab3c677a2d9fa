"""The traffic screen: what flies beside the fleet, and tasks for planners that are added and cancelled."""

import math

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.common import AddPoints, CancelPoints, PointOfInterest, Track
from tui_gcs.core.protocol.setup import GetTraffic, HearTraffic, RemoteIdRow, TrafficRow

NAN = math.nan


def crowded(station: FakeStation) -> None:
    """An intruder, an airliner, a glider without a height, another drone; three tasks."""
    station.fly()
    station.tracks = (Track(4, (300.0, 150.0, 40.0), (-6.0, 0.0, 0.0), (4.0, 0.0, 4.0), 90.0, 100.0, (2, 3), True),)
    station.traffic = (
        TrafficRow(0x4CA123, "RYR12", 52.2, -0.5, 9000.0, True, 270.0, 220.0, 0.0, False, 2, 3.0, NAN, NAN),
        TrafficRow(0x3D0001, "", 52.075, -0.62, NAN, False, 180.0, 25.0, -1.5, False, 1, 1.0, NAN, NAN),
    )
    station.remote_ids = (RemoteIdRow(0, 5, "DRONE-77", "op9", "", 52.08, -0.60, 120.0, NAN, NAN, None, "", 236, 2.0),)
    station.points = (
        PointOfInterest("gate", (450.0, 200.0), 2.0, "attack", 90.0, 400.0),
        PointOfInterest("roof", (100.0, 20.0), 1.0, "", 50.0, math.inf, "done", 95.0, 3),
    )


async def opened(c: Console, *keys: str) -> None:
    await c.press("S", "a")
    c.app.screen.look()
    await c.settle()
    await c.press(*keys)


def panel(c: Console) -> str:
    return " ".join(c.app.screen.panel.text().split())


def changes(c: Console) -> list[object]:
    return [r for r in c.station.requests if isinstance(r, AddPoints | CancelPoints | HearTraffic)]


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(("view", "keys"), [("contacts", []), ("tasks", ["tab"])])
async def test_pictures(view: str, keys: list[str], size: tuple[int, int]) -> None:
    async with console(size, crowded) as c:
        await opened(c, *keys)
        assert same_as_snapshot(f"traffic-{view}-{size[0]}x{size[1]}", c.text())


async def test_the_chosen_contact_is_described() -> None:
    async with console(WIDE, crowded) as c:
        await opened(c)
        names = [contact.seen.name for contact in c.app.screen.contact_list.rows]
        await c.press(*["down"] * names.index("@4"))
        assert "track @4: seen by vehicles 2-3" in panel(c) and "6 m/s" in panel(c)


@pytest.mark.parametrize(
    ("text", "place", "rest"),
    [
        ("450 200", (450.0, 200.0), ("", 1.0, math.inf)),
        ("450 200; gate 3; 2.5; 300", (450.0, 200.0), ("gate 3", 2.5, 300.0)),
    ],
)
async def test_a_task_is_added(text: str, place: tuple[float, float], rest: tuple[object, ...]) -> None:
    async with console(WIDE, crowded) as c:
        await opened(c, "plus", *("space" if letter == " " else letter for letter in text), "enter")
        (request,) = changes(c)
        (point,) = request.points
        assert point.place_m == place and (point.name, point.priority, point.within_s) == rest


async def test_a_task_is_added_at_the_cursor_of_the_map() -> None:
    async with console(WIDE, crowded) as c:
        await c.press("x")
        cursor = c.fly.cursor_m
        await opened(c, "plus", "enter")
        assert changes(c)[0].points[0].place_m == pytest.approx(cursor)


@pytest.mark.parametrize("text", ["nowhere", "cursor", "+5 5", "home", "1 2;a;0", "1 2;a;1;x", ";a", "zone 7", "v99"])
async def test_what_is_no_task_is_refused_in_one_line(text: str) -> None:
    async with console(WIDE, crowded) as c:
        await opened(c, "plus", *("space" if letter == " " else letter for letter in text), "enter")
        assert changes(c) == [] and panel(c)


async def test_a_task_is_cancelled_after_y() -> None:
    async with console(WIDE, crowded) as c:
        await opened(c, "tab", "delete", "escape")
        assert changes(c) == [] and "left as it is" in panel(c)
        await c.press("delete", "y")
        assert changes(c) == [CancelPoints(("gate",))]


async def test_a_task_that_is_over_or_none_is_not_cancelled() -> None:
    async with console(WIDE, crowded) as c:
        await opened(c, "delete")
        assert "Tab shows them" in panel(c)
        await c.press("tab", "down", "delete")
        assert "roof is done" in panel(c) and changes(c) == []


async def test_selected_vehicles_report_what_they_hear() -> None:
    async with console(WIDE, crowded) as c:
        await opened(c, "R")
        assert "no vehicle is selected" in panel(c) and changes(c) == []
        c.app.feed.selection.set((2,))
        await c.press("R")
        assert changes(c) == [HearTraffic((2,))]


async def test_a_read_only_console_changes_nothing() -> None:
    async with console(WIDE, crowded, read_only=True) as c:
        await opened(c, "plus", "R", "tab", "delete")
        assert "read-only" in panel(c) and c.station.commands() == []


async def test_nothing_is_asked_while_another_screen_is_shown() -> None:
    async with console(WIDE, lambda station: None) as c:
        await opened(c)
        assert "nothing is detected" in c.text()
        screen = c.app.screen
        await c.press("v")
        asked = sum(isinstance(r, GetTraffic) for r in c.station.requests)
        screen.look()
        await c.settle()
        assert sum(isinstance(r, GetTraffic) for r in c.station.requests) == asked


async def test_text_is_text() -> None:
    def hostile(station: FakeStation) -> None:
        crowded(station)
        station.points = (PointOfInterest("[b]x[/b]\x1b[31m", (1.0, 2.0), 1.0, "", 0.0, math.inf),)

    async with console(NARROW, hostile) as c:
        await opened(c, "tab")
        assert "\x1b" not in c.text() and "[b]x[/b]" in c.text()


async def test_a_task_is_described_with_what_has_become_of_it() -> None:
    async with console(NARROW, crowded) as c:
        await opened(c, "tab")
        assert "open: a planner that takes tasks sends a vehicle there" in panel(c)
        assert "450 m east, 200 m north of the origin; priority 2; for team attack" in panel(c)
        await c.press("down")
        assert "done by vehicle 3: it was seen from there" in panel(c) and "for any team" in panel(c)
