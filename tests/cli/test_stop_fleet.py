"""`tui-gcs hold`, `return` and `land`: stops from a shell, on a scripted station and on a real one."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.rigs.captured_command import CapturedCommand
from tests.rigs.console_pty import PtyConsole
from tests.rigs.own_station import Watcher, processes, station_in, until
from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.cli import stop_fleet
from tui_gcs.cli.main import main
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import BusSession, MemoryBus
from tui_gcs.core.protocol.common import Freshness, Hold, Phase, Return
from tui_gcs.core.protocol.flight import Land
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"


class Shell(CapturedCommand):
    """Runs a stop in this process against a station on paper; its time passes while the command waits."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.station = FakeStation(MemoryBus())
        self.station.fly()
        super().__init__(capsys)
        monkeypatch.setattr(stop_fleet, "which", lambda named: RunKind.SIM)
        monkeypatch.setattr(stop_fleet, "join", lambda kind: BusSession(self.station.bus))
        # Not time.monotonic itself: asyncio waits by it.
        clock = SimpleNamespace(sleep=self.station.tick, monotonic=lambda: self.station.t_s)
        monkeypatch.setattr(stop_fleet, "time", clock)
        monkeypatch.setattr(sys, "stdin", None)  # a stop never asks


@pytest.fixture
def shell(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Shell:
    return Shell(monkeypatch, capsys)


def test_a_stop_without_vehicles_is_for_all(shell: Shell) -> None:
    code, out, _ = shell.run("hold")
    assert code == 0
    assert out.splitlines() == [f"vehicle {v}: done" for v in range(1, 9)]
    assert shell.station.commands() == [Hold()]


def test_a_stop_of_named_vehicles_is_for_these(shell: Shell) -> None:
    code, report = shell.report("return", "1-2", "5")
    assert code == 0 and report["ok"]
    assert [entry["vehicle"] for entry in report["vehicles"]] == [1, 2, 5]
    assert shell.station.commands() == [Return(vehicles=(1, 2, 5))]


def test_it_is_ordered_by_its_number_like_a_console_s_stop(shell: Shell) -> None:
    shell.run("hold")
    (request,) = [r for r in shell.station.requests if isinstance(r, Hold)]
    assert request.given_ns > 0


def test_one_that_refuses_is_named_and_the_exit_code_is_1(shell: Shell) -> None:
    shell.station.refuse = (3,)
    code, report = shell.report("hold")
    assert code == 1 and not report["ok"] and report["code"] == "refused"
    assert [e["vehicle"] for e in report["vehicles"] if not e["ok"]] == [3]


def test_one_that_telemetry_does_not_show_is_no_success(shell: Shell) -> None:
    """The station accepts at once; whether it came about only telemetry shows. A lost one shows nothing."""
    shell.station.changes[2] = {"velocity_m_s": (8.0, 0.0, 0.0)}
    shell.station.changes[4] = {"freshness": Freshness.LOST}
    code, report = shell.report("hold")
    assert code == 1 and report["code"] == "not seen"
    assert [e["vehicle"] for e in report["vehicles"] if not e["ok"]] == [2, 4]
    assert "telemetry does not show it within 15 s" in report["vehicles"][1]["text"]


def test_one_that_stood_still_before_is_no_success_until_its_hold_is_confirmed(shell: Shell) -> None:
    """A vehicle that hears nothing and stands still looks as one that obeys: the station knows that it does not."""
    shell.station.changes[5] = {"stop_pending": True}
    code, report = shell.report("hold")
    assert code == 1 and report["code"] == "not seen"
    assert [e["vehicle"] for e in report["vehicles"] if not e["ok"]] == [5]
    assert report["vehicles"][4]["text"].startswith("asked, not confirmed")


def test_landing_is_seen_by_the_descent_and_not_by_what_the_station_wants(shell: Shell) -> None:
    shell.station.changes = {
        v: {"phase": Phase.LANDING, "velocity_m_s": (0.0, 0.0, -1.0 if v != 6 else 0.0)} for v in range(1, 9)
    }
    code, report = shell.report("land")
    assert code == 1 and [e["vehicle"] for e in report["vehicles"] if not e["ok"]] == [6]
    assert shell.station.commands() == [Land()]


def test_a_station_that_does_not_answer_is_no_success(shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    shell.station.silent = True
    monkeypatch.setattr(stop_fleet, "TRIES_OVER_RESTART", 1)
    code, out, err = shell.run("hold", "--json")
    report = json.loads(out)
    assert code == 2 and report["code"] == "no answer" and report["vehicles"] == []
    assert "may still carry this out" in err and len(err.splitlines()) == 1


def test_the_report_goes_to_a_file_too(shell: Shell, tmp_path: Path) -> None:
    code, out, _ = shell.run("hold", "2", "--output", str(tmp_path / "stop.json"))
    assert code == 0 and out == "vehicle 2: done\n"
    assert json.loads((tmp_path / "stop.json").read_text())["vehicles"][0]["vehicle"] == 2


@pytest.mark.parametrize("words", [("hold", "all"), ("land", "0"), ("return", "7-3")])
def test_a_wrong_name_stops_nothing(shell: Shell, words: tuple[str, ...]) -> None:
    code, _, err = shell.run(*words)
    assert code == 2 and len(err.splitlines()) == 1 and shell.station.requests == []


def test_no_station_is_exit_code_2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    assert main(["hold", "--json"]) == 2
    out, err = capsys.readouterr()
    assert "no station runs" in err and json.loads(out)["code"] == "cannot run"


# ---------------------------------------------------------------- processes


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watcher]:
    vehicles = spec_of(load(SCENARIO), autopilots="mixed")
    with station_in(
        tmp_path_factory.mktemp("r"),
        lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], LaunchOptions(vehicles)),
    ) as watcher:
        yield watcher


def stop(*words: str) -> tuple[int, dict]:
    done = subprocess.run(
        [sys.executable, "-m", "tui_gcs", *words, "--json"], capture_output=True, text=True, check=False, timeout=60
    )
    return done.returncode, json.loads(done.stdout)


def obeying(what: str) -> set[int]:
    return {entry["vehicle"] for entry in stop(what)[1]["vehicles"] if entry["ok"]}


@pytest.mark.process
@pytest.mark.long
def test_a_fleet_whose_console_was_killed_obeys_a_shell(fleet: Watcher) -> None:
    """ArduCopters and PX4s in turn: hold all, land two, land all; a station that is killed meanwhile comes back."""
    until(lambda: fleet.status is not None and fleet.status.heard == 8, 40, "8 vehicles heard")
    until(lambda: fleet.ask(m.Start(vehicles=tuple(range(1, 9)))).ok, 40, "vehicles ready")
    console = PtyConsole(["attach"])
    assert console.wait_for(b"8/8", 15)
    until(lambda: fleet.phases() == {Phase.FLYING}, 60, "all fly")
    console.kill()
    code, report = stop("hold")
    assert (code, report["ok"]) == (0, True)
    assert [entry["vehicle"] for entry in report["vehicles"]] == list(range(1, 9))
    assert fleet.phases() == {Phase.HOLDING}
    code, report = stop("land", "2-3")
    assert code == 0 and [e["vehicle"] for e in report["vehicles"]] == [2, 3]
    for pid in processes("tui_gcs.core.process.station_process"):
        os.kill(pid, signal.SIGKILL)
    # A station that comes back answers before it has heard a vehicle: exit code 1, nobody in the air, send it again.
    until(lambda: {1, 4, 5, 6, 7, 8} <= obeying("land"), 40, "all obey a landing")
    until(lambda: fleet.phases() <= {Phase.LANDING, Phase.GROUND}, 10, "all land")
