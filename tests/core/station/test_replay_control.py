"""A replay pauses, changes its speed, and goes to any moment: what is shown there does not depend on the way."""

import gc
import math
import struct
import types
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.station.test_replay_player import DATA, Console, heartbeats
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.replay import ControlReplay, ReplayAct, ReplayStatus
from tui_gcs.core.station.recorded_events import RecordedEvents
from tui_gcs.core.station.replay_player import MAX_SPEED, MAX_TWINS, MIN_SPEED
from tui_gcs.core.station.replayed_flight import ReplayedFlight

LOG = DATA / "arducopter-8.tlog"
ARMED = 81 | 128


def control(console: Console, act: ReplayAct, seconds: float = 0.0) -> m.Reply:
    """Press a key, and let the player come to what it is on its way to."""
    reply = console.ask(ControlReplay(act, seconds))
    console.player.tick()
    while console.player.searching:
        console.player.tick()
    return reply


def picture(console: Console) -> tuple[object, ...]:
    """Everything that screens show of this moment."""
    console.run(0.6)
    status, events = console.statuses[-1], console.ask(m.GetEvents(after=0)).events
    frame = m.encode(msgspec.structs.replace(console.frame, seq=0))  # as bytes: NaN equals itself
    return frame, status.alarms, status.dropped, events


def replay(console: Console) -> ReplayStatus:
    """What the newest status says about the player."""
    status = console.statuses[-1].replay
    assert status is not None
    return status


def paused(path: Path) -> Console:
    console = Console(path)
    control(console, ReplayAct.PAUSE)
    return console


@pytest.fixture(scope="module")
def moments() -> dict[int, tuple[object, ...]]:
    """The picture at each of these seconds, each by playing there once from the beginning at 1x."""
    found = {}
    for at_s in (12, 47, 104, 168):
        console = Console(LOG)
        console.run(at_s, step_s=0.1)
        console.player.tick()
        control(console, ReplayAct.PAUSE)
        assert console.player.at_s == pytest.approx(at_s)
        control(console, ReplayAct.GO_TO, at_s)
        found[at_s] = picture(console)
    return found


@settings(max_examples=12, deadline=None)
@given(way=st.lists(st.floats(0.0, 240.0), max_size=6), at_s=st.sampled_from([12, 47, 104, 168]))
def test_the_picture_of_a_moment_does_not_depend_on_the_way(
    moments: dict[int, tuple[object, ...]], way: list[float], at_s: int
) -> None:
    console = paused(LOG)
    for stop_s in way:
        control(console, ReplayAct.GO_TO, stop_s)
    control(console, ReplayAct.GO_TO, at_s)
    assert picture(console) == moments[at_s]


def test_a_kept_copy_shares_nothing_that_changes() -> None:
    flight = ReplayedFlight(LOG, "log", Origin(-35.36, 149.16, 584.0))
    flight.advance(60.0, 1_000_000)
    shared = _reachable(flight.twin()).keys() & _reachable(flight).keys()
    objects = _reachable(flight)
    fixed = (tuple, types.FunctionType, types.MethodType, types.BuiltinMethodType, Path, struct.Struct, RecordedEvents)
    assert [objects[key] for key in shared if not isinstance(objects[key], fixed)] == []


def _reachable(root: object) -> dict[int, object]:
    """All objects that can be reached from `root`, also through closures, but not through classes and modules."""
    found: dict[int, object] = {}
    waiting: list[object] = [root]
    while waiting:
        each = waiting.pop()
        plain = (str, int, float, bytes, type(None), type, types.ModuleType, msgspec.Struct)
        if id(each) in found or isinstance(each, plain) or not gc.is_tracked(each):
            continue
        found[id(each)] = each
        if isinstance(each, types.FunctionType):
            waiting += [cell.cell_contents for cell in each.__closure__ or ()]
        else:
            waiting += gc.get_referents(each)
    return found


def test_a_pause_stands_still_until_the_next() -> None:
    console = Console(LOG)
    console.run(3.0)
    control(console, ReplayAct.PAUSE)
    before = console.player.at_s
    console.run(5.0)
    assert console.player.at_s == before
    assert replay(console).paused
    control(console, ReplayAct.PAUSE)
    console.run(1.0)
    assert console.player.at_s == pytest.approx(before + 1.0, abs=0.2)


def test_the_speed_doubles_and_halves_within_its_limits() -> None:
    console = Console(LOG)
    assert control(console, ReplayAct.FASTER).text == "plays at 2 x"
    for _ in range(20):
        control(console, ReplayAct.FASTER)
    assert replay(console).speed == MAX_SPEED
    for _ in range(20):
        control(console, ReplayAct.SLOWER)
    assert replay(console).speed == MIN_SPEED


def test_back_and_forward_by_seconds_end_at_the_ends_of_the_recording() -> None:
    console = paused(LOG)
    control(console, ReplayAct.MOVE, 30.0)
    assert replay(console).at_s == pytest.approx(30.0)
    control(console, ReplayAct.MOVE, -10.0)
    assert (replay(console).at_s, replay(console).rewinds) == (pytest.approx(20.0), 1)
    control(console, ReplayAct.MOVE, -1000.0)
    assert replay(console).at_s == 0.0
    control(console, ReplayAct.GO_TO, 1e9)
    assert console.player.finished
    control(console, ReplayAct.MOVE, -5.0)
    assert not console.player.finished
    assert not control(console, ReplayAct.GO_TO, math.nan).ok


def test_the_length_is_known_soon_and_cuts_long_gaps(tmp_path: Path) -> None:
    console = Console(heartbeats(tmp_path / "a.tlog", [0, 1, 3601, 3602]))
    console.run(1.0)
    assert replay(console).length_s == pytest.approx(12.0)


def test_the_length_of_a_long_recording_is_known_at_once(tmp_path: Path) -> None:
    """It was "?" for minutes, and `G` took no share of it: adding up 472 MB takes that long."""
    console = Console(heartbeats(tmp_path / "a.tlog", [float(at_s) for at_s in range(1200)]))
    console.player._length.measure = lambda _records: None  # type: ignore[method-assign]
    console.run(1.0)
    assert replay(console).length_s == pytest.approx(1199.0)


def test_from_event_to_event_and_back(tmp_path: Path) -> None:
    console = paused(LOG)
    stops = []
    for _ in range(4):
        control(console, ReplayAct.NEXT_EVENT)
        stops.append(console.player.at_s)
        newest = console.ask(m.GetEvents(after=0)).events[-1]
        assert newest.t_s == pytest.approx(console.player.at_s, abs=0.11)
    assert stops == sorted(set(stops))
    control(console, ReplayAct.PREVIOUS_EVENT)
    assert console.player.at_s == pytest.approx(stops[-2], abs=0.6)


def test_to_an_alarm_and_where_there_is_none(tmp_path: Path) -> None:
    console = paused(heartbeats(tmp_path / "a.tlog", [0, 1, 2, 3, 4, 12, 13, 14, 15, 16], ARMED))
    control(console, ReplayAct.GO_TO, 5.0)
    control(console, ReplayAct.NEXT_ALARM)
    assert "lost" in [alarm.cause for alarm in console.statuses[-1].alarms]
    at_s = console.player.at_s
    control(console, ReplayAct.GO_TO, 15.5)
    control(console, ReplayAct.NEXT_ALARM)
    assert console.player.at_s == pytest.approx(15.5)
    assert replay(console).said == "the next alarm: there is none"
    control(console, ReplayAct.GO_TO, at_s + 1.0)
    control(console, ReplayAct.PREVIOUS_ALARM)
    assert console.player.at_s == pytest.approx(at_s, abs=0.11)
    control(console, ReplayAct.GO_TO, 0.5)
    assert not control(console, ReplayAct.PREVIOUS_ALARM).ok


def test_at_the_end_nothing_comes_after_it() -> None:
    console = Console(LOG, 1000.0)
    console.run_to_end()
    reply = control(console, ReplayAct.NEXT_EVENT)
    assert (reply.ok, reply.text) == (False, "the end of the recording: nothing comes after it")


def test_an_hour_keeps_no_more_copies_than_its_limit(tmp_path: Path) -> None:
    console = paused(heartbeats(tmp_path / "a.tlog", [float(at) for at in range(3600)]))
    control(console, ReplayAct.GO_TO, 3000.0)
    assert len(console.player._twins) <= MAX_TWINS
    control(console, ReplayAct.GO_TO, 1800.0)
    assert console.frame.t_s == pytest.approx(1800.0)
