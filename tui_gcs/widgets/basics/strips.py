"""Lines of cells or words as Textual strips, and text that fits into cells.

Strips have few style runs, because bytes on the wire follow their number (docs/terminal.md B1).
"""

from collections.abc import Iterable
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray
from rich.cells import cell_len, set_cell_size
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from tui_gcs.widgets.basics.palette import STYLES, Ink

Run = tuple[str, Ink]
"""A piece of a line and its ink."""

SPACE = ord(" ")
CUT = ".."
MIN_CUT_CELLS = 5
"""With fewer cells, the mark of a cut would hide more than it shows."""
MIN_WRAP_CELLS = 10
"""Text for a narrower panel is wrapped as if it were this wide, and cut where it is drawn."""
_REVERSED = {ink for ink, style in STYLES.items() if style.reverse}


def cells_to_strip(codes: NDArray[np.uint32], inks: NDArray[np.uint8], base: Style) -> Strip:
    """One row of a map. A blank takes the ink to its left unless that is reversed, so that runs stay few."""
    text = codes.astype("<u4").tobytes().decode("utf-32-le")
    segments: list[Segment] = []
    start, current = 0, int(inks[0]) if len(inks) else 0
    for column in range(1, len(inks)):
        ink = int(inks[column])
        # A run costs 40 bytes in true colour with a background (docs/terminal.md B1), a blank shows no ink.
        if ink == current or (codes[column] == SPACE and current not in _REVERSED):
            continue
        segments.append(Segment(text[start:column], base + STYLES[current]))
        start, current = column, ink
    segments.append(Segment(text[start:], base + STYLES[current]))
    return Strip(segments, len(text))


def cut(text: str, width: int) -> str:
    """`text` in exactly `width` cells; it ends with `..` if a word is lost."""
    kept = set_cell_size(text, width)
    if len(kept) >= len(text.rstrip()) or width < MIN_CUT_CELLS:
        return kept
    return set_cell_size(text, width - len(CUT)) + CUT


def cut_before(text: str, width: int, mark: str) -> str:
    """As much of `text` as leaves room for `mark` in `width` cells."""
    return set_cell_size(text, max(width - cell_len(mark), 0)).rstrip()


def wrapped(text: str, cells: int, most: int | None = None, *, placeholder: str = CUT) -> list[str]:
    """`text` in lines of at most `cells` cells, at most `most` of them; a blank text gives one empty line.

    It breaks at words, whatever a vehicle may send; `placeholder` ends a text that was cut.
    """
    room = max(cells, MIN_WRAP_CELLS)
    if cell_len(text) != len(text):
        room //= 2  # as if all its characters were wide
    return wrap(text, room, max_lines=most, placeholder=placeholder) or [""]


def runs_to_strip(runs: Iterable[Run], width: int, base: Style) -> Strip:
    """A line of text, cut or filled to `width` cells; the text is never markup."""
    segments: list[Segment] = []
    used = 0
    for text, ink in runs:
        if used >= width:
            break
        wide = cell_len(text)
        if used + wide > width:
            text, wide = cut(text, width - used), width - used
        segments.append(Segment(text, base + STYLES[ink]))
        used += wide
    if used < width:
        segments.append(Segment(" " * (width - used), base))
    return Strip(segments, width)
