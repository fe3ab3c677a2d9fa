"""How each autopilot is calibrated and how one of its motors is tested: which command, and how it goes on from there.

Measured on both (docs/autopilots.md "Calibration"). ArduPilot's compassmot is not offered: it turns the motors, shows
armed, and its end crashed the autopilot.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.uplink.actions import MavCommand

# MAV_CMD. Compasses of ArduPilot are calibrated by commands of their own, all other sensors by 241 with a parameter.
PREFLIGHT_CALIBRATION, START_MAG_CAL, CANCEL_MAG_CAL = 241, 42424, 42426
# ArduPilot sends this command to the station for every pose; the station answers with the same command.
ACCELCAL_VEHICLE_POS = 42429
DO_MOTOR_TEST, ACTUATOR_TEST = 209, 310
"""MAV_CMD."""
MAG_CAL_PROGRESS, MAG_CAL_REPORT = 191, 192
"""Message ids that ArduPilot sends only when requested."""
STATUS_CALIBRATING = 2
"""MAV_STATE."""
# ArduPilot counts outputs for motors up to 12; a type that is not listed below may have that many.
MAX_MOTORS = 12
MOTORS = {2: 4, 13: 6, 14: 8, 29: 12, 35: 10}
"""By MAV_TYPE, where it gives the number: quad-, hexa-, octo-, dodeca-, decarotor. Numbers beyond it both autopilots
accept, and nothing turns (measured: 5 and 9 on quadrotors)."""
# param1 to param3 of 42424: a mask of compasses, where 0 is all; try again by itself; store without being asked.
ALL_COMPASSES, NO_RETRY, AUTOSAVE = 0, 0, 1
THROTTLE_PERCENT = 0
"""MOTOR_TEST_THROTTLE_TYPE."""


class Sensor(StrEnum):
    """What can be calibrated; the words are the operator's."""

    GYRO = "gyro"
    ACCEL = "accelerometer"
    SIMPLE_ACCEL = "simple accelerometer"
    LEVEL = "level"
    COMPASS = "compass"
    BARO = "barometer"
    AIRSPEED = "airspeed"


class Dialogue(StrEnum):
    """How a calibration goes on after it was requested."""

    ACK = "ack"
    """The acknowledgement is its end."""
    POSES = "poses"
    """The vehicle names a pose, the operator confirms it (ACCELCAL_VEHICLE_POS both ways)."""
    COMPASSES = "compasses"
    """MAG_CAL_PROGRESS and MAG_CAL_REPORT of each compass."""
    TEXTS = "texts"
    """Texts that begin with [cal]; the acknowledgement only shows that the command was understood."""


@dataclass(frozen=True)
class CalibrationProcedure:
    """One calibration of one autopilot."""

    dialogue: Dialogue
    order: MavCommand
    prompt: str
    """What the operator does before it begins."""
    limit_s: float
    """After this long it is given up."""
    cancel: MavCommand | None = None
    no_cancel: str = ""
    """Why it cannot be cancelled."""
    settle_s: float = 0.0
    """For this long after another calibration this one would be refused, silently."""
    unsettled_by: frozenset[Sensor] = frozenset(Sensor)
    """The calibrations after which that holds."""
    needs_reboot: bool = False
    """Its result counts from the next boot on."""
    reboot_once_begun: bool = False
    """Also cancelled or failed it refuses to arm before that boot (measured on ArduPilot's compasses)."""


_STILL = "keep the vehicle still"
_LEVEL = "place the vehicle level, as it flies, and keep it still"
_OUTSIDE = "go outside, away from iron and reinforced concrete"
_NOT_LONG = "it cannot be cancelled, and is over in a moment"
_ACCELS = frozenset({Sensor.ACCEL, Sensor.SIMPLE_ACCEL, Sensor.LEVEL})


def _preflight(*params: float) -> MavCommand:
    return MavCommand(PREFLIGHT_CALIBRATION, params)


def _acked(order: MavCommand, prompt: str, settle_s: float = 0.0) -> CalibrationProcedure:
    return CalibrationProcedure(
        Dialogue.ACK, order, prompt, 45.0, no_cancel=_NOT_LONG, settle_s=settle_s, unsettled_by=_ACCELS
    )


_ARDUPILOT = {
    Sensor.GYRO: _acked(_preflight(1), _STILL),
    Sensor.BARO: _acked(_preflight(0, 0, 1), _STILL),
    Sensor.LEVEL: _acked(_preflight(0, 0, 0, 0, 2), _LEVEL, settle_s=6.0),
    Sensor.SIMPLE_ACCEL: _acked(_preflight(0, 0, 0, 0, 4), _LEVEL, settle_s=6.0),
    Sensor.ACCEL: CalibrationProcedure(
        Dialogue.POSES,
        _preflight(0, 0, 0, 0, 1),
        "six poses, each held still; have all sides of the vehicle free",
        1800.0,
        no_cancel="this autopilot cannot cancel it: finish all six poses, or reboot it",
        needs_reboot=True,
    ),
    Sensor.COMPASS: CalibrationProcedure(
        Dialogue.COMPASSES,
        MavCommand(START_MAG_CAL, (ALL_COMPASSES, NO_RETRY, AUTOSAVE)),
        f"{_OUTSIDE}; turn the vehicle slowly about all its axes until all compasses are done",
        600.0,
        cancel=MavCommand(CANCEL_MAG_CAL),
        needs_reboot=True,
        reboot_once_begun=True,
    ),
}
_CANCEL_ALL = _preflight()
_SIDES = "six sides, each held still until it is done"


def _texts(order: MavCommand, prompt: str, limit_s: float, *, cancels: bool = True) -> CalibrationProcedure:
    return CalibrationProcedure(
        Dialogue.TEXTS,
        order,
        prompt,
        limit_s,
        cancel=_CANCEL_ALL if cancels else None,
        no_cancel="" if cancels else _NOT_LONG,
        settle_s=2.5,
    )


_PX4 = {
    Sensor.GYRO: _texts(_preflight(1), _STILL, 60.0),
    Sensor.ACCEL: _texts(_preflight(0, 0, 0, 0, 1), _SIDES, 900.0),
    Sensor.LEVEL: _texts(_preflight(0, 0, 0, 0, 2), _LEVEL, 60.0, cancels=False),
    Sensor.COMPASS: _texts(_preflight(0, 1), f"{_OUTSIDE}; the vehicle reports which side and when to turn it", 900.0),
    Sensor.AIRSPEED: _texts(_preflight(0, 0, 0, 0, 0, 1), "keep the sensor out of the wind", 180.0),
}
_ALL = {AUTOPILOT_ARDUPILOT: _ARDUPILOT, AUTOPILOT_PX4: _PX4}


def calibration(vehicle: Vehicle, sensor: Sensor) -> CalibrationProcedure | None:
    """The procedure for this vehicle; None if it has none."""
    return _ALL.get(vehicle.autopilot, {}).get(sensor)


def why_no_calibration(vehicle: Vehicle, sensor: Sensor) -> str:
    """Why this vehicle has no such calibration, or ""."""
    if calibration(vehicle, sensor) is not None:
        return ""
    if vehicle.autopilot == AUTOPILOT_PX4 and sensor is Sensor.BARO:
        # PX4's barometer calibration was seen to hang for ever (1.16.1, SIH): one processor at 100 %, no
        # cancelling, no arming before a reboot. Its simple one of the accelerometers never reports that it began or
        # ended (measured): not offered.
        return "this autopilot's may hang until it is rebooted: not offered"
    return f"this autopilot has no {sensor} calibration"


def is_calibrating(vehicle: Vehicle) -> bool:
    """Whether its heartbeat shows a calibration. PX4's does; ArduPilot's never."""
    return vehicle.telemetry.system_status == STATUS_CALIBRATING


def motor_test(vehicle: Vehicle, motor: int, throttle: float, seconds: float) -> MavCommand | None:
    """The command that turns motor 1, 2, … with `throttle` 0 to 1 for some seconds; None if this autopilot cannot."""
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        return MavCommand(DO_MOTOR_TEST, (motor, THROTTLE_PERCENT, 100.0 * throttle, seconds, 1))
    if vehicle.autopilot == AUTOPILOT_PX4:
        return MavCommand(ACTUATOR_TEST, (throttle, seconds, 0, 0, motor))  # ACTUATOR_OUTPUT_FUNCTION_MOTOR1 is 1
    return None


def motor_word(autopilot: str, motor: int) -> str:
    """What an autopilot, called as in fleet frames, takes for motor 1, 2, … of a motor test.

    ArduPilot counts round the vehicle, as A, B, … of its motor test, and not as its outputs are numbered; PX4 does.
    """
    if not autopilot.startswith("Ardu") or not 1 <= motor <= MAX_MOTORS:
        return f"motor {motor}"
    return f"motor {chr(ord('A') + motor - 1)} ({motor} in the test's order: clockwise from the front right)"


def motors(vehicle: Vehicle) -> int:
    """The largest number of motors the vehicle can have."""
    return MOTORS.get(vehicle.type, MAX_MOTORS)


def motor_test_end(vehicle: Vehicle, motor: int) -> MavCommand:
    """The command that ends a motor test early."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return MavCommand(ACTUATOR_TEST, (math.nan, 0.1, 0, 0, motor))
    return MavCommand(DO_MOTOR_TEST, (motor, THROTTLE_PERCENT, 0, 0, 1))


def motor_test_hint(vehicle: Vehicle) -> str:
    """Why it may refuse a motor test without giving a reason; "" where it gives one."""
    return "is its safety switch on, or COM_MOT_TEST_EN 0?" if vehicle.autopilot == AUTOPILOT_PX4 else ""
