"""What is painted key by key is what a whole picture would show: forms are painted in parts, to be fast."""

import io

import pytest
from rich.console import Console
from textual._compositor import CompositorUpdate

from tests.screens.rigs.mission_station import mission_console
from tests.screens.rigs.plan_station import plan_console
from tui_gcs.app import ConsoleApp
from tui_gcs.terminal.cell_painter import CellPainter

pytestmark = pytest.mark.long  # seconds of a core each

WIDE, SMALL = (120, 40), (80, 24)
PLAN_KEYS = [
    *("down", "down", "up", "e", "right", "n", "escape"),
    *("1", "tab", "x", "tab", "right", "right", "tab", "9", "escape"),
    *("2", "tab", "tab", "tab", "tab", "right", "tab", "5", "escape", "u"),
    *("g", "tab", "4", *["tab"] * 30, "escape", "plus", "escape", "delete", "delete"),
]
MISSION_KEYS = [
    *("plus", "plus", "plus", "up", "e", "right", "escape", "E", "up", "escape"),
    *("tab", "right", "right", "right", "tab", "1", "tab", "tab", "2", "escape"),
    *("n", "plus", "f", "plus", "f", "f", "N", "G", "tab", "right", "escape", "u", "u", "delete"),
]


class Watched:
    """What a terminal would show that got every partial picture of this console."""

    def __init__(self, app: ConsoleApp, monkeypatch: pytest.MonkeyPatch) -> None:
        self._app, self._painter = app, CellPainter()
        self._console = Console(file=io.StringIO(), force_terminal=True, color_system="truecolor")
        monkeypatch.setattr(app, "_display", lambda _screen, update: self._paint(update))
        self.differences()

    def _paint(self, update: CompositorUpdate | None) -> str:
        return self._painter.paint(update, self._console) if update is not None else ""

    def differences(self) -> str:
        """What a whole picture, nothing of it remembered, writes besides."""
        for widget in self._app.screen.walk_children():
            widget._styles_cache.clear()
        return self._paint(self._app.screen._compositor.render_update(full=True))


@pytest.mark.parametrize("size", [WIDE, SMALL])
async def test_the_plan_screen(size: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    async with plan_console(size) as c:
        watched = Watched(c.app, monkeypatch)
        for number, key in enumerate(PLAN_KEYS):
            await c.press(key)
            assert watched.differences() == "", (number, key)


@pytest.mark.parametrize("size", [WIDE, SMALL])
async def test_the_missions_screen(size: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    async with mission_console(size) as c:
        watched = Watched(c.app, monkeypatch)
        for number, key in enumerate(MISSION_KEYS):
            await c.press(key)
            assert watched.differences() == "", (number, key)
