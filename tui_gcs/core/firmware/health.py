"""Could a vehicle arm now, in the mode it would fly in, and if not, why? Per autopilot, read from its own telemetry.

Pure functions of what was heard. A problem `blocks` if the vehicle would refuse to arm, or must not be flown so. What
an autopilot reports of itself counts most; the rest explains it in words.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.mavlink.mode_names import known_modes, mode_name

Newest = Callable[[int], Fields | None]
"""The newest message of an id, None if none came lately."""

# Message ids (common.xml, ardupilotmega.xml).
SYS_STATUS, GPS_RAW_INT, RC_CHANNELS, BATTERY_STATUS = 1, 24, 65, 147
EKF_STATUS_REPORT, ESTIMATOR_STATUS = 193, 230

PREARM_CHECK = 0x10000000
"""MAV_SYS_STATUS_PREARM_CHECK in SYS_STATUS.onboard_control_sensors_health."""
# Present but not enabled: a safety switch holds the motors back.
MOTOR_OUTPUTS = 0x8000
SENSORS = {
    0x1: "gyro",
    0x2: "accelerometer",
    0x4: "compass",
    0x8: "barometer",
    0x10: "airspeed sensor",
    0x20: "GPS",
    0x40: "optical flow",
    0x80: "vision position",
    0x100: "range finder",
    0x400: "rate control",
    0x800: "attitude control",
    0x1000: "yaw control",
    0x2000: "altitude control",
    0x4000: "position control",
    0x10000: "RC receiver",
    0x20000: "second gyro",
    0x40000: "second accelerometer",
    0x80000: "second compass",
    0x100000: "geofence",
    0x200000: "AHRS",
    0x400000: "terrain data",
    0x1000000: "logging",
    0x2000000: "battery",
    0x4000000: "proximity sensor",
    0x8000000: "satellite link",
    0x20000000: "obstacle avoidance",
    0x40000000: "propulsion",
}
"""MAV_SYS_STATUS_SENSOR."""
FENCE = 0x100000
# Gyroscope, accelerometer, barometer and AHRS: without one of them no autopilot stays in the air.
ESSENTIAL = 0x1 | 0x2 | 0x8 | 0x200000
# Compass and thrust are among them: an ArduCopter without any compass flew on without a word.
NEEDED_IN_FLIGHT = ESSENTIAL | 0x4 | 0x40000000
"""Sensors whose loss in flight is a problem."""
BATTERY_STATES = {2: "low", 3: "critical", 4: "at its end", 5: "failed", 6: "unhealthy", 7: "charging"}
"""MAV_BATTERY_CHARGE_STATE, as far as it is worth reporting."""
CHARGE_LOW, CHARGE_SPENT = 2, frozenset({2, 3})
"""The first of them is no reason to hurry; the others only state how much is left."""
BATTERY_FAULTS = (
    "deep discharge",
    "spikes",
    "cell failed",
    "over-current",
    "over-temperature",
    "under-temperature",
    "incompatible voltage",
    "incompatible firmware",
    "incompatible cells",
)
"""MAV_BATTERY_FAULT, by bit."""
# The charge at which the alarm in flight begins, too; the time is BATTERY_STATUS.time_remaining, in seconds.
LOW_PCT, LITTLE_S = 25.0, 180
MAX_VARIANCE = 1.0
"""Limit of an estimator's innovation, as a share of what it accepts (both autopilots scale to 1)."""
MIN_FIX = 3
"""GPS_FIX_TYPE_3D_FIX."""
POOR_M = 10.0
"""A horizontal accuracy worse than this is reported."""

EKF_READY = 0x33F
"""EKF_STATUS_REPORT.flags of an ArduPilot that has a position (831, measured); a GPS fix alone is 31 s too early."""
# ardupilotmega.xml, EKF_STATUS_FLAGS; 0x8000 was set 1.4 s after a GPS jump of 220 m (docs/autopilots.md).
EKF_UNINITIALISED, EKF_CONSTANT_POSITION, EKF_GLITCH = 0x400, 0x80, 0x8000
EKF_PARTS = {
    0x1: "attitude",
    0x2: "horizontal velocity",
    0x4: "vertical velocity",
    0x8: "relative position",
    0x10: "absolute position",
    0x20: "height",
    0x100: "predicted relative position",
    0x200: "predicted absolute position",
}
"""The common part of ESTIMATOR_STATUS_FLAGS and EKF_STATUS_FLAGS."""
PX4_PARTS = {0x1: "attitude", 0x2: "horizontal velocity", 0x4: "vertical velocity", 0x10: "absolute position"}
# common.xml, ESTIMATOR_STATUS_FLAGS; PX4 sends the bits of ArduPilot's glitch under other numbers.
PX4_GLITCH, PX4_ACCEL_ERROR = 0x400, 0x800
EKF_VARIANCES = {
    "velocity": "velocity_variance",
    "position": "pos_horiz_variance",
    "height": "pos_vert_variance",
    "compass": "compass_variance",
}
"""Fields of EKF_STATUS_REPORT, as shares of what it accepts; PX4's of ESTIMATOR_STATUS are below."""
PX4_RATIOS = {
    "velocity": "vel_ratio",
    "position": "pos_horiz_ratio",
    "height": "pos_vert_ratio",
    "compass": "mag_ratio",
}
_OF_COMPASS, _OF_HEIGHT = ": compass ", ": height "
STICK_MODES = frozenset({"ALT_HOLD", "LOITER", "POSHOLD", "CIRCLE", "SPORT", "DRIFT", "FLOWHOLD", "AUTOTUNE"})
"""ArduCopter modes in which the throttle stick is the climb rate, an absent pilot's stick included."""
STICK_LOW_US = 1400
"""Below this the stick orders a descent (middle 1500 less THR_DZ's 100 µs); 0 is no stick."""
PREARM_TEXT_S = 35.0
"""ArduPilot repeats its pre-arm texts every 30 s."""


REMOTE_ID_TEXTS = ("PreArm: OpenDroneID", "PreArm: ODID")
"""Pre-arm texts of ArduPilot with DID_ENABLE 1 and bit 0 of DID_OPTIONS set."""
NO_OPERATOR_ID = "; this station sends no operator's Remote ID: another one must, or DID_OPTIONS must not ask for it"


Concern = Literal["position", "height", "battery", "battery-low", "health", "fence"]
"""What a problem in flight puts in doubt."""


@dataclass(frozen=True)
class ArmingChecks:
    """What a vehicle's own arming checks reported in EVENTs, for the mode it would fly in."""

    can_arm: bool | None
    """None if they reported nothing."""
    reasons: tuple[str, ...] = ()
    """Why it cannot arm, the worst reason first."""


@dataclass(frozen=True)
class HealthProblem:
    """One thing that is wrong with a vehicle."""

    text: str
    blocks: bool
    """Whether it must not be armed so."""
    about: Concern = field(default="health", compare=False)
    """What it puts in doubt; problems with the same words are equal."""
    is_charge: bool = field(default=False, compare=False)
    """It states how much is left in a battery: a percentage is more precise."""


GLITCH = HealthProblem(
    "GPS glitch: its position may jump to a wrong place within seconds", blocks=True, about="position"
)
GLITCH_OVER = "Glitch cleared"


def _reports_glitch(texts: Sequence[str]) -> bool:
    """Whether the newest text about GPS glitches reports one."""
    # ArduPilot sends "GPS Glitch or Compass error" (older: "GPS Glitch"), and `GLITCH_OVER` at its end.
    reports = [text for text in texts if text.startswith("GPS Glitch") or text == GLITCH_OVER]
    return bool(reports) and reports[-1] != GLITCH_OVER


def problems(vehicle: Vehicle, newest: Newest, checks: ArmingChecks, now: float) -> Iterator[HealthProblem]:
    """All that is wrong with a vehicle."""
    yield from _state(vehicle)
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        yield from _ardupilot(vehicle, newest, now)
    elif vehicle.autopilot == AUTOPILOT_PX4:
        yield from _px4(vehicle, newest, checks)
    else:
        yield from _about("position", _gps(vehicle, newest, blocks=True))
    yield from _sensors(newest)
    yield from _battery(vehicle, newest)


def problems_in_flight(
    vehicle: Vehicle, newest: Newest, texts: Sequence[str] = ()
) -> Iterator[tuple[Concern, HealthProblem]]:
    """What an autopilot reports of itself in the air that needs action; its silence is reported elsewhere.

    `texts`: its texts of the last seconds, oldest first. A glitch comes in one at once, in telemetry later, and over a
    slow radio not at all.
    """
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT and _reports_glitch(texts):
        yield "position", GLITCH
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT and newest(EKF_STATUS_REPORT) is not None:
        yield from _estimator_findings(_ardupilot_ekf(vehicle, newest))
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT and (stick := sinking_stick(vehicle, newest)):
        reads = vehicle.mode_name in STICK_MODES
        yield from _blocking("health", iter([HealthProblem(stick, blocks=reads)]))
    if vehicle.autopilot == AUTOPILOT_PX4 and (estimator := newest(ESTIMATOR_STATUS)) is not None:
        yield from _estimator_findings(_px4_estimator(estimator))
    if newest(SYS_STATUS) is not None:
        yield from _blocking("health", _sensors(newest, NEEDED_IN_FLIGHT))
        yield from _blocking("fence", _breach(newest))
    for problem in _battery(vehicle, newest):
        if problem.blocks:
            yield problem.about, problem


def _about(concern: Concern, found: Iterator[HealthProblem]) -> Iterator[HealthProblem]:
    return (replace(problem, about=concern) for problem in found)


def _blocking(concern: Concern, found: Iterator[HealthProblem]) -> Iterator[tuple[Concern, HealthProblem]]:
    return ((concern, problem) for problem in found if problem.blocks)


def _estimator_findings(found: Iterator[HealthProblem]) -> Iterator[tuple[Concern, HealthProblem]]:
    """What an estimator's problems put in doubt."""
    # With a compass that does not fit the position is known all the same (within 0.2 m, flown).
    for concern, problem in _blocking("position", found):
        yield "health" if _OF_COMPASS in problem.text else "height" if _OF_HEIGHT in problem.text else concern, problem


def flight_mode(vehicle: Vehicle) -> int:
    """custom_mode in which this station flies such a vehicle; for unknown autopilots the one it is in."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return 0x3040000  # Hold: arming and take-off begin there
    for number, name in known_modes(vehicle.autopilot, vehicle.type).items():
        if name == "GUIDED":
            return number
    return vehicle.telemetry.custom_mode


def sinking_stick(vehicle: Vehicle, newest: Newest) -> str:
    """Why a mode that reads the throttle stick would lose height, or "".

    Measured on ArduCopter: LOITER by a ground station with the stick at the bottom sinks at 2.5 m/s, silently.
    """
    if vehicle.autopilot != AUTOPILOT_ARDUPILOT:
        return ""
    sticks = newest(RC_CHANNELS)
    if sticks is None or not 0 < sticks["chan3_raw"] < STICK_LOW_US:
        return ""
    return f"throttle stick is low ({sticks['chan3_raw']} µs): LOITER, ALT_HOLD, POSHOLD and CIRCLE would sink"


def _state(vehicle: Vehicle) -> Iterator[HealthProblem]:
    """Problems that HEARTBEAT.system_status (MAV_STATE) reports."""
    words = {
        1: "still booting",
        2: "calibrating",
        5: "CRITICAL: one of its failsafes is active",
        6: "EMERGENCY: it reports that it is out of control",
        7: "switching off",
        8: "flight was terminated",
    }
    if vehicle.telemetry.system_status in words:
        yield HealthProblem(words[vehicle.telemetry.system_status], blocks=True)
    elif vehicle.telemetry.system_status == 0 and vehicle.autopilot != AUTOPILOT_PX4:
        # PX4 reports 0 whenever its checks fail in the mode it is in.
        yield HealthProblem("still starting", blocks=True)


def _sensors(newest: Newest, needed: int = ESSENTIAL) -> Iterator[HealthProblem]:
    status = newest(SYS_STATUS)
    if status is None:
        yield HealthProblem("nothing is heard of its sensors (SYS_STATUS)", blocks=True)
        return
    enabled = status["onboard_control_sensors_present"] & status["onboard_control_sensors_enabled"]
    bad = enabled & ~status["onboard_control_sensors_health"]
    for bit, name in SENSORS.items():
        if bad & bit:
            yield HealthProblem(f"{name} unhealthy", blocks=bool(bit & needed))


def _breach(newest: Newest) -> Iterator[HealthProblem]:
    """A breach of the fence on board. ArduPilot's state stays ACTIVE, and FENCE_ACTION may be to report only."""
    if any(problem.blocks for problem in _sensors(newest, FENCE)):
        yield HealthProblem("it is outside of its own fence", blocks=True, about="fence")


def _gps(vehicle: Vehicle, newest: Newest, *, blocks: bool) -> Iterator[HealthProblem]:
    gps = newest(GPS_RAW_INT)
    if gps is None:
        yield HealthProblem("nothing is heard of its GPS", blocks)
        return
    satellites = f"{gps['satellites_visible']} satellites" if gps["satellites_visible"] != 255 else "satellites unknown"
    if gps["fix_type"] < MIN_FIX:
        yield HealthProblem(f"no GPS fix: {satellites}", blocks)
    elif vehicle.integrity.position_error_m > POOR_M:
        yield HealthProblem(f"GPS is poor: ±{vehicle.integrity.position_error_m:.0f} m, {satellites}", blocks=False)


def _battery(vehicle: Vehicle, newest: Newest) -> Iterator[HealthProblem]:
    """Problems of the battery: those of BATTERY_STATUS before those of SYS_STATUS."""
    battery = newest(BATTERY_STATUS)
    if battery is not None:
        state = battery["charge_state"]
        if state in BATTERY_STATES:
            about: Concern = "battery-low" if state == CHARGE_LOW else "battery"
            yield HealthProblem(f"battery {BATTERY_STATES[state]}", True, about, is_charge=state in CHARGE_SPENT)
        faults = [word for bit, word in enumerate(BATTERY_FAULTS) if battery["fault_bitmask"] >> bit & 1]
        if faults:
            yield HealthProblem(f"battery fault: {', '.join(faults)}", True, "battery")
        if 0 < battery["time_remaining"] < LITTLE_S:
            yield HealthProblem(f"battery for {battery['time_remaining']} s only", False, "battery")
    if math.isnan(vehicle.telemetry.battery_pct):
        yield HealthProblem("battery: charge unknown", False, "battery")
    elif vehicle.telemetry.battery_pct < LOW_PCT:
        yield HealthProblem(f"battery at {vehicle.telemetry.battery_pct:.0f} %", False, "battery")


def _estimates(values: Sequence[tuple[str, float]], whose: str) -> Iterator[HealthProblem]:
    for name, value in values:
        if not math.isfinite(value):
            yield HealthProblem(f"{whose}: {name} is no number", blocks=True)
        elif value > MAX_VARIANCE:
            yield HealthProblem(f"{whose}: {name} does not fit ({value:.1f}, should be below 1)", blocks=True)


def _checks_fail(newest: Newest) -> bool:
    """Whether the autopilot reports that it would refuse to arm in the mode it is in."""
    status = newest(SYS_STATUS)
    return status is not None and not status["onboard_control_sensors_health"] & PREARM_CHECK


def _ardupilot(vehicle: Vehicle, newest: Newest, now: float) -> Iterator[HealthProblem]:
    if not vehicle.telemetry.armed:
        yield from _ardupilot_prearm(vehicle, newest, now)
    ready = True
    for problem in _about("position", _ardupilot_ekf(vehicle, newest)):
        ready = ready and not problem.blocks
        yield problem
    yield from _about("position", _gps(vehicle, newest, blocks=not ready))
    if vehicle.telemetry.home_m is None:
        yield HealthProblem("home is not known yet", blocks=False, about="position")
    stick = sinking_stick(vehicle, newest)
    if stick:
        reads = vehicle.mode_name in STICK_MODES
        yield HealthProblem(stick, blocks=vehicle.telemetry.armed and reads)


def _ardupilot_prearm(vehicle: Vehicle, newest: Newest, now: float) -> Iterator[HealthProblem]:
    """Problems of the pre-arm checks."""
    mode = vehicle.mode_name
    # The pre-arm bit is for the mode it is in: true in STABILIZE long before GUIDED can be armed (measured). What
    # fails in another mode fails in GUIDED, too, which asks for most, unless it is about that mode.
    flown = vehicle.telemetry.custom_mode == flight_mode(vehicle)
    if _checks_fail(newest):
        yield HealthProblem(f"pre-arm checks fail in {mode}", blocks=flown)
        for text in vehicle.reasons_since(now - PREARM_TEXT_S):
            if text.startswith("PreArm:"):
                hint = NO_OPERATOR_ID if text.startswith(REMOTE_ID_TEXTS) else ""
                yield HealthProblem(text + hint, blocks=flown or "mode" not in text.lower())
    elif not flown:
        needed = mode_name(vehicle.autopilot, vehicle.type, flight_mode(vehicle))
        yield HealthProblem(f"its checks are for {mode}; those for {needed} are known in {needed} only", blocks=False)
    status = newest(SYS_STATUS)
    if status is not None:
        present, enabled = status["onboard_control_sensors_present"], status["onboard_control_sensors_enabled"]
        if present & ~enabled & MOTOR_OUTPUTS:
            yield HealthProblem("motors are off: safety switch", blocks=True)


def _ardupilot_ekf(vehicle: Vehicle, newest: Newest) -> Iterator[HealthProblem]:
    report = newest(EKF_STATUS_REPORT)
    if report is None:  # a slow radio has no room for it: then its checks count, in the mode it would fly in
        checks_pass = vehicle.telemetry.custom_mode == flight_mode(vehicle) and not _checks_fail(newest)
        yield HealthProblem("nothing is heard of its EKF", blocks=not checks_pass)
        return
    flags = report["flags"]
    if flags & EKF_UNINITIALISED or not flags:
        yield HealthProblem("EKF is not started", blocks=True)
    elif flags & EKF_CONSTANT_POSITION:
        yield HealthProblem("EKF has no position yet: GPS is not used so far", blocks=True)
    elif flags & EKF_READY != EKF_READY:
        missing = [word for bit, word in EKF_PARTS.items() if not flags & bit]
        yield HealthProblem(f"EKF without {', '.join(missing)}", blocks=True)
    if flags & EKF_GLITCH:
        yield GLITCH
    yield from _estimates([(word, report[name]) for word, name in EKF_VARIANCES.items()], "EKF")


def _px4(vehicle: Vehicle, newest: Newest, checks: ArmingChecks) -> Iterator[HealthProblem]:
    if not vehicle.telemetry.armed:
        yield from _px4_checks(vehicle, newest, checks)
    yield from _about("position", _gps(vehicle, newest, blocks=_checks_fail(newest)))
    estimator = newest(ESTIMATOR_STATUS)
    if estimator is not None:  # slow, and off where a link has no room: its checks report the same
        yield from _about("position", _px4_estimator(estimator))
    if vehicle.telemetry.home_m is None:
        text = "home is not known yet: take-off heights are counted from it"
        yield HealthProblem(text, blocks=True, about="position")


def _px4_checks(vehicle: Vehicle, newest: Newest, checks: ArmingChecks) -> Iterator[HealthProblem]:
    """Problems of PX4's arming checks.

    Its pre-arm bit is for the mode it is in, its EVENTs for the mode it would fly in.
    """
    for text in checks.reasons:
        yield HealthProblem(text, blocks=True)
    if checks.can_arm is False and not checks.reasons:
        yield HealthProblem("its arming checks fail, it does not say why", blocks=True)
    if checks.can_arm is not False and _checks_fail(newest):
        mode = vehicle.mode_name
        why = "in OFFBOARD without set-points it does not arm" if mode == "OFFBOARD" else f"it does not arm in {mode}"
        elsewhere = "" if vehicle.telemetry.custom_mode == flight_mode(vehicle) else ": set HOLD first"
        yield HealthProblem(why + elsewhere, blocks=not elsewhere)


def _px4_estimator(estimator: Fields) -> Iterator[HealthProblem]:
    flags = estimator["flags"]
    missing = [word for bit, word in PX4_PARTS.items() if not flags & bit]
    if missing:
        yield HealthProblem(f"estimator without {', '.join(missing)}", blocks=True)
    if flags & PX4_GLITCH:
        yield HealthProblem("GPS glitch: its position may be wrong", blocks=True)
    if flags & PX4_ACCEL_ERROR:
        yield HealthProblem("accelerometer is not trusted", blocks=True)
    yield from _estimates([(word, estimator[name]) for word, name in PX4_RATIOS.items()], "estimator")
