"""The base map under a map: dotted, under everything else, read on a thread, and only what is in view."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from tests.rigs.base_maps import HOSTILE, LAT_DEG, LON_DEG, base_map_file, tile, write_mbtiles
from tests.screens.rigs.fake_station import SCENARIO_FILE
from tests.screens.rigs.pictures import same_as_snapshot
from tests.widgets.map.test_map import MapApp, picture
from tui_gcs.core.formats.base_map_files import read_base_map
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.scenario.load import load
from tui_gcs.widgets.basics.glyphs import ASCII, UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map import base_map_layer
from tui_gcs.widgets.map.base_map_layer import BaseMapState, BaseMapTiles, draw_base_map, tiles_in_view
from tui_gcs.widgets.map.map_layers import Layer
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_view import MapView
from tui_gcs.widgets.map.map_viewport import Viewport

FRAME = LocalFrame(Origin(LAT_DEG, LON_DEG, 0.0))
CLOSE, FAR = Viewport((300.0, 200.0), 1.5, 270, 92), Viewport((300.0, 200.0), 30.0, 100, 34)


def all_read(tiles: BaseMapTiles) -> None:
    """Wait until what was asked for is there."""
    if (thread := tiles._thread) is not None:
        thread.join(20.0)
        assert not thread.is_alive()


def inks(tiles: BaseMapTiles, view: Viewport) -> set[int]:
    draw_base_map(tiles, view, FRAME)
    all_read(tiles)
    return set(np.unique(draw_base_map(tiles, view, FRAME)[0].inks).tolist()) - {Ink.BLANK}


def test_nothing_is_drawn_until_a_tile_is_read_and_each_is_read_once(tmp_path: Path) -> None:
    tiles = BaseMapTiles(read_base_map(base_map_file(tmp_path)))
    told: list[int] = []
    tiles.listen(lambda: told.append(1))
    raster, state = draw_base_map(tiles, CLOSE, FRAME)
    assert not raster.dots.any() and state is BaseMapState.READING
    all_read(tiles)
    raster, state = draw_base_map(tiles, CLOSE, FRAME)
    assert raster.dots.any() and state is BaseMapState.SHOWN
    assert tiles._thread is None and len(told) == len(list(tiles_in_view(tiles.base_map, CLOSE, FRAME)))


def test_farther_out_only_water_and_main_roads_are_drawn(tmp_path: Path) -> None:
    tiles = BaseMapTiles(read_base_map(base_map_file(tmp_path)))
    assert inks(tiles, CLOSE) == {Ink.WATER, Ink.ROAD, Ink.BUILDING, Ink.CONTOUR}
    assert inks(tiles, FAR) == {Ink.WATER, Ink.ROAD}


def test_where_the_view_is_far_wider_than_the_file_nothing_is_read(tmp_path: Path) -> None:
    tiles = BaseMapTiles(read_base_map(base_map_file(tmp_path)))
    world = Viewport((0.0, 0.0), 20_000.0, 100, 34)
    assert list(tiles_in_view(tiles.base_map, world, FRAME)) == []
    raster, state = draw_base_map(tiles, world, FRAME)
    assert not raster.dots.any() and state is BaseMapState.TOO_FAR


def test_another_map_that_has_its_tiles_does_not_cancel_the_reading_for_this_one(tmp_path: Path) -> None:
    tiles = BaseMapTiles(read_base_map(base_map_file(tmp_path)))
    draw_base_map(tiles, CLOSE, FRAME, "plan")
    all_read(tiles)
    with tiles.base_map._lock:  # the thread waits at its first tile
        draw_base_map(tiles, FAR, FRAME, "fly")
        draw_base_map(tiles, CLOSE, FRAME, "plan")
    all_read(tiles)
    assert all(place in tiles._kept for place in tiles_in_view(tiles.base_map, FAR, FRAME))


def test_a_map_that_has_moved_on_wants_only_what_it_shows_now(tmp_path: Path) -> None:
    tiles = BaseMapTiles(read_base_map(base_map_file(tmp_path)))
    with tiles.base_map._lock:
        draw_base_map(tiles, CLOSE, FRAME, "fly")
        draw_base_map(tiles, FAR, FRAME, "fly")
    all_read(tiles)
    assert len(set(tiles_in_view(tiles.base_map, CLOSE, FRAME)) & tiles._kept.keys()) <= 1, "the one under way"


def test_where_the_file_has_nothing_or_is_damaged_the_state_says_so(tmp_path: Path) -> None:
    elsewhere = LocalFrame(Origin(10.0, 10.0, 0.0))
    for data, frame, state in (
        (gzip.compress(tile()), elsewhere, BaseMapState.NOTHING_HERE),
        (b"\x1f\x8b\x08", FRAME, BaseMapState.DAMAGED),
    ):
        tiles = BaseMapTiles(read_base_map(write_mbtiles(tmp_path / state.name, data)))
        draw_base_map(tiles, CLOSE, frame)
        all_read(tiles)
        assert draw_base_map(tiles, CLOSE, frame)[1] is state


def test_tiles_used_last_are_kept_and_pieces_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(base_map_layer, "MAX_KEPT_PIECES", 30)  # of two tiles with 13 each
    tiles = BaseMapTiles(read_base_map(base_map_file(tmp_path)))
    draw_base_map(tiles, CLOSE, FRAME)
    wanted = len(list(tiles_in_view(tiles.base_map, CLOSE, FRAME)))
    all_read(tiles)
    assert wanted > 2 == len(tiles._kept) and tiles._pieces == 26


@pytest.mark.parametrize("lat_deg", [-84.0, 0.0, 84.0])
@pytest.mark.parametrize("lon_deg", [-180.0, 179.999])
def test_at_the_edges_of_the_world_tiles_are_tiles(tmp_path: Path, lat_deg: float, lon_deg: float) -> None:
    base_map = read_base_map(base_map_file(tmp_path))
    for place in tiles_in_view(base_map, CLOSE, LocalFrame(Origin(lat_deg, lon_deg, 0.0))):
        assert 0 <= place.x < 1 << place.zoom and 0 <= place.y < 1 << place.zoom


def test_at_a_pole_there_is_no_base_map(tmp_path: Path) -> None:
    base_map = read_base_map(base_map_file(tmp_path))
    assert list(tiles_in_view(base_map, CLOSE, LocalFrame(Origin(89.0, 0.0, 0.0)))) == []


def test_a_cell_with_anything_else_shows_nothing_of_the_base_map() -> None:
    base, zone = DotRaster(10, 5), DotRaster(10, 5)
    base.polyline(np.array([[0.0, 9.0], [19.0, 9.0]]), Ink.WATER)
    zone.polyline(np.array([[8.0, 0.0], [8.0, 19.0]]), Ink.DEFEND)
    zone.under(base)
    assert zone.inks[2].tolist() == [Ink.WATER] * 4 + [Ink.DEFEND] + [Ink.WATER] * 5
    assert zone.dots[9].tolist() == [True] * 9 + [False] + [True] * 10, "one dot of the line, none of the water"


@pytest.mark.parametrize("size", [(120, 40), (80, 24)], ids=["120x40", "80x24"])
@pytest.mark.parametrize("glyphs", [UNICODE, ASCII], ids=["braille", "ascii"])
async def test_picture_with_a_base_map(tmp_path: Path, size: tuple[int, int], glyphs: GlyphSet) -> None:
    scenario = load(SCENARIO_FILE)
    tiles = BaseMapTiles(read_base_map(write_mbtiles(tmp_path / "town", gzip.compress(tile()))))
    app = MapApp(MapView(glyphs=glyphs))
    async with app.run_test(size=size) as pilot:
        view = app.map_view
        view.set_scenario(scenario.rounds[0], scenario.places, scenario.origin)
        view.set_base_map(tiles)
        await pilot.pause()
        all_read(tiles)
        await pilot.pause()
        shown = picture(app)
        assert HOSTILE[:6] not in shown
        assert same_as_snapshot(f"base-map-{glyphs.dots}-{size[0]}x{size[1]}", shown)
        assert view.base_map_state is BaseMapState.SHOWN
        view.toggle_layer(Layer.BASE_MAP)
        await pilot.pause()
        assert picture(app) != shown
        view.toggle_layer(Layer.BASE_MAP)
        view.zoom(4.0)
        await pilot.pause()
        all_read(tiles)
        await pilot.pause()
        cells = view._cells
        assert cells is not None and np.isin(cells.inks, (Ink.ROAD, Ink.WATER, Ink.BUILDING)).any()
