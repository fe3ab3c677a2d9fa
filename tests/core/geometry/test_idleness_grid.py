"""Idleness: what the grid keeps up incrementally equals what a slow look at every cell finds."""

import math

import numpy as np
import pytest

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, cell_centres_m
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle

L_SHAPE = Polygon(((0.0, 0.0), (60.0, 0.0), (60.0, 20.0), (20.0, 20.0), (20.0, 50.0), (0.0, 50.0)))


def test_cells_are_those_whose_centre_is_inside() -> None:
    assert len(cell_centres_m(Rectangle((0.0, 0.0), 10.0, 5.0), 2.5)) == 8
    centres = cell_centres_m(L_SHAPE, 2.5)
    assert len(centres) == (60 * 20 + 20 * 30) / 2.5**2
    assert not ((centres[:, 0] > 20.0) & (centres[:, 1] > 20.0)).any()


def test_a_zone_smaller_than_a_cell_is_one_cell() -> None:
    grid = IdlenessGrid(Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))), 15.0)
    grid.update(0.0, [(5.0, 5.0)])
    assert (grid.cells, grid.coverage, grid.full_cover_t) == (1, 1.0, 0.0)


def test_nothing_seen_is_infinitely_idle() -> None:
    grid = IdlenessGrid(Circle((0.0, 0.0), 20.0), 5.0)
    grid.begin_window(0.0)
    grid.update(1.0, [(500.0, 0.0), (math.nan, 0.0)])
    assert grid.coverage == 0.0
    assert grid.full_cover_t is None
    assert np.isinf(grid.idleness_s(1.0)).all()
    assert (grid.worst_idleness_s, grid.average_idleness_s, grid.worst_now_s(1.0)) == (math.inf,) * 3


def test_without_a_window_there_is_no_measurement() -> None:
    grid = IdlenessGrid(Circle((0.0, 0.0), 20.0), 50.0)
    grid.update(1.0, [(0.0, 0.0)])
    assert math.isnan(grid.worst_idleness_s)
    assert math.isnan(grid.average_idleness_s)


def test_a_vehicle_that_stays_away_lets_idleness_grow() -> None:
    grid = IdlenessGrid(Circle((0.0, 0.0), 20.0), 50.0)
    grid.update(10.0, [(0.0, 0.0)])
    grid.begin_window(10.0)
    grid.update(14.0, np.empty((0, 2)))
    assert (grid.worst_idleness_s, grid.average_idleness_s) == (4.0, 2.0)
    assert (grid.worst_now_s(15.0), grid.average_now_s(15.0)) == (5.0, 5.0)


@pytest.mark.parametrize("shape", [Circle((3.0, -7.0), 33.0), L_SHAPE, Rectangle((0.0, 0.0), 70.0, 30.0, 25.0)])
def test_random_flight_agrees_with_brute_force(shape: Circle | Rectangle | Polygon) -> None:
    rng, cells = np.random.default_rng(3), cell_centres_m(shape, 2.5)
    grid, last = IdlenessGrid(shape, 12.0), np.full(len(cells), -np.inf)
    worst, integral, cover_t, begin_s = -math.inf, 0.0, None, 60.0
    places = np.cumsum(rng.normal(0.0, 6.0, (400, 3, 2)), axis=0) % 90.0 - 40.0
    for step, xy in enumerate(places):
        t_s = 0.5 * step
        if t_s > begin_s:
            worst = max(worst, float((t_s - last).max()))
            integral += float(((t_s - last) ** 2 - (t_s - 0.5 - last) ** 2).mean()) / 2.0
        under = (np.hypot(*(cells[:, None] - xy[None]).transpose(2, 0, 1)) <= 12.0).any(axis=1)
        last[under] = t_s
        cover_t = t_s if cover_t is None and np.isfinite(last).all() else cover_t
        grid.update(t_s, xy)
        if t_s == begin_s:
            grid.begin_window(t_s)
            worst = float((t_s - last).max())
    end_s = 0.5 * (len(places) - 1)
    assert cover_t is not None and cover_t < begin_s
    assert grid.full_cover_t == cover_t
    np.testing.assert_array_equal(grid.idleness_s(end_s), end_s - last)
    assert grid.worst_idleness_s == pytest.approx(worst)
    assert grid.average_idleness_s == pytest.approx(integral / (end_s - begin_s))


@pytest.mark.parametrize(("radius_m", "cell_m"), [(0.0, 2.5), (15.0, 0.0), (-1.0, 2.5), (math.nan, 2.5)])
def test_impossible_sizes_are_refused(radius_m: float, cell_m: float) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        IdlenessGrid(Circle((0.0, 0.0), 20.0), radius_m, cell_m)
