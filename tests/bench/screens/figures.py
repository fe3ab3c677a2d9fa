"""What each screen costs with 50 and 250 vehicles in flight, in lock-step: bytes, CPU, and the CPU of a key.

The station is made of paper and in the same process: its answers are a part of the CPU, so the figures are at most too
high. A key is `down` in a list that is full; its CPU is that from the key to the picture.
"""

import asyncio
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from msgspec.structs import replace
from rich.color import ColorSystem

from tests.bench.latency import percentile
from tests.bench.row import Row
from tests.bench.screens.base_map import base_maps
from tests.bench.screens.costs import KEYS, LIMIT_CPU_PCT, LIMIT_KB_S, LIMIT_KEY_MS, MEASURED_S, press, settled
from tests.screens.inspect.test_inspector_screen import HERTZ, NAMES, row
from tests.screens.links.test_links_screen import LAN, link, path
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.meter import Meter, metered
from tests.screens.setup.test_setup_screen import sections
from tui_gcs.core.protocol.common import PointOfInterest, Track
from tui_gcs.core.protocol.inspection import Inspection
from tui_gcs.core.protocol.link_report import LinkReport
from tui_gcs.core.protocol.services import ParamRow, TaskInfo
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.plots.live_plots_screen import LivePlotsScreen

COUNTS = (50, 250)
PARAMETERS = 1327
"""Of an ArduCopter 4.7."""
TRACKS, TASKS = 30, 60


def parameters(station: FakeStation) -> None:
    """The parameters of all, one of a hundred different on each vehicle."""
    for vehicle in range(1, station.count + 1):
        rows = (
            ParamRow(f"GROUP{at // 20:02}_NAME{at:04}", float(vehicle if at % 100 == 0 else at), "real32", float(at))
            for at in range(PARAMETERS)
        )
        station.params[vehicle] = {each.name: each for each in rows}


def inspected(station: FakeStation) -> None:
    """Five messages of each vehicle, which go on coming."""
    rows = [row(vehicle, msgid) for vehicle in range(1, station.count + 1) for msgid in NAMES]
    counts = tuple(replace(each, count=round(HERTZ[each.key.msgid] * station.t_s)) for each in rows)
    station.inspection = Inspection(station.t_s, counts, ())


def linked(station: FakeStation) -> None:
    """A link with a path to each vehicle, whose losses change."""
    lost = tuple(
        path(vehicle, LAN, loss_pct=(vehicle + station.t_s) % 7, frames=round(40 * station.t_s))
        for vehicle in range(1, station.count + 1)
    )
    carried = link(LAN, vehicles=station.count, bytes_in=round(9000 * station.t_s), frames=round(200 * station.t_s))
    station.link_report = LinkReport(station.t_s, (carried,), lost, (), passed=0)


def crowded(station: FakeStation) -> None:
    """Thirty tracks that move, ten tasks for planners."""
    station.tracks = tuple(
        Track(n, (20.0 * n, station.t_s, 40.0), (0.0, 1.0, 0.0), (4.0, 0.0, 4.0), station.t_s, 0.0, (1,), True)
        for n in range(TRACKS)
    )
    station.points = tuple(PointOfInterest(f"p{n}", (10.0 * n, 0.0), 1.0, "", 0.0, 1e6) for n in range(10))


def busy(station: FakeStation) -> None:
    """Downloads of sixty vehicles that go on."""
    station.tasks = {
        n: TaskInfo(
            number=n,
            vehicle=n,
            what="log 1",
            state="running",
            done=round(station.t_s),
            total=1000,
            text="",
            who="you",
            age_s=1.0,
        )
        for n in range(1, min(TASKS, station.count) + 1)
    }


def fitted(station: FakeStation) -> None:
    """The setup of all."""
    station.setup = tuple(each for vehicle in range(1, station.count + 1) for each in sections(vehicle))


SCREENS: dict[str, tuple[str, Callable[[FakeStation], None], tuple[str, ...]]] = {
    "fly": ("f", lambda station: None, ()),
    "parameters": ("p", parameters, ()),
    "inspector": ("i", inspected, ()),
    "links, paths": ("l", linked, ("w",)),
    "setup": ("s", fitted, ()),
    "logs on vehicles": ("o", lambda station: None, ()),
    "flights": ("f", lambda station: None, ()),
    "plots": ("g", lambda station: None, ("slash", *"altitude", "enter", "escape")),
    "traffic": ("a", crowded, ()),
    "tasks": ("t", busy, ()),
    "settings": ("e", lambda station: None, ()),
}
"""Letter in the menu of screens, what the station knows at every look, and keys that are pressed first."""


def screens(folder: Path) -> Iterator[Row]:
    """All screens, and the fly screen with a base map."""
    for count in COUNTS:
        for name in SCREENS:
            yield from asyncio.run(one_screen(name, count))
    yield from base_maps(folder)


async def one_screen(name: str, count: int) -> list[Row]:
    """Return the figures of one screen."""
    letter, prepare, keys = SCREENS[name]
    async with metered(count, ColorSystem.EIGHT_BIT) as meter:
        prepare(meter.station)
        for key in ((letter,) if name == "fly" else ("S", letter)) + keys:
            await press(meter, key)
        await look(meter)
        await meter.fly(1.0)
        written, cpu_s = 0, 0.0
        for _ in range(MEASURED_S):
            if prepare is not parameters:
                prepare(meter.station)
            looked = await look(meter)
            flown = await meter.fly(1.0)
            written, cpu_s = written + looked[0] + flown[0], cpu_s + looked[1] + flown[1]
        key_ms = [1000 * await press(meter, "down") for _ in range(KEYS)]
    title = f"{name}, {count} vehicles"
    return [
        Row(f"{title}: written", written / MEASURED_S / 1000, "kB/s", LIMIT_KB_S if count == COUNTS[0] else None),
        Row(f"{title}: CPU", 100 * cpu_s / MEASURED_S, "%", LIMIT_CPU_PCT if count == COUNTS[-1] else None),
        Row(f"{title}: CPU of a key, p95", percentile(key_ms, 95), "ms", LIMIT_KEY_MS),
    ]


async def look(meter: Meter) -> tuple[int, float]:
    """Have the screen ask the station and draw, as its timers do; return (bytes, CPU seconds) of a second of it."""
    screen, before, began_s = meter.app.screen, len(meter.written), time.process_time()
    if isinstance(screen, PolledScreen):
        for _ in range(max(1, round(1.0 / screen.LOOK_S))):
            screen.look()
            await settled(meter)
    elif isinstance(screen, LivePlotsScreen):
        screen.ask()
        screen.draw_on()
        await settled(meter)
    cpu_s = time.process_time() - began_s
    return sum(len(text.encode()) for text in meter.written[before:]), cpu_s
