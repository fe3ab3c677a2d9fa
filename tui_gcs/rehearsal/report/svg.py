"""Pictures as SVG text: a line chart, and a map that may hold a heat map.

No library is needed to draw them, and any browser shows them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Point = tuple[float, float]

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f7f7f")
"""Okabe and Ito's palette, which colour-blind readers can distinguish, and two more colours."""
WIDTH, HEIGHT = 760, 240
LEFT, RIGHT, TOP, BOTTOM = 46, 12, 10, 34
NOTE_CHARACTER, NOTE_ROWS = 6.2, 12
"""Largest width of a character of a mark's text, and rows of marks: marks close together stand below each other."""
MAX_POINTS = 1200
"""Longer lines are thinned out."""
SCALE = ("#fff7bc", "#fee391", "#fec44f", "#fe9929", "#d95f0e", "#8c2d04")
"""Colours of the heat map from seen often to seen seldom (ColorBrewer YlOrBr)."""
NEVER = "#000000"


@dataclass(frozen=True)
class ChartLine:
    """One line of a chart; NaN leaves a gap."""

    name: str
    xs: Sequence[float]
    ys: Sequence[float]
    colour: str
    dashed: bool = False


def chart(title: str, lines: Sequence[ChartLine], *, unit: str, marks: Sequence[tuple[float, str]] = ()) -> str:
    """Return a chart of lines over mission time (s); `marks` are (time, text)."""
    xs = [x for line in lines for x in line.xs] or [0.0, 1.0]
    ys = [y for line in lines for y in line.ys if math.isfinite(y)] or [0.0, 1.0]
    low_x, high_x = min(xs), max(max(xs), min(xs) + 1.0)
    high_y = nice(max(*ys, 1e-9))
    low_y = -nice(-min(ys)) if min(ys) < 0.0 else 0.0

    def at(x: float, y: float) -> Point:
        return (
            LEFT + (x - low_x) / (high_x - low_x) * (WIDTH - LEFT - RIGHT),
            HEIGHT - BOTTOM - min(max((y - low_y) / (high_y - low_y), 0.0), 1.0) * (HEIGHT - TOP - BOTTOM),
        )

    parts = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(title)}">']
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        value = low_y + share * (high_y - low_y)
        _, y = at(low_x, value)
        parts.append(f'<line class="grid" x1="{LEFT}" y1="{y:.1f}" x2="{WIDTH - RIGHT}" y2="{y:.1f}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        value = low_x + share * (high_x - low_x)
        x, _ = at(value, 0.0)
        anchor = "end" if share == 1.0 else "middle"  # the last label would be cut at the edge
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 15}" text-anchor="{anchor}">{value:.0f} s</text>')
    parts.append(f'<text x="{LEFT}" y="{TOP + 10}" class="unit">{escape(unit)}</text>')
    ends: list[float] = []
    for t_s, text in sorted(marks):
        x, _ = at(t_s, 0.0)
        wide = len(text) * NOTE_CHARACTER
        begin = x + 3 if x + 3 + wide < WIDTH else x - 3 - wide
        # Each mark takes the first row whose last text ends before it begins.
        row = next((row for row, end in enumerate(ends) if end < begin), len(ends))
        ends[row : row + 1] = [begin + wide]
        parts.append(f'<line class="mark" x1="{x:.1f}" y1="{TOP}" x2="{x:.1f}" y2="{HEIGHT - BOTTOM}"/>')
        parts.append(f"<title>{escape(text)}</title>")
        y = TOP + 10 + row % NOTE_ROWS * 13
        parts.append(f'<text x="{max(begin, LEFT):.1f}" y="{y}" class="note">{escape(text)}</text>')
    for line in lines:
        dash = ' stroke-dasharray="6 4"' if line.dashed else ""
        for run in _runs([at(x, y) if math.isfinite(y) else None for x, y in zip(line.xs, line.ys, strict=True)]):
            points = " ".join(f"{x:.1f},{y:.1f}" for x, y in thinned(run))
            parts.append(f'<polyline fill="none" stroke="{line.colour}" stroke-width="1.6"{dash} points="{points}"/>')
    parts.append("</svg>")
    return "".join(parts) + legend([(line.name, line.colour) for line in lines])


def legend(entries: Sequence[tuple[str, str]]) -> str:
    """Return names with their colours."""
    items = "".join(f'<span><i style="background:{colour}"></i>{escape(name)}</span>' for name, colour in entries)
    return f'<p class="legend">{items}</p>'


class SvgMap:
    """A map of ENU metres, north up, with equal metres along both axes."""

    def __init__(self, title: str, low: Point, high: Point, width: int = WIDTH) -> None:
        """Draw from `low` to `high` (metres)."""
        self._low, self._high = low, high
        self._scale = width / max(high[0] - low[0], 1.0)
        self._height = max(1.0, (high[1] - low[1]) * self._scale)
        self._parts = [
            f'<svg viewBox="0 0 {width} {self._height:.0f}" role="img" aria-label="{escape(title)}">',
        ]

    def at(self, x_m: float, y_m: float) -> Point:
        """Return the place on the picture."""
        return (x_m - self._low[0]) * self._scale, (self._high[1] - y_m) * self._scale

    def polygon(self, points_m: Sequence[Point], style: str) -> None:
        """Draw a closed outline of ENU metres."""
        self._parts.append(f'<polygon points="{self._points(points_m)}" {style}/>')

    def path(self, points_m: Sequence[Point], style: str) -> None:
        """Draw an open line; NaN leaves a gap."""
        for run in _runs([p if math.isfinite(p[0]) else None for p in points_m]):
            self._parts.append(f'<polyline fill="none" points="{self._points(thinned(run))}" {style}/>')

    def text(self, x_m: float, y_m: float, text: str, style: str = "") -> None:
        """Draw a text at a place."""
        x, y = self.at(x_m, y_m)
        self._parts.append(f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(text)}</text>')

    def dot(self, x_m: float, y_m: float, colour: str) -> None:
        """Draw a disc of four pixels radius at a place."""
        x, y = self.at(x_m, y_m)
        self._parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')

    def cross(self, x_m: float, y_m: float, colour: str) -> None:
        """Draw a small × at a place, for a vehicle that is gone."""
        x, y = self.at(x_m, y_m)
        way = f"M{x - 4:.1f},{y - 4:.1f}l8,8m0,-8l-8,8"
        self._parts.append(f'<path d="{way}" fill="none" stroke="{colour}" stroke-width="2"/>')

    def cells(self, centres_m: Floats, cell_m: float, values: Floats, most: float) -> None:
        """Draw squares coloured by value, 0 to `most`; black where infinite."""
        side = cell_m * self._scale
        for (x_m, y_m), value in zip(centres_m.tolist(), values.tolist(), strict=True):
            x, y = self.at(x_m - cell_m / 2, y_m + cell_m / 2)
            colour = heat(value / most) if math.isfinite(value) else NEVER
            size = f'width="{side + 0.3:.1f}" height="{side + 0.3:.1f}"'
            self._parts.append(f'<rect x="{x:.1f}" y="{y:.1f}" {size} fill="{colour}"/>')

    def __str__(self) -> str:
        """The whole picture as SVG."""
        return "".join([*self._parts, "</svg>"])

    def _points(self, points_m: Sequence[Point]) -> str:
        return " ".join("{:.1f},{:.1f}".format(*self.at(*p)) for p in points_m)


def heat(share: float) -> str:
    """Return a colour of the scale for 0…1."""
    return SCALE[min(int(max(share, 0.0) * len(SCALE)), len(SCALE) - 1)]


def nice(value: float) -> float:
    """Return the next of 1, 2, 2.5, 5 times a power of ten that is not smaller."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if value <= step * power * (1 + 1e-9))


def thinned(points: Sequence[Point]) -> Sequence[Point]:
    """Return at most about `MAX_POINTS` of the points, the last among them."""
    every = -(-len(points) // MAX_POINTS)
    return [*points[:-1:every], points[-1]] if every > 1 else points


def _runs(points: Sequence[Point | None]) -> list[list[Point]]:
    """Return the parts between the gaps."""
    runs: list[list[Point]] = [[]]
    for point in points:
        if point is None:
            runs.append([])
        else:
            runs[-1].append(point)
    return [run for run in runs if len(run) > 1]
