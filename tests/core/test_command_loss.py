"""Stops and starts at 30 % loss each way, ten thousand of each; the bench runs a million (`python -m tests.bench`)."""

from tests.bench.commands import Air
from tui_gcs.core.services.command import Retry


def test_stops_get_through_within_ten_seconds() -> None:
    """A million may leave ten: of five thousand none does."""
    tally = Air(Retry.STOP, 7).run(5_000)
    assert tally.commands == 5_000
    assert (tally.late, tally.sent_after_end) == (0, 0)


def test_starts_take_effect_within_two_seconds_or_never() -> None:
    tally = Air(Retry.START, 7).run(5_000)
    assert (tally.late_effects, tally.sent_after_end) == (0, 0)
    assert tally.most_copies == 3
