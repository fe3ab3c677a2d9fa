"""Putting vehicles and words into the cells of a map without one hiding another."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from rich.cells import cell_len

from tui_gcs.core.protocol.common import Freshness, VehicleRow
from tui_gcs.feed.notices import Severity
from tui_gcs.widgets.basics.glyphs import GlyphSet, heading_glyph
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.fleet.severity_levels import INKS, MARKS, SELECTED_INKS, on_ground
from tui_gcs.widgets.fleet.vehicle_alarms import AlarmsByVehicle, level_now
from tui_gcs.widgets.map.map_scene import Word
from tui_gcs.widgets.map.map_viewport import Viewport

MAX_LABELLED = 60
"""Beyond so many vehicles only the selected and the alarmed ones have labels."""
CROWD_COLUMNS, CROWD_ROWS, CROWD_MIN = 6, 3, 4
"""Then so many ordinary vehicles in a block of so many cells are one number in brackets."""


class Cells:
    """Code points and inks of a map, and which cells hold text already."""

    def __init__(self, codes: NDArray[np.uint32], inks: NDArray[np.uint8]) -> None:
        """Write upon `codes` and `inks`, both (rows, columns)."""
        self.codes = codes
        self.inks = inks
        self.taken: NDArray[np.bool_] = np.zeros(codes.shape, dtype=np.bool_)

    def fits(self, column: int, row: int, width: int) -> bool:
        """Whether so many cells from here on are in view and free of text."""
        rows, columns = self.codes.shape
        inside = 0 <= row < rows and column >= 0 and column + width <= columns
        return inside and not self.taken[row, column : column + width].any()

    def write(self, column: int, row: int, text: str, ink: Ink) -> None:
        """Write text of single-width characters; what is out of view is cut off."""
        rows, columns = self.codes.shape
        if not 0 <= row < rows:
            return
        for offset, character in enumerate(text):
            if 0 <= column + offset < columns:
                self.codes[row, column + offset] = ord(character)
                self.inks[row, column + offset] = ink
                self.taken[row, column + offset] = True

    def must(self, word: Word) -> None:
        """Write what may not be missing: its first sign in any case, the whole word where it fits, or a row beside."""
        for row in (word.row, word.row - 1, word.row + 1):
            if self.fits(word.column, row, len(word.text)):
                self.place(word._replace(row=row))
                break
        self.write(word.column, word.row, word.text[:1], word.ink)

    def place(self, word: Word) -> None:
        """Write a word if nothing is in its way; pushed into the view sideways, not hidden."""
        text = "".join(letter if cell_len(letter) == 1 else "?" for letter in word.text)  # a cell each
        columns = self.codes.shape[1]
        column = max(0, min(word.column, columns - len(text)))
        if abs(column - word.column) < len(text) and self.fits(column, word.row, min(len(text), columns)):
            self.write(column, word.row, text, word.ink)


def vehicle_glyph(glyphs: GlyphSet, row: VehicleRow) -> str:
    """The vehicle's shape: an arrow in flight, else what state it stands in."""
    if row.freshness is Freshness.LOST:
        return glyphs.lost
    if not row.armed:
        return glyphs.disarmed
    return glyphs.armed_on_ground if on_ground(row) else heading_glyph(glyphs, row.heading_deg)


class VehicleLabels:
    """Draws vehicles with their ids; a label keeps its side of the vehicle while it can."""

    def __init__(self) -> None:
        """No label has a side yet."""
        self._side: dict[int, int] = {}
        self._crowded: set[tuple[int, int]] = set()

    def draw(
        self,
        cells: Cells,
        view: Viewport,
        vehicles: Sequence[VehicleRow],
        selected: int | None,
        alarms: AlarmsByVehicle,
        glyphs: GlyphSet,
    ) -> None:
        """All vehicles in view, the selected (reversed) and the alarmed (marked) first."""
        levels = {row.id: level_now(row, alarms.get(row.id, ())) for row in vehicles}
        order = sorted(vehicles, key=lambda row: (row.id != selected, -levels[row.id], row.id))
        seen: list[tuple[VehicleRow, tuple[int, int]]] = []
        for row in order:
            cell = view.world_to_cell(row.position_m[0], row.position_m[1])
            if cell is not None and view.contains(cell):
                seen.append((row, cell))
        crowds = self._crowds(seen, levels, selected) if len(seen) > MAX_LABELLED else {}
        for row, (x, y) in reversed(seen):
            if (x // CROWD_COLUMNS, y // CROWD_ROWS) not in crowds or _stands_out(levels[row.id], row.id == selected):
                cells.write(x, y, vehicle_glyph(glyphs, row), _ink(levels[row.id], row.id == selected))
        for row, (x, y) in seen:
            level, chosen = levels[row.id], row.id == selected
            if len(seen) <= MAX_LABELLED or _stands_out(level, chosen):
                self._label(cells, row.id, x, y, f"{MARKS[level]}{row.id}", _ink(level, chosen))
        for (x, y), count in crowds.items():
            cells.place(Word(x * CROWD_COLUMNS, y * CROWD_ROWS, f"({count})", Ink.TEXT))

    def _crowds(
        self, seen: Sequence[tuple[VehicleRow, tuple[int, int]]], levels: dict[int, Severity], selected: int | None
    ) -> dict[tuple[int, int], int]:
        """Blocks of cells with so many ordinary vehicles that a number tells more; one that was stays a while."""
        counts = Counter(
            (x // CROWD_COLUMNS, y // CROWD_ROWS)
            for row, (x, y) in seen
            if not _stands_out(levels[row.id], row.id == selected)
        )
        self._crowded = {
            block for block, count in counts.items() if count >= CROWD_MIN - (1 if block in self._crowded else 0)
        }
        return {block: counts[block] for block in self._crowded}

    def _label(self, cells: Cells, vehicle: int, x: int, y: int, text: str, ink: Ink) -> None:
        sides = ((x + 1, y), (x - len(text), y), (x, y - 1), (x, y + 1), (x + 1, y - 1), (x + 1, y + 1))
        kept = self._side.get(vehicle, 0)
        for side in (kept, *(side for side in range(len(sides)) if side != kept)):
            column, row = sides[side]
            if cells.fits(column, row, len(text)):
                self._side[vehicle] = side
                cells.write(column, row, text, ink)
                return


def _stands_out(level: Severity, selected: bool) -> bool:
    """Whether this vehicle is shown by itself however crowded it is."""
    return selected or level > Severity.GREY


def _ink(level: Severity, selected: bool) -> Ink:
    return SELECTED_INKS[level] if selected else INKS[level]
