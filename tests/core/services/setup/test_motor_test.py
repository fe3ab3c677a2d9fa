"""Motor tests: one motor, for a moment, once, on the ground, without propellers."""

import math
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import ARDUPILOT, PX4, Fields, Peer, ServiceRig
from tui_gcs.core.services.setup.motor_test import MotorTestService
from tui_gcs.core.uplink.actions import Outcome

MOTOR_TEST, ACTUATOR_TEST = 209, 310


class Motors(Peer):
    """Looks armed while a motor turns, if it is an ArduPilot."""

    def __init__(self, autopilot: int = ARDUPILOT, result: int = 0) -> None:
        super().__init__(1, autopilot=autopilot)
        self.result = result
        self.answers["COMMAND_LONG"] = Motors.order

    def order(self, fields: Fields) -> None:
        if fields["command"] in (MOTOR_TEST, ACTUATOR_TEST):
            self.ack(fields["command"], self.result)
            if fields["command"] == MOTOR_TEST and self.result == 0:
                self.armed = fields["param4"] > 0
                self.after(fields["param4"], lambda: setattr(self, "armed", False))
        elif fields["command"] in (511, 512):
            self.ack(fields["command"])

    def orders(self) -> list[Fields]:
        return [f for f in self.got("COMMAND_LONG") if f["command"] in (MOTOR_TEST, ACTUATOR_TEST)]


def make(tmp_path: Path, peer: Motors, **how: Any) -> tuple[ServiceRig, MotorTestService]:
    rig = ServiceRig(tmp_path, peer, **how).heard()
    return rig, rig.station.services.motor_tests


def test_the_flag_is_demanded(tmp_path: Path) -> None:
    peer = Motors()
    _, motors = make(tmp_path, peer)
    assert "propellers off" in motors.start(1, 1, props_removed=False)
    assert not peer.orders() and not motors.is_testing(1)


@pytest.mark.parametrize(
    "how",
    [
        {"motor": 0},
        {"motor": 5},
        {"motor": 13},
        {"motor": 1, "throttle": 0.31},
        {"motor": 1, "throttle": 0.0},
        {"motor": 1, "throttle": -0.1},
        {"motor": 1, "throttle": math.nan},
        {"motor": 1, "seconds": 3.1},
        {"motor": 1, "seconds": 0.0},
        {"motor": 1, "seconds": math.nan},
    ],
)
def test_limits(tmp_path: Path, how: dict[str, Any]) -> None:
    peer = Motors()
    rig, motors = make(tmp_path, peer)
    assert motors.start(1, props_removed=True, **how)
    rig.run(0.5)
    assert not peer.orders()


def test_ardupilots_motor_by_number_and_percent(tmp_path: Path) -> None:
    peer = Motors()
    rig, motors = make(tmp_path, peer)
    ended: list[Outcome] = []
    assert motors.start(1, 2, props_removed=True, seconds=2.0, on_done=lambda o, why: ended.append(o)) == ""
    rig.run(0.5)
    (order,) = peer.orders()
    assert [order[f"param{i}"] for i in range(1, 6)] == [2, 0, 15, 2, 1] and ended == []
    rig.run(2.0)
    assert ended == [], "its outputs are looked at for a moment longer"
    rig.run(1.0)
    assert ended == [Outcome.CONFIRMED], "when it does not turn any more"


class Outputs(Motors):
    """Reports its outputs on request; the motor that `drives` names is on output 3."""

    def __init__(self, drives: int, autopilot: int = ARDUPILOT) -> None:
        super().__init__(autopilot)
        self.drives, self.level_us = drives, 1000
        self.answers["COMMAND_LONG"] = Outputs.order

    def order(self, fields: Fields) -> None:
        super().order(fields)
        if fields["command"] == MOTOR_TEST and fields["param1"] == self.drives:
            self.level_us = 1150
            self.after(fields["param4"], lambda: setattr(self, "level_us", 1000))
        elif fields["command"] == 512 and fields["param1"] == 36:
            levels = {f"servo{n}_raw": self.level_us if n == 3 else 1000 for n in range(1, 9)}
            self.say("SERVO_OUTPUT_RAW", time_usec=0, port=0, **levels)


@pytest.mark.parametrize(
    ("drives", "outcome", "words"),
    [
        (1, Outcome.CONFIRMED, "it drove output 3 (1000 to 1150 µs)"),
        (4, Outcome.NOT_CONFIRMED, "accepted, but no output of it was seen to move"),
    ],
)
def test_the_result_is_what_its_outputs_showed(tmp_path: Path, drives: int, outcome: Outcome, words: str) -> None:
    rig, motors = make(tmp_path, Outputs(drives))
    ended: list[tuple[Outcome, str]] = []
    assert motors.start(1, 1, props_removed=True, on_done=lambda *end: ended.append(end)) == ""
    rig.run(3.0)
    assert ended == [(outcome, words)]


def test_of_one_that_does_not_tell_its_outputs_nothing_is_claimed(tmp_path: Path) -> None:
    rig, motors = make(tmp_path, Motors())
    ended: list[str] = []
    motors.start(1, 1, props_removed=True, on_done=lambda outcome, why: ended.append(why))
    rig.run(3.0)
    assert ended == ["accepted; the vehicle reports no outputs: check whether the motor turned"]


def test_armed_by_a_motor_test_is_no_arming(tmp_path: Path) -> None:
    peer = Motors()
    rig, motors = make(tmp_path, peer)
    motors.start(1, 1, props_removed=True, seconds=3.0)
    rig.until(lambda: rig.vehicle().telemetry.armed, 3.0)
    assert motors.start(1, 2, props_removed=True) == "a motor of it is being tested"
    while motors.is_testing(1):
        rig.run(0.1)
    assert not rig.vehicle().telemetry.armed, "it is marked for as long as its heartbeat may show it"
    peer.armed = True
    rig.run(2.0)
    assert motors.start(1, 1, props_removed=True) == "it is armed"


def test_px4s_motor_as_an_actuator(tmp_path: Path) -> None:
    peer = Motors(PX4)
    rig, motors = make(tmp_path, peer)
    motors.start(1, 3, props_removed=True, throttle=0.2)
    rig.run(0.3)
    (order,) = peer.orders()
    assert order["command"] == ACTUATOR_TEST and order["param5"] == 3
    assert order["param1"] == pytest.approx(0.2) and order["param2"] == 1.0


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 5))])
def test_a_motor_never_turns_twice(tmp_path: Path, seed: int) -> None:
    peer = Motors()
    rig, motors = make(tmp_path, peer, loss=0.4, seed=seed)
    motors.start(1, 1, props_removed=True)
    rig.run(5.0)
    assert len(peer.orders()) <= 1


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_it_is_stopped_early(tmp_path: Path, autopilot: int) -> None:
    peer = Motors(autopilot)
    rig, motors = make(tmp_path, peer)
    assert motors.stop(1) == "no motor is being tested"
    motors.start(1, 1, props_removed=True, seconds=3.0)
    rig.run(0.5)
    assert motors.stop(1) == ""
    rig.run(0.5)
    last = peer.orders()[-1]
    assert math.isnan(last["param1"]) if autopilot == PX4 else (last["param3"], last["param4"]) == (0, 0)
    assert not peer.armed


def test_a_refusal_ends_it(tmp_path: Path) -> None:
    rig, motors = make(tmp_path, Motors(PX4, result=2))
    ended: list[str] = []
    motors.start(1, 1, props_removed=True, on_done=lambda outcome, why: ended.append(why))
    rig.run(2.0)
    assert ended == ["denied: is its safety switch on, or COM_MOT_TEST_EN 0?"] and not motors.is_testing(1)
