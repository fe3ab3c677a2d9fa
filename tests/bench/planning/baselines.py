"""What else flies: a loop that an operator draws, strips there and back, and greedy pursuit of the oldest cell."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, cell_centres_m
from tui_gcs.core.geometry.zones import Shape, bounds
from tui_gcs.planner.patrol.tour import Tour, resampled, timed

Floats = NDArray[np.floating[Any]]

SPEED_M_S, ACCEL_M_S2, RADIUS_M = 8.0, 2.5, 15.0
WARM_S, FLOWN_S, STEP_S = 200.0, 600.0, 0.25


def loops(shape: Shape, n: int) -> list[Tour]:
    """One rectangle per vehicle, a footprint inside its share of the zone's bounding box: drawn by hand in a minute."""
    columns = math.ceil(math.sqrt(n))
    rows = math.ceil(n / columns)
    tours = []
    for k in range(n):
        x0, y0, x1, y1 = _part(shape, columns, rows, k % (columns * rows))
        dx, dy = min(RADIUS_M, (x1 - x0) / 2.5), min(RADIUS_M, (y1 - y0) / 2.5)
        tours.append(_flown([(x0 + dx, y0 + dy), (x1 - dx, y0 + dy), (x1 - dx, y1 - dy), (x0 + dx, y1 - dy)]))
    return tours


def strips(shape: Shape, n: int) -> list[Tour]:
    """One strip per vehicle, flown up and down lane by lane, and the same way back."""
    tours = []
    for k in range(n):
        x0, y0, x1, y1 = _part(shape, n, 1, k)
        lanes = math.ceil((x1 - x0) / (2.0 * RADIUS_M))
        points = []
        for lane in range(lanes):
            x = x0 + (lane + 0.5) * (x1 - x0) / lanes
            ends = [(x, y0 + RADIUS_M / 2), (x, y1 - RADIUS_M / 2)]
            points += ends if lane % 2 == 0 else ends[::-1]
        tours.append(_flown([*points, *points[-2:0:-1]]))
    return tours


def worst_of_tours(shape: Shape, tours: list[Tour]) -> float:
    """Worst idleness (s) when each vehicle flies its own tour; infinite if a cell is never seen."""
    return _measured(shape, lambda t_s: np.array([tour.at(np.array([t_s]))[0][0] for tour in tours]))


def greedy_worst(shape: Shape, n: int) -> float:
    """Worst idleness (s) when each vehicle flies to the cell that waits longest for its way, unless another does."""
    cells = cell_centres_m(shape, 5.0)
    xy, velocity = cells[:: max(1, len(cells) // n)][:n].copy(), np.zeros((n, 2))
    seen_s, aims = np.full(len(cells), -60.0), np.arange(n) * (len(cells) // n)

    def move(t_s: float) -> Floats:
        nonlocal xy, velocity
        for k in range(n):
            seen_s[((cells - xy[k]) ** 2).sum(axis=1) <= RADIUS_M**2] = t_s
        for k in range(n):
            if seen_s[aims[k]] >= t_s - 1.0:
                value = (t_s - seen_s) / (np.hypot(*(cells - xy[k]).T) / SPEED_M_S + 3.0)
                for other in np.delete(aims, k):
                    value[((cells - cells[other]) ** 2).sum(axis=1) < (2 * RADIUS_M) ** 2] = 0.0
                aims[k] = int(np.argmax(value))
        away = cells[aims] - xy
        wanted = away * (SPEED_M_S / np.maximum(np.hypot(*away.T), 1e-6))[:, None]
        change = wanted - velocity
        velocity += change * np.minimum(1.0, ACCEL_M_S2 * STEP_S / np.maximum(np.hypot(*change.T), 1e-9))[:, None]
        xy = xy + velocity * STEP_S
        return xy

    return _measured(shape, move)


def _measured(shape: Shape, places_at: Any) -> float:
    grid = IdlenessGrid(shape, RADIUS_M)
    for k in range(round(FLOWN_S / STEP_S)):
        t_s = k * STEP_S
        grid.update(t_s, places_at(t_s))
        if k == round(WARM_S / STEP_S):
            grid.begin_window(t_s)
    return grid.worst_idleness_s if grid.coverage == 1.0 else math.inf


def _part(shape: Shape, columns: int, rows: int, k: int) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = bounds(shape)
    wide, high = (x1 - x0) / columns, (y1 - y0) / rows
    left, low = x0 + wide * (k % columns), y0 + high * (k // columns)
    return left, low, left + wide, low + high


def _flown(points: list[tuple[float, float]]) -> Tour:
    return timed(resampled(np.array(points), 0.5), SPEED_M_S, ACCEL_M_S2)
