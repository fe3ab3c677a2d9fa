"""How often set-points leave when the station's ticks are not exact."""

import numpy as np
import pytest

from tui_gcs.core.steering import next_due_s


@pytest.mark.parametrize("gap_s", [0.1, 0.2])
@pytest.mark.parametrize("tick_s", [0.05, 0.0499, 0.0525, 0.06])
def test_the_rate_is_kept_though_ticks_are_a_little_off(gap_s: float, tick_s: float) -> None:
    sent, due_s, rng = 0, 0.0, np.random.default_rng(1)
    for now in np.arange(0.0, 60.0, tick_s) + rng.uniform(0.0, 0.01, len(np.arange(0.0, 60.0, tick_s))):
        if now >= due_s:
            sent, due_s = sent + 1, next_due_s(due_s, now, gap_s)
    assert sent * gap_s / 60.0 == pytest.approx(1.0, abs=0.02)


def test_a_pause_is_not_made_up_for() -> None:
    due_s = next_due_s(0.0, 5.0, 0.1)
    assert due_s == pytest.approx(5.05)
    assert next_due_s(due_s, 5.06, 0.1) == pytest.approx(5.15)
