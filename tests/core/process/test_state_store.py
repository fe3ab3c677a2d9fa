"""What a station writes down and the next one reads, without a flight; killed in flight: test_station_restart.py."""

import json
import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tui_gcs.client import launcher
from tui_gcs.core.base.directories import EARLIER_STATE_FILE, STATE_FILE, runtime_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.flight.flights import Lost
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.core.protocol.plan_limits import MAX_LEARNT_BYTES
from tui_gcs.core.scenario.model import LinkLoss
from tui_gcs.core.station.station import Station

MakeRig = Callable[..., Rig]
KEYS = {"toml", "run", "round_index", "revision", "task_revision", "started_s", "flights"}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "memory.json"


def held(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text())
    return found


def next_station(rig: Rig, path: Path, **changed: Any) -> Station:
    """The station after this one; `changed` is written over what this one leaves."""
    StateStore(path).remember(rig.station.parts, rig.station.frontend)
    path.write_text(json.dumps(held(path) | changed))
    rig.restart_station(StateStore(path))
    return rig.station


# ---------------------------------------------------------------- who flies, and what


def test_flights_are_found_in_the_air_where_they_were_and_with_their_homes(rig: MakeRig, path: Path) -> None:
    ground = rig(3)
    one, two, _ = ground.station.flight.flights
    one.home_m, one.layer_m = (45.0, 170.0, 1.0), 33.0
    one.enter(Phase.FLYING, 5.0)
    two.enter(Phase.BY_HAND, 5.0)
    after = next_station(ground, path)
    assert [flight.phase for flight in after.flight.flights] == [Phase.TAKEN_OUT, Phase.TAKEN_OUT, Phase.GROUND]
    assert [flight.step for flight in after.flight.flights] == [Lost(None), Lost(None), None]
    assert [flight.stays for flight in after.flight.flights] == ["", "was flown by hand", ""]
    assert [flight.home_m for flight in after.flight.flights] == [(45.0, 170.0, 1.0), None, None]
    assert (after.flight.flights.by_id[1].team, after.flight.flights.by_id[1].layer_m) == ("defend", 33.0)
    assert after.flight.executive.run is RunPhase.HOLD and after.conditions.memory_lost == ""


@pytest.mark.parametrize("started_s", [math.nan, 123.5])
def test_the_clock_of_the_mission_goes_on_or_has_not_begun(rig: MakeRig, path: Path, started_s: float) -> None:
    ground = rig(1)
    ground.station.flight.executive.started_s = started_s
    after = next_station(ground, path)
    assert held(path)["started_s"] == (None if math.isnan(started_s) else started_s)
    assert after.flight.executive.started_s == pytest.approx(started_s, nan_ok=True)
    assert after.flight.executive.run is RunPhase.IDLE, "no vehicle is in the air"


@pytest.mark.parametrize(
    ("run", "resume", "resumes"),
    [
        (RunPhase.RUNNING, True, True),
        (RunPhase.STARTING, True, True),
        (RunPhase.HOLD, True, False),
        (RunPhase.RETURNING, True, False),
        (RunPhase.RUNNING, False, False),
    ],
)
def test_only_what_ran_is_resumed_and_only_if_the_scenario_says_so(
    rig: MakeRig, path: Path, run: RunPhase, resume: bool, resumes: bool
) -> None:
    ground = rig(1, mission=msgspec.structs.replace(scenario(1), link_loss=LinkLoss(resume=resume)))
    ground.station.flight.executive.run = run
    assert next_station(ground, path).flight.executive.resume_found is resumes


@pytest.mark.parametrize(("written", "found"), [(0, 0), (2, 2), (7, 2)])
def test_the_round_is_the_same_or_the_last_one_there_is(rig: MakeRig, path: Path, written: int, found: int) -> None:
    ground = rig(1)
    assert len(ground.station.active.scenario.rounds) == 3
    assert next_station(ground, path, round_index=written).active.round_index == found


def test_revisions_go_on_so_that_no_answer_to_the_last_station_is_taken(rig: MakeRig, path: Path) -> None:
    ground = rig(1)
    ground.station.active.revision, ground.station.active.task_revision = 17, 40
    after = next_station(ground, path)
    assert after.active.revision == 17 and after.active.task_revision > 40


def test_the_text_last_flown_can_be_asked_for(rig: MakeRig, path: Path) -> None:
    assert StateStore(path).toml == ""
    ground = rig(1)
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    assert StateStore(path).toml == ground.station.active.toml


# ---------------------------------------------------------------- what planners learnt


def test_what_planners_learnt_comes_back_to_each_team(rig: MakeRig, path: Path) -> None:
    ground = rig(8)
    for name, controller in ground.station.active.team_controllers.items():
        controller.learnt = name.encode() + b"\x00\xff"
    after = next_station(ground, path)
    assert {name: controller.learnt for name, controller in after.active.team_controllers.items()} == {
        "defend": b"defend\x00\xff",
        "attack": b"attack\x00\xff",
    }


@pytest.mark.parametrize(
    ("learnt", "found"),
    [
        ({"defend": "QUJD"}, b"ABC"),
        ({"defend": "QUJD!"}, b""),
        ({"defend": "QUJ"}, b""),
        ({"defend": 7}, b""),
        ({"attack": "QUJD"}, b""),
        ("QUJD", b""),
        (None, b""),
        ({"defend": "QUFB" * (MAX_LEARNT_BYTES // 3 + 1)}, b""),
        ({"defend": "QUFB" * (MAX_LEARNT_BYTES // 3)}, b"AAA" * (MAX_LEARNT_BYTES // 3)),
    ],
)
def test_what_is_damaged_of_it_is_learnt_again_and_nothing_else_is_lost(
    rig: MakeRig, path: Path, learnt: Any, found: bytes
) -> None:
    after = next_station(rig(1), path, learnt=learnt, round_index=1)
    assert (after.active.team_controllers["defend"].learnt, after.active.round_index, after.conditions.memory_lost) == (
        found,
        1,
        "",
    )


def test_what_was_cut_short_is_told_as_an_alert_in_one_harmless_line(rig: MakeRig, path: Path) -> None:
    ground = rig(1)
    next_station(ground, path, unfinished=[[1, "set X\x1b[2J = 5"]])
    (event,) = (event for event in ground.events() if "cut short" in event.text)
    assert event.text.endswith(": cut short when the station ended, it may hold a part: look, do it again")
    assert "\x1b" not in event.text and (event.source, event.severity) == ("vehicle 1", 1)


# ---------------------------------------------------------------- what is no memory


def test_without_a_file_there_was_no_last_run(rig: MakeRig, path: Path) -> None:
    memory = StateStore(path)
    assert memory.lost == ""
    ground = rig(1)
    ground.restart_station(memory)
    assert ground.station.conditions.memory_lost == ""


@pytest.mark.parametrize("missing", sorted(KEYS))
def test_a_file_of_another_version_is_said_to_be_lost(rig: MakeRig, path: Path, missing: str) -> None:
    ground = rig(1)
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    path.write_text(json.dumps({key: value for key, value in held(path).items() if key != missing}))
    memory = StateStore(path)
    assert (memory.lost, memory.toml) == ("it is not this version's", "")


@pytest.mark.parametrize(
    ("text", "why"),
    [("[]", "it is not this version's"), ("{", "it cannot be read: "), ("\ud800", "it cannot be read: ")],
)
def test_what_is_not_even_a_memory_is_said_to_be_lost(path: Path, text: str, why: str) -> None:
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    assert StateStore(path).lost.startswith(why)


@pytest.mark.parametrize(
    ("run", "lost"),
    [(RunPhase.IDLE, "why"), (RunPhase.HOLD, "why"), (RunPhase.STARTING, ""), (RunPhase.RUNNING, "")],
)
def test_a_lost_memory_is_told_until_somebody_says_how_to_go_on(
    rig: MakeRig, path: Path, run: RunPhase, lost: str
) -> None:
    ground = rig(1)
    ground.station.conditions.memory_lost, ground.station.flight.executive.run = "why", run
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    assert ground.station.conditions.memory_lost == lost


# ---------------------------------------------------------------- what cannot be written


def test_what_could_not_be_written_is_tried_again_after_two_seconds(
    rig: MakeRig, path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    ground = rig(1)
    memory = StateStore(path / "not.there")
    for step_s, tries in ((0.0, 1), (1.9, 1), (0.2, 2)):
        ground.clock.advance(step_s)
        memory.remember(ground.station.parts, ground.station.frontend)
        path.mkdir(exist_ok=True)
        assert (path / "not.there").exists() is (tries == 2)
        assert ground.station.conditions.memory_error == (
            "" if tries == 2 else f"{path / 'not.new'}: No such file or directory"
        )
    assert [record.getMessage().split(":")[0] for record in caplog.records] == ["memory of this run cannot be written"]


def test_only_what_changed_is_written_again(rig: MakeRig, path: Path) -> None:
    ground, memory = rig(1), StateStore(path)
    memory.remember(ground.station.parts, ground.station.frontend)
    path.unlink()
    memory.remember(ground.station.parts, ground.station.frontend)
    assert not path.exists()
    ground.station.flight.executive.started_s = 3.0
    memory.remember(ground.station.parts, ground.station.frontend)
    assert held(path)["started_s"] == 3.0 and list(path.parent.glob("*.new")) == []


# ---------------------------------------------------------------- after a kill of the station and its supervisor


def killed_in_round(rig: MakeRig, path: Path, index: int, *, in_the_air: bool = True) -> Rig:
    """A run whose state stays behind; its station and its supervisor are gone."""
    flight = rig(2)
    if in_the_air:
        for one in flight.station.flight.flights:
            one.enter(Phase.FLYING, 5.0)
    flight.station.active.set_round(index)
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    return flight


def started_anew(flight: Rig, earlier: Path, toml: str) -> Station:
    store = StateStore(earlier.with_name("new.json"))
    store.take_over(earlier, toml)
    flight.restart_station(store)
    return flight.station


def test_a_new_station_goes_on_in_the_round_that_the_fleet_flies(rig: MakeRig, path: Path) -> None:
    flight = killed_in_round(rig, path, 1)
    after = started_anew(flight, path, flight.station.active.toml)
    assert after.active.round_index == 1 and after.flight.flights.by_id[1].phase is Phase.TAKEN_OUT
    assert f"goes on where a station ended that was killed: in {after.active.round.name}" in flight.texts("station")


def test_under_another_scenario_it_begins_with_the_first_round_and_says_so(rig: MakeRig, path: Path) -> None:
    flight = killed_in_round(rig, path, 1)
    after = started_anew(flight, path, flight.station.active.toml + "\n# changed")
    assert after.active.round_index == 0
    assert "under another scenario" in after.conditions.memory_lost


@pytest.mark.parametrize(("in_the_air", "age_s"), [(False, 0.0), (True, 7 * 3600.0)])
def test_what_was_on_the_ground_or_long_ago_is_not_continued(
    rig: MakeRig, path: Path, in_the_air: bool, age_s: float
) -> None:
    flight = killed_in_round(rig, path, 1, in_the_air=in_the_air)
    os.utime(path, (time.time() - age_s,) * 2)
    after = started_anew(flight, path, flight.station.active.toml)
    assert after.active.round_index == 0 and after.conditions.memory_lost == ""


@pytest.mark.parametrize("left", ["{", "[1]", json.dumps({"flights": 7}), json.dumps({"toml": "x", "flights": [1]})])
def test_what_is_damaged_is_reported_or_ignored(rig: MakeRig, path: Path, left: str) -> None:
    path.write_text(left)
    after = started_anew(rig(1), path, "x")
    assert after.active.round_index == 0 and after.conditions.memory_lost


def test_a_launch_keeps_what_a_killed_supervisor_left(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setattr(launcher.subprocess, "Popen", lambda *_, **__: None)
    directory = runtime_dir(RunKind.SIM)
    (directory / STATE_FILE).write_text("left")
    launcher.launch(RunKind.SIM, "a.toml", "text", [])
    assert (directory / EARLIER_STATE_FILE).read_text() == "left" and not (directory / STATE_FILE).exists()
    (directory / STATE_FILE).write_text("of our own vehicles, which ended with it")
    launcher.launch(RunKind.SIM, "a.toml", "text", [], launcher.LaunchOptions(sim_spec={"seed": 1}))
    assert not (directory / EARLIER_STATE_FILE).exists() and not (directory / STATE_FILE).exists()
