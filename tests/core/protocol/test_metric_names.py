"""What planners count, in words."""

import math

import pytest

from tui_gcs.core.protocol.metric_names import all_words, metric_words, seen_pct


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("predicted_worst_s", 26.412, "predicted worst 26.4 s"),
        ("nearest_m", 9.876, "nearest 9.88 m"),
        ("wind_m_s", 3.0, "wind 3 m/s"),
        ("most_m_s2", 2.5, "most 2.5 m/s²"),
        ("left_pct", 12.34, "left 12.3 %"),
        ("searched", 0.12345, "searched 0.123"),
        ("steps", 123456.7, "steps 123457"),
        ("tracks", -0.0, "tracks 0"),
        ("period_s", math.nan, "period --"),
        ("_s", 1.0, "s 1"),
        ("huge", 1e300, "huge 1e+300"),
    ],
)
def test_names_numbers_and_units(name: str, value: float, words: str) -> None:
    assert metric_words(name, value) == words


def test_all_by_name_but_those_left_out() -> None:
    assert all_words({"b": 2.0, "a_m": 1.0, "c": 3.0}, frozenset({"c"})) == ["a 1 m", "b 2"]


@pytest.mark.parametrize(
    ("coverage", "digits", "pct"),
    [(1.0, 0, 100.0), (0.9999, 0, 99.0), (0.9996, 1, 99.9), (0.57, 0, 57.0), (0.29, 1, 29.0), (0.0, 0, 0.0)],
)
def test_the_whole_is_said_only_of_what_was_seen_whole(coverage: float, digits: int, pct: float) -> None:
    assert seen_pct(coverage, digits) == pct


def test_coverage_that_is_not_known_stays_so() -> None:
    assert math.isnan(seen_pct(math.nan))
