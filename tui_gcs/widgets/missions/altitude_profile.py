"""The altitude profile of the edited mission: height above home along the path, with the edited item marked.

Where the heights of the ground are known, the ground is filled below the path.
"""

from itertools import groupby

import numpy as np

from tui_gcs.core.missions.ground_clearance import Floats, relative_ground_m
from tui_gcs.core.missions.timed_path import TimedPath
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_text import distance

SCALE_CELLS = 6
FILLED = (":", "░")
"""The ground below the path, without and with signs beyond ASCII."""
_LETTERS = np.full(len(Ink), ord("*"), dtype=np.uint32)


class AltitudeProfile(LinesView):
    """A curve with its greatest height and its length."""

    DEFAULT_CSS = framed("AltitudeProfile", "height: 6;")

    def __init__(self, editor: MissionEditor, **options: object) -> None:
        super().__init__(**options)  # type: ignore[arg-type]
        self._editor = editor

    def lines(self, width: int, height: int) -> list[Line]:
        """Return the curve with its scale, or that there is no mission."""
        path = self._editor.forecast.path(self._editor.vehicle)
        columns = width - SCALE_CELLS
        if path.is_empty or columns < 4 or height < 1:
            return [[("no mission, no profile", Ink.MUTED)]]
        # A mission on the ground has no height to scale by.
        top_m = max(float(path.points_m[:, 2].max()), 1.0)
        ground_m = self._ground_m(path, columns)
        low_m = min(0.0, float(np.nanmin(ground_m))) if np.isfinite(ground_m).any() else 0.0
        top_m = max(top_m, float(np.nanmax(ground_m))) if np.isfinite(ground_m).any() else top_m
        rows = _curve(path, columns, height, (low_m, top_m), self.glyphs.dots)
        mark = self._mark(path, columns)
        lines: list[Line] = []
        for y, row in enumerate(rows):
            scale = (
                f"{top_m:>4.0f}m " if y == 0 else f"{distance(float(path.along_m[-1])):>6}" if y == height - 1 else ""
            )
            runs = [(f"{scale:<{SCALE_CELLS}}", Ink.MUTED)]
            if mark is None:
                inks = [Ink.PLAN] * columns
            else:
                inks = [Ink.TEXT] * columns
                inks[mark] = Ink.SELECTED
                row = row[:mark] + (row[mark] if row[mark] != " " else "|") + row[mark + 1 :]
            # The ground reaches up to this height in the middle of the row.
            level_m = top_m - (y + 0.5) / height * (top_m - low_m)
            below = [char == " " and ground > level_m for char, ground in zip(row, ground_m.tolist(), strict=True)]
            signs = [
                FILLED[self.glyphs.unicode] if is_ground else char for char, is_ground in zip(row, below, strict=True)
            ]
            inks = [Ink.MUTED if is_ground else ink for ink, is_ground in zip(inks, below, strict=True)]
            runs += [
                ("".join(sign for sign, _ in same), ink)
                for ink, same in groupby(zip(signs, inks, strict=True), key=lambda each: each[1])
            ]
            lines.append(runs)
        return lines

    def _ground_m(self, path: TimedPath, columns: int) -> Floats:
        """Return the ground below each column, (columns,), in metres above the ground at home; NaN where unknown."""
        forecast = self._editor.forecast
        if forecast.elevation is None:
            return np.full(columns, np.nan)
        along_m = (np.arange(columns) + 0.5) / columns * path.along_m[-1]
        places_m = np.column_stack([np.interp(along_m, path.along_m, path.points_m[:, axis]) for axis in (0, 1)])
        home_m = (float(path.points_m[0, 0]), float(path.points_m[0, 1]))
        return relative_ground_m(forecast.elevation, forecast.frame, places_m, home_m)

    def _mark(self, path: TimedPath, columns: int) -> int | None:
        """Return the column of the edited item; None if the path does not reach it."""
        at_s = path.arrivals_s.get(self._editor.index)
        if at_s is None or not path.along_m[-1]:
            return None
        along_m = float(np.interp(at_s, path.t_s, path.along_m))
        return min(int(along_m / path.along_m[-1] * columns), columns - 1)


def _curve(path: TimedPath, columns: int, rows: int, band_m: tuple[float, float], dots: str) -> list[str]:
    """Draw the path in the rows; `band_m` are the heights of the lowest and the highest of them."""
    low_m, top_m = band_m
    raster = DotRaster(columns, rows)
    length_m = max(float(path.along_m[-1]), 1e-9)
    x = path.along_m / length_m * (columns * DOTS_X - 1)
    y = (top_m - np.clip(path.points_m[:, 2], low_m, top_m)) / (top_m - low_m) * (rows * DOTS_Y - 1)
    raster.polyline(np.column_stack([x, y]) + 0.5, Ink.PLAN)
    codes = raster.codes(dots, _LETTERS)  # type: ignore[arg-type]
    return [row.astype("<u4").tobytes().decode("utf-32-le") for row in codes]
