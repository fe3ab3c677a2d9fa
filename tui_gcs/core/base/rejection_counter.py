"""Counts of what was refused, by cause; whose it was is remembered until it is told."""

from collections import Counter


class RejectionCounter(Counter[str]):
    """A counter by cause that can say which vehicles the newest counts are of."""

    def __init__(self) -> None:
        """Nothing yet."""
        super().__init__()
        self._whose: dict[str, set[int]] = {}

    def count(self, cause: str, vehicle: int | None) -> None:
        """One more of this vehicle; None: of nobody that is known."""
        self[cause] += 1
        if vehicle is not None:
            self._whose.setdefault(cause, set()).add(vehicle)

    def take_vehicles(self, cause: str) -> tuple[int, ...]:
        """Ids that were counted for `cause` since this was asked last."""
        return tuple(sorted(self._whose.pop(cause, ())))
