"""The flights screen: recordings on disk, what happened in them, replay, export, delete."""

import os
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import msgspec
import pytest

from tests.core.records.onboard_log_files import copter_log
from tests.core.records.test_flight_archive import flown, heartbeats_in
from tests.core.station.test_replay_player import DATA
from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.judging.flight_timeline import FlightTimeline, timeline
from tui_gcs.core.protocol.replay import ReplayStatus
from tui_gcs.core.records.flight_archive import RecordedFlight
from tui_gcs.core.records.rehearsal_store import FILE, RehearsalRecord, remember
from tui_gcs.screens.flights.flight_files import time_of_day
from tui_gcs.screens.flights.flights_screen import FlightsScreen

DAY_S = 86_400.0


async def read_here(flight: RecordedFlight, archive: tuple[RecordedFlight, ...]) -> FlightTimeline:
    """Read in this process, which is faster than `read_timeline`."""
    return timeline(flight, archive)


def recorded(folder: Path) -> dict[str, Path]:
    """A LIVE flight, a failed rehearsal and a log of vehicle 7; the newest first in this order."""
    live, sim = folder / "live", folder / "sim"
    path = flown(live)
    rehearsal = heartbeats_in(sim / "rehearsal-20261126-090000")
    remember(
        sim / FILE,
        RehearsalRecord("p", False, 1.0, "swarm", 11, 12, folder=rehearsal.parent.name, report="/home/pat/report.html"),
    )
    log = live / "logs/vehicle-7/log-00012.bin"
    log.parent.mkdir(parents=True)
    log.write_bytes(copter_log())
    for age, file in enumerate((path, rehearsal, log)):
        os.utime(file, (1.75e9 - age * DAY_S, 1.75e9 - age * DAY_S))
    return {"LIVE": live, "SIM": sim}


@asynccontextmanager
async def flights(
    tmp_path: Path, size: tuple[int, int] = WIDE, *, replay: bool = False, empty: bool = False
) -> AsyncIterator[Console]:
    folders = {} if empty else recorded(tmp_path)
    async with console(size, recordings=folders, replay=replay) as c:
        await c.press("S", "f")
        screen(c).read = read_here
        yield c


def screen(c: Console) -> FlightsScreen:
    assert isinstance(c.app.screen, FlightsScreen)
    return c.app.screen


def panel(c: Console) -> str:
    return " ".join(screen(c).panel.text().split())


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures(tmp_path: Path, size: tuple[int, int]) -> None:
    async with flights(tmp_path, size) as c:
        shown = c.text().replace(str(tmp_path), "~")
        assert "LIVE" in shown and "rehearsal" in shown and "log of 7" in shown
        screen(c).panel.display = False  # the folder of a test has another name each time
        await c.tick()
        assert same_as_snapshot(f"flights-{size[0]}x{size[1]}", c.text())
        await c.press("enter")
        assert same_as_snapshot(f"flights-opened-{size[0]}x{size[1]}", c.text())


async def test_nothing_recorded_yet_says_what_to_do(tmp_path: Path) -> None:
    async with flights(tmp_path, empty=True) as c:
        assert "nothing was recorded yet; + opens a file" in c.text()
        for key in ("enter", "R", "e", "delete", "y"):
            await c.press(key)
        assert "no flight is chosen" in panel(c)


async def test_a_rehearsal_shows_its_result_and_the_path_of_its_report(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        await c.press("down")
        assert "FAILED 11/12" in panel(c) and "report: /home/pat/report.html" in panel(c)
        await c.press("y")
        assert "clipboard: /home/pat/report.html" in panel(c)


async def test_words_find_a_flight(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        await c.press("slash", *"rehear", "enter")
        assert [flight.source for flight in screen(c).flight_list.rows] == ["rehearsal"]
        await c.press("escape")
        assert len(screen(c).flight_list.rows) == 3


async def test_an_opened_flight_shows_what_happened_by_severity_and_words(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        await c.press("enter")
        assert "LOST in the air: vehicle 3" in c.text() and "over: LOST" in c.text()
        assert "w alarms" in c.line(-1)
        await c.press("w")
        assert "alarms" in str(screen(c).timeline_list.border_title)
        assert {entry.source for entry in screen(c).timeline_list.rows} == {"alarm"}
        await c.press("w", "w")
        assert [entry.text for entry in screen(c).timeline_list.rows] == [
            "battery low: vehicle 7",
            "LOST in the air: vehicle 3",
        ]
        assert "alarm: battery low: vehicle 7" in panel(c), "the chosen entry whole, though its line may be cut"
        await c.press("slash", *"batt", "enter")
        assert len(screen(c).timeline_list.rows) == 1
        await c.press("escape", "escape")
        assert screen(c).row_list is screen(c).flight_list


async def test_replay_begins_where_the_chosen_entry_is(tmp_path: Path) -> None:
    async with flights(tmp_path, empty=True) as c:
        await c.press("plus", *str(DATA / "arducopter-8.tlog"), "enter")
        await c.press("enter", "slash", *"reached command #2", "enter")
        commands: list[list[str]] = []
        screen(c).files.run_program = lambda command: commands.append(command) or 0
        await c.press("enter")
        assert commands[0][3:] == ["replay", str(DATA / "arducopter-8.tlog"), "--at", "80.6"]
        assert "back from arducopter-8.tlog" in panel(c)


async def test_the_log_of_a_vehicle_is_plotted_at_the_chosen_entry(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        commands: list[list[str]] = []
        screen(c).files.run_program = lambda command: commands.append(command) or 0
        await c.press("end", "enter", "end")
        entry = screen(c).timeline_list.chosen_row
        assert entry is not None and "Enter plots here" in c.line(-1)
        await c.press("enter")
        path = str(tmp_path / "live/logs/vehicle-7/log-00012.bin")
        assert commands[-1][3:] == ["plot", path, "--at", time_of_day(entry.wall_s)]
        await c.press("g")
        assert commands[-1] == commands[-2]
        assert "back from log-00012.bin" in panel(c)
        await c.press("escape")
        assert screen(c).row_list is screen(c).flight_list, "Esc goes back with the first press, report or not"


def test_a_time_of_day_for_a_command_line_is_within_the_day() -> None:
    assert time_of_day(1.75e9 + 0.32) == "15:06:40.3Z"
    assert time_of_day(86_399.96) == "00:00:00.0Z"


async def test_a_downloaded_log_is_listed_by_the_time_at_which_the_vehicle_began_it(tmp_path: Path) -> None:
    folders = recorded(tmp_path)
    log = tmp_path / "live/logs/vehicle-7/log-00012.bin"
    log.rename(log.with_name("log-00012-20250102T030405Z.bin"))
    async with console(WIDE, recordings=folders) as c:
        await c.press("S", "f")
        assert "2025-01-02 03:04 log of 7" in c.text()


async def test_the_chosen_recording_or_all_marked_ones_are_plotted(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        commands: list[list[str]] = []
        screen(c).files.run_program = lambda command: commands.append(command) or 0
        chosen = [str(flight.path) for flight in screen(c).flight_list.rows]
        assert "g plots" in c.line(-1)
        await c.press("end", "g")
        assert commands[-1][3:] == ["plot", chosen[2]] and "back from log-00012.bin" in panel(c)
        await c.press("home", "m", "down", "m")
        assert [line[1] for line in c.text().splitlines()[4:7]] == ["*", " ", "*"]
        await c.press("g")
        assert commands[-1][3:] == ["plot", chosen[0], chosen[2]] and "back from 2 recordings" in panel(c)
        await c.press("home", "m", "end", "m", "home", "g")
        assert commands[-1][3:] == ["plot", chosen[0]], "the marks are off again"


async def test_plots_are_refused_while_something_is_armed_and_without_a_recording(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        status = c.app.feed.status
        assert status is not None
        c.app.feed.status = msgspec.structs.replace(status, armed=3)
        await c.press("g")
        assert "3 armed: plot in another terminal: tui-gcs plot" in panel(c)
        await c.press("enter", "m")
        assert "marks are set in the list: Esc first" in panel(c)
    async with flights(tmp_path, empty=True) as c:
        await c.press("g")
        assert "no flight is chosen" in panel(c)
        await c.press("m")
        assert "no flight is chosen" in panel(c)


async def test_replay_is_refused_where_alarms_would_be_missed_or_nothing_can_be_shown(tmp_path: Path) -> None:
    folders = recorded(tmp_path)
    async with console(WIDE, recordings=folders) as c:
        await c.press("S", "f")
        await c.press("end", "R")
        assert "only a telemetry log can be replayed; ArduPilot log: Enter shows what happened, g plots it" in panel(c)
        status = c.app.feed.status
        assert status is not None
        c.app.feed.status = msgspec.structs.replace(status, armed=3)
        await c.press("home", "R")
        assert "3 armed: replay in another terminal: tui-gcs replay" in panel(c)
        player = ReplayStatus(at_s=1.0, length_s=2.0, speed=1.0, paused=False)
        c.app.feed.status = msgspec.structs.replace(status, armed=0, replay=player)
        await c.press("R")
        assert "this is a replay" in panel(c)


async def test_the_log_of_a_vehicle_is_opened_and_a_damaged_one_says_so(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        await c.press("end", "enter")
        assert "ArduCopter V4.6.0" in c.text() and "mode LOITER" in c.text()
        await c.press("escape")
        (tmp_path / "live/logs/vehicle-7/log-00012.bin").write_bytes(b"junk")
        await c.press("end", "enter")
        assert "not a log of ArduPilot" in panel(c)


async def test_a_log_is_read_by_a_process_of_its_own(tmp_path: Path) -> None:
    folders = recorded(tmp_path)
    async with console(WIDE, recordings=folders) as c:
        await c.press("S", "f")
        await c.press("end", "enter")
        assert "mode LOITER" in c.text()


async def test_tracks_are_exported_and_never_over_another_file(tmp_path: Path) -> None:
    target = tmp_path / "track.csv"
    async with flights(tmp_path) as c:
        await c.press("end", "e")
        await c.press(*["backspace"] * 20, *str(target), "enter")
        assert "2 points" in panel(c) and target.read_text().count("\n") == 3
        await c.press("e", *["backspace"] * 20, *str(target), "enter")
        assert "is there already: choose another name" in panel(c)
        await c.press("e", *["backspace"] * 20, *str(tmp_path / "track.doc"), "enter")
        assert "NOT WRITTEN" in panel(c) and "csv, kml or gpx" in panel(c)


async def test_a_flight_is_deleted_after_y(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        await c.press("delete")
        assert "it cannot be brought back" in c.text()
        await c.press("escape")
        assert "NOT DELETED: it stays" in panel(c) and len(screen(c).flight_list.rows) == 3
        await c.press("delete", "y")
        assert "20261127-a.tlog is deleted" in panel(c)
        screen(c).look()
        await c.settle()
        assert len(screen(c).flight_list.rows) == 2
        assert not (tmp_path / "live/20261127-a.tlog").exists()


async def test_a_flight_that_may_still_be_recorded_is_not_deleted(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        os.utime(tmp_path / "live/20261127-a.tlog", (time.time(), time.time()))
        screen(c).look()
        await c.settle()
        await c.press("home", "delete", "y")
        assert "may still be recorded" in panel(c)


async def test_a_path_that_is_no_flight_is_refused(tmp_path: Path) -> None:
    async with flights(tmp_path) as c:
        await c.press("plus", *"/tmp/x.txt", "enter")
        assert "no flight: .tlog, .bin, .ulg" in panel(c)
        await c.press("plus", "escape")
        assert len(screen(c).flight_list.rows) == 3


async def test_hostile_names_and_texts_are_drawn_as_text(tmp_path: Path) -> None:
    folder = tmp_path / "sim"
    flown(folder, "[red]\x1b]0;own\x07")
    async with console(WIDE, recordings={"SIM": folder}) as c:
        await c.press("S", "f")
        assert "\x1b" not in c.text() and "\x07" not in c.text()
        assert "[red]" in c.text()
