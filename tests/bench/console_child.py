"""The console that is measured: python -m tests.bench.console_child [--live] [--naive] [--storm] [--gaps FILE]

The same as `tui-gcs attach`; `--live` joins a live station. `--naive` writes as Textual does it when a program only
calls `update` and `refresh`: every panel whole. `--storm` writes the whole screen ten times a second: what fits into
the system's buffers would hide that nobody reads. `--gaps` notes in FILE when the event loop stood still.
"""

import argparse
import asyncio
import time
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from textual.app import App
from textual.screen import Screen

from tui_gcs.app import ConsoleApp
from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.zenoh_bus import connect_later
from tui_gcs.feed.messages import FleetUpdated

LOOK_S = 0.02


class NaiveConsole(ConsoleApp):
    """Every frame all panels are rendered and written, by Textual alone."""

    def _display(self, screen: Screen[Any], renderable: RenderableType | None) -> None:
        App._display(self, screen, renderable)

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        for widget in self.screen.walk_children():
            widget.notify_style_update()
            widget.refresh()


async def note_gaps(file: Path) -> None:
    """A line for each time that the event loop stood still: when it went on, and for how long, seconds; for ever."""
    before_s = time.monotonic()
    with file.open("a", buffering=1) as lines:
        while True:
            await asyncio.sleep(LOOK_S)
            now_s = time.monotonic()
            if now_s - before_s > 2 * LOOK_S:
                lines.write(f"{now_s} {now_s - before_s - LOOK_S}\n")
            before_s = now_s


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--live", action="store_true")
    parser.add_argument("--naive", action="store_true")
    parser.add_argument("--gaps", type=Path)
    parser.add_argument("--storm", action="store_true")
    arguments = parser.parse_args()
    kind = RunKind.LIVE if arguments.live else RunKind.SIM
    bus = connect_later(socket_path(kind))
    app = (NaiveConsole if arguments.naive else ConsoleApp)(bus, kind=kind)
    if arguments.gaps:
        app.call_later(lambda: app.run_worker(note_gaps(arguments.gaps)))
    if arguments.storm:
        app.call_later(lambda: app.set_interval(0.1, app.redraw))
    app.run(mouse=False)
    bus.close()


if __name__ == "__main__":
    main()
