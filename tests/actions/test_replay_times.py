"""Times of a replay as an operator types them."""

import math

import msgspec
import pytest

from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.actions.replay_times import ReplayTimeError, played_time_s
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import StationStatus
from tui_gcs.core.protocol.replay import ReplayStatus

NOON_S = 1_700_006_400.0 - 1_700_006_400.0 % 86_400.0 + 43_200.0


def at(at_s: float, length_s: float = 200.0) -> StationStatus:
    """The status of a recording that began at noon."""
    replay = ReplayStatus(at_s=at_s, length_s=length_s, speed=1.0, paused=False)
    return msgspec.structs.replace(FakeStation(MemoryBus()).status(), wall_s=NOON_S + at_s, replay=replay)


@pytest.mark.parametrize(
    ("typed", "played_s"),
    [
        ("95", 95.0),
        ("1:35", 95.0),
        ("1:02:03", 3723.0),
        ("12.5", 12.5),
        ("+30", 130.0),
        ("-1:30", 10.0),
        ("-1000", 0.0),
        ("12:03:00Z", 180.0),
        ("12:01:30z", 90.0),
        ("11:00:00Z", 0.0),
        ("50 %", 100.0),
        ("500%", 200.0),
    ],
)
def test_times_are_read_as_operators_write_them(typed: str, played_s: float) -> None:
    assert played_time_s(typed, at(100.0)) == pytest.approx(played_s)


@pytest.mark.parametrize("typed", ["", "x", "1:2:3:4", "--5", "+", "Z", "%", "1e9", "nan", "١"])
def test_anything_else_is_refused_with_what_is_taken(typed: str) -> None:
    with pytest.raises(ReplayTimeError, match="1:35 since the beginning"):
        played_time_s(typed, at(100.0))


def test_a_share_needs_the_length_and_a_time_needs_a_recording() -> None:
    with pytest.raises(ReplayTimeError, match="not known yet"):
        played_time_s("50%", at(100.0, math.nan))
    with pytest.raises(ReplayTimeError, match="no recording"):
        played_time_s("50", FakeStation(MemoryBus()).status())
