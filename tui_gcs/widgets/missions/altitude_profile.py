"""The altitude profile of the edited mission: height above home along the path, with the edited item marked."""

import numpy as np

from tui_gcs.core.missions.timed_path import TimedPath
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_raster import DotRaster
from tui_gcs.widgets.map.map_viewport import DOTS_X, DOTS_Y
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_text import distance

SCALE_CELLS = 6
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
        rows = _curve(path, columns, height, top_m, self.glyphs.dots)
        mark = self._mark(path, columns)
        lines: list[Line] = []
        for y, row in enumerate(rows):
            scale = (
                f"{top_m:>4.0f}m " if y == 0 else f"{distance(float(path.along_m[-1])):>6}" if y == height - 1 else ""
            )
            runs = [(f"{scale:<{SCALE_CELLS}}", Ink.MUTED)]
            if mark is None:
                lines.append([*runs, (row, Ink.PLAN)])
            else:
                sign = row[mark] if row[mark] != " " else "|"
                lines.append([*runs, (row[:mark], Ink.TEXT), (sign, Ink.SELECTED), (row[mark + 1 :], Ink.TEXT)])
        return lines

    def _mark(self, path: TimedPath, columns: int) -> int | None:
        """Return the column of the edited item; None if the path does not reach it."""
        at_s = path.arrivals_s.get(self._editor.index)
        if at_s is None or not path.along_m[-1]:
            return None
        along_m = float(np.interp(at_s, path.t_s, path.along_m))
        return min(int(along_m / path.along_m[-1] * columns), columns - 1)


def _curve(path: TimedPath, columns: int, rows: int, top_m: float, dots: str) -> list[str]:
    raster = DotRaster(columns, rows)
    length_m = max(float(path.along_m[-1]), 1e-9)
    x = path.along_m / length_m * (columns * DOTS_X - 1)
    y = (1.0 - np.maximum(path.points_m[:, 2], 0.0) / top_m) * (rows * DOTS_Y - 1)
    raster.polyline(np.column_stack([x, y]) + 0.5, Ink.PLAN)
    codes = raster.codes(dots, _LETTERS)  # type: ignore[arg-type]
    return [row.astype("<u4").tobytes().decode("utf-32-le") for row in codes]
