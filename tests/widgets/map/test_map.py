"""The map: geometry, what is drawn where, and that only changed rows are written."""

import math

import numpy as np
import pytest
from textual.app import App, ComposeResult

from tests.screens.rigs.console import WIDE, console
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Zone
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import Annotation, Freshness, RunPhase
from tui_gcs.core.scenario.model import OperatingArea, Round
from tui_gcs.widgets.basics.glyphs import ASCII, UNICODE, heading_glyph, wants_ascii
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_view import MapView
from tui_gcs.widgets.map.map_viewport import Viewport

AREA = OperatingArea(Rectangle((300.0, 200.0), 600.0, 400.0), 20.0, 90.0)


def flight(station: FakeStation) -> None:
    station.fly()


class MapApp(App[None]):
    CSS = "MapView { width: 1fr; height: 1fr; }"

    def __init__(self, map_view: MapView) -> None:
        super().__init__()
        self.map_view = map_view

    def compose(self) -> ComposeResult:
        yield self.map_view


def picture(app: App[None]) -> str:
    return "\n".join(strip.text for strip in app.screen._compositor.render_strips())


def one_zone(zone: Zone) -> Round:
    return Round(name="r", duration_s=60.0, area=AREA, zones=(zone,))


def test_cells_and_world_are_inverse() -> None:
    view = Viewport((300.0, 200.0), 5.0, 70, 30)
    for cell in ((0, 0), (69, 29), (35, 15)):
        assert view.world_to_cell(*view.cell_to_world(*cell)) == cell
    assert view.world_to_cell(math.nan, 0.0) is None


def test_fit_shows_everything_at_a_round_scale() -> None:
    view = Viewport(columns=70, rows=30).fitted((0.0, 0.0, 600.0, 400.0))
    assert view.m_per_dot == 4.5
    assert view.contains(view.world_to_cell(1.0, 1.0))
    assert view.contains(view.world_to_cell(599.0, 399.0))


def test_fit_of_a_point_is_finite() -> None:
    view = Viewport(columns=70, rows=30).fitted((5.0, 5.0, 5.0, 5.0))
    assert view.contains(view.world_to_cell(5.0, 5.0))


def test_line_far_outside_costs_no_dots() -> None:
    raster = DotRaster(10, 5)
    raster.polyline(np.array([[-1e9, -1e9], [1e9, -1e9]]), 1)
    raster.polyline(np.array([[-1e9, 10.0], [1e9, 10.0]]), 2)
    assert raster.dots.sum() == 20
    assert raster.dots[10].all()


def test_infinite_and_unknown_points_draw_nothing() -> None:
    raster = DotRaster(10, 5)
    raster.polyline(np.array([[0.0, 0.0], [np.nan, 3.0]]), 1)
    raster.plot(np.array([[np.inf, 0.0], [np.nan, np.nan]]), 1)
    assert not raster.dots.any()


@pytest.mark.parametrize(("heading_deg", "glyph"), [(0, "▲"), (45, "◥"), (90, "►"), (180, "▼"), (270, "◄"), (359, "▲")])
def test_heading_glyphs(heading_deg: float, glyph: str) -> None:
    assert heading_glyph(UNICODE, heading_deg) == glyph


def test_ascii_is_chosen_where_needed() -> None:
    assert wants_ascii({"TERM": "linux"}, "utf-8")
    assert wants_ascii({"TERM": "xterm"}, "ascii")
    assert wants_ascii({"TUI_GCS_ASCII": "1"}, "utf-8")
    assert wants_ascii({"LANG": "C", "LC_CTYPE": "C.UTF-8"}, "utf-8"), "as Python changes it"
    assert wants_ascii({"LC_ALL": "POSIX", "LANG": "en_GB.UTF-8"}, "utf-8")
    assert not wants_ascii({"LC_CTYPE": "C.UTF-8", "LANG": ""}, "utf-8")
    assert not wants_ascii({"TERM": "xterm-256color"}, "UTF-8")


async def test_roles_differ_without_colour() -> None:
    shape = Rectangle((300.0, 200.0), 200.0, 120.0)
    pictures = set()
    for role in Role:
        app = MapApp(MapView())
        async with app.run_test(size=(72, 30)) as pilot:
            app.map_view.set_scenario(one_zone(Zone("x", role, shape)))
            await pilot.pause()
            lines = picture(app).splitlines()
            pictures.add("\n".join(line for line in lines if "x" not in line))
    assert len(pictures) == len(Role)


@pytest.mark.parametrize(
    "shape",
    [
        Circle((math.nan, 0.0), 10.0),
        Circle((0.0, 0.0), 0.0),
        Rectangle((0.0, 0.0), 1e12, 1.0),
        Polygon(((0.0, 0.0), (10.0, 10.0), (0.0, 10.0), (10.0, 0.0))),
        Polygon(((5.0, 5.0), (5.0, 5.0), (5.0, 5.0))),
    ],
)
@pytest.mark.parametrize("role", list(Role))
async def test_odd_shapes_while_typing_do_no_harm(shape: Circle | Rectangle | Polygon, role: Role) -> None:
    app = MapApp(MapView())
    async with app.run_test(size=(72, 30)) as pilot:
        app.map_view.set_scenario(one_zone(Zone("odd", role, shape)))
        app.map_view.edited_zone = "odd"
        await pilot.pause()
        assert "map" in picture(app)


async def test_hostile_names_are_letters() -> None:
    app = MapApp(MapView(glyphs=ASCII))
    async with app.run_test(size=(72, 30)) as pilot:
        app.map_view.heading = "editing [red]x[/"
        app.map_view.set_scenario(one_zone(Zone("[b]z[/", Role.DEFEND, Circle((300.0, 200.0), 80.0))))
        app.map_view.set_annotations({"t": (Annotation(kind="text", points_m=((300.0, 200.0),), text="[/]漢"),)})
        await pilot.pause()
        assert "editing [red]x[/" in picture(app)
        assert "DEFEND [b]z[/" in picture(app)
        assert "[/]?" in picture(app)


async def test_only_rows_that_changed_are_drawn_again() -> None:
    async with console(WIDE, flight) as c:
        view = c.fly.map_view
        regions: list[object] = []
        refresh = view.refresh
        view.refresh = lambda *args, **kw: regions.extend(args) or refresh(*args, **kw)
        c.station.changes[1] = {"position_m": (500.0, 390.0, 27.0)}
        frame = c.station.frame()
        view.set_fleet(frame, {})
        assert 0 < len(regions) <= 10
        regions.clear()
        view.set_fleet(frame, {})
        assert regions == []


async def test_lost_selected_and_alarmed_vehicles_have_their_marks() -> None:
    async with console(WIDE, flight) as c:
        c.station.changes[5] = {"freshness": Freshness.LOST}
        c.station.changes[7] = {"battery_pct": 20.0}
        await c.tick()
        assert "×!5" in c.text()
        assert "^7" in c.text()


async def test_unknown_positions_are_not_drawn() -> None:
    async with console(WIDE, flight) as c:
        nowhere = (math.nan, math.nan, math.nan)
        for vehicle in range(1, 9):
            c.station.changes[vehicle] = {"position_m": nowhere, "heading_deg": math.nan}
        await c.tick()
        assert "►" not in "".join(line[:60] for line in c.text().splitlines()[2:31])


async def test_labels_never_hide_another_vehicle() -> None:
    async with console(WIDE) as c:
        for vehicle in range(1, 9):
            c.station.changes[vehicle] = {"position_m": (300.0 + 12.0 * vehicle, 350.0, 0.0)}
        await c.tick()
        row = next(line[:64] for line in c.text().splitlines() if line[:64].count("◇") == 8)
        assert row.count("◇") == 8


async def test_trail_fades_after_a_minute() -> None:
    app = MapApp(MapView())
    async with app.run_test(size=(72, 30)) as pilot:
        app.map_view.set_scenario(one_zone(Zone("x", Role.DEFEND, Circle((300.0, 200.0), 50.0))))
        station = FakeStation(MemoryBus(), run=RunPhase.RUNNING)
        for _ in range(30):
            station.t_s += 1.0
            app.map_view.set_fleet(station.frame(), {})
        assert len(app.map_view._painter.trails.points_m()) == 8 * 30
        station.run = RunPhase.IDLE
        station.t_s += 61.0
        app.map_view.set_fleet(station.frame(), {})
        await pilot.pause()
        assert len(app.map_view._painter.trails.points_m()) == 0


async def test_follow_moves_the_view_only_when_needed() -> None:
    async with console(WIDE, flight) as c:
        await c.press("n", "+", "+", "+", "F")
        x_m, y_m, _ = c.app.feed.frame.position_m[0]
        view = c.fly.map_view
        assert view.view.contains(view.view.world_to_cell(x_m, y_m))
        before = view.view
        await c.tick(0.1)
        assert view.view == before
