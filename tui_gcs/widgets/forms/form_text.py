"""Conversion between the texts of form fields and numbers, points and ids. Independent of Textual.

A field that was not touched keeps its exact value, however it is rounded on the screen.
"""

import math
import re
from collections.abc import Iterable

Point = tuple[float, float]

_BETWEEN_POINTS = re.compile(r"[;\s]+")
_MAX_ID = 254


class FieldError(ValueError):
    """A field does not hold an allowed value: one line with what is wrong and what is allowed."""


def number_text(value: float | None) -> str:
    """Format a number to millimetres at most, without trailing zeros; "" for None."""
    if value is None:
        return ""
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


def to_number(text: str, name: str, old: float | None = None) -> float:
    """Return the number in `text`; exactly `old` if the text is how `old` is shown. Raises FieldError."""
    # The field shows a rounded number: as long as it is not touched, the exact one is kept.
    if old is not None and text == number_text(old):
        return old
    try:
        value = float(text.strip())
    except ValueError:
        value = math.nan
    # `float` takes nan, inf and 1_000, which are no numbers that an operator means.
    if not math.isfinite(value) or "_" in text:
        raise FieldError(f"{name}: {shown(text)} is not a number; must be a number like 80 or -12.5")
    return value


def points_text(points: Iterable[Point]) -> str:
    """Format points as `E,N` pairs with blanks between them."""
    return " ".join(f"{number_text(x)},{number_text(y)}" for x, y in points)


def to_points(text: str, name: str, old: tuple[Point, ...] = ()) -> tuple[Point, ...]:
    """Return the `E,N` pairs in `text`; a pair that was not touched keeps its exact value. Raises FieldError."""
    exact = {points_text([point]): point for point in old}
    points = []
    for count, pair in enumerate((part for part in _BETWEEN_POINTS.split(text.strip()) if part), 1):
        if pair in exact:
            points.append(exact[pair])
            continue
        east, comma, north = pair.partition(",")
        if not comma:
            raise FieldError(f"{name}[{count}]: {shown(pair)} is no corner; must be E,N like 90,130")
        points.append((to_number(east, f"{name}[{count}] E"), to_number(north, f"{name}[{count}] N")))
    return tuple(points)


def ids_text(ids: Iterable[int]) -> str:
    """Format ids as `1-4 7`, in the order given."""
    parts: list[list[int]] = []
    for vehicle in ids:
        if parts and vehicle == parts[-1][1] + 1:
            parts[-1][1] = vehicle
        else:
            parts.append([vehicle, vehicle])
    return " ".join(str(low) if low == high else f"{low}-{high}" for low, high in parts)


def to_ids(text: str, name: str) -> tuple[int, ...]:
    """Return the ids in a text of ids and ranges, separated by blanks or commas. Raises FieldError."""
    ids: list[int] = []
    for part in re.split(r"[,\s]+", text.strip()):
        if not part:
            continue
        found = re.fullmatch(r"([0-9]{1,3})(?:-([0-9]{1,3}))?", part)
        low = int(found[1]) if found else 0
        high = int(found[2] or low) if found else 0
        if not 1 <= low <= high <= _MAX_ID:
            raise FieldError(f"{name}: {shown(part)} is no system id; must be ids from 1 to {_MAX_ID}, like 1-4 7")
        ids += range(low, high + 1)
    return tuple(ids)


def shown(text: str) -> str:
    """Return a typed text as it may stand in a message: short, on one line, nothing unprintable."""
    if not text.strip():
        return "nothing"
    clean = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return f"'{clean if len(clean) <= 30 else clean[:29] + '…'}'"
