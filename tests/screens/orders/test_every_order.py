"""Every order of the menu, each way it can go: done, failed, refused, not for who is lost; and none when read-only."""

import math
import random

import pytest

from tests.screens.rigs.console import NARROW, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.actions.orders import ORDERS
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.common import Freshness, Phase

NAN = math.nan
IN_FLIGHT: dict[str, tuple[str, object]] = {
    "photo": ("f enter", setup.UseCamera((3,), "photo")),
    "video": ("y enter", setup.UseCamera((3,), "start")),
    "video off": ("z enter", setup.UseCamera((3,), "stop")),
    "gimbal": ("x enter 1 5 enter enter", setup.PointGimbal((3,), -45.0, 15.0)),
    "mission": ("i y", f.OnBoardMission((3,), "start")),
    "continue": ("c y", f.OnBoardMission((3,), "continue")),
    "altitude": ("u 4 5 enter y", f.GoTo((3,), ((NAN, NAN, 45.0),))),
    "orbit": ("o 4 5 0 space 2 0 0 enter enter enter y", f.CircleFlight((3,), (450.0, 200.0, NAN), 20.0)),
    "follow": ("w 4 enter y", f.Follow((3,), 4)),
    "speed": ("v 5 enter y", f.LimitSpeed((3,), 5.0)),
    "mode": ("m R T L enter y", s.SetMode((3,), "RTL", sure=True)),
}
"""Keys after `c`, and what is asked then."""
ON_GROUND: dict[str, tuple[str, object]] = {
    "take off": ("t 2 0 enter y", f.TakeOff((3,), 20.0)),
    "arm": ("a y", f.Arm((3,))),
    "reboot": ("b 1 enter", s.Reboot((3,))),
}
BEGINS = {order.name for order in ORDERS if order.begins}


def flight(station: FakeStation) -> None:
    station.fly()


def on_its_way(station: FakeStation) -> None:
    station.fly()
    station.changes[3] = {"phase": Phase.BY_HAND, "slot": "", "goal_m": (450.0, 200.0, 30.0)}


async def ask(c: Console, keys: str) -> None:
    await c.press("c", *keys.split())
    if c.app.screen is not c.fly and hasattr(c.app.screen, "tick"):
        c.clock.advance(3.1)  # what takes a number is sent after three seconds
        c.app.screen.tick()
        await c.settle()
        await c.tick(1.0)


def sent(c: Console) -> str:
    """What was asked last, NaN and all."""
    return repr(c.station.commands()[-1]) if c.station.commands() else ""


@pytest.mark.long
@pytest.mark.parametrize("name", [*IN_FLIGHT, *ON_GROUND])
async def test_each_way_an_order_goes(name: str) -> None:
    keys, request = (IN_FLIGHT | ON_GROUND)[name]
    scene = on_its_way if name == "speed" else flight if name in IN_FLIGHT else lambda station: None
    async with console(NARROW, scene) as c:
        await c.press("3", "enter")
        await ask(c, keys)
        assert sent(c) == repr(request)
        c.station.end_task(1, "failed", "denied: it says so")
        c.app.results.follow()
        await c.settle()
        assert "FAILED    denied: it says so" in c.result()
        await ask(c, keys)
        c.station.end_task(2, "done", "")
        c.app.results.follow()
        await c.settle()
        assert f"{name} 3: {'begun' if name in BEGINS else 'done'}" in c.result()
        c.station.refuse = (3,)
        await ask(c, keys)
        assert "REFUSED   prearm: compass" in c.result()
        count = len(c.station.commands())
        c.station.changes[3] = {"freshness": Freshness.LOST}
        await c.tick()
        await c.press("c", keys.split()[0], "enter", "y")
        assert len(c.station.commands()) == count, "not to who is lost"


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({}, "set by its planner"),
        ({"phase": Phase.HOLDING}, "is not on its way"),
        ({"phase": Phase.BY_HAND, "slot": ">2"}, "is not on its way"),
        ({"phase": Phase.BY_HAND, "slot": "", "goal_m": (1.0, 2.0, 3.0), "goal_radius_m": 20.0}, "is not on its way"),
    ],
)
async def test_a_speed_is_not_offered_where_the_station_would_refuse_it(changes: dict[str, object], why: str) -> None:
    async with console(NARROW, flight) as c:
        c.station.changes[3] = changes
        await c.tick()
        await c.press("3", "enter", "c", "v")
        assert f"speed: {why}" in c.text()
        assert c.station.commands() == []


async def test_what_is_typed_replaces_what_stood_in_the_field() -> None:
    async with console(NARROW, flight) as c:
        await c.press("3", "enter")
        await ask(c, "x minus 3 0 enter 9 0 enter enter")
        assert sent(c) == repr(setup.PointGimbal((3,), -30.0, 90.0))
        await ask(c, "x backspace 0 enter enter enter")
        assert sent(c) == repr(setup.PointGimbal((3,), -40.0, 0.0)), "unless the first key changes it"


async def test_a_mission_is_paused_by_a_hold_and_goes_on() -> None:
    """Who flies what is on board is taken out of its team; stops are for everybody."""
    async with console(NARROW, flight) as c:
        c.station.changes[3] = {"phase": Phase.TAKEN_OUT, "mode": "AUTO"}
        await c.tick()
        await c.press("3", "enter")
        await ask(c, "h enter")
        assert c.station.commands() == [m.Hold(vehicles=(3,))]
        c.station.changes[3] = {"phase": Phase.HOLDING, "velocity_m_s": (0.0, 0.0, 0.0)}
        await c.tick()
        assert "hold 3: done" in c.result()
        await ask(c, "c y")
        assert c.station.commands()[-1] == f.OnBoardMission((3,), "continue")


async def test_no_keys_whatever_command_anything_from_a_console_that_only_looks() -> None:
    chance = random.Random(6)
    letters = [*"abcdefghijklmnoprstuvwxyzABDFGJKLNTX0123456789+-/<>*!:?", "space", "enter", "enter", "escape", "tab"]
    keys = [*letters, *("up", "down", "left", "right", "backspace", "delete", "ctrl+g", "ctrl+s", "ctrl+p", "pageup")]
    async with console(NARROW, flight, read_only=True) as c:
        await c.press("s", *"all", "enter", "!", "h", "!", "r", "!", "l", "c", "space", "enter", "a", "o", "escape")
        for _ in range(6):
            await c.press(*chance.choices(keys, k=10), "escape", "escape")
        assert c.station.commands() == []
