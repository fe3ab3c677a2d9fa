"""What a base map costs the fly screen: bytes, CPU, and the CPU of a key that moves the map, with and without it.

The tiles are made here, of a town as dense as an old one: a street every 40 m, a house every 20 m, a river, contours.
"""

import asyncio
import gzip
from collections.abc import Iterator
from pathlib import Path

import mapbox_vector_tile
from rich.color import ColorSystem

from tests.bench.latency import percentile
from tests.bench.row import Row
from tests.bench.screens.costs import KEYS, LIMIT_CPU_PCT, LIMIT_KB_S, LIMIT_KEY_MS, MEASURED_S, press
from tests.rigs.base_maps import SHORE, layer, write_mbtiles
from tests.screens.rigs.meter import Meter, metered
from tui_gcs.core.formats.base_map_files import read_base_map
from tui_gcs.widgets.map.base_map_layer import BaseMapTiles
from tui_gcs.widgets.map.map_view import MapView

CASES = (((120, 40), 50), ((120, 40), 250), ((200, 60), 250))
TILE_UNITS, STREET_UNITS, HOUSE_UNITS = 4096, 220, 110
"""A tile of zoom 15 is 750 m wide here."""
READ_S = 60.0
"""All tiles in view are read within this time, or the figures would be of a map without them."""


def town() -> bytes:
    """A vector tile of a dense town, packed."""
    streets = ", ".join(
        f"({at} 0, {at + 30} {TILE_UNITS}), (0 {at}, {TILE_UNITS} {at + 30})"
        for at in range(0, TILE_UNITS, STREET_UNITS)
    )
    houses = ", ".join(
        f"(({x} {y}, {x + 60} {y}, {x + 60} {y + 50}, {x} {y + 50}, {x} {y}))"
        for x in range(20, TILE_UNITS, HOUSE_UNITS)
        for y in range(20, TILE_UNITS, HOUSE_UNITS)
    )
    contours = ", ".join(f"(0 {y}, 1500 {y + 200}, {TILE_UNITS} {y - 100})" for y in range(100, TILE_UNITS, 400))
    layers = [
        layer("water", (SHORE, {"class": "river"})),
        layer("transportation", (f"MULTILINESTRING({streets})", {"class": "minor"})),
        layer("building", (f"MULTIPOLYGON({houses})", {})),
        layer("contour", (f"MULTILINESTRING({contours})", {"ele": 40})),
    ]
    return gzip.compress(mapbox_vector_tile.encode(layers, default_options={"y_coord_down": True}))


def base_maps(folder: Path) -> Iterator[Row]:
    """Each case without and with the base map, so that what it costs can be seen on a busy machine, too."""
    file = write_mbtiles(folder / "town.mbtiles", town(), range(12, 16))
    for size, count in CASES:
        for shown in (None, file):
            yield from asyncio.run(fly_screen(shown, size, count))


async def fly_screen(file: Path | None, size: tuple[int, int], count: int) -> list[Row]:
    """Return the figures of one case."""
    async with metered(count, ColorSystem.EIGHT_BIT, size=size) as meter:
        if file is not None:
            await show(meter, BaseMapTiles(read_base_map(file)))
        await meter.fly(2.0)
        flown = [await meter.fly(1.0) for _ in range(MEASURED_S)]
        keys = ("left", "right", "up", "down")
        key_ms = [1000 * await press(meter, keys[at % len(keys)]) for at in range(KEYS)]
    written, cpu_s = (sum(column) for column in zip(*flown, strict=True))
    kind = "a base map" if file is not None else "no base map"
    title = f"fly at {size[0]}x{size[1]}, {kind}, {count} vehicles"
    # At 200x60 twice as much is drawn with or without a base map: the figures stand there to be compared.
    is_limited = size == CASES[0][0]
    return [
        Row(f"{title}: written", written / MEASURED_S / 1000, "kB/s", LIMIT_KB_S if is_limited else None),
        Row(f"{title}: CPU", 100 * cpu_s / MEASURED_S, "%", LIMIT_CPU_PCT if is_limited else None),
        Row(f"{title}: CPU of a key, p95", percentile(key_ms, 95), "ms", LIMIT_KEY_MS),
    ]


async def show(meter: Meter, tiles: BaseMapTiles) -> None:
    """Show a base map, and wait until all tiles in view are read and drawn."""
    meter.app.screen.query_one(MapView).set_base_map(tiles)
    await meter.painted()
    assert await asyncio.to_thread(tiles.wait, READ_S), "the tiles in view are not read"
    await meter.painted()
