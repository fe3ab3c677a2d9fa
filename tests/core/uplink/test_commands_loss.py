"""Stops and starts at 30 % loss each way, thousands of each; `python -m tests.bench commands` runs a million."""

import pytest

from tests.bench.commands import Air
from tui_gcs.core.uplink.actions import RetryClass

COMMANDS = 3_000


def test_stops_get_through_within_ten_seconds() -> None:
    """A million may leave ten: of a few thousand none does."""
    tally = Air(RetryClass.STOP, 7).run(COMMANDS)
    assert tally.confirmed == tally.commands >= COMMANDS
    assert (tally.late, tally.untrue, tally.sent_after_end) == (0, 0, 0)


@pytest.mark.long
def test_starts_take_effect_within_two_seconds_or_never() -> None:
    tally = Air(RetryClass.START, 7).run(COMMANDS)
    assert (tally.late_effects, tally.second_effects, tally.untrue, tally.sent_after_end) == (0, 0, 0, 0)
    assert tally.most_copies == 3
    assert tally.took_effect > 0.95 * tally.commands, "three copies: nearly all get through"
