"""Rejection counter: counts of refused frames and values by cause, with the vehicles concerned."""

from collections import Counter


class RejectionCounter(Counter[str]):
    """A counter by cause that also keeps which vehicles the newest counts belong to."""

    def __init__(self) -> None:
        super().__init__()
        self._vehicles: dict[str, set[int]] = {}

    def count(self, cause: str, vehicle: int | None) -> None:
        """Count one more; `vehicle` is None where it belongs to no known vehicle."""
        self[cause] += 1
        if vehicle is not None:
            self._vehicles.setdefault(cause, set()).add(vehicle)

    def take_vehicles(self, cause: str) -> tuple[int, ...]:
        """Return the ids that were counted for `cause` since the last call."""
        return tuple(sorted(self._vehicles.pop(cause, ())))
