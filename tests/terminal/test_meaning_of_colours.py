"""Cells whose look is their meaning: what a terminal is told for them, in truecolour, in 16 colours and without any."""

import re

import pytest
from rich.color import ColorSystem

from tests.screens.rigs.console import NARROW, Console, console
from tests.screens.rigs.fake_station import FakeStation, trouble
from tui_gcs.core.protocol.common import RunKind
from tui_gcs.terminal.cell_painter import Pen, Pens

TRUE, SIXTEEN = ColorSystem.TRUECOLOR, ColorSystem.STANDARD
RED, YELLOW = "255;80;80", "240;200;64"


def flight(station: FakeStation) -> None:
    station.fly()


def pen_of(c: Console, text: str, system: ColorSystem, line: int | None = None) -> Pen:
    """How the first piece of the screen that has `text` in it is drawn."""
    strips = c.app.screen._compositor.render_strips()
    for strip in strips if line is None else strips[line : line + 1]:
        for segment in strip:
            if text in segment.text:
                return Pens(system).of(segment.style)
    raise AssertionError(f"{text!r} is not shown")


async def test_an_alarm_that_nobody_has_seen_is_reversed_red_and_one_that_was_seen_plain_red() -> None:
    async with console(NARROW, trouble) as c:
        line = c.fly.top_lines.alarm_line
        line._timer.pause()  # type: ignore[union-attr]
        line._bright = True
        line.update_lines()
        await c.settle()
        new, new16 = (pen_of(c, "! WARN", system, 1) for system in (TRUE, SIXTEEN))
        assert (new.foreground, new16.foreground) == (f"38;2;{RED}", "91")
        assert "7" in new.attributes and "7" in new16.attributes, "reversed"
        await c.press("A", "a", "x", "escape")
        await c.tick()
        seen, seen16 = (pen_of(c, "! WARN", system, 1) for system in (TRUE, SIXTEEN))
        assert (seen.foreground, seen16.foreground) == (f"38;2;{RED}", "91")
        assert "7" not in seen.attributes | seen16.attributes


async def test_a_vehicle_with_a_caution_is_yellow_and_one_without_is_not() -> None:
    async with console(NARROW, trouble) as c:
        low, low16 = (pen_of(c, "7 GUIDED", system) for system in (TRUE, SIXTEEN))
        assert (low.foreground, low16.foreground) == (f"38;2;{YELLOW}", "93")
        well = pen_of(c, "6 GUIDED", TRUE)
        assert well.foreground not in (f"38;2;{YELLOW}", f"38;2;{RED}")


async def test_live_looks_unlike_sim() -> None:
    async with console(NARROW, flight, kind=RunKind.LIVE) as live, console(NARROW, flight) as sim:
        for system in (TRUE, SIXTEEN):
            one, other = pen_of(live, " LIVE ", system, 0), pen_of(sim, " SIM ", system, 0)
            assert (one.foreground, one.background, one.attributes) != (
                other.foreground,
                other.background,
                other.attributes,
            )


async def test_the_svg_has_the_alarm_in_red_on_its_ground() -> None:
    async with console(NARROW, trouble) as c:
        await c.press("x", "A", "x", "escape")
        await c.tick()
        svg = c.app.export_screenshot()
        style = re.search(r'class="(\S+-r\d+)"[^>]*>[^<]*LOST&#160;in&#160;the&#160;air', svg)
        assert style is not None
        assert re.search(rf"\.{style[1]} {{ fill: #ff5050", svg)


async def test_without_colours_shape_and_word_remain_and_no_colour_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    async with console(NARROW, trouble) as c:
        assert "! WARN" in c.line(1)
        assert "^   7 GUIDED" in c.text()
        assert c.line(0).startswith(" SIM ")
        assert c.app.no_color
