"""Station and supervisor killed together while a fleet flies its second round: the next station goes on in that round.

Seen: the fleet flew round 2, the new station was in round 1, said nothing, and a resume flew there.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from tests.rigs.own_station import Watcher, join, processes, station_in, until
from tui_gcs.client.launcher import free_port, launch
from tui_gcs.core.base.directories import STATE_FILE, runtime_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
STATION, SUPERVISOR = "tui_gcs.core.process.station_process", "tui_gcs.client.launcher"
FLOWN = (1, 2)

pytestmark = [pytest.mark.process, pytest.mark.long]


@pytest.fixture
def place() -> Iterator[str]:
    """Where the vehicles send to: they are simulated by a process of their own, which outlives stations."""
    place = f"127.0.0.1:{free_port()}"
    command = [sys.executable, "-m", "tui_gcs", "sim", str(SCENARIO), "--target", place, "--quiet"]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL) as vehicles:
        yield place
        vehicles.terminate()


def test_the_next_station_goes_on_in_the_round_that_the_fleet_flies(place: str, tmp_path: Path) -> None:
    def start(toml: str) -> None:
        launch(RunKind.SIM, str(SCENARIO), toml, [f"udpin:{place}"])

    toml = SCENARIO.read_text()
    with station_in(tmp_path, lambda: start(toml)) as first:
        until(lambda: first.status is not None and first.status.heard == 8, 60, "8 vehicles heard")
        until(lambda: first.ask(m.Start(vehicles=FLOWN)).ok, 60, "vehicles ready")
        until(lambda: first.status.run is m.RunPhase.RUNNING, 90, "they fly for their planner")
        assert first.ask(m.SwitchRound(index=1)).ok
        until(lambda: first.status.round_index == 1, 10, "the second round")
        kill_all()
        assert (runtime_dir(RunKind.SIM) / STATE_FILE).exists(), "what the station knew stays behind"

        start(toml)
        with joined() as second:
            assert second.status.round_index == 1 and second.status.armed == len(FLOWN)
            assert second.told("goes on where a station ended that was killed: in round 2")
            until(lambda: second.ask(m.Resume()).ok, 20, "they hold, and are resumed")
            until(lambda: second.status.run is m.RunPhase.RUNNING, 60, "resumed, in that round")
            kill_all()

        # Another scenario knows nothing of that round: its operator is asked, by an alarm, before anything flies there.
        start(toml + "\n# changed\n")
        with joined() as third:
            assert third.status.round_index == 0
            until(lambda: "memory" in {alarm.cause for alarm in third.status.alarms}, 10, "alarmed")
            until(lambda: set(phases_of_armed(third)) == {m.Phase.HOLDING}, 10, "they are left alone")


def kill_all() -> None:
    """`kill -9` of the supervisor first, so that it starts no station again."""
    for part in (SUPERVISOR, STATION):
        for pid in processes(part):
            os.kill(pid, signal.SIGKILL)
    until(lambda: not processes(SUPERVISOR) and not processes(STATION), 10, "both are gone")


@contextmanager
def joined() -> Iterator[Watcher]:
    """A console of the new station, once that one has heard what flies."""
    with closing(join(30.0)) as bus:
        watcher = Watcher(bus)
        until(lambda: watcher.status is not None and watcher.status.armed == len(FLOWN), 30, "the vehicles in the air")
        # Its first events were published before anybody listened.
        watcher.events += watcher.ask(m.GetEvents(after=0)).events
        yield watcher


def phases_of_armed(watcher: Watcher) -> list[m.Phase]:
    """What the station does with the vehicles in the air."""
    assert watcher.frame is not None
    return [phase for phase, armed in zip(watcher.frame.phase, watcher.frame.armed, strict=True) if armed]
