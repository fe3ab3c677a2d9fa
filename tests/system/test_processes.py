"""The real thing: simulator, station, planner workers and consoles as processes, at 1x, and what survives what.

One flight of about 90 s; the steps are in order because each begins where the last one left the fleet.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.rigs.console_pty import PtyConsole
from tests.rigs.own_station import Watcher, processes, station_in, until
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.scenario.load import load

RECORDING = Path(__file__).parents[1] / "data" / "arducopter-8.tlog"
SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"

pytestmark = [pytest.mark.process, pytest.mark.long]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watcher]:
    vehicles = spec_of(load(SCENARIO))
    with station_in(
        tmp_path_factory.mktemp("r"),
        lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], LaunchOptions(vehicles)),
    ) as watcher:
        yield watcher


def test_vehicles_are_heard_and_planners_ready(fleet: Watcher):
    until(lambda: fleet.status is not None and fleet.status.heard == 8, 20, "8 vehicles heard")
    until(lambda: {t.worker for t in fleet.status.teams} == {"running"}, 20, "planners plan")


def test_sixty_seconds_of_flight(fleet: Watcher):
    until(lambda: fleet.ask(m.Start(vehicles=tuple(range(1, 9)))).ok, 20, "vehicles ready")
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 50, "all at their layers, then the planners")
    positions = fleet.frame.position_m
    time.sleep(28)
    moved = [abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in zip(positions, fleet.frame.position_m, strict=True)]
    assert min(moved) > 20, "every vehicle is under way"
    assert fleet.status.faults == {}
    assert fleet.status.vetoes == {}
    assert fleet.status.outside_area_m == 0


def test_a_killed_console_changes_nothing_and_the_next_one_shows_the_truth(fleet: Watcher):
    first = PtyConsole(["attach"])
    assert first.wait_for(b"8/8", 15)
    first.kill()
    time.sleep(1.5)
    assert fleet.phases() == {m.Phase.FLYING}
    second = PtyConsole(["attach"], 80, 24)
    assert second.wait_for(b"armed 8", 15)
    second.press(b"q")
    assert second.wait_exit(10) == 0
    assert fleet.phases() == {m.Phase.FLYING}
    assert fleet.status.faults == {}


def test_a_replay_shows_what_flies_meanwhile_and_hold_all_holds_that(fleet: Watcher):
    replay = PtyConsole(["replay", str(RECORDING)], 120, 40)
    assert replay.wait_for(b"8 ARMED", 20), "the third line of a replay is of the station that flies"
    for keys in (b"!r", b"!l", b" "):  # in a replay these reach no vehicle
        replay.press(keys)
    time.sleep(1.5)
    assert fleet.phases() == {m.Phase.FLYING}
    replay.press(b"!h")
    until(lambda: fleet.phases() == {m.Phase.HOLDING}, 10, "all hold")
    replay.press(b"q")
    assert replay.wait_exit(10) == 0
    assert fleet.ask(m.Resume()).ok
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 10, "all fly on")


def test_a_killed_planner_worker_makes_its_team_hold_and_the_operator_is_told(fleet: Watcher):
    fleet.events.clear()
    for pid in processes("--team attack"):
        os.kill(pid, signal.SIGKILL)
    until(lambda: fleet.told("GONE"), 5, "told that the worker is gone")
    until(lambda: fleet.told("hold") or fleet.team("attack").worker == "running", 6, "hold, or planned again in time")
    assert {p for p, team in zip(fleet.frame.phase, fleet.frame.team, strict=True) if team == "defend"} == {
        m.Phase.FLYING
    }
    until(lambda: fleet.team("attack").worker == "running", 25, "the worker is back")
    if m.Phase.HOLDING in fleet.phases():
        assert fleet.ask(m.Resume()).ok
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 15, "the team flies again")


def test_a_killed_station_comes_back_with_the_whole_picture_and_sends_nothing(fleet: Watcher):
    fleet.status = None
    for pid in processes("tui_gcs.core.process.station_process"):
        os.kill(pid, signal.SIGKILL)
    until(lambda: fleet.status is not None and fleet.status.armed == 8, 15, "the whole picture again")
    until(lambda: fleet.phases() == {m.Phase.HOLDING}, 10, "nobody is steered")
    # ArduCopter brakes 3 s after the last velocity target, from 8 m/s in another 3.2 s
    until(lambda: max(abs(v) for velocity in fleet.frame.velocity_m_s for v in velocity) < 0.1, 10, "all hover")
    time.sleep(2)
    assert max(abs(v) for velocity in fleet.frame.velocity_m_s for v in velocity) < 0.1, "and go on hovering"
    assert fleet.status.run is m.RunPhase.HOLD


def test_return_brings_everybody_home_and_a_flying_fleet_keeps_its_station(fleet: Watcher):
    assert not fleet.ask(m.Shutdown()).ok, "not while armed"
    assert fleet.ask(m.Return()).ok
    until(lambda: fleet.phases() <= {m.Phase.RETURNING, m.Phase.LANDING}, 10, "all return")
    status = subprocess.run(
        [sys.executable, "-m", "tui_gcs.cli.main", "status", "--json"], capture_output=True, text=True, check=True
    )
    assert len(json.loads(status.stdout)["vehicles"]) == 8
    until(lambda: m.Phase.LANDING in fleet.phases(), 90, "above home the first one descends")
    assert fleet.status.faults == {}


def test_simulated_vehicles_fly_on_with_the_station_alone_and_end_with_it(fleet: Watcher):
    """Seen: launcher and station killed, the simulator ran for ever."""
    for pid in processes("tui_gcs.client.launcher"):
        os.kill(pid, signal.SIGKILL)
    until(lambda: any(alarm.cause == "supervisor" for alarm in fleet.status.alarms), 5, "told that nobody supervises")
    time.sleep(2.5)
    assert processes("sitl.launch.simulated") and max(fleet.frame.heard_age_s) < 1.5, "it is still flown"
    for pid in processes("tui_gcs.core.process.station_process"):
        os.kill(pid, signal.SIGKILL)
    until(lambda: not processes("sitl.launch.simulated"), 5, "nobody wants vehicles any more")
