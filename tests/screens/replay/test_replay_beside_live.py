"""A replay while a station flies: its news are on every screen, HOLD ALL reaches it, and no other key does."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest

from tests.screens.replay.test_replay_console import LOG, NARROW, WIDE, Replay
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.actions.scopes import SCOPES
from tui_gcs.app import ReplayApp
from tui_gcs.console.parts import ConsoleOptions
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.station.replay_player import Player
from tui_gcs.feed.live_watch import LiveWatch
from tui_gcs.widgets.basics.glyphs import UNICODE


@dataclass
class ReplayBesideLive(Replay):
    """A replay with a LIVE and a SIM station on this computer."""

    live: FakeStation
    sim: FakeStation
    rung: list[float]

    async def tick(self, *stations: FakeStation, seconds: float = 0.5) -> None:
        """Those stations publish, and the console looks."""
        self.clock.advance(seconds)
        for station in stations:
            station.tick(seconds)
        self.app.look_at_what_flies()
        await self.settle()

    @property
    def third(self) -> str:
        """The line below status and alarm."""
        return self.text().splitlines()[2]


@asynccontextmanager
async def beside(size: tuple[int, int] = WIDE) -> AsyncIterator[ReplayBesideLive]:
    bus, clock = MemoryBus(), VirtualClock()
    player = Player(LOG, 1.0, bus, clock)
    live, sim = FakeStation(MemoryBus(), kind=m.RunKind.LIVE), FakeStation(MemoryBus())
    watch = LiveWatch({m.RunKind.LIVE: live.bus, m.RunKind.SIM: sim.bus}, "replay-test", clock)
    options = ConsoleOptions(glyphs=UNICODE, replay=True, beside=watch)
    app = ReplayApp(bus, "console-test", m.RunKind.REPLAY, options, clock=clock)
    rung: list[float] = []
    app.bell = lambda: rung.append(clock.now())  # type: ignore[method-assign]
    async with app.run_test(size=size):
        attached = ReplayBesideLive(app, QuietPilot(app), player, clock, live, sim, rung)
        await attached.run(8.0)
        yield attached
    player.close()


def lost(station: FakeStation) -> None:
    station.changes = {3: {"freshness": m.Freshness.LOST}}


def alarmed(station: FakeStation) -> None:
    station.alarm = "battery low"


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures(size: tuple[int, int]) -> None:
    async with beside(size) as r:
        await r.press("space")
        r.live.fly()
        lost(r.live)
        await r.tick(r.live)
        assert same_as_snapshot(f"replay-beside-live-{size[0]}x{size[1]}", r.text())


async def test_without_a_station_there_is_no_third_line_and_hold_all_says_that_nothing_is_commanded() -> None:
    async with beside() as r:
        await r.tick()
        assert "NOW" not in r.third
        await r.press("exclamation_mark", "h")
        assert "nothing is commanded from here" in r.text()


@pytest.mark.parametrize("screen_keys", [[], ["v"], ["J"], ["S", "f"], ["question_mark"], ["G"]])
async def test_it_is_a_replay_on_every_screen_and_what_flies_is_beside_it(screen_keys: list[str]) -> None:
    async with beside() as r:
        await r.press(*screen_keys)
        await r.tick(r.sim)
        assert r.top.startswith(" REPLAY ") and "NOW  SIM  8/8 heard" in r.third
        assert "q goes back  !h HOLD ALL of this" in r.third


@pytest.mark.parametrize(
    ("happens", "words"),
    [(FakeStation.fly, "8 ARMED"), (lost, "LOST 3"), (alarmed, "battery low")],
    ids=["arming", "lost vehicle", "alarm"],
)
async def test_what_happens_to_the_live_fleet_rings_once_and_is_shown(
    happens: Callable[[FakeStation], None], words: str
) -> None:
    async with beside(NARROW) as r:
        await r.tick(r.live)
        assert not r.rung
        happens(r.live)
        await r.tick(r.live)
        assert words in r.third and "q back  !h HOLDS this" in r.third and len(r.rung) == 1
        await r.tick(r.live)
        assert len(r.rung) == 1


async def test_a_silent_station_is_said_and_an_ended_one_is_gone() -> None:
    async with beside() as r:
        await r.tick(r.live)
        await r.tick(seconds=4.0)
        assert "! NOW  LIVE station silent for 4 s" in r.third and len(r.rung) == 1
        await r.tick(seconds=1.0)
        assert "silent for 5 s" in r.third and len(r.rung) == 1
        await r.tick(r.live)
        assert "LIVE  8/8 heard" in r.third


async def test_of_two_stations_the_worse_is_first() -> None:
    async with beside() as r:
        r.sim.fly()
        await r.tick(r.live, r.sim)
        assert r.third.index("SIM  8 ARMED") < r.third.index("LIVE  8/8 heard")


async def test_a_terminal_that_is_too_small_shows_what_happens() -> None:
    async with beside((60, 12)) as r:
        r.live.fly()
        await r.tick(r.live)
        assert "NOW LIVE 8 ARMED" in " ".join(r.text().split())


@pytest.mark.parametrize("screen_keys", [[], ["G"], ["question_mark"], ["S"]])
async def test_hold_all_holds_every_fleet_that_flies_also_from_dialogs(screen_keys: list[str]) -> None:
    async with beside() as r:
        r.live.fly()
        r.sim.fly()
        await r.tick(r.live, r.sim)
        await r.press(*screen_keys)
        await r.pilot.press("exclamation_mark")
        assert "h HOLD ALL of LIVE and SIM NOW" in r.text()
        await r.press("h")
        for station in (r.live, r.sim):
            assert [type(request) for request in station.requests] == [m.Hold]
            assert station.requests[0].vehicles == ()
        assert "HOLD ALL LIVE: sent to 8" in r.text()
        await r.tick(r.live)
        assert "8 ARMED  HOLD" in r.third


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_a_vehicle_that_does_not_hold_is_named(size: tuple[int, int]) -> None:
    async with beside(size) as r:
        r.live.fly()
        r.live.refuse = (4,)
        await r.tick(r.live)
        await r.press("exclamation_mark", "h")
        assert "HOLD ALL LIVE NOT DONE for 4: " in r.text()


async def test_no_other_key_reaches_what_flies() -> None:
    async with beside() as r:
        r.live.fly()
        await r.tick(r.live)
        bound = {key for scope in ("app", "fly", "replay") for action in SCOPES[scope] for key in action.keys}
        letters = set("abcdefghijklmnoprstuvwxyzABCDEFGHIJKLMNOPRSTUVWXYZ123")
        for key in sorted((bound | letters | {"enter", "space", "delete"}) - {"q", "exclamation_mark"}):
            await r.pilot.press(key, "enter", "y", "escape", "escape")
        for second in ("r", "l"):
            await r.press("exclamation_mark", second)
            assert "NOT DONE: replay: nothing is commanded from here" in r.text()
        assert r.live.requests == []


async def test_a_sample_that_cannot_be_read_changes_nothing() -> None:
    async with beside() as r:
        await r.tick(r.live)
        r.live.bus.publish(keys.STATUS, b"\xff")
        r.live.bus.publish(keys.FLEET, b"\x1b[2J")
        await r.tick()
        assert "LIVE  8/8 heard" in r.third
