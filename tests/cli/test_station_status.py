"""`tui-gcs station status`: what an operator reads of the counts since the start."""

import math

from tui_gcs.cli.station_control import count_lines
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.common import RunPhase, StationStatus

STATUS = StationStatus(
    seq=1,
    t_s=10.0,
    wall_s=10.0,
    kind=RunKind.SIM,
    scenario="two zones",
    revision=1,
    run=RunPhase.IDLE,
    round_index=0,
    rounds=("one",),
    mission_time_s=0.0,
    heard=0,
    vehicles=0,
    armed=0,
    in_control="",
    teams=(),
    links=(),
    min_separation_m=math.nan,
    faults={"link": 1, "too close": 12},
    dropped={"bad CRC": 1234, "notes of \x1b[2J": 2},
)


def test_each_kind_of_count_has_a_line_with_the_largest_first() -> None:
    assert count_lines(STATUS) == [
        "faults: 12 too close, 1 link",
        "received, not used: 1,234 bad CRC, 2 notes of ␛[2J",
    ]
