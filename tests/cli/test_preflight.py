"""`tui-gcs preflight`, and what `run` and `rehearse` have to do with it."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario, toml
from tui_gcs.cli import preflight, rehearse
from tui_gcs.cli.main import main
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.mission_script import Script, Step
from tui_gcs.core.judging.result_check import ResultCheck
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.preflight import Check, CheckState
from tui_gcs.core.records.rehearsal_store import FILE, RehearsalStore, plan_digest
from tui_gcs.core.scenario.model import Scenario

OPTIONS = argparse.Namespace(
    kind=None, json=False, output=None, read_again=False, acknowledge=[], tick=[], sign=False, operator="Ada"
)


class RigBus:
    """The bus of a rig, whose time goes on with every question."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig

    def ask(self, key: str, payload: bytes, timeout_s: float = 0.0) -> bytes:
        self.rig.run(0.5)
        return self.rig.bus.ask(key, payload)

    def close(self) -> None:
        pass


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    """A LIVE station with two vehicles, and the command on its bus."""
    rig = Rig(scenario(2), toml(), tmp_path)
    rig.station.config.kind, rig.station.config.token = RunKind.LIVE, ""
    rig.restart_station(StateStore(tmp_path / "none.json"))
    rig.ready()
    monkeypatch.setattr(preflight, "which", lambda kind: RunKind.LIVE)
    monkeypatch.setattr(preflight, "join", lambda kind: RigBus(rig))
    monkeypatch.setattr(preflight.time, "sleep", lambda seconds: None)
    yield rig
    rig.close()


def said(arguments: argparse.Namespace, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    code = preflight.run(arguments)
    return code, " ".join(capsys.readouterr().out.split())


def test_the_list_is_read_from_the_vehicles_and_the_exit_code_says_whether_it_refuses(
    rig: Rig, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out = said(OPTIONS, capsys)
    assert code == 1
    assert "FAIL station-loss vehicles 1-2: this station is not heard: NOTHING (FS_GCS_ENABLE 0)" in out
    assert "FAIL rehearsal: this plan was not rehearsed" in out
    assert "unknown" not in out


def test_failsafes_are_acknowledged_and_the_list_is_signed_from_a_script(
    rig: Rig, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    accepted = ["station-loss", "battery-loss", "fence-cross"]
    code, out = said(argparse.Namespace(**{**vars(OPTIONS), "acknowledge": accepted}), capsys)
    assert code == 1 and "ACKNOWLEDGED station-loss vehicles 1-2" in out
    monkeypatch.setattr(
        "tui_gcs.core.preflight.fleet_checks.rehearsal", lambda *_: Check("rehearsal", CheckState.OK, "passed")
    )
    code, out = said(argparse.Namespace(**{**vars(OPTIONS), "sign": True}), capsys)
    assert code == 0 and "sign-off" in out.partition("OK ")[2]


def test_items_of_the_checklist_are_ticked_from_a_script(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    active = rig.station.active
    active.scenario = msgspec.structs.replace(active.scenario, checklist=("props tight", "props whole", "area clear"))
    _, out = said(argparse.Namespace(**{**vars(OPTIONS), "tick": ["area", "props tight"]}), capsys)
    assert "FAIL checklist: props whole" in out
    assert "TICKED checklist: area clear -> ticked by Ada at " in out
    for wrong, why in (("props", "is the beginning of several"), ("x", "is no item of the checklist; there are: ")):
        with pytest.raises(preflight.CommandError, match=why):
            preflight.run(argparse.Namespace(**{**vars(OPTIONS), "tick": [wrong]}))


def test_what_cannot_be_acknowledged_or_overridden_is_one_line(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(preflight.CommandError, match="what can be acknowledged: station-loss"):
        preflight.run(argparse.Namespace(**{**vars(OPTIONS), "acknowledge": ["rehearsal"]}))
    assert main(["run", "none.toml", "--override", "battery"]) == 2
    assert "no check that can be overridden; these can: station-loss" in capsys.readouterr().err


# ---------------------------------------------------------------- run


def refused(checks: Sequence[Check], insists: bool, seconds: int) -> tuple[Script, list[m.Start]]:
    """A script whose starts are refused by what it does not override; what it asked for in so many seconds."""
    bus, asked = MemoryBus(), []

    def answer(_key: str, payload: bytes, reply: Callable[[bytes], None]) -> None:
        asked.append(m.decode(payload, m.Start))
        stopping = tuple(check for check in checks if check.name not in asked[-1].overrides)
        reply(m.encode(m.Reply(ok=not stopping, text="not started: so and so", refused_by=stopping)))

    bus.answer(keys.REQUEST.format(principal="*"), answer)
    script = Script(
        scenario(1),
        bus,
        principal="run",
        whole_duration=True,
        operator="Ada",
        overrides=("fence",),
        insists=insists,
    )
    team = m.TeamStatus("defend", "home", "defend", "patrol", (1,), "ready", 0, 5, 0, 0, 0, 0, 0, 0, 0, 0)
    for t_s in range(seconds):
        script.on_status(
            m.StationStatus(t_s, 0.0, 0.0, RunKind.LIVE, "it", 1, m.RunPhase.IDLE, 0, ("r",), 0.0, 1, 1, 0, "", (team,))
        )
        script.on_frame(msgspec.structs.replace(_frame(), t_s=float(t_s)))
        script.tick()
        if script.step is not Step.WAIT:
            break
    return script, asked


NOT_REHEARSED = Check("rehearsal", CheckState.FAIL, "this plan was not rehearsed")
NOT_READ = Check("battery-loss", CheckState.UNKNOWN, "not read yet", vehicles=(1,))


def test_a_run_that_is_refused_for_what_does_not_heal_ends_at_once_and_says_what_helps() -> None:
    script, asked = refused([NOT_REHEARSED], insists=False, seconds=1)
    assert script.done and "--override rehearsal" in script.problem
    assert asked == [m.Start((1,), overrides=("fence",), operator="Ada")]


def test_a_run_whose_command_line_is_the_order_overrides_by_name_and_tells() -> None:
    script, asked = refused([NOT_REHEARSED], insists=True, seconds=2)
    assert script.step is Step.TAKE_OFF and script.overridden == (NOT_REHEARSED,)
    assert asked[-1] == m.Start((1,), overrides=("fence", "rehearsal"), operator="Ada")


def test_what_is_being_read_of_the_vehicles_is_waited_for_before_it_is_overridden() -> None:
    script, _ = refused([NOT_READ], insists=True, seconds=15)
    assert script.step is Step.WAIT and not script.overridden
    script, _ = refused([NOT_READ], insists=True, seconds=30)
    assert script.step is Step.TAKE_OFF and script.overridden == (NOT_READ,)


def _frame() -> m.FleetFrame:
    """One vehicle that is heard, with a fix."""
    from tests.screens.rigs.fake_station import FakeStation

    return FakeStation(MemoryBus(), count=1).frame()


# ---------------------------------------------------------------- rehearse


@pytest.mark.parametrize("good", [True, False])
def test_a_rehearsal_leaves_a_record_that_is_found_by_its_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, good: bool
) -> None:
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path))
    result = FlightResult("it", 42, [ResultCheck("all", good, 1.0, 1.0)], [])
    options = argparse.Namespace(
        lose=["3@120"],
        drain=[],
        restart=[200.0],
        autopilot=None,
        scenario="it.toml",
        planner=[],
        set=[],
        vehicles=None,
        instances=None,
        wind="3,0",
        gps_noise=None,
        fault="",
        intruders=None,
        sensor=None,
        report=None,
    )
    rehearse._remember("it", plan_digest(scenario(), {}), result, "", options, "flown")
    found = RehearsalStore(tmp_path / "sim" / FILE).newest(plan_digest(scenario(), {}))
    assert found is not None and found.passed is good and found.folder == "flown"
    assert found.conditions == "--lose 3@120, --restart 200, wind, m/s east,north 3,0"
    other = msgspec.structs.replace(scenario(), seed=7)
    assert RehearsalStore(tmp_path / "sim" / FILE).newest(plan_digest(other, {})) is None


@pytest.mark.parametrize("option", ["--output", "--report"])
def test_a_full_disk_takes_neither_the_result_nor_its_record(
    option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`/dev/full` can be opened, and every write fails as on a disk that has filled up during the flight."""

    def flown(mission: Scenario, *_: object, watch: Callable[[object, object], None], **__: object) -> object:
        watch(MemoryBus(), None)
        return FlightResult(mission.name, mission.seed, [ResultCheck("all", True, 1.0, 1.0)], []), ""

    monkeypatch.setattr("tui_gcs.cli.lock_step_run.rehearse", flown)
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path))
    other = {"--output": "--report", "--report": "--output"}[option]
    assert main(["rehearse", option, "/dev/full", other, str(tmp_path / "other")]) == 2
    out, err = capsys.readouterr()
    assert "1 of 1 checks hold" in out
    assert err.splitlines()[-1].startswith("tui-gcs: /dev/full: cannot be written (No space left on device)")
    assert (tmp_path / "other").stat().st_size > 100, "what can be written is"
    assert list((tmp_path / "sim").glob(FILE)), "a LIVE start knows of it"
