"""ArduCopter's calibration dialogues and motor test: PREFLIGHT_CALIBRATION, ACCELCAL_VEHICLE_POS, DO_START_MAG_CAL.

Handlers acknowledge by themselves, often later. Times and texts were measured on ArduCopter 4.7.
"""

import math
from collections.abc import Callable
from typing import Any

from sitl.common.autopilot import Autopilot, Command
from sitl.common.states import Severity
from sitl.common.tasks import Task
from sitl.links.wire import Received
from sitl.services.calibration import REBOOT_ACCELS, REBOOT_COMPASS, Compass

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = range(6)

MOTOR_TEST, PREFLIGHT_CALIBRATION, PREFLIGHT_STORAGE = 209, 241, 245
START_MAG_CAL, ACCEPT_MAG_CAL, CANCEL_MAG_CAL, FIXED_MAG_CAL_YAW, VEHICLE_POS = 42424, 42425, 42426, 42006, 42429
POSES = 6
"""Level, left, right, nose down, nose up, back."""
SUCCESS, FAILURE = 16_777_215, 16_777_216
"""Positions that are told when it is over: every second until the next boot."""
POSE_EVERY_US = 1_050_000
SAMPLE_US = 600_000
INITIALISING_US, GYRO_US = 30_000, 500_000
BARO_US = 750_000
LEVEL_US = 1_080_000
SIMPLE_US = 1_040_000
ACCEL_PAUSE_US = 5_000_000
UNHEALTHY_US = 3_000_000
COMPASSMOT_US = 5_000_000
THREE_COMPASSES_US, ONE_COMPASS_US = 48_900_000, 39_000_000
COMPASSES = 3
ACCEPT_STORED = 76
MAX_MOTOR_TEST_S = 600.0
MOTOR_OUTPUTS: dict[float, int] = {1: 3, 2: 1, 3: 4, 4: 2}
"""Motors of a test are counted clockwise from the front; 1 and 4 measured on a quadrotor "+", 5 and 9 drive nothing."""

_ACCEL = "accelerometer calibration"


class Asked:
    """A command, and who gave it."""

    def __init__(self, ap: Autopilot, command: Command, system: int, component: int) -> None:
        self.ap, self.command, self.system, self.component = ap, command, system, component

    def answer(self, result: int) -> None:
        """Acknowledge."""
        self.ap.acknowledge(self.command.number, result, self.system, self.component)

    def later(self, wait_us: int, *texts: tuple[Severity, str]) -> None:
        """Acknowledge after a while, then say something."""

        def act() -> None:
            self.answer(ACCEPTED)
            for severity, text in texts:
                self.ap.text(severity, text)

        self.ap.tasks.after("calibration", wait_us, act, self.ap.now_us)

    def initialise(self) -> None:
        """Gyros are calibrated with everything: that is said first."""
        say = self.ap.text
        self.ap.tasks.after(
            "initialising", INITIALISING_US, lambda: say(Severity.INFO, "Initialising ArduPilot"), self.ap.now_us
        )


def _calibrate(asked: Asked) -> None:
    ap, p, state = asked.ap, asked.command.p, asked.ap.stores.calibration
    if ap.armed or state.compassmot:
        asked.answer(FAILED)
        ap.text(Severity.NOTICE, "Disarm to allow calibration")
    elif p[4] == 1:
        asked.initialise()
        asked.later(GYRO_US)
        ap.tasks.after(_ACCEL, GYRO_US + 20_000, lambda: _begin_poses(ap), ap.now_us)
    elif p[4] == 2:
        _accels_done(ap)
        asked.initialise()
        asked.later(LEVEL_US, (Severity.INFO, "Trim OK: roll=0.00 pitch=-0.00 yaw=0.00"))
    elif p[4] == 4:
        if state.accels_us is not None and ap.now_us - state.accels_us < ACCEL_PAUSE_US:
            asked.answer(TEMPORARILY_REJECTED)
            return
        _accels_done(ap)
        asked.later(SIMPLE_US)
    elif ACCEPT_STORED in (p[4], p[1]):
        asked.answer(ACCEPTED)
    elif p[0] == 1:
        asked.initialise()
        asked.later(GYRO_US)
    elif p[2] == 1:
        asked.answer(IN_PROGRESS)
        ap.text(Severity.INFO, "Updating barometer calibration")
        ap.text(Severity.INFO, "Barometer calibration complete")
        asked.later(BARO_US)
    elif p[5] == 1:
        _compassmot(ap)
    else:
        asked.answer(UNSUPPORTED)


def _accels_done(ap: Autopilot) -> None:
    ap.stores.calibration.accels_us = ap.now_us
    ap.stores.calibration.unhealthy_until_us = ap.now_us + UNHEALTHY_US


# Accelerometers, six poses


def _begin_poses(ap: Autopilot) -> None:
    state = ap.stores.calibration
    if state.pose == 0 or state.pose > POSES:
        state.pose = 1
        ap.text(Severity.CRITICAL, "Place vehicle level and press any key.")
    ap.tasks.start(_ACCEL, _tell_pose(ap), ap.now_us)


def _tell_pose(ap: Autopilot) -> Task:
    while True:
        ap.send("COMMAND_LONG", command=VEHICLE_POS, param1=float(ap.stores.calibration.pose))
        yield POSE_EVERY_US


def _pose(asked: Asked) -> None:
    """The operator says that it lies as asked."""
    ap, state = asked.ap, asked.ap.stores.calibration
    if not 1 <= state.pose <= POSES or asked.command.p[0] != state.pose:
        asked.answer(FAILED)
        return
    asked.answer(ACCEPTED)
    if state.pose_stuck and state.pose > 1:
        _end_poses(ap, FAILURE)
    else:
        ap.tasks.after(_ACCEL, SAMPLE_US, lambda: _next_pose(ap), ap.now_us)


def _next_pose(ap: Autopilot) -> None:
    state = ap.stores.calibration
    state.pose += 1
    if state.pose > POSES:
        _end_poses(ap, SUCCESS)
    else:
        ap.tasks.start(_ACCEL, _tell_pose(ap), ap.now_us)


def _end_poses(ap: Autopilot, outcome: int) -> None:
    """Said every second until the next boot."""
    state = ap.stores.calibration
    state.pose = outcome
    state.accels_us = ap.now_us
    if outcome == SUCCESS:
        ap.text(Severity.INFO, "Trim OK: roll=-0.00 pitch=-0.00 yaw=0.00")
        ap.text(Severity.CRITICAL, "Calibration successful")
        state.problems.add(REBOOT_ACCELS)
    else:
        ap.text(Severity.CRITICAL, "Calibration FAILED")
        state.problems.add("3D Accel calibration needed")
    ap.tasks.start(_ACCEL, _tell_pose(ap), ap.now_us)


# Compasses


def _start_compasses(asked: Asked) -> None:
    """Mask 0 is all. Progress and reports are streams that have to be asked for."""
    ap, state = asked.ap, asked.ap.stores.calibration
    if ap.armed or state.compassmot:
        asked.answer(FAILED)
        ap.text(Severity.NOTICE, "Disarm to allow compass calibration")
        return
    asked.answer(ACCEPTED)
    if any(not compass.done(ap.now_us) for compass in state.compasses):
        return
    mask = int(asked.command.p[0]) if math.isfinite(asked.command.p[0]) else 0
    chosen = [n for n in range(COMPASSES) if mask == 0 or mask & 1 << n]
    ap.stores.calibration.problems.add(REBOOT_COMPASS)  # however it ends
    lasts_us = ONE_COMPASS_US if len(chosen) == 1 else THREE_COMPASSES_US
    state.compasses = [Compass(n, ap.now_us, lasts_us) for n in chosen]
    ap.tasks.after("compass calibration", lasts_us, lambda: _compasses_done(ap), ap.now_us)


def _compasses_done(ap: Autopilot) -> None:
    for compass in ap.stores.calibration.compasses:
        ap.text(Severity.INFO, f"Mag({compass.number}) good orientation: 0 1.2")


def _end_compasses(asked: Asked) -> None:
    """Accept or cancel: neither is told in words."""
    asked.answer(ACCEPTED)
    asked.ap.stores.calibration.compasses = []
    asked.ap.tasks.stop("compass calibration")


def _mask(ap: Autopilot) -> int:
    return sum(1 << compass.number for compass in ap.stores.calibration.compasses)


def mag_cal_progress(ap: Autopilot) -> dict[str, Any] | None:
    """One message per compass; the last one's fields are returned, None if there is none."""
    running = [compass for compass in ap.stores.calibration.compasses if not compass.done(ap.now_us)]
    every = [
        {
            "compass_id": compass.number,
            "cal_mask": _mask(ap),
            "cal_status": 2 if compass.percent(ap.now_us) < 30 else 3,
            "attempt": 1,
            "completion_pct": compass.percent(ap.now_us),
            "completion_mask": (255,) * (compass.percent(ap.now_us) // 10)
            + (0,) * (10 - compass.percent(ap.now_us) // 10),
        }
        for compass in running
    ]
    return _all_but_last(ap, "MAG_CAL_PROGRESS", every)


def mag_cal_report(ap: Autopilot) -> dict[str, Any] | None:
    """One message per compass, again and again until accepted or cancelled."""
    done = [compass for compass in ap.stores.calibration.compasses if compass.done(ap.now_us)]
    every: list[dict[str, Any]] = [
        {
            "compass_id": compass.number,
            "cal_mask": _mask(ap),
            "cal_status": 4,
            "autosaved": 1,
            "fitness": 0.035,
            "ofs_x": 5.0,
            "ofs_y": 13.0,
            "ofs_z": -18.0,
            "diag_x": 1.0,
            "diag_y": 1.0,
            "diag_z": 1.0,
            "orientation_confidence": 1.2,
            "scale_factor": 1.0,
        }
        for compass in done
    ]
    return _all_but_last(ap, "MAG_CAL_REPORT", every)


def _all_but_last(ap: Autopilot, name: str, every: list[dict[str, Any]]) -> dict[str, Any] | None:
    for fields in every[:-1]:
        ap.send(name, **fields)
    return every[-1] if every else None


# Motors


def _compassmot(ap: Autopilot) -> None:
    """Acknowledged to nobody in particular; looks armed until a station sends a COMMAND_ACK."""
    ap.stores.calibration.compassmot = True
    ap.acknowledge(PREFLIGHT_CALIBRATION, ACCEPTED, 0, 0)
    ap.text(Severity.INFO, "Starting calibration")
    ap.text(Severity.INFO, "Current")
    ap.tasks.start("compassmot", _turn_motors(ap), ap.now_us)


def _turn_motors(ap: Autopilot) -> Task:
    while True:
        yield COMPASSMOT_US
        ap.text(Severity.INFO, "Initialising ArduPilot")


def heard_ack(ap: Autopilot, frame: Received) -> None:
    """COMMAND_ACK of a station: the only end of compassmot."""
    if ap.stores.calibration.compassmot:
        ap.stores.calibration.compassmot = False
        ap.tasks.stop("compassmot")
        ap.acknowledge(PREFLIGHT_CALIBRATION, ACCEPTED, frame.system, frame.component)
        ap.text(Severity.NOTICE, "Failed")


def _motor_test(asked: Asked) -> None:
    """One motor for some seconds: heartbeats say armed meanwhile."""
    ap, seconds = asked.ap, asked.command.p[3]
    if ap.armed or not math.isfinite(seconds) or not 0.0 <= seconds <= MAX_MOTOR_TEST_S:
        asked.answer(FAILED)
        return
    motor, throttle = asked.command.p[0], asked.command.p[2] / 100.0
    output = MOTOR_OUTPUTS.get(motor, 0)
    ap.stores.calibration.test_motor(output, min(max(throttle, 0.0), 1.0), ap.now_us + round(seconds * 1e6))
    asked.answer(ACCEPTED)


COMMANDS: dict[int, Callable[[Asked], None]] = {
    MOTOR_TEST: _motor_test,
    PREFLIGHT_CALIBRATION: _calibrate,
    PREFLIGHT_STORAGE: lambda asked: asked.answer(DENIED),
    FIXED_MAG_CAL_YAW: lambda asked: asked.answer(ACCEPTED),
    START_MAG_CAL: _start_compasses,
    ACCEPT_MAG_CAL: _end_compasses,
    CANCEL_MAG_CAL: _end_compasses,
    VEHICLE_POS: _pose,
}


def execute(ap: Autopilot, command: Command, system: int, component: int) -> bool:
    """Carry out a command of these dialogues; False if it is none."""
    handler = COMMANDS.get(command.number)
    if handler is None:
        return False
    handler(Asked(ap, command, system, component))
    return True
