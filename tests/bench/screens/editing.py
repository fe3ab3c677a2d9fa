"""What a key costs where a scenario and missions are edited: processor time, from the key to the picture."""

import asyncio
import gc
import math
import statistics
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from textual.events import Key

from tests.bench.row import Row
from tui_gcs.app import ConsoleApp
from tui_gcs.core.base.clock import MonotonicClock
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.screens.missions.missions_screen import MissionsScreen

VEHICLES, ITEMS = 8, 1000
LIMIT_MS, WORST_MS = 50.0, 100.0
SIZE = (120, 40)
TIMES, SETTLES_S = 10, 2.0


def editing(_folder: Path) -> Iterator[Row]:
    """Median and worst of each kind of key."""
    yield from asyncio.run(_measured())


async def _measured() -> list[Row]:
    from tests.screens.rigs.mission_station import MissionStation

    bus = MemoryBus()
    station = MissionStation(bus)
    app = ConsoleApp(bus, "bench", clock=MonotonicClock())
    rows: list[Row] = []
    gc.freeze()  # as `attach` does, before the first screen
    async with app.run_test(size=SIZE):
        station.tick(0.1)
        await asyncio.sleep(SETTLES_S)
        await _cost(app, ["p"])
        rows += await _rows(app, "zone editor", [
            ("next zone", ["down", "up"], []),
            ("moved on the map", ["right", "left"], ["e"]),
            ("letter in a field", ["1", "2"], ["escape", "tab", "end"]),
            ("digit of a radius", ["backspace", "0"], ["escape", "1", *["tab"] * 6, "end"]),
            ("settings opened and closed", ["g", "escape"], ["escape"]),
        ])  # fmt: skip
        await _cost(app, ["escape", "m"])
        screen = app.screen
        assert isinstance(screen, MissionsScreen)
        screen.editor.take("bench", _long_missions(screen))
        screen.did("")
        rows += await _rows(app, f"missions of {VEHICLES} x {ITEMS}", [
            ("next item", ["down", "up"], []),
            ("last and first item", ["end", "home"], []),
            ("next vehicle", ["n", "N"], []),
            ("item moved on the map", ["right", "left"], ["e"]),
            ("digit of a height", ["1", "backspace"], ["escape", "down", *["tab"] * 4, "end"]),
            ("item added and deleted", ["plus", "delete"], ["escape"]),
            ("undo and redo", ["u", "Y"], []),
            ("all items moved", ["right", "left"], ["E"]),
        ])  # fmt: skip
        begin_s = time.process_time()
        gc.collect()  # the console does it while nobody types: a key that comes just then waits for it
        took_ms = (time.process_time() - begin_s) * 1000.0
        rows.append(Row("garbage of all these keys, collected when nobody types", took_ms, "ms"))
    return rows


async def _rows(app: ConsoleApp, where: str, parts: Sequence[tuple[str, list[str], list[str]]]) -> list[Row]:
    rows = []
    for name, keys, before in parts:
        await _cost(app, before)
        costs = [await _cost(app, [key]) for _ in range(TIMES) for key in keys]
        rows.append(Row(f"{where}: {name}, median", statistics.median(costs), "ms", LIMIT_MS))
        rows.append(Row(f"{where}: {name}, worst of {len(costs)}", max(costs), "ms", WORST_MS))
    return rows


async def _cost(app: ConsoleApp, keys: list[str]) -> float:
    """Processor time in ms until all that follows from these keys is drawn."""
    begin_s = time.process_time()
    for key in keys:
        seen, drawn = asyncio.Event(), asyncio.Event()
        app.post_message(Key(key, key if len(key) == 1 else None))
        app.call_later(seen.set)
        await seen.wait()
        while not app.keys.is_idle:
            await asyncio.sleep(0)
        app.screen.call_after_refresh(drawn.set)
        await drawn.wait()
    return (time.process_time() - begin_s) * 1000.0


def _long_missions(screen: MissionsScreen) -> MissionDraft:
    """Rings about the middle, of each vehicle on its own layer, within fences of a hundred corners."""
    frame, vehicles = screen.editor.frame, {}
    for v in range(1, VEHICLES + 1):
        height_m = 20.0 + 7.0 * v
        angles = [math.tau * i / 97 for i in range(ITEMS)]
        places = [
            (300 + (60 + 0.1 * i) * math.cos(a), 200 + (60 + 0.1 * i) * math.sin(a)) for i, a in enumerate(angles)
        ]
        turns = [math.tau * i / 100 for i in range(100)]
        corners = [(300 + 190 * math.cos(turn), 200 + 190 * math.sin(turn)) for turn in turns]
        fence = fences.polygon([frame.to_geodetic(*corner) for corner in corners])
        vehicles[v] = VehicleDraft(build.path_items(frame, places, height_m), fence)
    return MissionDraft(vehicles)
