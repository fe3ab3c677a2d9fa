"""The scale of a plot: its ends, the round numbers that are marked, and numbers that fit into few cells."""

import math
from dataclasses import dataclass

MIN_ROWS_PER_TICK = 3
PAD_SHARE = 0.02
"""A flat line gets a scale of this share of its value, or of one unit, to both sides."""
MIN_SPAN = 1e-150
"""Smaller differences are not shown: near the smallest of all a scale has no steps."""
UNKNOWN = "--"


@dataclass(frozen=True)
class PlotScale:
    """The values at the lower and upper edge of a plot, and the marked ones between them."""

    low: float
    high: float
    ticks: tuple[float, ...]
    step: float

    def covers(self, low: float, high: float) -> bool:
        """Whether these values fit onto it and fill a third of it or more, so that it need not be changed."""
        return self.low <= low and high <= self.high and (high - low) * 3.0 >= self.high - self.low - self.step


def nice_scale(low: float, high: float, rows: int) -> PlotScale:
    """Return a scale that holds `low` to `high`, both finite; it begins and ends at round numbers."""
    pad = max(abs(low), abs(high)) * PAD_SHARE
    # Also where the values are so large that their difference is lost in their last digits.
    if not high - low > max(abs(low), abs(high), MIN_SPAN) * 1e-9:
        pad = pad if pad > MIN_SPAN else 1.0
        low, high = low - pad, high + pad
    step = _round_step((high - low) / max(1, rows // MIN_ROWS_PER_TICK))
    first, last = math.floor(low / step), math.ceil(high / step)
    ticks = tuple((first + at) * step for at in range(last - first + 1))
    return PlotScale(first * step, last * step, ticks, step)


def _round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next((factor * power for factor in (1.0, 2.0, 5.0) if factor * power >= least), 10.0 * power)


def tick_words(value: float, step: float, cells: int) -> str:
    """Return the number of a mark, with as many decimals as its neighbours differ in."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    text = f"{value + 0.0:.{decimals}f}" if abs(value) < 1e9 and decimals < 9 else f"{value:.3g}"
    return text if len(text) <= cells else short_number(value, cells)


def short_number(value: float, cells: int) -> str:
    """Return a number in at most `cells` cells (six or more), with at most four digits; `--` if it is not known."""
    if not math.isfinite(value):
        return UNKNOWN
    for digits in (4, 3, 2, 1):
        text = f"{value + 0.0:.{digits}g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
        if digits == 4 and 1e4 <= abs(value) < 1e6:
            text = f"{value:.0f}"
        if len(text) <= cells:
            break
    return text
