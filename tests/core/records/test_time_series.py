"""Values over time: bounded, with every spike, and safe with any number."""

import math

import numpy as np
import pytest

from tui_gcs.core.records.time_series import COARSE_POINTS, FINE_POINTS, MAX_ABS, TimeSeries, thinned, value_at


def filled(count: int, spike_at: int = -1) -> TimeSeries:
    series = TimeSeries()
    for at in range(count):
        series.add(at * 0.2, 1000.0 if at == spike_at else math.sin(at / 50))
    return series


def test_points_come_back_as_they_were_added() -> None:
    series = TimeSeries()
    series.add(1.0, 5.0)
    series.add(2.0, 6.0)
    times_s, values = series.points()
    assert times_s.tolist() == [1.0, 2.0] and values.tolist() == [5.0, 6.0]
    assert (series.last_s, series.last) == (2.0, 6.0)


def test_a_window_begins_with_the_point_before_it() -> None:
    series = filled(100)
    times_s, _ = series.points(10.0, 11.0)
    assert times_s[0] == pytest.approx(9.8) and times_s[-1] == pytest.approx(11.0)


@pytest.mark.parametrize("count", [FINE_POINTS * 2 + 1, 50_000, 400_000])
def test_memory_is_bounded_and_the_whole_flight_is_there(count: int) -> None:
    series = filled(count)
    assert len(series) <= 2 * FINE_POINTS + COARSE_POINTS
    times_s, _ = series.points()
    assert times_s[0] <= 4 * count / COARSE_POINTS and times_s[-1] == pytest.approx((count - 1) * 0.2)
    assert (np.diff(times_s) > 0).all()


def test_a_spike_of_one_point_stays_visible_for_ever() -> None:
    series = filled(200_000, spike_at=77)
    times_s, values = series.points()
    assert values.max() == 1000.0
    assert times_s[values.argmax()] == pytest.approx(15.4)


def test_thinning_keeps_the_lowest_and_the_highest_of_four() -> None:
    times_s, values = thinned(np.arange(9.0), np.array([1.0, 9.0, 0.0, 5.0, 2.0, 2.0, 2.0, 2.0, 7.0]))
    assert values.tolist() == [9.0, 0.0, 2.0, 2.0, 7.0]
    assert times_s.tolist() == [1.0, 2.0, 4.0, 7.0, 8.0]


def test_thinning_keeps_gaps() -> None:
    nan = math.nan
    _, values = thinned(np.arange(8.0), np.array([nan] * 4 + [nan, 3.0, nan, 4.0]))
    assert np.isnan(values[:2]).all() and values[2:].tolist() == [3.0, 4.0]


def test_time_that_runs_backwards_begins_anew() -> None:
    series = filled(100)
    series.add(1.0, 2.0)
    assert series.points()[1].tolist() == [2.0]


def test_a_second_point_of_one_time_is_left_out() -> None:
    series = TimeSeries()
    series.add(1.0, 2.0)
    series.add(1.0, 3.0)
    assert series.points()[1].tolist() == [2.0]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_a_gap(value: float) -> None:
    series = TimeSeries()
    series.add(1.0, value)
    assert math.isnan(series.last)


def test_huge_numbers_are_cut_so_that_they_can_be_subtracted() -> None:
    series = TimeSeries()
    series.add(1.0, 1.7e308)
    series.add(2.0, -1.7e308)
    values = series.points()[1]
    assert values.tolist() == [MAX_ABS, -MAX_ABS] and math.isfinite((values[0] - values[1]) ** 2)


def test_the_value_at_a_time_is_the_newest_one_until_then() -> None:
    times_s, values = np.array([1.0, 2.0]), np.array([5.0, 6.0])
    assert value_at(times_s, values, 1.9) == 5.0
    assert value_at(times_s, values, 2.0) == 6.0
    assert math.isnan(value_at(times_s, values, 0.5))
