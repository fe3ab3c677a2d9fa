"""Writes to the terminal only the cells that changed, and of their style only what changed.

Textual writes every dirty region whole, each from the left edge of its widget, with the full style before and a reset
after every run: 300 kB/s for a map of 120x40 (docs/terminal.md B2). The painter keeps what the terminal shows and
writes the difference, for every panel of every screen. It stands between Textual's compositor and its driver.

The painter's picture of the terminal holds only as long as nothing else writes to it: after a resize, or when another
program wrote to the terminal, call `forget` and refresh the screen.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from rich.cells import get_character_cell_size
from rich.color import Color, ColorSystem
from rich.console import COLOR_SYSTEMS, Console, RenderableType
from rich.segment import Segment, Segments
from rich.style import Style
from textual.strip import Strip

from tui_gcs.terminal.private.compositor import ScreenUpdates
from tui_gcs.terminal.themes import DARK, SIXTEEN, SIXTEEN_OF, Theme

_ATTRIBUTES = ("bold", "dim", "italic", "underline", "blink", "blink2", "reverse", "conceal", "strike")
"""Style attributes in the order of their SGR codes, from 1 on."""
_ON_BLANKS = frozenset("4579")
"""SGR codes that can be seen on a blank: underline, blink, reverse, strike."""
_NARROW = re.compile("[ -~\u00a1-\u00ac\u00ae-\u02ff\u2010-\u2027\u2190-\u21ff\u2500-\u25ff\u2800-\u28ff]*")
"""Characters that every terminal draws one cell wide (docs/terminal.md C2)."""
_PIECES = re.compile("[\x00-\xff\u2500-\u257f]+|.")
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f]")
RESET = "\x1b[0m"


@dataclass(frozen=True, eq=False)
class Pen:
    """How a cell is drawn, in SGR codes; there is one object for each look, so pens are compared by identity."""

    foreground: str
    background: str
    attributes: frozenset[str]
    blank: "Pen | None" = field(default=None, repr=False)
    """The pen that draws a blank of the same look; None if that is this pen."""


PLAIN = Pen("39", "49", frozenset())


class Pens:
    """The pens of all styles used so far, for one colour system and theme."""

    def __init__(self, system: ColorSystem, theme: Theme = DARK) -> None:
        self.system = system
        self.theme = theme
        self._sixteen = SIXTEEN_OF.get(theme.name, SIXTEEN)
        self._by_style: dict[Style | None, Pen] = {None: PLAIN}
        self._by_look: dict[tuple[str, str, frozenset[str]], Pen] = {("39", "49", frozenset()): PLAIN}

    def of(self, style: Style | None) -> Pen:
        """The pen that draws a Rich style; None is the terminal's own look."""
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
        """SGR codes of a colour of the palette in this theme; other colours become the nearest of the colour system."""
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
            # On a blank only background, underline, blink, reverse and strike can be seen: other looks share a pen.
            seen = bool(attributes & _ON_BLANKS) or (foreground == "39" and not attributes)
            blank = None if seen else self._look("39", background, frozenset())
            pen = self._by_look[look] = Pen(*look, blank)
        return pen


@dataclass
class _ShownRow:
    """What one line of the terminal shows; the second cell of a wide character holds an empty string."""

    texts: list[str]
    pens: list[Pen | None]


class CellPainter:
    """Holds what the terminal shows, and writes changes to it with few bytes."""

    def __init__(self) -> None:
        self.theme = DARK
        self._rows: dict[int, _ShownRow] = {}
        self._pens = Pens(ColorSystem.TRUECOLOR)

    def forget(self) -> None:
        """Take it that the terminal may show anything: every cell will be written again."""
        self._rows.clear()

    def thin(self, update: RenderableType | None) -> RenderableType | None:
        """An update that writes only the difference to what is shown; other renderables stay as they are."""
        return ScreenUpdates.replaced(update, self.paint)

    def paint(self, update: object, console: Console) -> str:
        """Return the bytes that make the terminal show `update`, and take them as written."""
        system = COLOR_SYSTEMS[console.color_system or "truecolor"]
        if system is not self._pens.system or self.theme is not self._pens.theme:
            self._pens = Pens(system, self.theme)
            self.forget()
        line = _Line()
        for y, x, strips in ScreenUpdates.pieces(update):
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
            row = self._rows[y] = _ShownRow([], [])
        if len(row.texts) < end:
            missing = end - len(row.texts)
            row.texts += [""] * missing
            row.pens += [None] * missing
        shown_texts, shown_pens = row.texts[x:end], row.pens[x:end]
        # Most rows of an update are unchanged: comparing lists is far quicker than looking for changed columns.
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


class _Line:
    """Collects the bytes of one update, and follows the terminal's cursor and pen."""

    def __init__(self) -> None:
        self._out: list[str] = []
        self._at: tuple[int, int] | None = None
        self._pen = PLAIN

    def text(self) -> str:
        """All bytes; they end with the plain pen, with which every update begins."""
        # Other writers (Textual's own control sequences) expect the terminal's plain look.
        if self._pen is not PLAIN:
            self._out.append(RESET)
        return "".join(self._out)

    def write(self, x: int, y: int, texts: Sequence[str], pens: Sequence[Pen | None], changed: Sequence[int]) -> None:
        """Write the changed columns of a row that begins at column x."""
        before = None
        for column in changed:
            gap = range(column if before is None else before + 1, column)
            before = column
            if not texts[column]:  # the second half of a wide character
                continue
            # A short gap costs fewer bytes when it is written again than a move of the cursor over it.
            if gap and self._at == (x + gap.start, y) and self._bridges(gap, texts, pens):
                for between in gap:
                    self._put(texts[between], pens[between])
            self._move(x + column, y)
            self._put(texts[column], pens[column])

    def _bridges(self, gap: range, texts: Sequence[str], pens: Sequence[Pen | None]) -> bool:
        """Whether writing what is there already costs no more bytes than a move over it."""
        if len(gap) > 5 or not all(texts[column] and self._draws(texts[column], pens[column]) for column in gap):
            return False
        return sum(len(texts[column].encode()) for column in gap) <= (3 if len(gap) == 1 else 4)

    def _draws(self, text: str, pen: Pen | None) -> bool:
        """Whether the current pen draws this cell as it must look."""
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
        # Terminals do not agree about the width of other characters: the cursor may be anywhere after them.
        self._at = (self._at[0] + 1, self._at[1]) if self._at is not None and _NARROW.fullmatch(text) else None


def _change(old: Pen, new: Pen) -> str:
    """The SGR sequence that changes one pen to another."""
    codes = []
    # There is no code for "not bold" alone that all terminals know: what is taken away needs a reset first.
    if old.attributes - new.attributes:
        codes.append("0")
        old = PLAIN
    codes += sorted(new.attributes - old.attributes)
    if new.foreground != old.foreground:
        codes.append(new.foreground)
    if new.background != old.background:
        codes.append(new.background)
    return f"\x1b[{';'.join(codes)}m"


def themed(update: object, theme: Theme) -> Segments:
    """Everything that an update shows, line by line in the colours of a theme, for pictures of the screen."""

    def colour(color: Color | None) -> Color | None:
        return color if color is None or color.triplet is None else Color.parse(theme.colour(color.triplet.hex))

    segments = []
    for _, _, strips in ScreenUpdates.pieces(update):
        for strip in strips:
            for text, style, _ in strip:
                if style is not None:
                    style += Style.from_color(colour(style.color), colour(style.bgcolor))
                # Fonts do not agree about the width of other characters: each stands alone, so the rest stays in place.
                segments += [Segment(piece, style) for piece in _PIECES.findall(text)]
        segments.append(Segment.line())
    return Segments(segments)


def _cells(text: str) -> list[str]:
    """One string for each cell: marks join their character, wide ones fill two cells, control codes vanish."""
    cells: list[str] = []
    for character in text:
        width = 0 if _CONTROL.match(character) else get_character_cell_size(character)
        if width:
            cells += [character, *[""] * (width - 1)]
        elif cells and not _CONTROL.match(character):
            last = max(index for index, cell in enumerate(cells) if cell)
            cells[last] += character
    return cells
