"""Reading what a worker prints: whole lines, levels, floods, and never a wait."""

import os
import subprocess
from io import FileIO
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from tui_gcs.core.process.worker_output import LINES_PER_S, MAX_LINE_BYTES, MAX_LINES, WorkerOutput
from tui_gcs.core.protocol.planner_log import PLANNER_LOG_END
from tui_gcs.core.records.planner_log import PlannerLog


class Worker:
    """Both ends of the pipes of a worker without a process."""

    def __init__(self, folder: Path) -> None:
        out, self.stdout = os.pipe()
        err, self.stderr = os.pipe()
        process = SimpleNamespace(stdout=FileIO(out, "r"), stderr=FileIO(err, "r"))
        self.log = PlannerLog(folder / "log", lambda: 0.0)
        self.output = WorkerOutput(cast(subprocess.Popen[bytes], process), "red", self.log, 0.0)

    def lines(self) -> list[tuple[str, str]]:
        return [(line.level.value, line.text) for line in self.log.before(PLANNER_LOG_END).lines]


@pytest.fixture
def worker(tmp_path: Path) -> Worker:
    return Worker(tmp_path)


def test_lines_are_kept_when_they_end(worker: Worker) -> None:
    worker.output.read("mine", 0.0)
    os.write(worker.stdout, b"one\n\ntw")
    worker.output.read("mine", 0.1)
    assert worker.lines() == [("stdout", "one")]
    os.write(worker.stdout, b"o\r10 %\r20 %")
    worker.output.read("mine", 0.2)
    assert worker.lines()[1:] == [("stdout", "two"), ("stdout", "10 %")], "a progress bar overwrites its line"
    worker.output.close("mine", 0.3)
    assert worker.lines()[3:] == [("stdout", "20 %")]


@pytest.mark.parametrize(
    ("written", "level", "text"),
    [
        (b"Traceback (most recent call last):\n", "stderr", "Traceback (most recent call last):"),
        (b"<7>mine: details\n", "debug", "mine: details"),
        (b"<6>mine: begun\n", "info", "mine: begun"),
        (b"<4>mine: low\n", "warning", "mine: low"),
        (b"<3>mine: broken\n", "error", "mine: broken"),
        (b"<2>mine: gone\n", "critical", "mine: gone"),
        (b"<9>nine\n", "stderr", "<9>nine"),
    ],
)
def test_levels_of_log_records(worker: Worker, written: bytes, level: str, text: str) -> None:
    os.write(worker.stderr, written)
    worker.output.read("mine", 0.0)
    assert worker.lines() == [(level, text)]


def test_a_level_on_stdout_is_text(worker: Worker) -> None:
    os.write(worker.stdout, b"<3>not a record\n")
    worker.output.read("mine", 0.0)
    assert worker.lines() == [("stdout", "<3>not a record")]


def test_hostile_bytes_are_one_clean_line(worker: Worker) -> None:
    os.write(worker.stderr, b"<4>\x1b]0;own\x07\xff\xfe [b]x[/b]\t\x00\n")
    worker.output.read("mine", 0.0)
    assert worker.lines() == [("warning", "␛]0;own␇\ufffd\ufffd [b]x[/b]␉␀")]


def test_a_line_without_end_takes_no_memory(worker: Worker) -> None:
    for _ in range(5):
        os.write(worker.stdout, b"x" * (MAX_LINE_BYTES + 1))
        worker.output.read("mine", 0.0)
    assert [len(text) for _, text in worker.lines()] == [500] * 5


def test_a_flood_is_counted_and_what_comes_after_it_is_kept(worker: Worker) -> None:
    flood = MAX_LINES + 4000
    for at in range(0, flood, 1000):
        os.write(worker.stdout, b"".join(b"line %d\n" % number for number in range(at, at + 1000)))
        worker.output.read("mine", 0.05)
    assert worker.log.left_out == 4000
    worker.output.read("mine", 20.0)
    os.write(worker.stdout, b"calm again\n")
    worker.output.read("mine", 20.1)
    told = f"prints too much: 4000 lines were left out (more than {LINES_PER_S:.0f} a second)"
    assert worker.lines()[-2:] == [("station", told), ("stdout", "calm again")]
    assert worker.lines()[MAX_LINES - 1] == ("stdout", f"line {MAX_LINES - 1}")
