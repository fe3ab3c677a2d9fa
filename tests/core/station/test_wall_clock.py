"""Somebody sets the computer's clock while vehicles fly: nothing waits by it, logs go on, and it is told."""

import time
from collections.abc import Callable

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.base.clock import MonotonicClock, VirtualClock, WallClockMonitor, wall_offset_s
from tui_gcs.core.judging.tlog_summary import summarize
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase

MakeRig = Callable[..., Rig]
HOUR_S = 3600.0


def test_steady_time_goes_on_as_it_began() -> None:
    clock = VirtualClock()
    begun_s = clock.steady_wall()
    assert begun_s == clock.wall()
    clock.advance(5.0)
    clock.set_wall(-HOUR_S)
    assert clock.wall() == begun_s + 5.0 - HOUR_S
    assert clock.steady_wall() == begun_s + 5.0
    real = MonotonicClock()
    assert real.steady_wall() == pytest.approx(real.wall(), abs=0.5)


def test_what_a_time_service_corrects_is_not_told() -> None:
    clock = VirtualClock()
    watch = WallClockMonitor(clock)
    clock.set_wall(0.3)
    assert watch.was_set_by() == 0.0
    clock.set_wall(-90.0)
    clock.advance(7.0)
    assert watch.was_set_by() == pytest.approx(-90.0)
    assert watch.was_set_by() == 0.0


@pytest.mark.parametrize("by_s", [HOUR_S, -HOUR_S, 3.2e8])
def test_a_flight_does_not_notice(rig: MakeRig, by_s: float) -> None:
    """Flown with real ArduCopters, too: their log was 7200 s long, and began an hour before it did."""
    flight = rig(2).flying().run(8.0)
    flight.clock.set_wall(by_s)
    alarms = flight.station.alarms.alarms()
    flight.run(8.0)
    assert flight.phases() == {Phase.FLYING}
    assert flight.station.alarms.alarms() == alarms
    (reported,) = (text for text in flight.texts("station") if "clock was set" in text)
    assert ("ahead" if by_s > 0 else "back") in reported
    assert flight.ask(m.Hold()).ok
    flight.run(6.0)
    assert all(flight.speed(v) < 0.3 for v in flight.ids)
    flight.clock.set_wall(-by_s)
    flight.run(2.0)
    events = [event.t_s for event in flight.station.records.events.since(0)]
    assert events == sorted(events)
    flight.station.records.recorder.flush()
    summary = summarize(flight.station.records.recorder.path)
    assert summary.last_wall_s - summary.first_wall_s == pytest.approx(flight.clock.now(), abs=3.0)


def test_the_words_name_how_far(rig: MakeRig) -> None:
    ground = rig(1).run(1.0)
    ground.clock.set_wall(-5400.0)
    ground.run(0.5)
    assert any("set back by 1.5 h" in text for text in ground.texts("station"))


def test_the_next_station_s_log_goes_on_and_it_tells_that_the_clock_was_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """As read: a station killed after the clock was set back began an hour before its own log's end."""
    begun = wall_offset_s()
    first = MonotonicClock(begun)
    before_s, plain = first.steady_wall(), time.time
    monkeypatch.setattr(time, "time", lambda: plain() - HOUR_S)
    second = MonotonicClock(begun)
    assert second.steady_wall() == pytest.approx(before_s, abs=1.0)
    assert second.wall() == pytest.approx(before_s - HOUR_S, abs=1.0)
    assert WallClockMonitor(second).was_set_by() == pytest.approx(-HOUR_S, abs=1.0)
    assert WallClockMonitor(MonotonicClock()).was_set_by() == 0.0
