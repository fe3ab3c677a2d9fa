"""Writes to the terminal only the cells that changed, and of their style only what changed.

Textual writes every dirty region whole, each one from the left edge of its widget, equal or not, with the full style
before and a reset after every run (facts: 300 kB/s for a map of 120x40). The painter keeps what the terminal shows
and writes the difference, for every panel of every screen. It stands between Textual's compositor and its driver and
reads the two kinds of update of Textual 8.2.8, here and nowhere else; a test fails when they change.

What the painter believes is only as true as the terminal: after a resize, or when somebody else wrote on it, call
`forget` and refresh the screen.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import cast

from rich.cells import get_character_cell_size
from rich.color import Color, ColorSystem
from rich.console import Console, RenderableType
from rich.segment import Segment, Segments
from rich.style import Style
from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
from textual.strip import Strip

from tui_gcs.terminal.themes import DARK, SIXTEEN, SIXTEEN_OF, Theme

_ATTRIBUTES = ("bold", "dim", "italic", "underline", "blink", "blink2", "reverse", "conceal", "strike")
"""Style attributes in the order of their SGR codes, from 1 on."""
_ON_BLANKS = frozenset("4579")
"""SGR codes that can be seen on a blank: underline, blink, reverse, strike."""
_NARROW = re.compile("[ -~\u00a1-\u00ac\u00ae-\u02ff\u2010-\u2027\u2190-\u21ff\u2500-\u25ff\u2800-\u28ff]*")
"""Characters that every terminal draws one cell wide."""
_PIECES = re.compile("[\x00-\xff\u2500-\u257f]+|.")
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f]")
RESET = "\x1b[0m"


@dataclass(frozen=True, eq=False)
class Pen:
    """How a cell is drawn, in SGR codes; one object for each look, so that pens are compared by identity."""

    foreground: str
    background: str
    attributes: frozenset[str]
    blank: "Pen | None" = field(default=None, repr=False)
    """The pen that draws the same blank; None if it is this one."""


PLAIN = Pen("39", "49", frozenset())


class Pens:
    """The pens of all styles that were used, for one colour system and theme."""

    def __init__(self, system: ColorSystem, theme: Theme = DARK) -> None:
        """None yet."""
        self.system = system
        self.theme = theme
        self._sixteen = SIXTEEN_OF.get(theme.name, SIXTEEN)
        self._by_style: dict[Style | None, Pen] = {None: PLAIN}
        self._by_look: dict[tuple[str, str, frozenset[str]], Pen] = {("39", "49", frozenset()): PLAIN}

    def of(self, style: Style | None) -> Pen:
        """The pen for a Rich style."""
        pen = self._by_style.get(style)
        if pen is None and style is not None:
            attributes = frozenset(str(code) for code, name in enumerate(_ATTRIBUTES, 1) if getattr(style, name))
            colours = [
                self._codes(color, foreground) if color is not None else default
                for color, foreground, default in ((style.color, True, "39"), (style.bgcolor, False, "49"))
            ]
            pen = self._by_style[style] = self._look(colours[0], colours[1], attributes)
        return pen or PLAIN

    def _codes(self, color: Color, foreground: bool) -> str:
        """SGR codes of a colour of the palette in this theme; other colours are taken as near as they come."""
        name = color.triplet.hex if color.triplet is not None else ""
        if self.system is ColorSystem.STANDARD and name in self._sixteen:
            color = Color.from_ansi(self._sixteen[name])
        elif name:
            color = Color.parse(self.theme.colour(name))
        return ";".join(color.downgrade(self.system).get_ansi_codes(foreground))

    def _look(self, foreground: str, background: str, attributes: frozenset[str]) -> Pen:
        look = (foreground, background, attributes)
        pen = self._by_look.get(look)
        if pen is None:
            seen = bool(attributes & _ON_BLANKS) or (foreground == "39" and not attributes)
            blank = None if seen else self._look("39", background, frozenset())
            pen = self._by_look[look] = Pen(*look, blank)
        return pen


@dataclass
class _Row:
    """What one line of the terminal shows; a wide character has an empty string in its second cell."""

    texts: list[str]
    pens: list[Pen | None]


class CellPainter:
    """Knows what the terminal shows, and how to change it with few bytes."""

    def __init__(self) -> None:
        """Nothing is known yet: everything will be written."""
        self.theme = DARK
        self._rows: dict[int, _Row] = {}
        self._pens = Pens(ColorSystem.TRUECOLOR)

    def forget(self) -> None:
        """The terminal may show anything now: write every cell again."""
        self._rows.clear()

    def thin(self, update: RenderableType | None) -> RenderableType | None:
        """An update of the compositor that writes the difference only; other things as they are."""
        if not isinstance(update, ChopsUpdate | LayoutUpdate):
            return update
        return cast("RenderableType", DiffUpdate(self, update))  # Textual asks it for `render_segments` only

    def paint(self, update: CompositorUpdate, console: Console) -> str:
        """The bytes that make the terminal show `update`; from now on they count as written."""
        system = console._color_system or ColorSystem.TRUECOLOR
        if system is not self._pens.system or self.theme is not self._pens.theme:
            self._pens = Pens(system, self.theme)
            self.forget()
        line = _Line()
        for y, x, strips in _pieces(update):
            self._paint_row(line, x, y, strips)
        return line.text()

    def _paint_row(self, line: "_Line", x: int, y: int, strips: Iterable[Strip]) -> None:
        texts: list[str] = []
        pens: list[Pen | None] = []
        for strip in strips:
            for text, style, _ in strip:
                cells = text if _NARROW.fullmatch(text) else _cells(text)
                pen = self._pens.of(style)
                texts += cells
                if pen.blank is None or " " not in text:
                    pens += [pen] * len(cells)
                else:
                    pens += [pen.blank if cell == " " else pen for cell in cells]
        row = self._rows.get(y)
        end = x + len(texts)
        if row is None:
            row = self._rows[y] = _Row([], [])
        if len(row.texts) < end:
            missing = end - len(row.texts)
            row.texts += [""] * missing
            row.pens += [None] * missing
        shown_texts, shown_pens = row.texts[x:end], row.pens[x:end]
        if shown_texts == texts and shown_pens == pens:
            return
        changed = [
            column
            for column, (text, shown, pen, shown_pen) in enumerate(
                zip(texts, shown_texts, pens, shown_pens, strict=True)
            )
            if text != shown or (pen is not shown_pen and text)
        ]
        row.texts[x:end], row.pens[x:end] = texts, pens
        line.write(x, y, texts, pens, changed)


class DiffUpdate(CompositorUpdate):
    """Takes the place of a compositor's update; what it writes is decided when it is written."""

    def __init__(self, painter: CellPainter, update: CompositorUpdate) -> None:
        """Show `update` by way of `painter`."""
        self._painter = painter
        self._update = update

    def render_segments(self, console: Console) -> str:
        """See `CompositorUpdate.render_segments`."""
        return self._painter.paint(self._update, console)


class _Line:
    """Collects what is written in one update; knows where the terminal's cursor is and with which pen it writes."""

    def __init__(self) -> None:
        self._out: list[str] = []
        self._at: tuple[int, int] | None = None
        self._pen = PLAIN

    def text(self) -> str:
        """All of it; the pen is put down at the end, so that whoever writes next begins with a plain one."""
        if self._pen is not PLAIN:
            self._out.append(RESET)
        return "".join(self._out)

    def write(self, x: int, y: int, texts: Sequence[str], pens: Sequence[Pen | None], changed: Sequence[int]) -> None:
        """Write the changed columns of a row that begins at x; short gaps are written again, longer ones skipped."""
        before = None
        for column in changed:
            gap = range(column if before is None else before + 1, column)
            before = column
            if not texts[column]:  # the second half of a wide character
                continue
            if gap and self._at == (x + gap.start, y) and self._bridges(gap, texts, pens):
                for between in gap:
                    self._put(texts[between], pens[between])
            self._move(x + column, y)
            self._put(texts[column], pens[column])

    def _bridges(self, gap: range, texts: Sequence[str], pens: Sequence[Pen | None]) -> bool:
        """Whether writing what is there already costs no more than a move over it."""
        if len(gap) > 5 or not all(texts[column] and self._draws(texts[column], pens[column]) for column in gap):
            return False
        return sum(len(texts[column].encode()) for column in gap) <= (3 if len(gap) == 1 else 4)

    def _draws(self, text: str, pen: Pen | None) -> bool:
        """Whether the pen in hand draws this cell as it must look."""
        if pen is self._pen:
            return True
        return text == " " and pen is not None and pen is self._pen.blank

    def _move(self, x: int, y: int) -> None:
        if self._at == (x, y):
            return
        if self._at is not None and self._at[1] == y and x > self._at[0]:
            by = x - self._at[0]
            self._out.append(f"\x1b[{by}C" if by > 1 else "\x1b[C")
        else:
            self._out.append(f"\x1b[{y + 1};{x + 1}H" if x else f"\x1b[{y + 1}H")
        self._at = (x, y)

    def _put(self, text: str, pen: Pen | None) -> None:
        if pen is not None and not self._draws(text, pen):
            self._out.append(_change(self._pen, pen))
            self._pen = pen
        self._out.append(text)
        # Where the cursor is after a character that terminals do not agree about is not known.
        self._at = (self._at[0] + 1, self._at[1]) if self._at is not None and _NARROW.fullmatch(text) else None


def _change(old: Pen, new: Pen) -> str:
    """The SGR sequence from one pen to another."""
    codes = []
    if old.attributes - new.attributes:
        codes.append("0")
        old = PLAIN
    codes += sorted(new.attributes - old.attributes)
    if new.foreground != old.foreground:
        codes.append(new.foreground)
    if new.background != old.background:
        codes.append(new.background)
    return f"\x1b[{';'.join(codes)}m"


def _pieces(update: object) -> Iterator[tuple[int, int, Iterable[Strip]]]:
    """(y, x, strips side by side from x on) of all that an update holds."""
    if isinstance(update, LayoutUpdate):
        for y, strips in enumerate(update.strips, update.region.y):
            yield y, update.region.x, strips
    elif isinstance(update, ChopsUpdate):
        for y, first, last in update.spans:
            for end, (x, strip) in zip(update.chop_ends[y], update.chops[y].items(), strict=False):
                if strip is not None and x <= last and end > first:
                    yield y, x, [strip if end <= last else strip.crop(0, min(end, last) - x)]


def themed(update: object, theme: Theme) -> Segments:
    """All that an update shows, line by line in the colours of a theme, for pictures of the screen.

    Signs beyond ASCII stand alone: fonts do not agree about their width, and what follows is to stay in its cells.
    """

    def colour(color: Color | None) -> Color | None:
        return color if color is None or color.triplet is None else Color.parse(theme.colour(color.triplet.hex))

    segments = []
    for _, _, strips in _pieces(update):
        for strip in strips:
            for text, style, _ in strip:
                if style is not None:
                    style += Style.from_color(colour(style.color), colour(style.bgcolor))
                segments += [Segment(piece, style) for piece in _PIECES.findall(text)]
        segments.append(Segment.line())
    return Segments(segments)


def _cells(text: str) -> list[str]:
    """One string a cell: marks join the character they stand on, wide ones fill two cells, control codes vanish."""
    cells: list[str] = []
    for character in text:
        width = 0 if _CONTROL.match(character) else get_character_cell_size(character)
        if width:
            cells += [character, *[""] * (width - 1)]
        elif cells and not _CONTROL.match(character):
            last = max(index for index, cell in enumerate(cells) if cell)
            cells[last] += character
    return cells
