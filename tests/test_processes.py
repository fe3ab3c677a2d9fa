"""The real thing: simulator, station, planner workers and consoles as processes, at 1x, and what survives what.

One flight of about 90 s; the steps are in order because each begins where the last one left the fleet.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.console_pty import PtyConsole
from tui_gcs.commands.sim_fleet import spec_of
from tui_gcs.core import messages as m
from tui_gcs.core.bus import EVENT, FLEET, STATUS, BusError
from tui_gcs.core.config import socket_path
from tui_gcs.core.kinds import Kind
from tui_gcs.core.scenario_load import load
from tui_gcs.core.zenoh_bus import ZenohBus, connect
from tui_gcs.launcher import launch

SCENARIO = Path(__file__).parents[1] / "tui_gcs/scenarios/swarm-challenge.toml"

pytestmark = [pytest.mark.process, pytest.mark.long]


class Watcher:
    """A console without a screen."""

    def __init__(self, bus: ZenohBus) -> None:
        self.bus = bus
        self.frame: m.FleetFrame | None = None
        self.status: m.StationStatus | None = None
        self.events: list[m.Event] = []
        bus.subscribe(FLEET, lambda _, data: setattr(self, "frame", m.decode(data, m.FleetFrame)))
        bus.subscribe(STATUS, lambda _, data: setattr(self, "status", m.decode(data, m.StationStatus)))
        bus.subscribe(EVENT, lambda _, data: self.events.append(m.decode(data, m.Event)))

    def ask(self, request: m.AnyRequest) -> m.Reply:
        return m.decode(self.bus.ask("gcs/req/test", m.encode(request)), m.Reply)

    def phases(self) -> set[m.Phase]:
        return set(self.frame.phase) if self.frame else set()

    def modes(self) -> set[str]:
        return set(self.frame.mode) if self.frame else set()

    def told(self, text: str) -> bool:
        return any(text in event.text for event in self.events)

    def team(self, name: str) -> m.TeamStatus:
        assert self.status is not None
        return next(team for team in self.status.teams if team.name == name)


def until(what: Callable[[], bool], seconds: float, why: str) -> None:
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, f"not within {seconds} s: {why}"
        time.sleep(0.05)


def processes(part: str) -> list[int]:
    """Ids of this run's processes whose command line has `part` and our runtime directory."""
    listing = subprocess.run(["ps", "-ww", "-eo", "pid,args"], capture_output=True, text=True, check=True).stdout
    ours = os.environ["TUI_GCS_RUNTIME_DIR"]
    return [int(line.split()[0]) for line in listing.splitlines() if part in line and ours in line]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watcher]:
    folder = tmp_path_factory.mktemp("r")
    before = {name: os.environ.get(name) for name in ("TUI_GCS_RUNTIME_DIR", "TUI_GCS_STATE_DIR")}
    os.environ["TUI_GCS_RUNTIME_DIR"] = str(folder / "run")
    os.environ["TUI_GCS_STATE_DIR"] = str(folder / "state")
    launch(Kind.SIM, str(SCENARIO), SCENARIO.read_text(), [], sim_spec=spec_of(load(SCENARIO)))
    bus = join(20.0)
    yield Watcher(bus)
    bus.close()
    for part in ("tui_gcs.launcher", "tui_gcs.core.station_process", "sitl.launch"):
        for pid in processes(part):
            os.kill(pid, signal.SIGKILL)
    for name, value in before.items():
        os.environ.pop(name) if value is None else os.environ.update({name: value})


def join(seconds: float) -> ZenohBus:
    end = time.monotonic() + seconds
    while True:
        try:
            return connect(socket_path(Kind.SIM))
        except BusError:
            assert time.monotonic() < end, "no station"
            time.sleep(0.1)


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
    for pid in processes("tui_gcs.core.station_process"):
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
        [sys.executable, "-m", "tui_gcs.cli", "status", "--json"], capture_output=True, text=True, check=True
    )
    assert len(json.loads(status.stdout)["vehicles"]) == 8
    until(lambda: m.Phase.LANDING in fleet.phases(), 90, "above home the first one descends")
    assert fleet.status.faults == {}
