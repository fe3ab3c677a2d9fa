"""How often set-points leave when the station's ticks are not exact."""

import numpy as np
import pytest

from tui_gcs.core.flight.steering import next_due_s
from tui_gcs.core.guard.guard import MIN_SETPOINT_GAP_S


def times_sent(tick_s: float, gap_s: float) -> np.ndarray:
    """In a minute of ticks that are each up to 8 ms late."""
    ticks = np.arange(0.0, 60.0, tick_s)
    sent, due_s = [], 0.0
    for now in ticks + np.random.default_rng(1).uniform(0.0, 0.008, len(ticks)):
        if now >= due_s:
            sent.append(now)
            due_s = next_due_s(due_s, now, gap_s)
    return np.array(sent)


@pytest.mark.parametrize("gap_s", [0.1, 0.2])
@pytest.mark.parametrize("tick_s", [0.05, 0.0495])
def test_the_rate_is_kept_though_ticks_are_a_little_off(gap_s: float, tick_s: float) -> None:
    sent = times_sent(tick_s, gap_s)
    assert len(sent) * gap_s / 60.0 == pytest.approx(1.0, abs=0.06)  # it was two thirds
    assert np.diff(sent).min() > MIN_SETPOINT_GAP_S, "or the guard would veto it"


@pytest.mark.parametrize("tick_s", [0.03, 0.055, 0.07])
def test_the_guard_never_finds_them_too_close(tick_s: float) -> None:
    assert np.diff(times_sent(tick_s, 0.1)).min() > MIN_SETPOINT_GAP_S


def test_a_pause_is_not_made_up_for() -> None:
    due_s = next_due_s(0.0, 5.0, 0.1)
    assert due_s == pytest.approx(5.09)
    assert next_due_s(due_s, 5.1, 0.1) == pytest.approx(5.19)
