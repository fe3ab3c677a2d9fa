"""`--plain`: the console on stock Textual, in a process of its own, because the choice is made at import."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tui_gcs.terminal.terminal_options import wants_plain

SCRIPT = """
import asyncio, sys
from tests.screens.rigs.console import NARROW, console
from tests.screens.rigs.fake_station import FakeStation

async def use():
    async with console(NARROW, FakeStation.fly) as c:
        print(c.text())
        await c.press("2", "enter", "v")
        print("mode", c.app.current_mode, "selected", c.app.feed.selection.ids)
        await c.press("f", "T")
        print("theme", c.app.display_theme, "#d70000" in c.app.export_screenshot())
        await c.press("exclamation_mark", "h")
        print("sent", [type(request).__name__ for request in c.station.commands()])

asyncio.run(use())
private = ("tui_gcs.terminal.private", "tui_gcs.terminal.cell")
print("private", sorted(name for name in sys.modules if name.startswith(private)))
from textual._xterm_parser import XTermParser
from textual.drivers import linux_driver
print("parser", linux_driver.XTermParser is XTermParser)
"""


@pytest.mark.parametrize(("value", "plain"), [("", False), ("0", False), ("1", True)])
def test_the_environment_chooses(value: str, plain: bool) -> None:
    assert wants_plain({"TUI_GCS_PLAIN": value}) is plain


def test_a_plain_console_shows_the_fleet_takes_keys_and_uses_no_private_part() -> None:
    environment = os.environ | {"TUI_GCS_PLAIN": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        env=environment,
        cwd=Path(__file__).parents[2],
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "swarm-challenge" in done.stdout and "GUIDED" in done.stdout
    assert "mode vehicles selected (2,)" in done.stdout
    assert "theme night True" in done.stdout
    assert "sent ['Hold']" in done.stdout
    assert "private []" in done.stdout
    assert "parser True" in done.stdout
