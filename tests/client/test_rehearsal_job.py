"""A rehearsal in the background: typed options, one at a time, its priority, its end."""

import os
import time
from pathlib import Path

import pytest

import tui_gcs
from tui_gcs.cli.main import command_line_parser
from tui_gcs.client.rehearsal_job import (
    FOLDER,
    LOWEST_PRIORITY,
    OPTIONS,
    RehearsalJob,
    RehearsalJobError,
    _JobFile,
    parsed_options,
)
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.records.rehearsal_store import FILE, read_rehearsals

SCENARIO = Path(tui_gcs.__file__).parent / "scenarios/swarm-challenge.toml"
pytestmark = pytest.mark.process


def test_options_are_known_words_with_a_value() -> None:
    assert parsed_options("--wind 3,1 --lose=2@60 --lose 3@90/10") == ["--wind=3,1", "--lose=2@60", "--lose=3@90/10"]
    assert parsed_options("  ") == []


@pytest.mark.parametrize("text", ["--output x", "--report=x", "other.toml", "--wind", "--wind 'a", "-h", "\x1b[2J"])
def test_other_words_are_refused_in_one_line(text: str) -> None:
    with pytest.raises(RehearsalJobError) as refused:
        parsed_options(text)
    assert "\n" not in str(refused.value) and "\x1b" not in str(refused.value)


def test_a_busy_computer_is_named() -> None:
    assert "too busy: 2.5 processes wait for each processor" in RehearsalJob(Path(), lambda: 2.5).too_busy()
    assert RehearsalJob(Path(), lambda: 2.0).too_busy() == ""


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RehearsalJobError, match="Not a directory"):
        RehearsalJob(tmp_path / "file", lambda: 0.0).start("s", "", [], [])


def wait_for_end(job: RehearsalJob, limit_s: float = 60.0) -> None:
    """The process is another one: its end is waited for."""
    until = time.monotonic() + limit_s
    while job.is_running and time.monotonic() < until:
        time.sleep(0.05)
    assert not job.is_running


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path))
    return tmp_path / RunKind.SIM.lower()


def test_a_scenario_that_cannot_be_flown_says_why(state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Other tests leave nothing to a process of lowest priority.
    monkeypatch.setattr("tui_gcs.client.rehearsal_job.LOWEST_PRIORITY", 0)
    job = RehearsalJob(state, lambda: 0.0)
    job.start("mine", "this is [no scenario", [], [])
    wait_for_end(job)
    found = job.look()
    assert found is not None and not found.running and "scenario.toml" in found.text


def test_it_runs_alone_at_the_lowest_priority_and_another_console_cancels_it(state: Path) -> None:
    job, elsewhere = RehearsalJob(state, lambda: 0.0), RehearsalJob(state, lambda: 0.0)
    job.start("swarm", SCENARIO.read_text(), [], [])
    with pytest.raises(RehearsalJobError, match="a rehearsal is under way"):
        elsewhere.start("swarm", SCENARIO.read_text(), [], [])
    found = elsewhere.look()
    assert found is not None and found.running
    pid = job._child.pid if job._child is not None else 0
    assert os.getpriority(os.PRIO_PROCESS, pid) == LOWEST_PRIORITY and os.getsid(pid) == pid
    assert "cancelled" in elsewhere.cancel()
    wait_for_end(job, 5.0)
    found = job.look()
    assert found is not None and found.cancelled and read_rehearsals(state / FILE) == []
    assert list(state.glob("rehearsal-*")) == [], "what it had recorded is removed"


def test_of_a_cancelled_one_only_its_own_recording_is_removed(tmp_path: Path) -> None:
    state = tmp_path / "sim"
    own, other, outside = (path / "rehearsal-20261127-184130" for path in (state, state / "x", tmp_path))
    kept = state / "rehearsal-20261127-184131"
    for made in (own, other, outside, kept, state / FOLDER):
        made.mkdir(parents=True)
    job = RehearsalJob(state)
    job._write(_JobFile(1, 0.0, "s", cancelled=True))
    # Whatever stands there: only a folder with the name of a rehearsal, directly below the state directory.
    printed = [f"recording: {own}", f"recording: {tmp_path}/..", "recording: keys", f"report: {kept}/report.html"]
    (state / FOLDER / "output.txt").write_text("\n".join(printed))
    found = job.look()
    assert found is not None and found.cancelled and not found.running
    assert not own.exists() and other.exists() and outside.exists() and kept.exists()


def test_a_killed_process_has_no_reason_and_a_fault_of_the_program_has_its_last_line(tmp_path: Path) -> None:
    job = RehearsalJob(tmp_path)
    (tmp_path / FOLDER).mkdir()
    job._write(_JobFile(1, 0.0, "s"))
    progress = tmp_path / FOLDER / "progress.txt"
    bar = "[####......]  40% round 1  T+24 s  armed 2\n"
    for printed, reason in [
        (bar, ""),
        (bar + 'Traceback (most recent call last):\n  File "x"\nMemoryError\n', "MemoryError"),
        (bar + "tui-gcs: disk is full\n" + "Exception ignored in: <x>\n", "disk is full"),
    ]:
        progress.write_text(printed)
        found = job.look()
        assert found is not None and (found.text, found.done) == (reason, 0.4)
    progress.write_text("tui-gcs: x.html: cannot be written (No space left on device); the result is as printed above")
    (tmp_path / FOLDER / "output.txt").write_text("recording: x\n\n15 of 16 checks hold\n411 s simulated in 74 s\n")
    found = job.look()
    assert found is not None and found.result == "15 of 16 checks hold"
    assert found.text == "x.html: cannot be written (No space left on device)"


def test_every_example_of_an_option_is_one_that_the_command_takes() -> None:
    typed = " ".join(f"{name} {example}" for name, example in OPTIONS.items())
    given = command_line_parser().parse_args(["rehearse", *parsed_options(typed)])
    assert given.lose and given.drain and given.restart and given.fault and given.autopilot == "mixed"
