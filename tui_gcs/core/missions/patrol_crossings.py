"""The tours that planners' vehicles fly in circles: missions may cross them, at unknown times."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tui_gcs.core.missions.mission_conflicts import ComparablePath, comparable_loop
from tui_gcs.core.protocol.common import Annotation, VehicleRow


@dataclass(frozen=True)
class PatrolTours:
    """One vehicle of a team, on each of the tours that its planner has drawn."""

    team: str
    loops: tuple[ComparablePath, ...]


Flown = Mapping[int, tuple[str, float]]
"""By vehicle: its team, and the layer in metres on which it flies whatever its planner plans."""


def flown_by(rows: Iterable[VehicleRow]) -> Flown:
    """Return the vehicles that fly, or will fly, for a planner."""
    return {row.id: (row.team, row.layer_m) for row in rows if row.team and math.isfinite(row.layer_m)}


def patrols(flown: Flown, drawn: Mapping[str, Sequence[Annotation]]) -> dict[int, PatrolTours]:
    """Return the tours by vehicle. A tour is a drawn line that ends where it begins."""
    found = {}
    for vehicle, (team, layer_m) in flown.items():
        loops = [np.array(line.points_m) for line in drawn.get(team, ()) if line.is_loop]
        if loops:
            found[vehicle] = PatrolTours(team, tuple(comparable_loop(loop, layer_m) for loop in loops))
    return found
