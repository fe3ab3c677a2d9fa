"""A recording on the screens: keys control its player, and the top line shows where it stands."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.screens.rigs.pictures import same_as_snapshot
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.app import ReplayApp
from tui_gcs.console.parts import ConsoleOptions
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import RunKind
from tui_gcs.core.protocol.planner_log import PlannerLogLevel
from tui_gcs.core.records.planner_log import PlannerLog, log_files
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.station.replay_player import Player
from tui_gcs.widgets.basics.glyphs import UNICODE

LOG = Path(__file__).parents[2] / "data" / "arducopter-8.tlog"
WIDE, NARROW = (120, 40), (80, 24)


@dataclass
class Replay:
    """A console beside the player of a recording."""

    app: ReplayApp
    pilot: QuietPilot
    player: Player
    clock: VirtualClock

    async def run(self, seconds: float) -> None:
        """Let so much time pass, and show what is played."""
        for _ in range(round(seconds / 0.1)):
            self.clock.advance(0.1)
            self.player.tick()
        await self.settle()

    async def settle(self) -> None:
        """Everything asked is answered, and the player is where it was sent."""
        await self.pilot.pause()
        await self.app.workers.wait_for_complete()
        self.player.tick()
        while self.player.searching:
            self.player.tick()
        for _ in range(2):
            self.app.feed.deliver()
            await self.app.feed.idle()
        await self.pilot.pause()

    async def press(self, *keys: str) -> None:
        """Keys, and what they lead to."""
        for key in keys:
            await self.pilot.press(key)
            await self.settle()

    def text(self) -> str:
        """The screen as plain text."""
        strips = self.app.screen._compositor.render_strips()
        return "\n".join(strip.text.rstrip() for strip in strips) + "\n"

    @property
    def top(self) -> str:
        """The top line."""
        return self.text().splitlines()[0]


@asynccontextmanager
async def replay(size: tuple[int, int] = WIDE, log: Path = LOG) -> AsyncIterator[Replay]:
    bus, clock = MemoryBus(), VirtualClock()
    player = Player(log, 1.0, bus, clock)
    app = ReplayApp(bus, "console-test", RunKind.REPLAY, ConsoleOptions(glyphs=UNICODE, replay=True), clock=clock)
    async with app.run_test(size=size):
        attached = Replay(app, QuietPilot(app), player, clock)
        await attached.run(8.0)
        yield attached
    player.close()


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures(size: tuple[int, int]) -> None:
    async with replay(size) as r:
        await r.press("space", "G", "1", ":", "1", "0", "enter")
        assert same_as_snapshot(f"replay-{size[0]}x{size[1]}", r.text())
        await r.press("G", "9", "x", "enter")
        assert same_as_snapshot(f"replay-time-{size[0]}x{size[1]}", r.text())


async def test_space_pauses_and_goes_on() -> None:
    async with replay() as r:
        await r.press("space")
        assert "PAUSED" in r.top and "Space play" in r.text().splitlines()[-1]
        before = r.player.at_s
        await r.run(2.0)
        assert r.player.at_s == before
        await r.press("space")
        assert "► 1x" in r.top and "Space pause" in r.text().splitlines()[-1]


async def test_braces_change_the_speed() -> None:
    async with replay() as r:
        await r.press("right_curly_bracket", "right_curly_bracket")
        assert "► 4x" in r.top
        await r.press(*["left_curly_bracket"] * 3)
        assert "► 0.5x" in r.top


async def test_full_stop_and_comma_go_forward_and_back() -> None:
    async with replay() as r:
        await r.press("space", "full_stop", "full_stop")
        assert "T+00:27/03:49" in r.top
        await r.press("comma")
        assert "T+00:17/03:49" in r.top
        await r.press("comma", "comma", "comma")
        assert "T+00:00/03:49" in r.top


async def test_events_after_the_moment_are_forgotten_when_it_goes_back() -> None:
    async with replay() as r:
        await r.press("space", "G", "4", "7", "enter", "J")
        assert "Arming motors" in r.text()
        await r.press("comma")
        assert "Arming motors" not in r.text()
        assert [event.seq for event in r.app.feed.events.kept] == list(range(1, len(r.app.feed.events.kept) + 1))
        await r.press("full_stop")
        assert r.text().count("Arming motors") == 8


async def test_from_event_to_event_and_alarm_to_alarm() -> None:
    async with replay() as r:
        await r.press("space", "G", "1", ":", "2", "0", "enter", "right_parenthesis")
        assert "Reached command #2" in r.text()
        await r.press("right_parenthesis")
        assert "Mission: 4 WP" in r.text()
        await r.press("left_parenthesis")
        assert "Mission: 4 WP" not in r.text()
        await r.press("greater_than_sign")
        assert "the next alarm: there is none" in r.top
        await r.press("less_than_sign")
        assert "T+00:56" in r.top


async def test_what_is_no_time_says_so_and_esc_leaves() -> None:
    async with replay() as r:
        await r.press("space", "G", "x", "enter")
        assert "no time: 1:35 since the beginning" in r.text()
        await r.press("backspace", "2", "enter")
        assert "T+00:02" in r.top
        await r.press("G", "9", "escape")
        assert "T+00:02" in r.top


async def test_the_help_lists_the_keys_and_commands_stay_refused() -> None:
    async with replay() as r:
        await r.press("question_mark")
        assert "stand still, and go on" in r.text()
        await r.press("escape", "r")
        assert "nothing is commanded" in r.text()


async def test_plots_of_a_replay_are_not_called_live() -> None:
    async with replay() as r:
        await r.press("S", "g")
        r.app.screen.show_all()  # type: ignore[attr-defined]
        await r.settle()
        state = next(line for line in r.text().splitlines() if line.startswith(" window"))
        assert "   replay" in state
        assert "live" not in state
        await r.press("full_stop", "space")
        r.app.screen.show_all()  # type: ignore[attr-defined]
        await r.settle()
        assert "replay, paused" in r.text()


async def test_the_planner_log_follows_the_moment_also_back(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(LOG.read_bytes())
    begin_s, _ = next(iter(read_tlog(path)))
    now_s = begin_s
    log = PlannerLog(log_files(path)[0], lambda: now_s)
    for at_s in (10.0, 20.0, 30.0):
        now_s = begin_s + at_s
        log.write("red", "patrol", PlannerLogLevel.STDOUT, f"planned at {at_s:.0f} s")
    log.close()
    async with replay(log=path) as r:
        await r.press("space", "G", "2", "5", "enter", "S", "n")
        assert "planned at 20 s" in r.text() and "planned at 30 s" not in r.text()
        await r.press("comma")
        r.app.screen.look()  # type: ignore[attr-defined]
        await r.settle()
        assert "planned at 10 s" in r.text() and "planned at 20 s" not in r.text()
