"""Text for the numbers that planners publish: `predicted_worst_s` = 26.41 becomes "predicted worst 26.4 s"."""

import math
from collections.abc import Mapping

UNITS = {"_m_s2": " m/s²", "_m_s": " m/s", "_s": " s", "_m": " m", "_deg": "°", "_pct": " %"}
"""What the ends of names mean."""
UNKNOWN = "--"


def metric_words(name: str, value: float) -> str:
    """Name, number and unit. Names are cleaned where they come in (`TeamController`)."""
    for end, unit in UNITS.items():
        if name.endswith(end) and name != end:
            return f"{_plain(name.removesuffix(end))} {_number(value)}{unit if math.isfinite(value) else ''}"
    return f"{_plain(name)} {_number(value)}"


def all_words(metrics: Mapping[str, float], leave_out: frozenset[str] = frozenset()) -> list[str]:
    """Of all of them, by name."""
    return [metric_words(name, value) for name, value in sorted(metrics.items()) if name not in leave_out]


def seen_pct(coverage: float, digits: int = 1) -> float:
    """Coverage (0 to 1) in percent for people, never rounded up: 100 appears only when every cell was seen."""
    if not math.isfinite(coverage):
        return math.nan
    scale = 10.0**digits
    # Rounded first: 0.29 * 100 is 28.999… in floating point.
    return math.floor(round(coverage * 100 * scale, 6)) / scale


def _plain(name: str) -> str:
    return name.replace("_", " ").strip()


def _number(value: float) -> str:
    """At most three significant digits: a sixth digit that changes all the time cannot be read."""
    if not math.isfinite(value):
        return UNKNOWN
    whole = abs(value) < 1e9 and (abs(value) >= 100.0 or value == round(value))
    return f"{value + 0.0:.0f}" if whole else f"{value:.3g}"
