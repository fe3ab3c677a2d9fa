"""Our simulator's personalities meet the same checks that real autopilots do, in lock-step. And the runner's own tests.

An ArduCopter and a PX4 are judged at the same time, as a fleet is.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conformance import __main__ as program
from tests.conformance import checks
from tests.conformance.borrow import borrow, put, read
from tests.conformance.field import Failed, Field, NotApplicable, simulated_field
from tests.conformance.pilot import Pilot, flying
from tests.conformance.report import CHECKS, Check, Line, Run, as_json, chosen, summary
from tests.conformance.turns import Turns

checks.load()
pytestmark = [pytest.mark.xdist_group("conformance"), pytest.mark.long]
ARDUPILOT, PX4 = 1, 2


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Field]:
    field = simulated_field(("ardupilot", "px4"), tmp_path_factory.mktemp("conformance"))
    field.discover(60.0, print)
    yield field
    field.close()


def run_one(field: Field, entry: Check, *ids: int) -> list[Line]:
    return Run(field, [entry], print).one(entry, ids or (field.ids[:1] if entry.fleet else field.ids))


@pytest.mark.parametrize("entry", CHECKS, ids=[entry.name for entry in CHECKS])
def test_check(field: Field, entry: Check) -> None:
    lines = run_one(field, entry)
    assert not [str(line) for line in lines if line.verdict == "FAIL"]
    assert max(line.took_s for line in lines) < 1.5 * entry.takes_s + 5.0, "what is said of its length is wrong"


def test_a_gimbal_and_a_camera_are_judged_where_there_are_any(field: Field) -> None:
    entries = [entry for entry in CHECKS if entry.name.startswith(("gimbal", "camera"))]
    for system, params in {
        ARDUPILOT: ("MNT1_TYPE", 1, "CAM1_TYPE", 1),
        PX4: ("MNT_MODE_IN", 4, "TRIG_MODE", 1),
    }.items():
        gimbal, gimbal_on, camera, camera_on = params
        was = [read(field, system, name) for name in (gimbal, camera)]
        put(field, system, gimbal, gimbal_on)
        put(field, system, camera, camera_on)
        texts = [line.text for entry in entries for line in run_one(field, entry, system)]
        assert texts == ["it is at pitch -30, yaw 20 from the nose", "the camera reported the picture"]
        for name, value in zip((gimbal, camera), was, strict=True):
            put(field, system, name, value)


def test_a_check_that_fails_in_the_air_leaves_everything_as_it_was(field: Field) -> None:
    before = read(field, ARDUPILOT, "RTL_ALT")

    def body(field: Field, vehicle: int) -> str:
        borrow(field, vehicle, {"RTL_ALT": before + 700.0})
        with flying(field, vehicle):
            raise Failed("on purpose")

    (line,) = run_one(field, Check("fails", body, 60.0), ARDUPILOT)
    assert (line.verdict, line.text) == ("FAIL", "on purpose")
    assert not field.vehicle(ARDUPILOT).telemetry.armed
    assert read(field, ARDUPILOT, "RTL_ALT") == before


def test_a_check_that_never_ends_is_ended_and_cleaned_up(field: Field) -> None:
    def body(field: Field, vehicle: int) -> str:
        with flying(field, vehicle):
            field.run(1e9)
        return "never"

    (line,) = run_one(field, Check("endless", body, 1.0), PX4)
    assert line.verdict == "FAIL" and "not over after 90 s" in line.text
    assert not field.vehicle(PX4).telemetry.armed


def test_a_fault_of_a_check_is_one_line(field: Field) -> None:
    def body(field: Field, vehicle: int) -> str:
        return str(1 // 0)

    (line,) = run_one(field, Check("faulty", body, 1.0), PX4)
    assert line.verdict == "FAIL" and "ZeroDivisionError" in line.text and "\n" not in str(line)


def test_a_vehicle_that_cannot_be_judged_does_not_hinder_the_other(field: Field) -> None:
    def body(field: Field, vehicle: int) -> str:
        if vehicle == ARDUPILOT:
            raise NotApplicable("not for it")
        field.run(3.0)
        return "well"

    lines = run_one(field, Check("mixed", body, 1.0))
    assert {(line.vehicle, line.verdict) for line in lines} == {(ARDUPILOT, "N/A"), (PX4, "PASS")}


def test_stopping_lands_what_flies_and_makes_no_further_checks(field: Field) -> None:
    reported: list[Line] = []

    def body(field: Field, vehicle: int) -> str:
        with flying(field, vehicle):
            field.turns.stopping = True
            field.run(30.0)
        return "not reached"

    entry = Check("stopped", body, 60.0)
    lines = Run(field, [entry, entry], reported.append).all()
    field.turns.stopping = False
    assert [line.verdict for line in lines] == ["FAIL", "FAIL"] and "stopped by the operator" in lines[0].text
    assert not any(field.vehicle(system).telemetry.armed for system in field.ids)


def test_a_vehicle_that_does_not_hear_us_hears_us_again(field: Field) -> None:
    pilot = Pilot(field, ARDUPILOT)
    with field.unheard(ARDUPILOT), pytest.raises(Failed, match="no answer"):
        pilot.must(pilot.firmware.arm(pilot.vehicle, pilot.done))
    field.run(20.0)
    assert pilot.armed() < 2.0
    pilot.down()


def test_it_waits_with_a_message_for_vehicles_that_are_not_ready(
    field: Field, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ready_s = field.clock.now() + 25.0
    monkeypatch.setattr(program, "_could_start", lambda pilot: pilot.system == PX4 or field.clock.now() > ready_s)
    program._wait_until_ready(field)
    reported = capsys.readouterr().out.splitlines()
    assert len(reported) == 2 and all(line.startswith("---- waiting: vehicle 1: ") for line in reported)
    assert field.clock.now() == pytest.approx(ready_s, abs=1.0)


def test_bodies_take_turns_and_time_passes_for_all_of_them() -> None:
    moves: list[int] = []
    turns = Turns(lambda: moves.append(1), lambda: float(len(moves)))
    said: list[str] = []

    def body(name: str, waits: int) -> None:
        for _ in range(waits):
            said.append(f"{name}{len(moves)}")
            turns.wait()

    turns.together([lambda: body("a", 3), lambda: body("b", 2)])
    assert said == ["a0", "b0", "a1", "b1", "a2"] and len(moves) == 3


def test_a_broken_body_is_not_swallowed() -> None:
    turns = Turns(lambda: None, lambda: 0.0)
    with pytest.raises(KeyError):
        turns.together([lambda: {}["x"]])


@pytest.mark.parametrize(("text", "ids"), [("1-3,7", (1, 2, 3, 7)), ("5", (5,)), ("2,1,2", (2, 1))])
def test_ids(text: str, ids: tuple[int, ...]) -> None:
    assert program.ids_of(text) == ids


@pytest.mark.parametrize("text", ["", "a", "0-3", "250-260", "1,,2", "-4"])
def test_wrong_ids_are_one_line(text: str) -> None:
    with pytest.raises(ValueError, match="--ids"):
        program.ids_of(text)


def test_checks_are_chosen_by_word_and_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert {entry.name for entry in chosen(["FENCE: two"])} == {"fence: two corners are no fence"}
    assert program.main(["--list", "rally"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "rally: round trip  (5 s)",
        "fence and rally: more than fit  (10 s)",
    ]
    assert program.main(["no such check"]) == 2


def test_vehicles_on_a_real_network_have_to_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert program.main(["--link", "udpin:0.0.0.0:15399"]) == 2
    assert "name the vehicles" in capsys.readouterr().err


def test_the_result_is_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert program.main(["--sim", "px4", "--json", str(tmp_path / "r.json"), "discovery: identity"]) == 0
    result = json.loads((tmp_path / "r.json").read_text())
    assert result["counts"] == {"PASS": 1, "FAIL": 0, "N/A": 0}
    assert result["lines"][0]["name"] == "discovery: identity"
    assert result["vehicles"][0]["firmware"] == "PX4"


def test_what_failed_is_said_again_in_the_end() -> None:
    lines = [Line("PASS", "a", 1, "x"), Line("FAIL", "b", 2, "expected 3, measured 4")]
    assert "expected 3, measured 4" in summary(lines)
    assert summary(lines).endswith("1 passed, 1 failed, 0 not applicable")
    assert json.loads(as_json(lines, [], 1.0))["counts"]["FAIL"] == 1
