"""A recorded flight is played onto the bus as if it happened now."""

import math
from pathlib import Path

import pytest

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.inspection import GetMessages, GetValues, ValueKey
from tui_gcs.core.protocol.planner_log import PLANNER_LOG_END, GetPlannerLog, PlannerLogLevel
from tui_gcs.core.protocol.replay import ControlReplay, ReplayAct
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.records.planner_log import PlannerLog, log_files
from tui_gcs.core.records.tlog_reader import TlogError
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.station.replay_player import Player
from tui_gcs.core.station.replayed_flight import LONGEST_GAP_S

DATA = Path(__file__).parents[2] / "data"
START_S = 1.7e9


class Console:
    """Collects what a player publishes, and drives it."""

    def __init__(self, path: Path, speed: float = 1.0) -> None:
        self.bus, self.clock = MemoryBus(), VirtualClock()
        self.frames: list[m.FleetFrame] = []
        self.events: list[m.JournalEvent] = []
        self.statuses: list[m.StationStatus] = []
        self.bus.subscribe(keys.FLEET, lambda _, data: self.frames.append(m.decode(data, m.FleetFrame)))
        self.bus.subscribe(keys.EVENT, lambda _, data: self.events.append(m.decode(data, m.JournalEvent)))
        self.bus.subscribe(keys.STATUS, lambda _, data: self.statuses.append(m.decode(data, m.StationStatus)))
        self.player = Player(path, speed, self.bus, self.clock)

    def run(self, seconds: float, step_s: float = 0.05) -> None:
        for _ in range(round(seconds / step_s)):
            self.player.tick()
            self.clock.advance(step_s)

    def run_to_end(self, step_s: float = 0.05) -> None:
        while not self.player.finished:
            self.player.tick()
            self.clock.advance(step_s)

    def ask(self, request: m.Request) -> m.Reply:
        return m.decode(self.bus.ask(keys.REQUEST.format(principal="console"), m.encode(request)), m.Reply)

    @property
    def frame(self) -> m.FleetFrame:
        return self.frames[-1]


def heartbeats(path: Path, times_s: list[float], base_mode: int = 81) -> Path:
    """A log of one vehicle that says nothing but heartbeats, at these seconds."""
    log, encoder = TlogWriter(path), Encoder(7, 1)
    for at_s in times_s:
        beat = encoder.encode(
            "HEARTBEAT", type=2, autopilot=3, base_mode=base_mode, custom_mode=4, system_status=3, mavlink_version=3
        )
        log.write(START_S + at_s, beat)
    log.close()
    return path


def test_a_real_flight_of_eight_is_shown_as_it_was() -> None:
    console = Console(DATA / "arducopter-8.tlog", speed=20)
    console.run(60 / 20)
    frame = console.frame
    assert frame.kind is m.RunKind.REPLAY
    assert frame.ids == tuple(range(1, 9))
    assert frame.autopilot == ("ArduCopter",) * 8
    assert all(frame.armed)
    assert frame.mode == ("GUIDED",) * 8
    assert all(freshness is m.Freshness.OK for freshness in frame.freshness)
    assert all(math.hypot(x, y) < 300 and z > 5 for x, y, z in frame.position_m)
    console.run_to_end()
    assert not any(console.frame.armed)
    texts = [event.text for event in console.events]
    assert any("ArduPilot Ready" in text for text in texts)
    assert texts[-1] == "end of the recording"
    assert [event.seq for event in console.events] == list(range(1, len(console.events) + 1))


def test_px4_is_shown_too_and_the_end_stands_still() -> None:
    console = Console(DATA / "px4-8.tlog", speed=100)
    console.run_to_end()
    before = console.frame
    console.run(5)
    assert console.frame.autopilot == ("PX4",) * 8
    assert console.frame.freshness == before.freshness
    assert console.frame.t_s == pytest.approx(185.1, abs=0.2)
    assert console.frame.wall_s == pytest.approx(before.wall_s)


def test_ten_frames_and_two_statuses_a_second_at_any_speed() -> None:
    for speed in (0.5, 1.0, 8.0):
        console = Console(DATA / "arducopter-8.tlog", speed)
        console.run(4)
        assert len(console.frames) == 40
        assert len(console.statuses) == 8
        assert console.frame.t_s == pytest.approx(4 * speed, abs=0.2 * speed)


def test_the_map_lies_about_the_first_valid_position() -> None:
    console = Console(DATA / "arducopter-8.tlog")
    changed = console.ask(m.GetScenario()).scenario
    assert changed is not None
    assert changed.scenario.origin.lat_deg == pytest.approx(-35.36326, abs=1e-4)
    assert changed.scenario.origin.ground_amsl_m == pytest.approx(584, abs=1)
    assert changed.scenario.rounds == ()


def test_a_recording_takes_no_commands() -> None:
    console = Console(DATA / "px4-8.tlog")
    console.run(1)
    for request in (m.Start(vehicles=(1,)), m.Hold(), m.Return(), m.Shutdown(), m.SwitchRound(index=1)):
        assert console.ask(request) == m.Reply(ok=False, text="this is a recording: nothing can be commanded")
    assert console.ask(m.Hello(protocol=m.PROTOCOL, who="console")).ok
    assert console.ask(m.GetEvents(after=0)).events == tuple(console.events)
    assert not m.decode(console.bus.ask("gcs/req/console", b"junk"), m.Reply).ok


def test_the_status_says_replay_and_what_is_played() -> None:
    console = Console(DATA / "px4-8.tlog", speed=10)
    console.run(5)
    status = console.statuses[-1]
    assert (status.kind, status.heard, status.vehicles, status.armed) == (m.RunKind.REPLAY, 8, 8, 8)
    assert (status.scenario, status.recording) == ("px4-8.tlog", "px4-8.tlog")


def test_silence_in_the_recording_is_shown_as_lost(tmp_path: Path) -> None:
    console = Console(heartbeats(tmp_path / "a.tlog", [0, 1, 2, 8, 9]))
    console.run(6.5)
    assert console.frame.freshness == (m.Freshness.LOST,)
    console.run(2)
    assert console.frame.freshness == (m.Freshness.STALE,)  # heard again, but it never told a position


def test_an_hour_between_two_flights_is_not_waited_for(tmp_path: Path) -> None:
    console = Console(heartbeats(tmp_path / "a.tlog", [0, 1, 3601, 3602]))
    console.run(1 + LONGEST_GAP_S + 0.5)
    assert console.frame.wall_s == pytest.approx(START_S + 3601.5, abs=0.1)
    console.run(1)
    assert console.player.finished


def test_a_clock_that_goes_back_does_not_stop_the_replay(tmp_path: Path) -> None:
    console = Console(heartbeats(tmp_path / "a.tlog", [100, 101, 50, 51]))
    console.run(3)
    assert console.player.finished
    assert console.frame.wall_s == pytest.approx(START_S + 51, abs=0.1)


def test_a_slow_console_misses_nothing(tmp_path: Path) -> None:
    console = Console(DATA / "px4-8.tlog", speed=1000)
    console.player.tick()
    console.clock.advance(1.0)
    console.player.tick()
    assert console.player.finished
    assert console.frame.ids == tuple(range(1, 9))


def test_what_cannot_be_played_says_so(tmp_path: Path) -> None:
    path = tmp_path / "x.tlog"
    path.write_text("text")
    with pytest.raises(TlogError, match="not a telemetry log"):
        Player(path, 1.0, MemoryBus(), VirtualClock())
    for speed in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="replay speed"):
            Player(DATA / "px4-8.tlog", speed, MemoryBus(), VirtualClock())


def test_a_recorded_loss_is_an_alarm_that_neither_flashes_nor_rings(tmp_path: Path) -> None:
    armed = 81 | 128
    console = Console(heartbeats(tmp_path / "a.tlog", [0.0, 1.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0], armed))
    console.run(6.0)
    (alarm,) = console.statuses[-1].alarms
    assert (alarm.cause, alarm.vehicles, alarm.state, alarm.action) == ("lost", (7,), "acknowledged", "")
    console.run(7.0)
    assert "lost" not in [alarm.cause for alarm in console.statuses[-1].alarms]
    reported = [event.text for event in console.events if event.cls is m.EventClass.ALARM]
    assert "LOST in the air: vehicle 7" in reported
    assert "over: LOST in the air: vehicle 7" in reported


def planner_texts(console: Console, at: int = PLANNER_LOG_END, *, newer: bool = False) -> tuple[list[str], int]:
    """What planners had logged until the moment that is shown, and the place after it."""
    piece = inspected(console, GetPlannerLog(at, newer)).planner_log
    assert piece is not None
    return [line.text for line in piece.lines], piece.end


def test_what_planners_logged_is_shown_up_to_the_moment_that_is_played(tmp_path: Path) -> None:
    path = heartbeats(tmp_path / "flight.tlog", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    now_s = START_S
    log = PlannerLog(log_files(path)[0], lambda: now_s)
    for second in range(5):
        now_s = START_S + second + 0.5
        log.write("red", "patrol", PlannerLogLevel.STDOUT, f"at {second}.5 s")
    log.close()
    console = Console(path)
    console.run(2.2)
    texts, place = planner_texts(console)
    assert texts == ["at 0.5 s", "at 1.5 s"]
    console.run(1.0)
    assert planner_texts(console, place, newer=True)[0] == ["at 2.5 s"]
    console.ask(ControlReplay(ReplayAct.GO_TO, 1.0))
    console.run(0.1)
    assert planner_texts(console)[0] == ["at 0.5 s"]
    texts, end = planner_texts(console, place, newer=True)
    assert texts == [] and end < place, "so a console knows that what it holds was not written yet"


def test_a_recording_without_a_planner_log_says_so(tmp_path: Path) -> None:
    reply = inspected(Console(heartbeats(tmp_path / "flight.tlog", [0.0, 1.0])), GetPlannerLog())
    assert not reply.ok and reply.text == "no planner log lies beside this recording"


def inspected(console: Console, request: m.Request) -> ServiceReply:
    return m.decode(console.bus.ask(keys.REQUEST.format(principal="console"), m.encode(request)), ServiceReply)


def test_inspector_and_plots_are_answered_from_the_recording_also_after_going_back() -> None:
    console = Console(DATA / "arducopter-8.tlog", speed=16.0)
    console.run(3.0)
    now = inspected(console, GetMessages()).inspection
    assert now is not None and {"HEARTBEAT", "GLOBAL_POSITION_INT"} <= {row.name for row in now.rows}
    chosen = next(row for row in now.rows if row.name == "ATTITUDE" and row.vehicle == 3)
    whole = inspected(console, GetMessages(detail=chosen.key)).inspection
    assert whole is not None and whole.detail is not None
    assert "roll" in [field.name for field in whole.detail.fields]
    wanted = (ValueKey(3, "ATTITUDE.time_boot_ms"), ValueKey(3, "WPNAV_SPEED", is_parameter=True), ValueKey(99, "A.b"))
    late, unknown, nobody = inspected(console, GetValues(wanted)).values
    assert late.value > 0.0 and math.isnan(unknown.value) and math.isnan(nobody.value)
    console.ask(ControlReplay(ReplayAct.GO_TO, 5.0))
    console.run(0.2)
    assert inspected(console, GetValues(wanted)).values[0].value < late.value
