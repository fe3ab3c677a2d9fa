"""The planner log screen: follow, older lines, team, level, words, copies, and what it costs when it is closed."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import WALL_START_S, FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.planner_log import GetPlannerLog, PlannerLogLevel, PlannerLogLine
from tui_gcs.feed.logs import planner_log_watch

HOSTILE = clean("\x1b]52;c;eA==\x07 [b]bold[/b] \u202eevil 表")


def line(number: int, level: PlannerLogLevel = PlannerLogLevel.STDOUT, text: str = "") -> PlannerLogLine:
    team = "defend" if number % 2 else "attack"
    return PlannerLogLine(WALL_START_S + number, team, "patrol", level, text or f"tour {number} is better")


def printed(station: FakeStation) -> None:
    """Three hundred lines; the newest ones have every level."""
    station.fly()
    levels = list(PlannerLogLevel)
    said = {
        PlannerLogLevel.STDERR: '  File "mine.py", line 12, in step',
        PlannerLogLevel.ERROR: "mine: ZeroDivisionError: " + 30 * "a long story ",
        PlannerLogLevel.STATION: "its worker ended (exit code 3); the next one is started in 2 s",
        PlannerLogLevel.WARNING: HOSTILE,
    }
    old = [line(number, text="seldom seen" if number == 7 else "") for number in range(300)]
    station.planner_log = [*old, *(line(300 + at, level, said.get(level, "")) for at, level in enumerate(levels))]


async def look(c: Console) -> None:
    """A second passes, and the screen asks again."""
    c.app.screen.look()
    await c.settle()


def shown(c: Console) -> list[str]:
    return [row.text for row in c.app.screen.log_list.rows]


def chosen(c: Console) -> str:
    return c.app.screen.log_list.chosen_row.text


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(("name", "keys"), [("all", []), ("warnings", ["t", "w", "w", "up"])])
async def test_pictures(name: str, keys: list[str], size: tuple[int, int]) -> None:
    async with console(size, printed) as c:
        await c.press("S", "n", *keys)
        assert same_as_snapshot(f"planner-log-{name}-{size[0]}x{size[1]}", c.text())


async def test_new_lines_are_followed_until_one_goes_up() -> None:
    async with console(NARROW, printed) as c:
        await c.press("S", "n")
        assert c.station.planner_log is not None
        c.station.planner_log.append(line(400))
        await look(c)
        assert chosen(c) == "tour 400 is better" and "follows" in c.text()
        await c.press("up", "up")
        before = chosen(c)
        c.station.planner_log.append(line(401))
        await look(c)
        assert chosen(c) == before and "3 below: F follows" in c.text()
        await c.press("F")
        assert chosen(c) == "tour 401 is better"


async def test_going_up_asks_for_older_lines_until_the_beginning() -> None:
    async with console(NARROW, printed) as c:
        await c.press("S", "n")
        for _ in range(40):
            await c.press("pageup")
        assert chosen(c) == "tour 0 is better" and "from its beginning" in c.text()
        assert len(shown(c)) == len(c.station.planner_log)


async def test_older_lines_push_out_newer_ones_and_follow_brings_them_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planner_log_watch, "MAX_HELD_BYTES", 150)
    async with console(NARROW, printed) as c:
        await c.press("S", "n")
        for _ in range(40):
            await c.press("pageup")
        assert chosen(c) == "tour 0 is better" and len(shown(c)) <= 150
        before = shown(c)
        await look(c)
        assert shown(c) == before
        await c.press("end")
        assert chosen(c) == c.station.planner_log[-1].text


async def test_filters_by_team_level_and_words_ask_for_older_lines() -> None:
    async with console(NARROW, printed) as c:
        await c.press("S", "n", "t")
        assert "team defend" in c.text()
        assert {row.team for row in c.app.screen.log_list.rows} == {"defend"}
        await c.press("t")
        assert {row.team for row in c.app.screen.log_list.rows} == {"attack"}
        await c.press("t")
        assert {row.team for row in c.app.screen.log_list.rows} == {"attack", "defend"}
        await c.press("w", "w", "w")
        assert [row.level.value for row in c.app.screen.log_list.rows] == ["error", "critical"]
        await c.press("escape", "/", *"seldom def", "enter")
        assert shown(c) == ["seldom seen"], "found in the oldest piece"
        await c.press("escape", "/", *"nowhere", "enter")
        assert "no line fits: Esc ends the filter" in c.text()
        await c.press("escape")
        assert len(shown(c)) > 100


async def test_a_long_line_is_read_in_whole_and_hostile_text_is_text() -> None:
    async with console(WIDE, printed) as c:
        await c.press("S", "n", "/", *"zerodiv", "enter")
        assert c.app.screen.panel.text().count("a long story") >= 15
        await c.press("escape", "/", *"[b]bold", "enter")
        assert "␛]52;c;eA==␇ [b]bold[/b] \ufffdevil 表" in c.app.screen.panel.text()


async def test_lines_are_copied() -> None:
    async with console(WIDE, printed) as c:
        await c.press("S", "n", "y")
        row = c.app.screen.log_list.chosen_row
        line_ = f"2026-09-21T14:18:28Z\t{row.team}\tpatrol\tstation\t{row.text}"
        assert c.app.clipboard.splitlines() == ["utc\tteam\tplanner\tlevel\ttext", line_]
        assert "copied to the terminal's clipboard: utc 2026-09-21T14:18:28Z" in c.text()
        await c.press("w", "w", "w", "Y")
        assert len(c.app.clipboard.splitlines()) == 3


async def test_floods_are_named() -> None:
    def flooded(station: FakeStation) -> None:
        printed(station)
        station.lines_left_out = 4000

    async with console(WIDE, flooded) as c:
        await c.press("S", "n")
        assert "4000 LINES LEFT OUT" in c.text()


async def test_a_station_without_a_log_and_keys_without_a_line_say_so() -> None:
    async with console(WIDE) as c:
        await c.press("S", "n")
        assert "this station keeps no planner log" in c.text()
        await c.press("y")
        assert "there is no row to copy" in c.text()
        await c.press("pageup", "home", "F", "t", "w")
        assert "this station keeps no planner log" in c.text()
        c.station.planner_log = []
        await c.press("escape")
        await look(c)
        assert "no planner has printed or logged anything" in c.text()


async def test_a_station_that_came_back_is_read_from_its_end() -> None:
    async with console(NARROW, printed) as c:
        await c.press("S", "n", "pageup")
        c.station.silent = True
        c.clock.advance(10.0)
        c.app.feed.check()
        await c.settle()
        assert "STATION SILENT" in c.text()
        c.station.silent = False
        c.station.planner_log = [line(0, text="a new start")]
        await c.tick()
        await look(c)
        assert shown(c) == ["a new start"]


async def test_nothing_is_asked_while_another_screen_is_shown() -> None:
    async with console(WIDE, printed) as c:
        await c.press("S", "n", "f")
        asked = sum(isinstance(request, GetPlannerLog) for request in c.station.requests)
        screen = c.app.get_screen_stack("planner_log")[0]
        screen.look()
        await c.settle()
        assert sum(isinstance(request, GetPlannerLog) for request in c.station.requests) == asked > 0
