"""Places that move for ever on a closed way at constant speed: peaks of density maps, and moving obstacles.

A closed way needs no beginning: where the place is follows from the clock alone, in every process and after a restart.
"""

import math

import msgspec
import numpy as np

Point = tuple[float, float]


class Loop(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A closed way through points in ENU metres, or one fixed point."""

    points_m: tuple[Point, ...]
    period_s: float = 0.0
    """The time of one turn. With 0 the place stays at the first point."""

    def at(self, t_s: float) -> tuple[Point, Point]:
        """Return position in metres and velocity in m/s (east, north) at time `t_s`."""
        closed = np.array((*self.points_m, self.points_m[0]), dtype=float)
        legs = np.diff(closed, axis=0)
        lengths = np.hypot(legs[:, 0], legs[:, 1])
        total_m = float(lengths.sum())
        if total_m <= 0.0 or self.period_s <= 0.0:
            return self.points_m[0], (0.0, 0.0)
        along_m = math.fmod(t_s, self.period_s) / self.period_s * total_m % total_m
        ends = np.cumsum(lengths)
        leg = min(int(np.searchsorted(ends, along_m, side="right")), len(lengths) - 1)
        while lengths[leg] == 0.0:  # the last points may be one place
            leg -= 1
        unit = legs[leg] / lengths[leg]
        x, y = (closed[leg] + (along_m - ends[leg] + lengths[leg]) * unit).tolist()
        east, north = (unit * total_m / self.period_s).tolist()
        return (x, y), (east, north)
