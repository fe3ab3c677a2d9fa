"""Draws the README's pictures: three screens on a real lock-step flight. `python docs/make_pictures.py`."""

import asyncio
import re
import tempfile
from pathlib import Path

from textual.pilot import Pilot

from tui_gcs.app import ConsoleApp
from tui_gcs.cli.common import read_scenario
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.rehearsal.lock_step import LockStep

FOLDER = Path(__file__).parent
SIZE = (120, 40)
READY_S, PATROL_S = 10.0, 150.0


def fly(flight: LockStep, seconds: float) -> None:
    """Move the flight on."""
    end = flight.clock.now() + seconds
    while flight.clock.now() < end:
        flight.step()


async def settle(pilot: Pilot[None], flight: LockStep, app: ConsoleApp, times: int = 4) -> None:
    """Let the console take what was published; the flight goes on for half a second, so many times."""
    for _ in range(times):
        fly(flight, 0.5)
        await app.feed.idle()
        await pilot.pause(0.3)


def save(app: ConsoleApp, path: Path) -> None:
    """Export the screen; without the web fonts, so that looking at a picture asks nobody for anything."""
    svg = re.sub(r"@font-face\s*{.*?}", "", app.export_screenshot(title="tui-gcs"), flags=re.DOTALL)
    svg = re.sub(r"<!--.*?-->", "", svg, flags=re.DOTALL)
    path.write_text(svg.replace("Fira Code", "monospace"), encoding="utf-8")


async def main(folder: Path = FOLDER, patrol_s: float = PATROL_S, file: str | None = None) -> None:
    """Fly a scenario (None: the shipped one) for so long, then draw into a folder."""
    scenario, toml, _ = read_scenario(file)
    with tempfile.TemporaryDirectory() as logs:
        flight = LockStep(scenario, toml, Path(logs))
        app = ConsoleApp(flight.bus, "you", kind=RunKind.SIM)
        async with app.run_test(size=SIZE) as pilot:
            fly(flight, READY_S)
            start = m.Start(vehicles=tuple(sorted(flight.station.picture.fleet.vehicles)))
            flight.bus.ask(f"gcs/req/{app.feed.requests.principal}", m.encode(start))
            fly(flight, patrol_s)
            await settle(pilot, flight, app)
            await pilot.press("n", "n")
            await settle(pilot, flight, app)
            save(app, folder / "fly.svg")
            for key, name in (("p", "plan.svg"), ("v", "vehicles.svg")):
                await pilot.press(key)
                await settle(pilot, flight, app)
                save(app, folder / name)
        flight.close()


if __name__ == "__main__":
    asyncio.run(main())
