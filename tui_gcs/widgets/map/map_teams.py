"""How teams differ on a map: a colour and a dash for each, and letters and a legend where the operator wants them."""

from collections.abc import Iterable, Sequence

from tui_gcs.core.protocol.common import VehicleRow
from tui_gcs.widgets.basics.palette import TEAM_INKS, TOUR_INKS, Ink
from tui_gcs.widgets.map.task_markers import TASKS

PLAN_DASH = (1.0, 3.0)
"""Dots on and off of what a planner draws."""
DASHES = (PLAN_DASH, (4.0, 3.0), (8.0, 3.0), (2.0, 6.0), (1.0, 6.0), (12.0, 2.0))
"""Dots on and off of the tours of the first, second … team: they differ without colour."""


class MapTeams:
    """The teams that a map shows, in the order of their names. With fewer than two there is nothing to tell apart."""

    def __init__(self, names: Iterable[str] = ()) -> None:
        self.names: tuple[str, ...] = tuple(sorted({name for name in names if name}))
        self._index = {name: i for i, name in enumerate(self.names)} if len(self.names) > 1 else {}

    def vehicle_ink(self, team: str) -> Ink:
        """Return the ink of a vehicle with which nothing is wrong."""
        index = self._index.get(team)
        return Ink.TEXT if index is None else TEAM_INKS[index % len(TEAM_INKS)]

    def tour(self, team: str) -> tuple[Ink, tuple[float, float]]:
        """Return ink and dash of what a team's planner draws."""
        index = self._index.get(team)
        if index is None:
            return Ink.PLAN, PLAN_DASH
        return TOUR_INKS[index % len(TOUR_INKS)], DASHES[index % len(DASHES)]

    def letters(self, team: str) -> str:
        """Return the shortest beginning of a team's name that no other team's name begins with."""
        others = [name for name in self.names if name != team]
        if team not in self._index:
            return ""
        lengths = range(1, len(team) + 1)
        return next((team[:n] for n in lengths if not any(other.startswith(team[:n]) for other in others)), team)


def teams_of(rows: Sequence[VehicleRow], drawn: Iterable[str]) -> MapTeams:
    """Return the teams of vehicles and of drawings, which are kept by the names of teams."""
    return MapTeams([*(row.team for row in rows), *(name for name in drawn if name != TASKS)])
