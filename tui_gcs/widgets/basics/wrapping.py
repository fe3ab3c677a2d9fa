"""Text on several lines, at words: for any text a vehicle may send, and on any terminal."""

from textwrap import wrap

from rich.cells import cell_len

from tui_gcs.widgets.basics.strips import CUT

LEAST_CELLS = 10
"""Narrower is wrapped as if it were so wide: what sticks out is cut where it is drawn."""


def wrapped(text: str, cells: int, most: int | None = None, *, placeholder: str = CUT) -> list[str]:
    """`text` in lines of so many cells, at most `most`; at least one line, of a blank text an empty one.

    `placeholder` says that something was cut.
    """
    room = max(cells, LEAST_CELLS)
    if cell_len(text) != len(text):
        room //= 2  # as if all its characters were wide
    return wrap(text, room, max_lines=most, placeholder=placeholder) or [""]
