"""Pictures of every question, list and box over a screen, at 80x24 and 120x40."""

import pytest

from tests.screens.rigs.console import NARROW, WIDE, console
from tests.screens.rigs.fake_station import FakeStation, trouble
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.common import RunKind, RunPhase
from tui_gcs.feed.order_tracker import OrderState, VehicleProgress
from tui_gcs.screens.orders.vehicle_words import brief_words, now_words, rows_of


def ground(_station: FakeStation) -> None:
    pass


def flight(station: FakeStation) -> None:
    station.fly()


def hold(station: FakeStation) -> None:
    station.fly()
    station.run = RunPhase.HOLD


SELECT_TWO = ("s", "2", "minus", "3", "enter")
PICTURES = {
    "start-sim": (ground, ("space",)),
    "round-ground": (ground, ("o",)),
    "round-flight": (flight, ("o", "3")),
    "menu-ground": (ground, ("2", "enter", "c")),
    "menu-flight": (flight, (*SELECT_TWO, "c")),
    "menu-refused": (flight, (*SELECT_TWO, "c", "t", "h")),
    "order-value": (flight, (*SELECT_TWO, "c", "u")),
    "order-yes": (flight, ("2", "enter", "c", "u", "4", "0", "enter")),
    "order-enter": (flight, (*SELECT_TWO, "c", "h")),
    "order-count": (ground, (*SELECT_TWO, "c", "a")),
    "order-last-seconds": (ground, (*SELECT_TWO, "c", "a", "2", "enter")),
    "nudge": (flight, ("2", "enter", "c", "n", "y")),
    "result": (hold, (*SELECT_TWO, "c", "h", "enter")),
    "alarms": (trouble, ("A",)),
    "palette": (flight, ("colon", "o", "r")),
    "help": (flight, ("question_mark",)),
    "layers": (flight, ("L",)),
    "planners": (flight, ("M",)),
    "journal": (trouble, ("J",)),
}


@pytest.mark.parametrize("size", [NARROW, WIDE], ids=["80x24", "120x40"])
@pytest.mark.parametrize("name", PICTURES)
async def test_pictures(name: str, size: tuple[int, int]) -> None:
    prepare, keys = PICTURES[name]
    async with console(size, prepare) as c:
        await c.press(*keys)
        if name == "result":  # what came of it is seen in telemetry
            await c.tick()
        assert same_as_snapshot(f"box-{name}-{size[0]}x{size[1]}", c.text())


LATE = VehicleProgress(5, OrderState.NOT_SEEN, "asked, but telemetry does not show it")
LONG = "would come within 10 m of vehicle 6 in 4 s: it is flown to the layer of that one by its planner"
REFUSED = [VehicleProgress(v, OrderState.REFUSED, LONG) for v in (2, 4)]


@pytest.mark.parametrize("size", [NARROW, WIDE], ids=["80x24", "120x40"])
@pytest.mark.parametrize("crowd", [False, True], ids=["few", "all"])
async def test_pictures_of_bad_news(crowd: bool, size: tuple[int, int]) -> None:
    """The reasons whole while there is room for them, and always all of how the vehicles are now."""
    async with console(size, flight) as c:
        every = [VehicleProgress(v, OrderState.NOT_SEEN, f"{LATE.text} ({v})") for v in (1, 3, 5, 6, 7, 8)]
        results = [*REFUSED, *(every if crowd else [LATE, VehicleProgress(7, OrderState.DONE, "holds")])]
        panel = c.app.results.panel()
        await c.settle()
        panel.show(("hold all", results), [], rows_of(c.app.feed).get, now_words, brief_words)
        await c.settle()
        rows = c.result().splitlines()
        assert sum("m/s" in row for row in rows) == len(results)
        assert same_as_snapshot(f"box-result-{'all' if crowd else 'few'}-{size[0]}x{size[1]}", c.text())


@pytest.mark.parametrize("name", ["count", "last-seconds"])
async def test_pictures_of_a_live_start(name: str) -> None:
    async with console(NARROW, kind=RunKind.LIVE) as c:
        await c.press("space", *(("8", "enter") if name == "last-seconds" else ()))
        assert same_as_snapshot(f"box-start-live-{name}-80x24", c.text())


@pytest.mark.parametrize("keys", [(), ("!",), ("!", "h")], ids=["trouble", "prefix", "held"])
async def test_pictures_of_the_tiny_screen(keys: tuple[str, ...], request: pytest.FixtureRequest) -> None:
    async with console((40, 10), trouble) as c:
        await c.press(*keys)
        assert "LOST in the air" in c.text() and "!h HOLD ALL" in c.text()
        assert same_as_snapshot(f"tiny-{request.node.callspec.id}-40x10", c.text())
