"""What is recorded for plots: bounded, from before it was asked for, and anew after another station's time."""

import math
from time import process_time

import numpy as np
import pytest
from msgspec.structs import replace

from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.services import ParamRow
from tui_gcs.feed.plots.plotted_values import (
    PlotValue,
    ValueKind,
    ValueName,
    field_names,
    field_value,
    matching,
    metric_values,
    parameter_names,
    split_vehicles,
    telemetry_names,
)
from tui_gcs.feed.plots.value_history import MAX_COLUMNS, MAX_ROWS, ValueHistory
from tui_gcs.feed.plots.value_recorder import ValueRecorder
from tui_gcs.feed.requests import ConsoleRequests

BATTERY = PlotValue(ValueKind.TELEMETRY, 1, "battery", "%")


def flown(seconds: int, count: int = 8, recorder: ValueRecorder | None = None) -> tuple[ValueRecorder, FakeStation]:
    bus = MemoryBus()
    station = FakeStation(bus, count=count)
    station.fly()
    recorder = recorder or ValueRecorder(ConsoleRequests(bus, "test"))
    for _ in range(seconds):
        station.t_s += 1.0
        recorder.take_frame(station.frame())
    return recorder, station


def test_what_is_published_is_there_before_it_is_plotted() -> None:
    recorder, _ = flown(30)
    recorder.follow([BATTERY])
    times_s, values = recorder.series(BATTERY).points()
    assert len(times_s) == 30 and set(values) == {82.0}


def test_what_is_not_plotted_any_more_is_forgotten_but_for_one_row_a_second() -> None:
    recorder, _ = flown(5)
    recorder.follow([BATTERY])
    recorder.follow([])
    assert len(recorder.series(BATTERY)) == 0


def test_a_station_that_was_restarted_begins_anew() -> None:
    recorder, _ = flown(30)
    recorder.follow([BATTERY])
    flown(3, recorder=recorder)
    assert len(recorder.series(BATTERY)) == 3


def test_a_pause_is_a_gap() -> None:
    recorder, station = flown(3)
    recorder.follow([BATTERY])
    station.t_s += 60.0
    recorder.take_frame(station.frame())
    _, values = recorder.series(BATTERY).points()
    assert np.isnan(values[-2]) and values[-1] == 82.0


def test_metrics_have_the_unit_that_their_names_end_with() -> None:
    _, station = flown(1)
    station.metrics = {"predicted_worst_s": 26.0, "replans": 3.0, "\x1b[0m_deg": 1.0}
    found = metric_values(station.status())
    assert found[PlotValue(ValueKind.METRIC, "defend", "predicted worst", "s")] == 26.0
    assert found[PlotValue(ValueKind.METRIC, "attack", "replans", "")] == 3.0
    assert found[PlotValue(ValueKind.METRIC, "fleet", "min separation", "m")] == 21.4
    assert all("\x1b" not in value.name for value in found)


def test_a_history_of_a_day_is_bounded_and_reaches_back_to_its_beginning() -> None:
    history = ValueHistory()
    taken = 0
    for second in range(86_400):
        if history.is_due(float(second)):
            history.add(float(second), ("a",), np.array([float(second)]))
            taken += 1
    times_s, values = history.points("a")
    assert len(times_s) <= MAX_ROWS and times_s[0] == 0.0 and times_s[-1] > 86_000 and (times_s == values).all()
    assert taken < 8000


def test_columns_come_and_are_bounded() -> None:
    history = ValueHistory()
    history.add(1.0, ("a",), np.array([1.0]))
    history.add(2.0, ("b", "a"), np.array([5.0, 2.0]))
    assert history.points("a")[1].tolist() == [1.0, 2.0]
    assert np.isnan(history.points("b")[1][0]) and history.points("b")[1][1] == 5.0
    history.add(3.0, tuple(range(MAX_COLUMNS + 5)), np.zeros(MAX_COLUMNS + 5))
    assert len(history.points(MAX_COLUMNS + 4)[0]) == 0


def test_numbers_too_large_for_the_history_are_gaps() -> None:
    history = ValueHistory()
    history.add(1.0, ("a",), np.array([1e300]))
    assert math.isinf(history.points("a")[1][0])


def test_recording_250_vehicles_costs_little() -> None:
    recorder, station = flown(3, count=250)
    frames = [replace(station.frame(), t_s=1000.0 + at) for at in range(20)]
    began = process_time()
    for frame in frames:
        recorder.take_frame(frame)
    # One row a second: 5 ms would be half a percent of a core.
    assert (process_time() - began) / 20 < 0.02


@pytest.mark.parametrize(
    ("typed", "vehicles", "words"),
    [
        ("v3 roll", (3,), "roll"),
        ("roll v1-3,7 deg", (1, 2, 3, 7), "roll deg"),
        ("v9-2", (), ""),
        ("volt", (), "volt"),
        ("v1-", (), "v1-"),
    ],
)
def test_vehicles_are_named_among_the_words(typed: str, vehicles: tuple[int, ...], words: str) -> None:
    assert split_vehicles(typed) == (vehicles, words)


def test_a_huge_range_of_vehicles_is_cut() -> None:
    assert len(split_vehicles("v1-999999,5-999999")[0]) == 999


def test_fields_of_messages_are_listed_with_usual_units() -> None:
    names = {name.name: name for name in field_names(["ATTITUDE", "BATTERY_STATUS", "STATUSTEXT", "NO_SUCH"])}
    assert names["ATTITUDE.roll"].unit == "deg" and names["BATTERY_STATUS.voltages[9]"].unit == "V"
    assert "STATUSTEXT.text" not in names


def test_fields_come_in_usual_units_and_unknown_ones_are_gaps() -> None:
    assert field_value("BATTERY_STATUS.voltages[0]", 15_400.0) == pytest.approx(15.4)
    assert math.isnan(field_value("BATTERY_STATUS.voltages[0]", 65_535.0))
    assert field_value("NO_SUCH.field", 5.0) == 5.0


def test_the_search_looks_into_name_unit_and_meaning() -> None:
    names = [*telemetry_names(), *parameter_names([ParamRow("WPNAV_SPEED", 5.0, "REAL32", text="Speed")])]
    assert [each.name for each in matching(names, "speed")] == ["speed", "WPNAV_SPEED", "climb"]
    assert [each.name for each in matching(names, "m/s up")] == ["climb"]
    assert matching(names, "nothing has this") == []
    assert ValueName(ValueKind.METRIC, "x", subject="defend").of((1, 2)) == (
        PlotValue(ValueKind.METRIC, "defend", "x"),
    )
