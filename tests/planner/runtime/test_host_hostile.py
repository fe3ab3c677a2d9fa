"""Planners that do what no planner should: the host reports it in a plan that the station understands, and lives on."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from multiprocessing import Pipe
from pathlib import Path

import pytest

from tests.planner.rigs.bad_planners import source
from tests.planner.rigs.flights import SMALL, fleet, task_of, zone_of
from tui_gcs.core.protocol.bus import PREVIEW, PREVIEW_TASK, MemoryBus
from tui_gcs.core.protocol.common import Annotation, PreviewResult, PreviewTask, TeamPlan, decode, encode
from tui_gcs.core.protocol.plan_limits import MAX_POINTS, shown
from tui_gcs.planner.runtime import host as host_module
from tui_gcs.planner.runtime import planner_subprocess
from tui_gcs.planner.runtime.background_host import BackgroundHost
from tui_gcs.planner.runtime.bus_adapter import attach
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.planner_file import PlannerFile


def plans_of(text: str, folder: Path) -> list[TeamPlan]:
    path = folder / "mine.py"
    path.write_text(text)
    host = PlannerHost("red", {"mine": PlannerFile("mine", path, sha256(text.encode()).hexdigest())})
    host.set_task(task_of(zone_of(SMALL), planner="mine"))
    vehicles, plans = fleet(4), []
    for _ in range(20):
        frame = vehicles.frame()
        if host.due(frame.t_s):
            plans.append(decode(host.answer(frame), TeamPlan))
        vehicles.t_s += 0.2
    return plans


ENDS = {
    "an id of 71 bits": source(body="vehicle = 2**70"),
    "a place of 400 digits": source(after="out.intents = [Intent(1, 'goto', position_m=(10**400, 0.0, 0.0))]"),
    "a list that holds itself": source(after="a = []; a.append(a); out.annotations = a"),
    "nonsense after a while": source(after="self.count += 1; out.annotations = [3] if self.count > 3 else None"),
    "too many intents": source(after="out.intents = [Intent(1, 'hold')] * 1000"),
    "intents without end": source(after="out.intents = iter(lambda: Intent(1, 'hold'), None)"),
    "too much to draw": source(
        after="from tui_gcs.core.protocol.common import Annotation\n"
        "        out.annotations = [Annotation('polyline', ((1.0, 2.0),) * 300_000)]"
    ),
    "writes into what it is given": source(after="fleet.position_m[:] = 0.0"),
    "an exception of no kind": source(after="raise GeneratorExit"),
    "an exit in the constructor": source(extra="def __init__(self): raise SystemExit(2)"),
    "no exception at import": "raise BaseException('import')\n",
}


@pytest.mark.parametrize("text", ENDS.values(), ids=ENDS.keys())
def test_what_cannot_be_flown_ends_in_quarantine(text: str, tmp_path: Path) -> None:
    plans = plans_of(text, tmp_path)
    assert plans[-1].fate == "quarantined"
    assert plans[-1].error and not plans[-1].intents


@pytest.mark.parametrize("error", ["SystemExit(3)", "GeneratorExit()", "Odd()"])
def test_a_snapshot_that_fails_is_a_note(error: str, tmp_path: Path) -> None:
    odd = "class Odd(Exception):\n    def __str__(self): raise ValueError('text')\n"
    plans = plans_of(source(imports=odd, extra=f"def snapshot(self): raise {error}"), tmp_path)
    assert any("no snapshot: " in note for plan in plans for note in plan.notes)
    assert plans[-1].intents


@pytest.mark.parametrize("value", ["0", "float('nan')", "float('inf')", "1e9", "'fast'", "None"])
@pytest.mark.parametrize("name", ["rate_hz", "iterations_per_s"])
def test_rates_set_in_flight_stay_within_what_may_be_declared(name: str, value: str, tmp_path: Path) -> None:
    plans = plans_of(source(after=f"self.{name} = {value}"), tmp_path)
    assert len(plans) >= 4
    assert all(1.0 <= plan.rate_hz <= 20.0 and not plan.error for plan in plans)


def test_what_is_drawn_is_bounded_and_without_control_characters() -> None:
    line = Annotation("polyline", ((0.0, 0.0),) * (MAX_POINTS - 1))
    text = Annotation("text", ((1.0, 1.0),), "\x1b[2Jhere" + "x" * 999)
    drawn = shown([line, text, line, text])
    assert len(drawn) == 2
    assert "\x1b" not in drawn[1].text and len(drawn[1].text) <= 40


DRAWS = "from tui_gcs.planner.api import Annotation as A\n        out.annotations = "


def test_numpy_in_drawings_travels_as_numbers(tmp_path: Path) -> None:
    way = "np.array([[1.0, 2.0], [3.0, 4.0]])"
    points = (way, f"tuple({way})", "((1.0, 2.0), (3.0, np.float64(4.0)))", "[[1.0, 2.0], [3.0, 4.0]]")
    drawn = plans_of(source(after=DRAWS + f"[A('polyline', points) for points in ({', '.join(points)})]"), tmp_path)[-1]
    assert not drawn.error and drawn.annotations is not None
    assert [line.points_m for line in drawn.annotations] == [((1.0, 2.0), (3.0, 4.0))] * 4


def test_drawings_without_end_are_cut(tmp_path: Path) -> None:
    plan = plans_of(source(after=DRAWS + "iter(lambda: A('marker', ((1.0, 2.0),)), None)"), tmp_path)[-1]
    assert not plan.error and plan.annotations is not None and len(plan.annotations) == 201


def test_a_drawing_of_no_kind_says_which_there_are(tmp_path: Path) -> None:
    error = plans_of(source(after=DRAWS + "[A('line', ((1.0, 2.0),))]"), tmp_path)[-1].error
    assert "an annotation is one of polyline, polygon, marker, text, not 'line'" in error


# ---------------------------------------------------------------- Ctrl-C


INTERRUPTS = source(after="raise KeyboardInterrupt")


@pytest.fixture
def worker_signals() -> Iterator[None]:
    """As in a worker: Ctrl-C is the console's business."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("worker_signals")
def test_a_planner_that_raises_keyboard_interrupt_is_reported_as_any_other(tmp_path: Path) -> None:
    last = plans_of(INTERRUPTS, tmp_path)[-1]
    assert last.fate == "quarantined" and "KeyboardInterrupt" in last.error


def test_in_a_lock_step_run_it_is_the_operators(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        plans_of(INTERRUPTS, tmp_path)


# ---------------------------------------------------------------- previews


def test_a_preview_that_cannot_be_shown_is_reported_in_lock_step_runs_too(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(source(after=DRAWS + "[A('marker', ((object(), 1.0),))]; out.metrics = {'predicted_s': 1.0}"))
    task = task_of(zone_of(SMALL), (1,), planner="mine")
    bus, told = MemoryBus(), list[PreviewResult]()
    bus.subscribe(PREVIEW.format(team=task.team), lambda _, data: told.append(decode(data, PreviewResult)))
    attach(PlannerHost(task.team, {"mine": PlannerFile("mine", file, "")}), bus)
    for ask in (PreviewTask(1, task, fleet(1).frame()), PreviewTask(2, task, None)):
        bus.publish(PREVIEW_TASK.format(team=task.team), encode(ask))
    assert [(one.number, one.state) for one in told] == [(1, "failed"), (2, "failed")]
    assert all(one.text.startswith("nothing can be shown: ") for one in told)


# ---------------------------------------------------------------- memory


GREEDY = """
import os
from tui_gcs.planner.runtime import worker
worker.limit_memory()
try:
    bytearray(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") * 6 // 10)
except MemoryError:
    print("refused")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not keep to this limit")
def test_a_worker_gets_no_more_than_half_of_the_memory() -> None:
    done = subprocess.run([sys.executable, "-c", GREEDY], capture_output=True, text=True, check=True)
    assert done.stdout == "refused\n"


@pytest.mark.parametrize(
    ("background", "fates"), [(0.0, ["", "", "restarts", "", "", "quarantined"]), (10.0, ["", "", "", "", "", ""])]
)
def test_three_steps_in_a_row_that_no_flight_would_wait_for_are_a_failure_in_a_rehearsal_too(
    background: float, fates: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Background work is granted whole in a rehearsal, and less in a flight: it is no reason to fail.
    monkeypatch.setattr(host_module, "MAX_STEP_CPU_S", 0.0)
    plans = plans_of(source(extra=f"iterations_per_s = {background}"), tmp_path)
    assert [plan.fate for plan in plans[:6]] == fates
    if not background:
        assert "3 steps in a row took more than 0 s of CPU time" in plans[2].error
        assert not plans[2].intents and plans[3].intents, "begun anew, it has three steps again"


HANGS = {
    "a task": source(extra="def __init__(self):\n        while True: pass"),
    "a step": source(body="while True: pass"),
}


@pytest.mark.parametrize("text", HANGS.values(), ids=HANGS.keys())
def test_a_planner_that_hangs_does_not_hang_its_rehearsal(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planner_subprocess, "CALL_CPU_LIMIT_S", 0.2)
    path = tmp_path / "mine.py"
    path.write_text(text)
    host = BackgroundHost("red", {"mine": PlannerFile("mine", path, sha256(text.encode()).hexdigest())})
    here, there = Pipe()
    here.send_bytes(b"task" + encode(task_of(zone_of(SMALL), planner="mine")))
    here.send_bytes(b"step" + encode(fleet(4).frame()))
    here.close()
    planner_subprocess.serve(host, there)  # until the other end is closed
    problem = host.problem or host.failure
    assert "more than 0.2 s of CPU time at once" in problem and "while True: pass" in problem
