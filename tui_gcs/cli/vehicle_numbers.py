"""Vehicles as a user names them on a command line: 3, 3-7 or 1,4."""

from collections.abc import Sequence

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.base.text import clean

VEHICLE_NUMBER_LIMIT = 1_000_000
"""No vehicle has this number or a higher one."""
MAX_RANGE_SIZE = 999
"""The largest range: one network."""


def vehicle_ids(text: str) -> tuple[int, ...]:
    """Return the vehicles named as 3, 3-7 or 1,4, in that order. Raises `CommandError`."""
    ids: list[int] = []
    for part in text.split(","):
        first, dash, last = part.partition("-")
        if not (first.isascii() and first.isdigit() and (not dash or (last.isascii() and last.isdigit()))):
            raise CommandError(f"{clean(text, 40)!r}: vehicles are named as 3, 3-7 or 1,4")
        low, high = _number(first), _number(last or first)
        if not 0 < low <= high < VEHICLE_NUMBER_LIMIT or high - low > MAX_RANGE_SIZE:
            raise CommandError(f"{clean(text, 40)!r}: no such vehicles")
        ids += range(low, high + 1)
    return tuple(dict.fromkeys(ids))


def named_vehicles(words: Sequence[str]) -> tuple[int, ...]:
    """Return vehicles that are named in several words, as 1 2 3, 1-8 or 1,4. Raises `CommandError`."""
    return tuple(dict.fromkeys(vehicle for word in words for vehicle in vehicle_ids(word)))


def _number(digits: str) -> int:
    """Return the number, or `VEHICLE_NUMBER_LIMIT` if it has more digits than any vehicle's."""
    return int(digits) if len(digits) < len(str(VEHICLE_NUMBER_LIMIT)) else VEHICLE_NUMBER_LIMIT


def only_one(text: str, why: str) -> int:
    """Return the one vehicle that is named. Raises `CommandError`."""
    ids = vehicle_ids(text)
    if len(ids) != 1:
        raise CommandError(f"{clean(text, 40)}: name one vehicle, {why}")
    return ids[0]


def listed(ids: Sequence[int]) -> str:
    """Return vehicle numbers as text."""
    return f"vehicle{'s' if len(ids) > 1 else ''} {', '.join(map(str, ids))}"
