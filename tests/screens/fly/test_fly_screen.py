"""The fly screen shows what the station says, at both sizes."""

import math

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, WIDE, console
from tests.screens.rigs.fake_station import FakeStation, trouble
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Freshness, TeamStatus
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import VehicleInfoUpdated
from tui_gcs.widgets.basics.glyphs import ASCII, as_ascii
from tui_gcs.widgets.basics.top_lines import local_notice


def flight(station: FakeStation) -> None:
    station.fly()


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize("scene", [None, flight, trouble], ids=["ground", "flight", "trouble"])
async def test_picture(size: tuple[int, int], scene: object, request: pytest.FixtureRequest) -> None:
    async with console(size, scene or (lambda station: None)) as c:
        for _ in range(20):
            c.station.tick(1.0)
            c.app.feed.deliver()
        await c.press("n")
        assert same_as_snapshot(f"fly-{request.node.callspec.id}", c.text())


async def test_ascii_picture_has_only_ascii() -> None:
    async with console(NARROW, trouble, glyphs=ASCII) as c:
        c.station.changes[1] = {"mode": "GÜIDED"}
        await c.tick()
        await c.press("n")
        picture = c.text()
        assert picture.isascii()
        assert "DEFEND home" in picture
        assert as_ascii("±0.8 m 12° – …") == "~0.8 m 12  - ."


async def test_status_line_counts_vehicles_heard_and_armed() -> None:
    async with console(WIDE, trouble) as c:
        assert "SIM" in c.line(0)
        assert "7/8 heard" in c.line(0)
        assert "armed 8" in c.line(0)
        assert "Round 1/3" in c.line(0)
        assert "control: you" in c.line(0)


async def test_second_line_names_the_worst_and_the_key() -> None:
    async with console(WIDE, trouble) as c:
        assert "! WARN  LOST in the air: vehicle 5   → !h hold all" in c.line(1)
        assert "2 alarms" in c.line(1)
        c.station.changes.pop(5)
        await c.tick()
        assert "^ CAUT  battery low: vehicle 7  24 %" in c.line(1)


async def test_alarm_of_the_station_comes_first() -> None:
    async with console(WIDE, trouble) as c:
        c.station.alarm = "planner of attack is dead: vehicles hold   Enter resume"
        await c.tick()
        assert "planner of attack is dead" in c.line(1)


async def test_same_trouble_of_many_is_one_line() -> None:
    async with console(WIDE, flight) as c:
        for vehicle in (1, 2, 3, 6):
            c.station.changes[vehicle] = {"freshness": Freshness.LOST, "heard_age_s": 5.0}
        await c.tick()
        assert "LOST in the air: vehicles 1-3 6 " in c.line(1)


async def test_lost_vehicle_shows_no_values_as_if_true() -> None:
    async with console(WIDE, trouble) as c:
        line = next(line for line in c.fly.roster.text().splitlines() if "5 attack" in line)
        assert "LOST 12s" in line
        assert "55.0" not in line
        assert "--" in line


async def test_a_vehicle_without_a_position_shows_its_mode_and_an_old_position_its_age() -> None:
    def indoors(station: FakeStation) -> None:
        nowhere = {"freshness": Freshness.STALE, "position_m": (math.nan,) * 3, "age_s": math.nan, "mode": "STABILIZE"}
        station.changes = {2: nowhere, 3: {"freshness": Freshness.STALE, "age_s": 2.4}}

    async with console(NARROW, indoors) as c:
        rows = c.fly.roster.text().splitlines()
        assert "STABILIZ" in rows[2] and "--" in rows[2] and "old" not in rows[2]
        assert "old 2s" in rows[3]


async def test_narrow_drops_columns_never_rows() -> None:
    async with console(NARROW, flight) as c:
        header, *rows = c.fly.roster.text().splitlines()
        assert [int(row.split()[0]) for row in rows] == list(range(1, 9))
        assert [name in header for name in ("ID", "MODE", "ALT", "BAT", "TEAM", "GPS")] == [True] * 4 + [False] * 2


async def test_wide_roster_has_every_column() -> None:
    async with console(WIDE, flight) as c:
        header = c.fly.roster.text().splitlines()[0].split()
        assert header == ["ID", "TEAM", "AP", "MODE", "A", "ALT", "SPD", "BAT", "GPS", "AGE"]


async def test_many_vehicles_scroll_to_the_selected_one() -> None:
    def forty(station: FakeStation) -> None:
        station.count = 40

    async with console(NARROW, forty) as c:
        await c.press("3", "7", "enter")
        assert c.fly.selected == 37
        assert "37" in c.fly.roster.text()


async def test_of_many_vehicles_those_in_trouble_are_seen_first() -> None:
    def forty(station: FakeStation) -> None:
        station.count = 40
        station.fly()
        station.changes = {33: {"battery_pct": 10.0}, 21: {"battery_pct": 24.0}, 22: {"battery_pct": 24.0}}

    async with console(NARROW, forty) as c:
        shown = [line[:5].split() for line in c.fly.roster.text().splitlines()[1:]]
        assert shown[:4] == [["!", "33"], ["^", "21"], ["^", "22"], ["1"]]
        await c.pilot.click(c.fly.roster, offset=(5, 3))
        assert c.fly.selected == 21, "what was clicked is what was shown there"


async def test_a_lost_vehicle_shows_its_last_place_and_no_motion() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("5", "enter")
        assert "5 attack LOST 12 s" in c.text() and "last 52.07" in c.text() and "then 55m up, bat 78%" in c.text()
        assert "flying slot" not in c.text()


async def test_a_station_that_an_operator_ended_is_not_called_lost() -> None:
    async with console(WIDE, flight) as c:
        await c.tick()
        c.app.feed._take_status(msgspec.structs.replace(c.app.feed.status, ending=True))
        await c.pilot.pause()
        assert "STATION ENDED" in c.line(0) and "STATION LOST" not in c.line(0)
        assert "the station was ended" in c.line(1)
        await c.tick()
        assert "STATION ENDED" not in c.line(0), "another one was started"


def test_a_console_that_waits_for_a_start_says_so() -> None:
    feed = Feed(MemoryBus(), "test", clock=(clock := VirtualClock()))
    feed.station_lost = feed.starts_station = True
    clock.advance(4.0)
    assert "the station is being started, 4 s so far" in local_notice(feed).text
    clock.advance(20.0)
    assert "no station heard" in local_notice(feed).text


async def test_a_silent_station_is_reported_and_values_are_hidden() -> None:
    async with console(WIDE, flight) as c:
        c.station.silent = True
        c.clock.advance(3.5)
        c.app.feed.check()
        await c.pilot.pause()
        assert "STATION LOST" in c.line(0)
        assert "armed --" in c.line(0)
        assert "station silent for 3 s" in c.line(1) or "station silent for 4 s" in c.line(1)
        assert "GUIDED" not in c.text()
        c.station.silent = False
        await c.tick()
        assert "STATION LOST" not in c.line(0)
        assert "GUIDED" in c.text()


@pytest.mark.parametrize("size", [NARROW, WIDE])
async def test_what_to_do_while_the_station_is_silent_is_shown_uncut(size: tuple[int, int]) -> None:
    async with console(size, flight) as c:
        c.clock.advance(8.0)
        c.app.feed.check()
        await c.pilot.pause()
        assert c.line(1).strip() == "! WARN  station silent for 8 s   !h tries HOLD ALL   vehicles go on as set up"


async def test_events_are_shown_newest_first_with_their_class() -> None:
    async with console(WIDE, flight) as c:
        c.station.event("GPS glitch", source="vehicle 3", severity=4, cls="sensor")
        c.station.event("late", source="planner", severity=3, cls="processing")
        await c.settle()
        first, second, *_ = c.fly.event_lines.text().splitlines()
        assert "processing" in first
        assert "sensor" in second
        assert "GPS glitch" in second


async def test_hostile_text_is_shown_as_letters() -> None:
    evil = "[@click=app.detach]OK[/] [/] [red"
    async with console(WIDE, flight) as c:
        c.station.event(evil, source="[b]vehicle", severity=2, cls="vehicle")
        c.station.alarm = f"alarm {evil}"
        c.station.changes[1] = {"mode": "[/x]", "autopilot": evil, "team": "[bold]", "link": "[/]"}
        await c.tick()
        await c.press("n")
        assert evil in c.text()
        assert f"alarm {evil}" in c.line(1)
        assert "[/x]" in c.fly.roster.text()


async def test_other_round_is_on_the_map() -> None:
    async with console(WIDE, flight) as c:
        before = c.text()
        c.station.round_index = 2
        await c.tick()
        assert "Round 3/3" in c.line(0)
        assert c.text() != before


async def test_nothing_is_posted_when_nothing_visible_changed() -> None:
    async with console(NARROW) as c:
        posted: list[object] = []
        c.app.feed.listen(type("Ear", (), {"post_message": lambda self, message: posted.append(message)})())
        c.station.tick(0.0)
        c.app.feed.deliver()
        c.station.tick(0.01)
        c.app.feed.deliver()
        assert posted == []


async def test_what_planners_count_is_shown_in_words() -> None:
    async with console((160, 50), flight) as c:
        c.station.metrics = {"gap_m": 9.8764, "predicted_worst_s": 26.41, "slots": 4.0}
        await c.tick(1.0)
        assert "DEF gap 9.88 m  predicted worst 26.4 s  ATT gap 9.88 m" in c.text() and "  slots 4  " not in c.text()
        assert "recording 2026" in c.text()


async def test_what_there_is_no_room_for_is_left_out_with_a_sign() -> None:
    async with console(WIDE, flight) as c:
        c.station.metrics = {f"a_number_with_a_long_name_{i}": float(i) for i in range(64)}
        await c.tick(1.0)
        assert "DEF a number with a long name 0 0" in c.text() and "0 0 …" in c.text()


async def test_everything_of_the_planners_is_one_key_away_on_the_smallest_terminal() -> None:
    async with console(NARROW, flight) as c:
        c.station.metrics = {f"a_number_with_a_long_name_{i}": float(i) for i in range(30)}
        c.station.planner_error = 'File "mine.py", line 7\nZeroDivisionError: [/] division by zero'
        await c.tick(1.0)
        await c.press("M")
        assert "defend: vehicles 1-4, patrol at 5 Hz running" in c.text() and "x ideal 20.9  cover 100%" in c.text()
        seen = c.text()
        for _ in range(4):
            await c.press("pagedown")
            seen += c.text()
        assert "a number with a long name 29 29" in seen and "ZeroDivisionError: [/] division by zero" in seen
        assert "nearest pair" in c.text(), "that is its end"


async def test_a_long_hardware_id_is_shown_on_the_fly_screen() -> None:
    async with console((120, 40), flight) as c:
        await c.press("3", "enter")
        c.app.feed.inspection.look_at(3)
        await c.settle()
        info = c.app.feed.inspection.info
        assert info is not None
        c.app.feed.inspection.info = msgspec.structs.replace(info, uid="386438383030313630656236383662313233")
        c.fly.post_message(VehicleInfoUpdated())
        await c.settle()
        assert "4.7.0-dev  unsigned  38643838..62313233" in c.text()


async def test_fifty_vehicles_on_a_high_terminal_leave_room_for_the_planners() -> None:
    def fifty(station: FakeStation) -> None:
        station.count = 50
        station.fly()

    async with console((200, 60), fifty) as c:
        panel = c.text().split("─ planner ")[1]
        assert "DEFEND home" in panel and "ATTACK" in panel and "nearest pair" in panel


def team_of(zone: str, ratio: float, worker: str = "running") -> TeamStatus:
    status = FakeStation(MemoryBus()).status().teams[0]
    return msgspec.structs.replace(status, zone=zone, role="defend", ratio=ratio, worker=worker)


async def test_of_more_teams_than_there_is_room_for_the_worst_are_shown_and_the_others_counted() -> None:
    teams = [team_of(f"zone {n}", 1.0 + n / 10) for n in range(1, 9)] + [team_of("zone 9", 1.0, "dead")]
    async with console(NARROW) as c:
        panel = c.fly.brief_panel
        panel.show(msgspec.structs.replace(c.station.status(), teams=tuple(teams)), None, {})
        lines = ["".join(text for text, _ in line) for line in panel.lines(28, 7)]
    assert len(lines) == 7 and lines[-1].startswith("sep ")
    assert [line[:6] for line in lines[1:5]] == ["zone 9", "zone 8", "zone 7", "zone 6"]
    assert "dead" in lines[1]
    assert lines[5] == "5 more teams: M"
