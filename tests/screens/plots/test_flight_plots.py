"""Plots of recorded flights: the program of `tui-gcs plot`, from a log to the moment at the cursor."""

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.core.records.onboard_log_files import copter_log
from tests.core.records.test_flight_series import START_S, VEHICLE, attitude, heartbeat, param, tlog
from tests.screens.plots.test_plots_screen import typed
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tests.screens.rigs.quiet_pilot import QuietPilot
from tui_gcs.console.flight_plot_app import FlightPlotApp
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Hold, RunKind
from tui_gcs.core.records.onboard_series import open_flight
from tui_gcs.feed.live_watch import LiveWatch
from tui_gcs.feed.plots.flight_source import FlightPlotSource, joined
from tui_gcs.feed.plots.plot_layout import WHOLE_FLIGHT, PlotLayout
from tui_gcs.widgets.basics.glyphs import UNICODE

WIDE, NARROW = (120, 40), (80, 24)
STILL_S = 33.0
"""The vehicle rolls until then and is level afterwards."""


def recorded(folder: Path) -> Path:
    records = [(0.0, heartbeat(VEHICLE))]
    records += [
        (at * 0.5, attitude(VEHICLE, math.sin(at / 5) / 2 if at * 0.5 < STILL_S else 0.0)) for at in range(1, 121)
    ]
    records.append((60.0, param(VEHICLE, "WPNAV_SPEED", 500.0)))
    return tlog(folder / "flight.tlog", *records)


class Plots:
    def __init__(self, app: FlightPlotApp) -> None:
        self.app, self.pilot = app, QuietPilot(app)

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()
        # Under a dialog nothing is read.
        while self.app.plots.flight.is_reading and self.app.screen is self.app.plots:
            self.app.plots.read_on()
            await self.app.workers.wait_for_complete()
        self.app.plots.read_on()
        await self.pilot.pause()

    def text(self) -> str:
        strips = self.app.screen._compositor.render_strips()
        return "\n".join(strip.text.rstrip() for strip in strips) + "\n"


@asynccontextmanager
async def plots(folder: Path, size: tuple[int, int] = WIDE, at_s: float | None = None) -> AsyncIterator[Plots]:
    source = FlightPlotSource([open_flight(recorded(folder))])
    layout = PlotLayout(window=WHOLE_FLIGHT)
    app = FlightPlotApp(source, "flight.tlog", layout, folder=folder, glyphs=UNICODE, at_s=at_s)
    async with app.run_test(size=size):
        shown = Plots(app)
        await shown.press()
        yield shown


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures(tmp_path: Path, size: tuple[int, int]) -> None:
    async with plots(tmp_path, size) as p:
        await p.press(*typed("attitude.roll"))
        await p.press(*["left"] * 30)
        assert same_as_snapshot(f"plots-flight-{size[0]}x{size[1]}", p.text())


async def test_what_flies_meanwhile_is_on_a_line_and_hold_all_holds_it(tmp_path: Path) -> None:
    live, clock = FakeStation(MemoryBus(), kind=RunKind.LIVE), VirtualClock()
    source = FlightPlotSource([open_flight(recorded(tmp_path))])
    watch = LiveWatch({RunKind.LIVE: live.bus}, "plot-test", clock)
    app = FlightPlotApp(source, "f.tlog", PlotLayout(window=WHOLE_FLIGHT), glyphs=UNICODE, beside=watch, clock=clock)
    rung: list[str] = []
    app.bell = lambda: rung.append("bell")  # type: ignore[method-assign]
    async with app.run_test(size=NARROW):
        p = Plots(app)
        await p.press("exclamation_mark", "h")
        assert "nothing sent: plots" in p.text() and live.requests == []
        live.fly()
        live.tick(0.5)
        app.look_at_what_flies()
        await p.press()
        assert "8 ARMED" in p.text().splitlines()[1] and rung == ["bell"]
        for key in "abcdefgimnoprstuvwxyz":
            await p.press(key, "escape", "escape")
        await p.press("exclamation_mark", "r", "exclamation_mark", "l")
        assert live.requests == []
        await p.press("exclamation_mark", "h")
        assert [type(request) for request in live.requests] == [Hold]
        assert "HOLD ALL LIVE: sent to 8" in p.text()


async def test_the_whole_flight_is_shown_and_a_moment_is_found(tmp_path: Path) -> None:
    async with plots(tmp_path) as p:
        await p.press(*typed("attitude.roll"))
        assert p.app.plots.span() == pytest.approx((START_S, START_S + 60.0))
        await p.press("x", *["left"] * 50, *["left_square_bracket"] * 8)
        from_s, to_s = p.app.plots.span()
        assert to_s - from_s == 30.0 and from_s < START_S + STILL_S < to_s
        await p.press("end")
        assert p.app.plots.span()[1] == pytest.approx(START_S + 60.0)


async def test_parameters_of_a_flight_are_plotted(tmp_path: Path) -> None:
    async with plots(tmp_path) as p:
        await p.press(*typed("wpnav"))
        assert "500" in p.text()


async def test_views_are_kept_for_the_next_flight(tmp_path: Path) -> None:
    async with plots(tmp_path) as p:
        await p.press(*typed("attitude.roll"), "W", *"roll", "enter")
    async with plots(tmp_path) as p:
        await p.press("i", "enter")
        assert [value.label for value in p.app.plots.plan.values] == [
            "v1 ATTITUDE.roll"
        ] and "ATTITUDE.roll" in p.text()


async def test_help_and_leaving(tmp_path: Path) -> None:
    async with plots(tmp_path) as p:
        await p.press("question_mark")
        assert "find" in p.text() or "a value: words" in p.text()
        await p.press("escape", "q")
        assert p.app._exit


def test_logs_are_joined_by_time(tmp_path: Path) -> None:
    own = tmp_path / "own.bin"
    own.write_bytes(copter_log())
    source = FlightPlotSource([open_flight(recorded(tmp_path)), open_flight(own)])
    assert source.vehicles == (1, 7)
    values = [name.of((1, 7)) for name in source.names() if name.name in ("POS.RelHomeAlt", "ATTITUDE.roll")]
    assert [value.subject for found in values for value in found] == [7, 1]
    source.follow([value for found in values for value in found])
    assert source.is_reading
    source.read()
    assert not source.is_reading and all(len(source.points(found[0])[0]) for found in values)


def test_one_value_in_two_logs_is_one_curve_with_a_gap() -> None:
    first, second = (np.array([1.0, 2.0]), np.array([5.0, 6.0])), (np.array([8.0, 9.0]), np.array([7.0, 8.0]))
    times_s, values = joined([second, first])
    assert (np.diff(times_s) > 0).all() and np.isnan(values[[2, -1]]).all()
    assert values[~np.isnan(values)].tolist() == [5.0, 6.0, 7.0, 8.0]


def test_a_log_that_vanished_is_reported(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    source = FlightPlotSource([open_flight(path)])
    source.follow(list(next(name for name in source.names() if name.name == "ATTITUDE.roll").of((1,))))
    path.unlink()
    source.read()
    assert "cannot be read" in source.error and not source.is_reading


async def test_the_cursor_begins_at_the_moment_that_was_asked_for(tmp_path: Path) -> None:
    async with plots(tmp_path, NARROW, at_s=START_S + 20.0) as p:
        moment = p.app.plots.source.time_words(START_S + 20.0)
        assert f"cursor {moment}: x hides it" in p.text()
        await p.press(*typed("attitude.roll"))
        assert f"[{moment}]" in p.text() and " AT " in p.text()
        await p.press("x")
        assert "cursor " + moment not in p.text()


async def test_the_help_of_the_plots_begins_with_the_panes(tmp_path: Path) -> None:
    async with plots(tmp_path) as p:
        await p.press("question_mark")
        assert " Panes " in p.text() and " Here " in p.text() and " Map " not in p.text()
