"""Parameters of several vehicles side by side: which values there are, and which vehicles differ.

Independent of Textual and of the bus: `ParameterTransfers` brings the rows.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from tui_gcs.core.protocol.services import ParamRow
from tui_gcs.core.protocol.setup import Number


@dataclass(frozen=True)
class ValueGroup:
    """A value of a parameter, and the vehicles that hold it."""

    value: Number
    vehicles: tuple[int, ...]


@dataclass(frozen=True)
class FleetParameter:
    """One parameter of the compared vehicles."""

    name: str
    row: ParamRow
    """The row of the first vehicle that has it: type, meaning, unit and limits are the same for all of a kind."""
    groups: tuple[ValueGroup, ...]
    """All values, the one that most vehicles hold first."""
    lacking: tuple[int, ...]
    """Compared vehicles that do not have the parameter."""
    is_changed: bool
    """Whether a vehicle's value differs from the default that it reports."""
    words: str
    """Name and meaning in lower case, for the search."""

    @property
    def differs(self) -> bool:
        """Whether the vehicles that have it hold different values."""
        return len(self.groups) > 1

    def value_of(self, vehicle: int) -> Number | None:
        """Return the value of a vehicle; None if it does not have the parameter."""
        return next((group.value for group in self.groups if vehicle in group.vehicles), None)


class FleetParameters:
    """The newest known parameters of each vehicle, and the table that compares them."""

    def __init__(self) -> None:
        """Begin without any."""
        self._rows: dict[int, dict[str, ParamRow]] = {}
        self._complete: set[int] = set()
        self._table: tuple[FleetParameter, ...] = ()
        self._compared: tuple[int, ...] | None = None

    def take(self, vehicle: int, rows: Iterable[ParamRow], *, complete: bool) -> None:
        """Replace what is known of a vehicle; `complete`: the station has fetched all since the vehicle booted."""
        self._rows[vehicle] = {row.name: row for row in rows}
        (self._complete.add if complete else self._complete.discard)(vehicle)
        self._compared = None

    def of(self, vehicle: int) -> Mapping[str, ParamRow]:
        """Return the known parameters of a vehicle by name."""
        return self._rows.get(vehicle, {})

    def is_complete(self, vehicle: int) -> bool:
        """Return whether all parameters of a vehicle are known."""
        return vehicle in self._complete

    def table(self, vehicles: Sequence[int]) -> tuple[FleetParameter, ...]:
        """Return the parameters of these vehicles sorted by name. The same vehicles are not compared twice."""
        # A key press must not compare 1327 x 50 values again: comparing took 80 ms of CPU.
        compared = tuple(vehicles)
        if compared != self._compared:
            known = [vehicle for vehicle in compared if vehicle in self._rows]
            names = sorted({name for vehicle in known for name in self._rows[vehicle]})
            self._table = tuple(self._compare(name, known) for name in names)
            self._compared = compared
        return self._table

    def _compare(self, name: str, vehicles: Sequence[int]) -> FleetParameter:
        holders: dict[Number, list[int]] = {}
        lacking: list[int] = []
        first: ParamRow | None = None
        is_changed = False
        for vehicle in vehicles:
            row = self._rows[vehicle].get(name)
            if row is None:
                lacking.append(vehicle)
                continue
            first = first or row
            # NaN is not equal to itself: without one key for all of them each vehicle would be a group of its own.
            holders.setdefault(row.value if row.value == row.value else _NAN, []).append(vehicle)
            is_changed = is_changed or (row.default is not None and row.value != row.default)
        if first is None:
            raise ValueError(f"no vehicle has {name}")
        groups = sorted(holders.items(), key=lambda each: -len(each[1]))
        return FleetParameter(
            name,
            first,
            tuple(ValueGroup(value, tuple(held)) for value, held in groups),
            tuple(lacking),
            is_changed,
            f"{name} {first.text}".casefold(),
        )


_NAN = float("nan")


@dataclass(frozen=True)
class ParameterFilter:
    """Which parameters are shown: all parts of the filter must fit."""

    words: str = ""
    """Every word occurs in the name or in the meaning."""
    only_differing: bool = False
    only_changed: bool = False
    favourites: frozenset[str] | None = None
    """Only these names; None: all."""

    def matching(self, table: Sequence[FleetParameter]) -> list[FleetParameter]:
        """Return the parameters that fit; those whose name begins with what is searched come first."""
        words = self.words.casefold().split()
        found = [
            each
            for each in table
            if all(word in each.words for word in words)
            and (not self.only_differing or each.differs)
            and (not self.only_changed or each.is_changed)
            and (self.favourites is None or each.name in self.favourites)
        ]
        if words:
            found.sort(key=lambda each: not each.name.casefold().startswith(words[0]))
        return found


def group_of(name: str) -> str:
    """Return the group of a parameter: what stands before the first underscore, without an instance's digits."""
    return name.partition("_")[0].rstrip("0123456789")
