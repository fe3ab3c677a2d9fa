"""One line of the table."""

from dataclasses import dataclass


class NotMeasured(Exception):
    """Why a figure could not be measured."""


@dataclass(frozen=True)
class Row:
    """A measured figure; `limit` is what it must stay below (or above), None where nothing is asked."""

    name: str
    value: float
    unit: str
    limit: float | None = None
    at_least: bool = False

    @property
    def kept(self) -> bool:
        """Whether the limit holds."""
        if self.limit is None:
            return True
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    def __str__(self) -> str:
        limit = "" if self.limit is None else f"{'>=' if self.at_least else '<='} {self.limit:g} {self.unit}"
        shown = f"{self.value:.0f}" if self.value >= 100 else f"{self.value:.2f}"
        return f"{self.name:<60}{shown + ' ' + self.unit:>14}{limit:>12}{'' if self.kept else '  NOT KEPT'}"
