"""The bound holds for every plan; the ideal is what a tour without overlap and turns would reach."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui_gcs.core.geometry.idleness_bounds import ideal_idleness_s, idleness_bound_s, longest_m, sweep_of
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid
from tui_gcs.core.geometry.zone_cells import reachable_cells
from tui_gcs.core.geometry.zones import Circle, Rectangle, Shape

SPEED_M_S, STEP_S = 8.0, 0.1
FIELD = Rectangle((0.0, 0.0), 2000.0, 2000.0)


def bound_s(shape: Shape, n: int, radius_m: float) -> float:
    return reachable_cells(shape, FIELD, (), 5.0, radius_m).bound_s(n, SPEED_M_S, radius_m)


def test_ideal_is_area_over_what_is_swept_per_second() -> None:
    assert ideal_idleness_s(math.pi * 80.0**2, 4, 8.0, 15.0) == pytest.approx(20.94, abs=0.01)
    assert ideal_idleness_s(100.0, 0, 8.0, 15.0) == math.inf


def test_bound_takes_time_in_sight_off() -> None:
    assert idleness_bound_s(20_000.0, 0.0, 4, 8.0, 15.0) == pytest.approx((5000.0 - math.pi * 225.0) / 240.0)
    assert idleness_bound_s(math.pi * 12.0**2, 24.0, 4, 8.0, 15.0) == 0.0, "one footprint sees all of it all the time"
    assert idleness_bound_s(100.0, 10.0, 0, 8.0, 15.0) == math.inf


def test_a_narrow_zone_is_bounded_by_its_length() -> None:
    strip = Rectangle((0.0, 0.0), 500.0, 30.0)
    assert bound_s(strip, 4, 15.0) == pytest.approx(2.0 * (500.0 / 4 - 30.0) / 8.0, abs=0.2)
    assert bound_s(strip, 4, 15.0) > ideal_idleness_s(500.0 * 30.0, 4, 8.0, 15.0), "it cannot be swept one way round"


def test_length_is_the_largest_extent() -> None:
    assert longest_m(np.array([[0.0, 0.0], [30.0, 30.0]])) == pytest.approx(30.0 * math.sqrt(2.0))
    assert longest_m(np.empty((0, 2))) == 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(10.0, 160.0),
    st.floats(5.0, 60.0),
    st.integers(1, 4),
    st.sampled_from(["lanes", "circles", "to the idlest cell", "at random"]),
)
def test_no_plan_beats_the_bound(seed: int, long_m: float, wide_m: float, n: int, kind: str) -> None:
    """Vehicles without inertia, which may turn on the spot: they can do more than any real ones."""
    rng, radius_m = np.random.default_rng(seed), 12.0
    shape = Rectangle((0.0, 0.0), long_m, wide_m) if rng.random() < 0.7 else Circle((0.0, 0.0), wide_m)
    cells = reachable_cells(shape, FIELD, (), 5.0, radius_m)
    grid, centres = IdlenessGrid(cells, radius_m), cells.centres_m()
    low, high = centres.min(axis=0), centres.max(axis=0)
    xy, aims = rng.uniform(low, high, (n, 2)), rng.uniform(low, high, (n, 2))
    phase = rng.uniform(0.0, 2 * math.pi, n)
    for step in range(600):
        t_s = step * STEP_S
        grid.update(t_s, xy)
        if grid.full_cover_t == t_s:
            grid.begin_window(t_s)
        near = np.hypot(*(aims - xy).T) < 1.0
        for k in np.flatnonzero(near):
            aims[k] = _next_aim(kind, rng, grid.idleness_s(t_s), centres, xy[k], phase[k] + t_s)
        way = aims - xy
        xy = xy + way * np.minimum(1.0, SPEED_M_S * STEP_S / np.maximum(np.hypot(*way.T), 1e-9))[:, None]
    if grid.full_cover_t is not None and grid.full_cover_t < 30.0:
        assert grid.worst_idleness_s + 2 * STEP_S >= cells.bound_s(n, SPEED_M_S, radius_m)


def _next_aim(
    kind: str, rng: np.random.Generator, idle_s: np.ndarray, centres: np.ndarray, here: np.ndarray, turn: float
) -> np.ndarray:
    low, high = centres.min(axis=0), centres.max(axis=0)
    if kind == "lanes":
        return np.array([high[0] if here[0] < (low[0] + high[0]) / 2 else low[0], rng.uniform(low[1], high[1])])
    if kind == "circles":
        return (low + high) / 2 + (high - low) / 2 * np.array([math.cos(turn), math.sin(turn)])
    if kind == "to the idlest cell":
        return np.asarray(centres[int(np.argmax(np.minimum(idle_s, 1e6) - np.hypot(*(centres - here).T) / SPEED_M_S))])
    return np.asarray(rng.uniform(low, high))


def test_vehicles_of_different_speeds_sweep_what_they_sweep_together():
    both = sweep_of([5.0, 8.0], 2, 15.0)
    assert ideal_idleness_s(1000.0, *both[:3]) == pytest.approx(1000.0 / (30.0 * (5.0 + 8.0)))
    assert sweep_of([5.0, 8.0], 1, 15.0) == (1, 8.0, 15.0, 8.0), "the fastest fly, the others wait"
    assert sweep_of([], 0, 15.0) == (0, 0.0, 15.0, 0.0)


def test_the_bound_of_a_fence_is_that_of_the_fastest():
    """A vehicle of 8 m/s and one of 2 m/s may both go where only the fast one is needed."""
    strip = 30.0 * 600.0
    n, mean_m_s, radius_m, fastest_m_s = sweep_of([8.0, 2.0], 2, 15.0)
    fence_s = 2.0 * (600.0 / 2 - 30.0) / 8.0
    sweep_s = (strip / 2 - math.pi * 225.0) / (30.0 * 5.0)
    assert idleness_bound_s(strip, 600.0, n, mean_m_s, radius_m, fastest_m_s) == pytest.approx(max(fence_s, sweep_s))
