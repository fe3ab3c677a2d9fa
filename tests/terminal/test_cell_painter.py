"""The painter: the terminal shows what Textual meant, for fewer bytes."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.color import ColorSystem
from rich.console import Console
from rich.segment import Segment
from rich.style import Style
from textual._compositor import ChopsUpdate, LayoutUpdate
from textual.geometry import Region
from textual.strip import Strip

from tui_gcs.terminal.cell_painter import CellPainter

STYLES = [
    Style(color="#d8dee4", bgcolor="#101418"),
    Style(color="#ff5050", bgcolor="#101418", bold=True),
    Style(color="#ff5050", bgcolor="#101418", bold=True, reverse=True),
    Style(color="#56b4e9", bgcolor="#4a5560", underline=True),
    Style(),
]
WIDTH, HEIGHT = 12, 3
SEQUENCE = re.compile(r"\x1b\[([0-9;]*)([A-Za-z])|([^\x1b])")


class Terminal:
    """Understands just what the painter writes; every cell is (text, look), the look as a real one would have it."""

    def __init__(self) -> None:
        self.cells = [[("?", ("", "", ()))] * WIDTH for _ in range(HEIGHT)]
        self.x = self.y = 0
        self.pen: tuple[str, str, tuple[str, ...]] = ("39", "49", ())

    def feed(self, data: str) -> None:
        for match in SEQUENCE.finditer(data):
            values, final, text = match.groups()
            if text:
                self.cells[self.y][self.x] = (text, self.pen)
                self.x += 1
            elif final == "H":
                y, _, x = values.partition(";")
                self.y, self.x = int(y) - 1, int(x or 1) - 1
            elif final == "C":
                self.x += int(values or 1)
            else:
                assert final == "m"
                self.select(values.split(";"))

    def select(self, codes: list[str]) -> None:
        foreground, background, attributes = self.pen
        while codes:
            code = codes.pop(0)
            if code in ("38", "48"):
                code = ";".join([code, *(codes.pop(0) for _ in range(4 if codes[0] == "2" else 2))])
            if code in ("", "0"):
                foreground, background, attributes = "39", "49", ()
            elif int(code.partition(";")[0]) < 10:
                attributes = tuple(sorted({*attributes, code}))
            elif code[0] == "3" or code[0] == "9":
                foreground = code
            else:
                background = code
        self.pen = (foreground, background, attributes)


def look(style: Style, system: ColorSystem) -> tuple[str, str, tuple[str, ...]]:
    """What Rich itself would have selected."""
    terminal = Terminal()
    ansi = Strip.render_ansi(style.copy(), system)
    terminal.select(ansi.split(";") if ansi else ["0"])
    return terminal.pen


def seen(text: str, pen: tuple[str, str, tuple[str, ...]]) -> object:
    """What a person can tell apart: of a blank only its ground and lines."""
    if text == " " and not {"4", "5", "7", "9"} & set(pen[2]):
        return (text, pen[1])
    return (text, *pen)


def console_of(system: ColorSystem) -> Console:
    console = Console(force_terminal=True)
    console._color_system = system
    return console


row_cells = st.lists(st.tuples(st.sampled_from("ab  ⣿─►"), st.sampled_from(STYLES)), min_size=WIDTH, max_size=WIDTH)
pictures = st.lists(st.lists(row_cells, min_size=HEIGHT, max_size=HEIGHT), min_size=1, max_size=5)


@settings(max_examples=30, deadline=None)
@given(pictures, st.sampled_from([ColorSystem.EIGHT_BIT, ColorSystem.TRUECOLOR]), st.randoms())
def test_the_terminal_shows_every_picture(drawn: list, system: ColorSystem, chance) -> None:
    painter, terminal, console = CellPainter(), Terminal(), console_of(system)
    shown = [[("?", STYLES[0])] * WIDTH for _ in range(HEIGHT)]
    for picture in drawn:
        first = shown[0][0][0] == "?"
        strips = [Strip([Segment(text, style) for text, style in row], WIDTH) for row in picture]
        if first or chance.random() < 0.3:
            update = LayoutUpdate([[strip] for strip in strips], Region(0, 0, WIDTH, HEIGHT))
            shown = [list(row) for row in picture]
        else:
            y, start = chance.randrange(HEIGHT), chance.randrange(WIDTH)
            end = chance.randrange(start, WIDTH) + 1
            left, right = strips[y].crop(0, 5), strips[y].crop(5, WIDTH)
            update = ChopsUpdate([{0: left, 5: right}] * HEIGHT, [(y, start, end)], [[5, WIDTH]] * HEIGHT)
            low = 0 if start < 5 else 5
            if end > low:
                shown[y][low:end] = picture[y][low:end]
        terminal.feed(painter.thin(update).render_segments(console))
        expected = [[seen(text, look(style, system)) for text, style in row] for row in shown]
        assert [[seen(*cell) for cell in row] for row in terminal.cells] == expected


def line(text: str) -> LayoutUpdate:
    return LayoutUpdate([[Strip([Segment(text, STYLES[0])])]], Region(0, 0, len(text), 1))


def test_the_same_picture_costs_nothing_until_it_is_forgotten() -> None:
    painter, console = CellPainter(), console_of(ColorSystem.TRUECOLOR)
    first = painter.paint(line("armed 8"), console)
    assert "armed 8" in first
    assert painter.paint(line("armed 8"), console) == ""
    changed = painter.paint(line("armed 7"), console)
    assert changed.startswith("\x1b[1;7H")
    assert changed.endswith("7\x1b[0m")
    painter.forget()
    assert len(painter.paint(line("armed 7"), console)) == len(first)


@pytest.mark.parametrize("evil", ["\x1b]0;owned\x07", "\x1b[2J", "\r\n", "\x9b31m", "\x7f"])
def test_control_codes_end_here(evil: str) -> None:
    painter = CellPainter()
    written = painter.paint(line(f"a{evil}b"), console_of(ColorSystem.STANDARD))
    assert not set(re.sub(r"\x1b\[[0-9;]*[mHC]", "", written)) & set("\x1b\r\n\x07\x9b\x7f")


def test_after_a_wide_character_the_place_is_said_anew() -> None:
    painter, console = CellPainter(), console_of(ColorSystem.STANDARD)
    update = LayoutUpdate([[Strip([Segment("漢x", STYLES[0])], 3)]], Region(0, 0, 3, 1))
    assert "漢\x1b[1;3Hx" in painter.paint(update, console)
    assert painter.paint(update, console) == ""
