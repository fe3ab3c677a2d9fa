"""A planner in a file, in the real processes, that hangs, raises and changes: what is told, what comes back."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.rigs.own_station import Watcher, processes, station_in, until
from tui_gcs.cli.common import read_planners
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Team

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
ORDERS = "orders.txt"
FILE = """
import os
import time
from pathlib import Path
from tui_gcs.planner.api import Intent, Output, Param, Planner

ORDERS = Path(__file__).with_name("orders.txt")


class Puppet(Planner):
    name = "puppet"
    params = (Param("offset_m", float, 0.0, -50.0, 50.0, "m", "how far east"),)

    def configure(self, task, params, rng):
        super().configure(task, params, rng)
        self.offset_m = params["offset_m"]
        self.steps = 0

    def snapshot(self):
        return b"%d" % self.steps

    def restore(self, data):
        self.steps = int(data)

    def step(self, ctx):
        self.steps += 1
        order = ORDERS.read_text()
        if order == "hang":
            while True:
                time.sleep(1)
        if order == "fork" and self.steps % 5 == 0 and os.fork() == 0:
            time.sleep(1000)
        if order == "close":
            os.closerange(0, 4096)
        if order == "raise":
            raise ValueError("as ordered")
        fleet, (x, y) = ctx.fleet, self.task.zone.shape.centre_m
        places = zip(fleet.id[fleet.active], fleet.layer_m[fleet.active])
        intents = [Intent(int(i), "goto", position_m=(x + self.offset_m, y, float(z))) for i, z in places]
        return Output(intents, metrics={"steps": self.steps, "offset_m": self.offset_m})
"""

pytestmark = [pytest.mark.process, pytest.mark.long]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("p")
    (folder / ORDERS).write_text("fly")
    (folder / "puppet.py").write_text(FILE)
    return folder


@pytest.fixture(scope="module")
def fleet(folder: Path) -> Iterator[Watcher]:
    scenario = folder / "mine.toml"
    scenario.write_text(SCENARIO.read_text().replace('planner = "patrol"', 'planner = "puppet"'))
    planners = list(read_planners([str(folder / "puppet.py")]).values())
    vehicles = spec_of(load(SCENARIO))
    with station_in(
        folder,
        lambda: launch(
            RunKind.SIM, str(scenario), scenario.read_text(), [], LaunchOptions(vehicles, planners=planners)
        ),
    ) as watcher:
        yield watcher


def worker_of(team: str) -> int:
    return next(iter(processes(f"--team {team}")), 0)


def test_a_planner_in_a_file_flies_and_its_hash_is_in_the_status(fleet: Watcher, folder: Path):
    until(lambda: fleet.status is not None and fleet.status.heard == 8, 20, "8 vehicles heard")
    until(lambda: {t.worker for t in fleet.status.teams} == {"running"}, 30, "planners plan")
    assert str(folder / "puppet.py") in fleet.status.planner_files["puppet"]
    until(lambda: fleet.ask(m.Start(vehicles=tuple(range(1, 9)))).ok, 20, "vehicles ready")
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 50, "all fly")
    until(lambda: len(fleet.ask(m.GetPlanners()).planners) >= 2, 30, "known ones are described, too")


def test_a_team_that_is_new_is_foretold_by_another_ones_worker(fleet: Watcher):
    """Asked twice: the first three end."""
    now = fleet.ask(m.GetScenario()).scenario
    assert now is not None
    document = ScenarioDocument(now.toml)
    document.set_team("attack", vehicles=(5, 6))
    document.add_team(Team("third", "field", "puppet", (7, 8)))
    for _ in range(2):
        assert fleet.ask(m.Preview(base_revision=now.revision, toml=document.text)).ok
    until(lambda: {each.state for each in fleet.ask(m.GetPreviews()).previews.values()} == {"done"}, 90, "all foretold")
    found = fleet.ask(m.GetPreviews()).previews
    assert {team: each.ways.ids for team, each in found.items() if each.ways is not None} == {
        "defend": (1, 2, 3, 4),
        "attack": (5, 6),
        "third": (7, 8),
    }
    assert fleet.phases() == {m.Phase.FLYING}, "nobody is disturbed"


def test_a_planner_that_hangs_is_killed_and_goes_on_from_its_snapshot(fleet: Watcher, folder: Path):
    time.sleep(3.0)
    pid, steps = worker_of("attack"), fleet.team("attack").metrics["steps"]
    (folder / ORDERS).write_text("hang")
    until(lambda: fleet.phases() == {m.Phase.HOLDING}, 8, "2 s of silence: hold")
    until(lambda: worker_of("attack") not in (0, pid), 10, "killed, and another one started")
    (folder / ORDERS).write_text("fly")
    until(lambda: {t.worker for t in fleet.status.teams} == {"running"}, 40, "they plan again")
    kept = steps - 15  # a snapshot is up to 2 s old, a status half a second: at 5 Hz
    assert fleet.team("attack").metrics["steps"] > kept > 1, "not from 1"
    assert fleet.told("silent for")
    assert fleet.ask(m.Resume()).ok
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 15, "all fly again")


def test_a_planner_that_forks_and_one_that_closes_its_files_cost_a_hold_and_leave_nothing(fleet: Watcher, folder: Path):
    first = set(processes("--team "))
    (folder / ORDERS).write_text("fork")
    until(lambda: len(processes("--team ")) > 2 * len(first), 10, "there are many")
    (folder / ORDERS).write_text("close")
    until(lambda: fleet.phases() == {m.Phase.HOLDING}, 10, "nothing comes from them any more: hold")
    (folder / ORDERS).write_text("fly")
    until(lambda: {t.worker for t in fleet.status.teams} == {"running"}, 40, "they plan again")
    until(lambda: len(processes("--team ")) == len(first) and not first & set(processes("--team ")), 5, "and are alone")
    assert fleet.ask(m.Resume()).ok
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 15, "all fly again")


def test_a_planner_that_raises_again_and_again_is_left_alone(fleet: Watcher, folder: Path):
    pid = worker_of("attack")
    (folder / ORDERS).write_text("raise")
    until(lambda: {t.worker for t in fleet.status.teams} == {"quarantined"}, 10, "quarantined")
    until(lambda: fleet.phases() == {m.Phase.HOLDING}, 3, "and its vehicles hold")
    error = fleet.team("attack").error.splitlines()
    assert error[-1] == "ValueError: as ordered" and any("puppet.py" in line for line in error)
    (folder / ORDERS).write_text("fly")
    time.sleep(3.0)
    assert {t.worker for t in fleet.status.teams} == {"quarantined"}, "until the operator says so"
    assert worker_of("attack") == pid, "it was not the process that failed"
    assert fleet.ask(m.Resume()).ok
    until(lambda: fleet.phases() == {m.Phase.FLYING}, 15, "all fly again")
    until(lambda: {t.worker for t in fleet.status.teams} == {"running"}, 5, "and are planned for")


def test_a_file_that_changed_is_not_loaded_by_the_next_worker(fleet: Watcher, folder: Path):
    (folder / "puppet.py").write_text(FILE + "# changed\n")
    os.kill(worker_of("attack"), signal.SIGKILL)
    until(lambda: fleet.told("changed since the start (sha256"), 20, "told")
    until(lambda: fleet.team("attack").worker == "quarantined", 3, "left alone")
    until(lambda: m.Phase.HOLDING in fleet.phases(), 3, "its vehicles hold")
    (folder / "puppet.py").write_text(FILE)
    assert fleet.ask(m.Resume()).ok
    until(lambda: fleet.team("attack").worker == "running", 15, "with its old content again")
