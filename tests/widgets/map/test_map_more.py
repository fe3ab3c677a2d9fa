"""The map's cursor, measure, layers, crowds, traffic, and discs about vehicles that nobody hears."""

import math
import re

import numpy as np
import pytest

from tests.screens.rigs.console import WIDE, console
from tests.screens.rigs.fake_station import SCENARIO_FILE, FakeStation
from tests.screens.rigs.paper_fleet import PaperFleet
from tests.widgets.map.test_map import AREA, MapApp, picture
from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.protocol.services import OnBoardRow, PlanRow
from tui_gcs.core.protocol.setup import TrafficRow
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Round
from tui_gcs.widgets.basics.glyphs import UNICODE, next_dots
from tui_gcs.widgets.map.map_grid import round_length_m
from tui_gcs.widgets.map.map_layers import Layer
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_view import MapView
from tui_gcs.widgets.map.uncertainty_disc import uncertainty_radius_m

ORIGIN = Origin(52.0, -0.6, 100.0)
EMPTY = Round(name="r", duration_s=60.0, area=AREA, zones=())
PLANE = TrafficRow(
    icao=0x4840D6,
    callsign="KLM123",
    lat_deg=52.001,
    lon_deg=-0.598,
    alt_m=400.0,
    is_geometric=True,
    heading_deg=90.0,
    speed_m_s=80.0,
    climb_m_s=0.0,
    simulated=False,
    heard_by=1,
    age_s=0.5,
    distance_m=400.0,
    above_m=120.0,
)


async def test_without_a_round_the_view_holds_where_vehicles_have_been_until_the_operator_moves_it() -> None:
    """A replay has no round: its vehicles were a small heap in the middle of the map, or beside it."""
    app = MapApp(MapView())
    async with app.run_test(size=(100, 30)):
        view, fleet = app.map_view, FakeStation(MemoryBus(), count=2)

        def fly(x_m: float) -> bool:
            nowhere = (math.nan, math.nan, 0.0)
            fleet.changes[1] = {"position_m": (x_m, 900.0, 30.0)}
            fleet.changes[2] = {"position_m": nowhere if x_m < 1000.0 else (5e6, 0.0, 30.0)}
            view.set_fleet(fleet.frame(), {})
            return view.view.holds((x_m, 900.0, x_m, 900.0))

        assert fly(700.0) and view.view.m_per_dot < 2.0
        before = view.view
        assert fly(702.0) and view.view == before  # it does not move with every metre
        assert fly(1500.0) and view.view.m_per_dot < 20.0
        assert view.view.holds((700.0, 900.0, 700.0, 900.0))
        view.zoom(0.5)
        before = view.view
        assert not fly(3000.0) and view.view == before
        view.fit()
        assert view.view.holds((700.0, 900.0, 3000.0, 900.0))


async def test_cursor_shows_where_it_is_and_measures() -> None:
    app = MapApp(MapView())
    async with app.run_test(size=(100, 30)) as pilot:
        view = app.map_view
        view.set_scenario(EMPTY, (), ORIGIN)
        view.show_cursor()
        await pilot.pause()
        lowest = picture(app).splitlines()[-2]
        assert "52.00180 N 0.59563 W" in lowest
        assert "E 300 N 200 m" in lowest
        assert "30U" in lowest
        at = view.cursor_m
        view.mark()
        view.move_cursor(10, 0)
        await pilot.pause()
        assert view.cursor_m[0] - at[0] == pytest.approx(20 * view.view.m_per_dot, abs=2 * view.view.m_per_dot)
        assert re.search(r"from \+: 8\d\.\d m 0[89]\d", picture(app))
        view.show_cursor(False)
        await pilot.pause()
        assert view.cursor_m is None
        assert "30U" not in picture(app)


async def test_the_view_goes_with_the_cursor_and_layers_go_away() -> None:
    app = MapApp(MapView())
    async with app.run_test(size=(60, 20)) as pilot:
        view = app.map_view
        view.set_scenario(EMPTY, (), ORIGIN)
        view.show_cursor()
        for _ in range(60):
            view.move_cursor(1, 0)
        assert view.view.contains(view.view.world_to_cell(*view.cursor_m))
        assert view.cursor_m[0] > 600.0
        view.show_cursor(False)
        view.fit()
        for layer in Layer:
            before = picture(app)
            shown = view.toggle_layer(layer)
            await pilot.pause()
            assert (layer in view.content.hidden) is not shown
            if layer is Layer.GRID:
                assert picture(app) != before


async def test_traffic_and_overlays_are_named() -> None:
    app = MapApp(MapView())
    async with app.run_test(size=(80, 24)) as pilot:
        view = app.map_view
        view.set_scenario(EMPTY, (), ORIGIN)
        view.set_traffic([PLANE])
        road = Overlay("line", "[b]road", ((52.0, -0.6), (52.003, -0.592)))
        view.set_overlays([road, Overlay("point", "mast", ((52.0005, -0.599),))])
        await pilot.pause()
        assert "*KLM123 +120m" in picture(app)
        assert "[b]road" in picture(app)
        assert "omast" in picture(app)
        view.toggle_layer(Layer.TRAFFIC)
        view.toggle_layer(Layer.OVERLAYS)
        await pilot.pause()
        assert "KLM" not in picture(app)
        assert "mast" not in picture(app)


async def test_a_crowd_is_a_number_and_alarms_stand_out() -> None:
    app = MapApp(MapView())
    async with app.run_test(size=(60, 24)) as pilot:
        view = app.map_view
        view.set_scenario(EMPTY, (), ORIGIN)
        fleet = PaperFleet(MemoryBus(), count=250)
        fleet.fly()
        fleet.changes[7] = {"battery_pct": 5.0}
        view.selected = 100
        view.set_fleet(fleet.frame(), {})
        await pilot.pause()
        shown = picture(app)
        assert "(4)" in shown or "(5)" in shown
        assert "100" in shown


def test_doubt_grows_with_time_and_speed() -> None:
    station = FakeStation(MemoryBus())
    station.fly()
    row = station.frame().row(1)
    lost = row._replace(freshness=Freshness.LOST, age_s=10.0)
    assert uncertainty_radius_m(row) == 0.0
    assert uncertainty_radius_m(lost) == pytest.approx(80.0)
    assert uncertainty_radius_m(lost._replace(velocity_m_s=(0.0, 0.0, 0.0))) == pytest.approx(20.0)
    assert uncertainty_radius_m(lost, silent_s=5.0) == pytest.approx(120.0)
    assert uncertainty_radius_m(lost._replace(armed=False)) == 0.0
    assert uncertainty_radius_m(lost._replace(age_s=math.inf)) == 0.0


def test_quarter_blocks() -> None:
    raster = DotRaster(3, 1)
    raster.plot(np.array([[0.0, 0.0], [1.0, 3.0], [4.0, 2.0], [5.0, 2.0]]), 1)
    letters = np.full(99, ord("#"), dtype=np.uint32)
    assert "".join(map(chr, raster.codes("blocks", letters)[0])) == "▚ ▄"
    assert "".join(map(chr, raster.codes("letters", letters)[0])) == "# #"
    dots = UNICODE.dots
    assert [dots := next_dots(dots) for _ in range(3)] == ["blocks", "letters", "braille"]


@pytest.mark.parametrize(("least_m", "length_m"), [(0.3, 0.5), (1.0, 1.0), (45.0, 50.0), (51.0, 100.0)])
def test_round_lengths(least_m: float, length_m: float) -> None:
    assert round_length_m(least_m) == pytest.approx(length_m)


async def test_plans_that_the_selected_vehicle_is_known_to_hold_are_on_the_map() -> None:
    """Mission, fence, rally; and a layer switches them off."""
    frame = LocalFrame(load(SCENARIO_FILE).origin)

    def item(command: int, x_m: float, y_m: float, *params: float) -> PlanRow:
        lat_deg, lon_deg = frame.to_geodetic(x_m, y_m)
        four = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
        return PlanRow(command, 3, four, round(lat_deg * 1e7), round(lon_deg * 1e7), 20.0)  # type: ignore[arg-type]

    def holding(station: FakeStation) -> None:
        station.fly()
        mission = (item(16, 100.0, 60.0), item(16, 300.0, 60.0))
        fence = (item(5003, 250.0, 200.0, 120.0),)
        station.on_board[3] = OnBoardRow(3, mission, fence, (item(5100, 150.0, 330.0),))

    async with console(WIDE, holding) as c:
        before = c.text()
        assert "fence 3" not in before
        await c.press("3", "enter")
        assert all(word in c.text() for word in ("3.1", "3.2", "fence 3", "R3"))
        await c.press("L", "9", "escape")
        assert "fence 3" not in c.text()
        assert c.station.commands() == []


async def test_a_line_leads_to_where_a_single_vehicle_is_flown_and_none_where_it_is_there() -> None:
    async with console(WIDE, lambda station: station.fly()) as c:
        c.station.changes[3] = {"goal_m": (300.0, 350.0, 41.0)}
        await c.tick()
        assert c.fly.map_view.glyphs.marker + "3" in c.text()
        c.station.changes[3] = {"goal_m": (300.0, 350.0, 41.0), "position_m": (301.0, 350.0, 41.0)}
        await c.tick()
        assert c.fly.map_view.glyphs.marker + "3" not in c.text()
