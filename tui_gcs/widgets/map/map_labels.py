"""Places vehicles and words in the cells of a map, so that none hides another."""

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
from tui_gcs.widgets.map.map_teams import MapTeams
from tui_gcs.widgets.map.map_viewport import Viewport

MAX_LABELLED = 60
"""With more vehicles in view only the selected and the alarmed ones have labels."""
CROWD_COLUMNS, CROWD_ROWS, MIN_CROWD = 6, 3, 4
"""Then this many ordinary vehicles in a block of this size are shown as one number in brackets."""


class Cells:
    """Code points and inks of a map, both (rows, columns), and which cells hold text already."""

    def __init__(self, codes: NDArray[np.uint32], inks: NDArray[np.uint8]) -> None:
        """Write upon `codes` and `inks`, both (rows, columns)."""
        self.codes = codes
        self.inks = inks
        self.taken: NDArray[np.bool_] = np.zeros(codes.shape, dtype=np.bool_)

    def fits(self, column: int, row: int, width: int) -> bool:
        """Return whether this many cells, from here to the right, are in view and free of text."""
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

    def write_first_sign(self, word: Word) -> None:
        """Write a word that must not be missing: always its first sign, the rest where it fits, or a row beside."""
        # Conflicts and targets often lie at vehicles: a row beside is better than half a word.
        for row in (word.row, word.row - 1, word.row + 1):
            if self.fits(word.column, row, len(word.text)):
                self.place(word._replace(row=row))
                break
        self.write(word.column, word.row, word.text[:1], word.ink)

    def place(self, word: Word) -> None:
        """Write a word if its cells are free; at the edge it is pushed sideways into the view."""
        # Each character takes one cell here: wide ones would push the rest of the row aside.
        text = "".join(letter if cell_len(letter) == 1 else "?" for letter in word.text)
        columns = self.codes.shape[1]
        column = max(0, min(word.column, columns - len(text)))
        if abs(column - word.column) < len(text) and self.fits(column, word.row, min(len(text), columns)):
            self.write(column, word.row, text, word.ink)


def vehicle_glyph(glyphs: GlyphSet, row: VehicleRow) -> str:
    """Return the vehicle's shape: an arrow in flight, else a sign for its state."""
    if row.freshness is Freshness.LOST:
        return glyphs.lost
    if not row.armed:
        return glyphs.disarmed
    return glyphs.armed_on_ground if on_ground(row) else heading_glyph(glyphs, row.heading_deg)


class VehicleLabels:
    """Draws vehicles with their ids; a label keeps its side of the vehicle as long as there is room."""

    def __init__(self) -> None:
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
        teams: MapTeams,
        *,
        lettered: bool,
    ) -> None:
        """Draw all vehicles in view; selected (reversed) and alarmed (marked) ones are placed first.

        Vehicles with which nothing is wrong have the colour of their team; `lettered` puts its letters behind the id.
        """
        levels = {row.id: level_now(row, alarms.get(row.id, ())) for row in vehicles}
        order = sorted(vehicles, key=lambda row: (row.id != selected, -levels[row.id], row.id))
        seen: list[tuple[VehicleRow, tuple[int, int]]] = []
        for row in order:
            cell = view.world_to_cell(row.position_m[0], row.position_m[1])
            if cell is not None and view.contains(cell):
                seen.append((row, cell))
        crowds = self._crowds(seen, levels, selected) if len(seen) > MAX_LABELLED else {}
        # The most important vehicle is written last, so that it is on top where several share a cell.
        for row, (x, y) in reversed(seen):
            if (x // CROWD_COLUMNS, y // CROWD_ROWS) not in crowds or _stands_out(levels[row.id], row.id == selected):
                ink = _ink(levels[row.id], row.id == selected, teams.vehicle_ink(row.team))
                cells.write(x, y, vehicle_glyph(glyphs, row), ink)
        for row, (x, y) in seen:
            level, chosen = levels[row.id], row.id == selected
            if len(seen) <= MAX_LABELLED or _stands_out(level, chosen):
                text = f"{MARKS[level]}{row.id}{teams.letters(row.team) if lettered else ''}"
                self._label(cells, row.id, x, y, text, _ink(level, chosen, teams.vehicle_ink(row.team)))
        for (x, y), count in crowds.items():
            cells.place(Word(x * CROWD_COLUMNS, y * CROWD_ROWS, f"({count})", Ink.TEXT))

    def _crowds(
        self, seen: Sequence[tuple[VehicleRow, tuple[int, int]]], levels: dict[int, Severity], selected: int | None
    ) -> dict[tuple[int, int], int]:
        """Return the crowded blocks of cells with their number of vehicles."""
        counts = Counter(
            (x // CROWD_COLUMNS, y // CROWD_ROWS)
            for row, (x, y) in seen
            if not _stands_out(levels[row.id], row.id == selected)
        )
        # A block stays crowded with one vehicle less, so that it does not flicker.
        self._crowded = {
            block for block, count in counts.items() if count >= MIN_CROWD - (1 if block in self._crowded else 0)
        }
        return {block: counts[block] for block in self._crowded}

    def _label(self, cells: Cells, vehicle: int, x: int, y: int, text: str, ink: Ink) -> None:
        sides = ((x + 1, y), (x - len(text), y), (x, y - 1), (x, y + 1), (x + 1, y - 1), (x + 1, y + 1))
        kept = self._side.get(vehicle, 0)
        # A label that changed sides with every frame could not be read.
        for side in (kept, *(side for side in range(len(sides)) if side != kept)):
            column, row = sides[side]
            if cells.fits(column, row, len(text)):
                self._side[vehicle] = side
                cells.write(column, row, text, ink)
                return


def _stands_out(level: Severity, selected: bool) -> bool:
    """Return whether this vehicle is shown by itself however crowded its block is."""
    return selected or level > Severity.GREY


def _ink(level: Severity, selected: bool, ordinary: Ink) -> Ink:
    """Return the ink of a level; `ordinary` is that of a vehicle with which nothing is wrong."""
    if selected:
        return SELECTED_INKS[level]
    return ordinary if level is Severity.NORMAL else INKS[level]
