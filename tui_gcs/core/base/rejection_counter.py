"""Rejection counter: counts of refused frames and values by cause, with the vehicles concerned."""

from collections import Counter


class RejectionCounter(Counter[str]):
    """A counter by cause that also keeps which vehicles the newest counts belong to."""

    def __init__(self) -> None:
        super().__init__()
        self._vehicles: dict[str, set[int]] = {}

    def __deepcopy__(self, _memo: dict[int, object]) -> "RejectionCounter":
        """Return an independent copy. `Counter` copies itself by giving its counts to the constructor."""
        twin = RejectionCounter()
        twin.update(self)
        twin._vehicles = {cause: set(vehicles) for cause, vehicles in self._vehicles.items()}
        return twin

    def count(self, cause: str, vehicle: int | None) -> None:
        """Count one more; `vehicle` is None where it belongs to no known vehicle."""
        self[cause] += 1
        if vehicle is not None:
            self._vehicles.setdefault(cause, set()).add(vehicle)

    def take_vehicles(self, cause: str) -> tuple[int, ...]:
        """Return the ids that were counted for `cause` since the last call."""
        return tuple(sorted(self._vehicles.pop(cause, ())))
