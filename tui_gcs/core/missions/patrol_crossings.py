"""Tours that planners' vehicles fly round and round: where missions cross them, for nobody knows who is there then."""

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
"""By vehicle: its team, and the layer on which it flies whatever its planner plans, metres."""


def flown_by(rows: Iterable[VehicleRow]) -> Flown:
    """Who is heard and flies for a planner, or will."""
    return {row.id: (row.team, row.layer_m) for row in rows if row.team and math.isfinite(row.layer_m)}


def patrols(flown: Flown, drawn: Mapping[str, Sequence[Annotation]]) -> dict[int, PatrolTours]:
    """By vehicle. A tour is a line that ends where it begins."""
    found = {}
    for vehicle, (team, layer_m) in flown.items():
        loops = [np.array(line.points_m) for line in drawn.get(team, ()) if line.is_loop]
        if loops:
            found[vehicle] = PatrolTours(team, tuple(comparable_loop(loop, layer_m) for loop in loops))
    return found
