"""Logs on vehicles: listed, downloaded at once, cancelled; one outcome for each."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.services import CancelTask, DownloadLog, ListLogs, LogRow, TaskResult
from tui_gcs.screens.flights.flights_screen import FlightsScreen
from tui_gcs.screens.flights.vehicle_logs_screen import VehicleLogsScreen

NOON_S = 1_764_244_800


def screen(c: Console) -> VehicleLogsScreen:
    assert isinstance(c.app.screen, VehicleLogsScreen)
    return c.app.screen


def panel(c: Console) -> str:
    return " ".join(screen(c).panel.text().split())


async def until(c: Console, is_so: object) -> None:
    """Let the console ask the station again, which it does by the real clock."""
    for _ in range(100):
        await c.pilot.pause(0.05)
        if is_so():  # type: ignore[operator]
            return
    raise AssertionError(c.text())


@asynccontextmanager
async def listed(size: tuple[int, int] = WIDE) -> AsyncIterator[Console]:
    """Vehicles 1 and 2 were asked: the first holds two logs, the second one of hostile size and no time."""
    async with console(size) as c:
        c.app.feed.selection.set((1, 2))
        await c.press("S", "o")
        await c.pilot.press("u")
        await until(c, lambda: len(c.station.tasks) == 2)
        rows = ((LogRow(11, 2_000_000, NOON_S), LogRow(12, 3_500_000, NOON_S + 3600)), (LogRow(7, 900, 0),))
        for number in (1, 2):
            c.station.results[number] = TaskResult(logs=rows[number - 1])
            c.station.end_task(number, "done", "")
        await until(c, lambda: len(screen(c).log_list.rows) == 3)
        await c.settle()
        yield c


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures(size: tuple[int, int]) -> None:
    async with listed(size) as c:
        await c.press("w")
        assert same_as_snapshot(f"onboard-{size[0]}x{size[1]}", c.text())


async def test_nothing_is_asked_before_u_and_then_only_the_selected() -> None:
    async with listed() as c:
        asked = [request for request in c.station.requests if isinstance(request, ListLogs)]
        assert asked == [ListLogs((1, 2))]
        assert [(row[0], row[1].id) for row in screen(c).log_list.rows] == [(1, 12), (1, 11), (2, 7)]
        assert "list: done for vehicles 1-2" in panel(c)


async def test_vehicles_without_a_log_are_named_with_why_and_equal_refusals_are_one() -> None:
    async with console(WIDE) as c:
        c.app.feed.selection.set((1, 2, 3))
        await c.press("S", "o")
        await c.pilot.press("u")
        await until(c, lambda: len(c.station.tasks) == 3)
        for number in (1, 2, 3):
            c.station.end_task(number, "done", "")
        await until(c, lambda: "list: done for vehicles 1-3; no log on vehicles 1-3: most autopilots begin" in panel(c))
        await c.pilot.press("u")
        await until(c, lambda: len(c.station.tasks) == 6)
        for number in (4, 5, 6):
            c.station.end_task(number, "failed", "Disarm for log download")
        await until(c, lambda: "list: 3 of 3 NOT DONE: vehicles 1-3: Disarm for log download" in panel(c))


async def test_the_newest_of_each_vehicle_are_downloaded_at_once_with_progress_and_outcome() -> None:
    async with listed() as c:
        await c.press("w")
        await c.pilot.press("enter")
        await until(c, lambda: len(c.station.tasks) == 4)
        asked = [request for request in c.station.requests if isinstance(request, DownloadLog)]
        assert asked == [DownloadLog((1,), 12), DownloadLog((2,), 7)]
        c.station.tasks[3] = msgspec.structs.replace(c.station.tasks[3], done=700, total=1000)
        await until(c, lambda: "running 70 %" in c.text())
        c.station.results[3] = TaskResult(path="logs/vehicle-1/log-00012.bin")
        c.station.end_task(3, "done", "")
        c.station.end_task(4, "failed", "[b]no answer[/b]")
        await until(c, lambda: "done: logs/vehicle-1/log-00012.bin" in c.text())
        await until(c, lambda: "1 of 2 NOT DONE" in panel(c))
        assert "vehicle 2: [b]no answer[/b]" in panel(c)
        assert "FAILED: [b]no answer[/b]" in c.text()


async def test_the_footer_names_what_can_be_done_next_and_what_a_download_waits_for() -> None:
    async with listed(NARROW) as c:
        assert "Enter download" in c.line(-1)
        await c.pilot.press("enter")
        await until(c, lambda: "Del cancel" in c.line(-1))
        assert "Enter download" not in c.line(-1)
        c.station.tasks[3] = msgspec.structs.replace(c.station.tasks[3], state="queued", text="vehicle 2: log 7")
        await until(c, lambda: "waits for vehicle 2: log 7" in c.text())
        own = "vehicle 1: accelerometer calibration"
        c.station.tasks[3] = msgspec.structs.replace(c.station.tasks[3], text=own)
        await until(c, lambda: "waits for accelerometer calibration " in c.text())
        c.station.results[3] = TaskResult(path="logs/vehicle-1/log-00012.bin")
        c.station.end_task(3, "done", "")
        await until(c, lambda: "Tab flights" in c.line(-1))


async def test_a_download_is_cancelled_and_others_go_on() -> None:
    async with listed() as c:
        await c.press("delete")
        assert "the chosen log is not being downloaded" in panel(c)
        await c.pilot.press("enter")
        await until(c, lambda: screen(c).downloads.logs[1, 12].task is not None)
        await c.pilot.press("delete")
        await until(c, lambda: " cancelled" in c.text())
        assert [r for r in c.station.requests if isinstance(r, CancelTask)] == [CancelTask(3)]


async def test_marks_are_set_and_taken_off_and_tab_shows_the_flights() -> None:
    async with listed() as c:
        await c.press("m", "m")
        assert [row[2] for row in screen(c).log_list.rows] == [True, True, False]
        await c.press("escape")
        assert not any(row[2] for row in screen(c).log_list.rows)
        await c.press("tab")
        assert isinstance(c.app.screen, FlightsScreen)


async def test_a_read_only_console_asks_no_vehicle() -> None:
    async with console(WIDE, read_only=True) as c:
        await c.press("S", "o", "u")
        assert "read-only" in panel(c) and not [r for r in c.station.requests if isinstance(r, ListLogs)]
        await c.press("enter", "delete", "m", "w")
        assert "read-only" in panel(c)
