"""Alarms of a run without a console."""

import msgspec

from tui_gcs.cli.flights.alarm_lines import AlarmLines
from tui_gcs.core.protocol.alarms import Alarm, AlarmLevel

FULL = Alarm(
    "recording", AlarmLevel.CAUTION, "REC", "NOT RECORDING", "make room on the disk", "new", 7, 1.0, text="disk full"
)


def test_an_alarm_is_a_line_once_until_it_is_raised_again() -> None:
    lines = AlarmLines()
    assert list(lines.new([FULL])) == [f"CAUTION {FULL.words()}  -> make room on the disk"]
    assert "NOT RECORDING" in FULL.words() and "disk full" in FULL.words()
    assert list(lines.new([FULL])) == []
    assert list(lines.new([msgspec.structs.replace(FULL, state="over")])) == []
    assert len(list(lines.new([msgspec.structs.replace(FULL, raised=9)]))) == 1


def test_numbers_of_a_restarted_station_begin_anew() -> None:
    lines = AlarmLines()
    list(lines.new([FULL]))
    assert len(list(lines.new([msgspec.structs.replace(FULL, raised=1)]))) == 1
