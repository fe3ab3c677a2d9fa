"""A planner that is saved again while it flies: the new version goes on where the one before was, or that one does."""

import re
import sys
import threading
import time
from hashlib import sha256
from pathlib import Path
from types import ModuleType

import pytest

from tests.planner.rigs import bad_planners as bad
from tui_gcs.core.protocol.common import PlannerTask, TeamPlan, decode
from tui_gcs.planner.runtime import file_watching_host
from tui_gcs.planner.runtime.file_watching_host import TRIAL_STEPS, FileWatchingHost
from tui_gcs.planner.runtime.host import PlannerRun
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet, scattered, task_for
from tui_gcs.planner.runtime.planner_file import PlannerFile

COUNTS = bad.REMEMBERS
"""How far east it sends vehicles shows how many steps it has made, restarts included."""


LOADING = "mine.py was saved: loading it ("


def short(source: str) -> str:
    """As the operator reads which version it is."""
    return sha256(source.encode()).hexdigest()[:8]


class Flight:
    """One vehicle, and a file that its author edits."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "mine.py"
        self.path.write_text(COUNTS)
        self.world = KinematicFleet(task_for((1,), "mine"), scattered(1))
        self.host = FileWatchingHost(TEAM, {"mine": PlannerFile("mine", self.path, "of the start")})
        self.host.set_task(self.world.task)
        self.notes: list[str] = []
        """Without that something is being loaded."""
        self.told: list[tuple[str, bool]] = []

    def step(self) -> TeamPlan:
        self.world.t_s += 0.2
        plan = decode(self.host.answer(self.world.frame()), TeamPlan)
        assert plan.error == ""
        self.notes += [*plan.notes, *(text for text, _ in plan.news if LOADING not in text)]
        self.told += plan.news
        return plan

    def east_m(self) -> float:
        position = self.step().intents[0].position_m
        assert position is not None
        return position[0]

    def save(self, source: str) -> None:
        """Save, and fly until the new version has been looked at."""
        self.path.write_text(source)
        before, end = len(self.notes), time.monotonic() + 20.0
        while len(self.notes) == before and time.monotonic() < end:
            self.step()
            time.sleep(0.005)


@pytest.fixture
def flight(tmp_path: Path) -> Flight:
    return Flight(tmp_path)


def test_a_new_version_goes_on_with_the_state_of_the_one_before(flight: Flight) -> None:
    for _ in range(10):
        east_m = flight.east_m()
    assert east_m == pytest.approx(200.9)
    flight.save(COUNTS.replace("200.0 + shift", "300.0 + shift"))
    assert flight.notes[-1].startswith("mine.py: new version flies (")
    assert 301.0 < flight.east_m() < 320.0


def test_loading_a_version_is_reported_at_once_and_every_take_over_too(flight: Flight) -> None:
    newer = COUNTS.replace("200.0 + shift", "300.0 + shift")
    for source in (newer, COUNTS, newer):
        flight.told.clear()
        flight.save(source)
        (loading, well), (flies, flies_well) = flight.told
        assert loading == f"{LOADING}{short(source)})" and well and flies_well
        assert re.fullmatch(rf"mine\.py: new version flies \({short(source)}\) after \d+\.\d s", flies)
    flight.told.clear()
    flight.save("oops(\n")
    assert [well for _, well in flight.told] == [True, False], "what was not taken in is a warning"


def test_loading_is_reported_before_the_version_is_ready(flight: Flight, monkeypatch: pytest.MonkeyPatch) -> None:
    never = threading.Event()
    monkeypatch.setattr(flight.host, "prepare", lambda task, state: never.wait(20.0))
    flight.path.write_text(COUNTS.replace("200.0 + shift", "300.0 + shift"))
    for _ in range(3):  # the file is as it was a step ago, and its being loaded is told with the plan of the next
        flight.step()
    assert [text for text, _ in flight.told if text.startswith(LOADING)], "though nothing has come of it yet"
    never.set()


def test_what_the_new_version_declares_is_said_once_it_has_proved_itself(flight: Flight) -> None:
    flight.step()
    flight.save(COUNTS.replace("version = '1'", "version = '2'"))
    assert flight.step().declares is None, "on trial"
    for _ in range(TRIAL_STEPS):
        plan = flight.step()
    assert plan.declares is not None and plan.declares.file == str(flight.path)
    assert plan.declares.version == "2" and len(plan.declares.sha256) == 64


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("def step(:\n", "mine.py:1: invalid syntax; the version before flies on"),
        (COUNTS.replace('name = "mine"', 'name = "other"'), "mine.py: its name is 'other' now"),
        (COUNTS.replace("self.kept = []", "self.kept = 1 / 0"), "in configure: ZeroDivisionError"),
        (COUNTS.replace("self.count += 1", "1 / 0"), "in step: ZeroDivisionError"),
        (COUNTS.replace("self.count += 1", "self.count += 1; out.intents = [7]"), "TypeError: an intent is an Intent"),
    ],
    ids=["syntax", "name", "configure", "step", "no plan"],
)
def test_where_the_new_version_fails_the_one_before_flies_on(source: str, told: str, flight: Flight) -> None:
    flight.save(source)
    for _ in range(3):
        east_m = flight.east_m()
    assert 200.0 < east_m < 230.0
    assert told in "\n".join(flight.notes)
    flight.save(COUNTS.replace("200.0 + shift", "300.0 + shift"))  # mended
    assert 300.0 < flight.east_m() < 330.0


@pytest.mark.parametrize("where", ["configure", "load"])
def test_a_version_that_hangs_is_reported_and_the_next_one_is_loaded(
    where: str, flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    hangs = "while True: pass\n"
    source = COUNTS.replace("self.kept = []", hangs.strip()) if where == "configure" else hangs + COUNTS
    assert source.count(hangs.strip()) == 1
    before = set(threading.enumerate())  # another test of this process may have left a thread of its own
    with monkeypatch.context() as short:
        short.setattr(file_watching_host, "CONFIGURE_LIMIT_S", 0.5)
        flight.save(source)
    assert flight.notes == ["mine.py: does not finish loading and configure within 0.5 s; the version before flies on"]
    assert flight.east_m() > 200.0
    flight.save(COUNTS.replace("200.0 + shift", "300.0 + shift"))  # mended
    assert flight.notes[-1].startswith("mine.py: new version flies (")
    assert flight.east_m() > 300.0
    end = time.monotonic() + 20.0
    while set(threading.enumerate()) - before and time.monotonic() < end:
        time.sleep(0.01)
    assert not set(threading.enumerate()) - before, "the hanging one was ended, too"


def test_a_version_that_cannot_take_the_state_begins_anew_and_says_so(flight: Flight) -> None:
    flight.save(COUNTS.replace("int(data)", "int(data[99])"))
    assert any("begins anew: restore failed" in note for note in flight.notes)
    assert flight.east_m() < 202.0


def test_a_file_that_is_touched_is_no_new_version(flight: Flight) -> None:
    flight.path.touch()
    for _ in range(5):
        flight.step()
    assert flight.notes == []


def test_another_task_has_the_newest_version(flight: Flight) -> None:
    flight.save(COUNTS.replace("200.0 + shift", "300.0 + shift"))
    flight.host.set_task(task_for((1,), "mine", seed=2))
    assert flight.east_m() == 300.0


PICKLES = bad.source(
    imports="import pickle\nfrom dataclasses import dataclass\n\n\n@dataclass\nclass Log:\n    steps: int = 0\n",
    body="shift = 0.1 * self.log.steps",
    after="self.log.steps += 1",
    extra="""version = '1'
    log = Log()
    def snapshot(self): return pickle.dumps(self.log)
    def restore(self, data): self.log = pickle.loads(data)""",
)


def test_classes_of_the_file_may_be_in_its_state(flight: Flight) -> None:
    """A pickle finds them by the name of their module, which is the same for all versions."""
    flight.save(PICKLES)
    flight.save(PICKLES.replace("200.0 + shift", "1 / 0"))
    assert "ZeroDivisionError" in flight.notes[-1]
    for _ in range(15):  # a snapshot every two seconds
        flight.step()
    flight.save(PICKLES.replace("200.0 + shift", "300.0 + shift"))
    assert not any("no snapshot" in note for note in flight.notes)
    assert flight.east_m() > 301.5


def test_what_is_saved_again_while_it_is_loaded_is_loaded_again(
    flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Editors empty a file before they write it: the first load may find nothing in it."""
    begun, emptied, prepare = threading.Event(), threading.Event(), flight.host.prepare

    def late(task: PlannerTask, state: bytes) -> PlannerRun:
        begun.set()
        assert emptied.wait(20.0)
        return prepare(task, state)

    monkeypatch.setattr(flight.host, "prepare", late)
    newer = COUNTS.replace("200.0 + shift", "300.0 + shift")
    flight.path.write_text(newer)
    while not begun.is_set():
        flight.step()
    flight.path.write_text("")
    emptied.set()
    flight.host._thread.join()
    flight.save(newer)
    (told,) = flight.notes
    assert told.startswith(f"mine.py: new version flies ({short(newer)}) after ")


def test_a_snapshot_is_not_taken_while_another_version_is_half_loaded(
    flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pickle would find the classes of the new version, and say that they are not its own."""
    gate = ModuleType("gate")
    gate.opened = threading.Event()
    monkeypatch.setitem(sys.modules, "gate", gate)
    flight.save(PICKLES)
    flight.path.write_text("import gate\ngate.opened.wait(20.0)\n" + PICKLES)
    for _ in range(25):  # a snapshot every two seconds
        flight.step()
    gate.opened.set()
    flight.save(flight.path.read_text())
    assert not any("no snapshot" in note for note in flight.notes)
    assert "new version flies" in flight.notes[-1]
