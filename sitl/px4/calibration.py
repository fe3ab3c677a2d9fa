"""PX4's calibration dialogues: everything is told in texts that begin with [cal]; the acknowledgement comes first.

As measured on PX4 1.16.1: compass and accelerometer to their end with sensors that were made to turn as it asked. Its
own simulator rests on the ground for ever (`pose_stuck`).
"""

import math
from typing import TYPE_CHECKING

from sitl.common.autopilot import Command
from sitl.common.states import Result, Severity
from sitl.common.tasks import Task

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

PREFLIGHT_CALIBRATION, MOTOR_TEST, ACTUATOR_TEST = 241, 209, 310
COMMANDER_US = 4_000
MAX_ACTUATOR_TEST_S = 3.0
STEP_US = 101_000
FIRST_US = 53_000
CANCEL_US = 300_000
SETTLE_US = 2_000_000
"""Right after a calibration the next one is refused without a reason."""
STORM_ACK_US, STORM_TEXT_US = 12_000, 51_000
TURN_US = 3_000_000
"""How long somebody takes to turn the vehicle to the next side."""
SIDES = ("back", "front", "left", "right", "up", "down")
AIRSPEED_US, AIRSPEED_TELL_US = 30_000_000, 5_000_000
"""So long it waits for a sensor, and then with telling so."""
MEASURE_US, TURNED_US = 2_970_000, 7_000_000
GRAVITY_M_S2 = {
    "back": (9.807, 0.0, 0.0),
    "front": (-9.807, 0.0, 0.0),
    "left": (0.0, 9.807, 0.0),
    "right": (0.0, -9.807, 0.0),
    "up": (0.0, 0.0, 9.807),
    "down": (0.0, 0.0, -9.807),
}
"""What the accelerometers show while that side points down; m/s², forward, right, down."""

_CALIBRATION, _STORM, _STORM_TEXTS = "calibration", "calibration storm", "calibration storm texts"


def execute(ap: "Px4", command: Command, system: int, component: int) -> bool:
    """Carry out a command of these dialogues; False if it is none."""
    if command.number == PREFLIGHT_CALIBRATION:
        _calibrate(ap, command, system, component)
    elif command.number in (MOTOR_TEST, ACTUATOR_TEST):
        if not ap.armed and command.number == ACTUATOR_TEST:
            _test_actuator(ap, command)
        _answer(ap, command, Result.DENIED if ap.armed else Result.ACCEPTED, system, component)
    else:
        return False
    return True


def _test_actuator(ap: "Px4", command: Command) -> None:
    """One motor for so long; NaN ends it."""
    throttle, seconds, motor = command.p[0], command.p[1], command.p[4]
    output = int(motor) if motor in range(1, 5) and 0.0 <= throttle <= 1.0 else 0
    seconds = min(max(seconds, 0.0), MAX_ACTUATOR_TEST_S) if math.isfinite(seconds) else 0.0
    level = throttle if output else 0.0
    ap.stores.calibration.test_motor(output, level, ap.now_us + round(seconds * 1e6))


def _answer(
    ap: "Px4", command: Command, result: Result, system: int, component: int, wait_us: int = COMMANDER_US
) -> None:
    ap.deferred = None
    ap.answer_later(command.number, result, system, component, wait_us)


def _calibrate(ap: "Px4", command: Command, system: int, component: int) -> None:
    state, p = ap.stores.calibration, command.p
    cancel = not any(p)
    if state.kind:
        if cancel:
            _cancel(ap, command, system, component)
        else:
            _refuse(ap, command, system, component)
        return
    settling = state.ended_us is not None and ap.now_us - state.ended_us < SETTLE_US
    if ap.armed or (settling and not cancel):
        _answer(ap, command, Result.TEMPORARILY_REJECTED, system, component)
        return
    _answer(ap, command, Result.ACCEPTED, system, component)
    started = {(0, 1): "gyro", (1, 1): "mag", (4, 1): "accel", (4, 2): "level", (5, 1): "airspeed"}
    kind = next((kind for (at, value), kind in started.items() if p[at] == value), "")
    if not kind:
        return  # accepted, and nothing happens
    state.kind, ap.calibrating = kind, True
    dialogue = {"gyro": _gyro, "mag": _mag, "accel": _accel, "level": _level, "airspeed": _airspeed}[kind]
    ap.tasks.start(_CALIBRATION, dialogue(ap), ap.now_us)


def _say(ap: "Px4", text: str, severity: Severity = Severity.INFO) -> None:
    ap.text(severity, f"[cal] {text}")


def _end(ap: "Px4") -> None:
    state = ap.stores.calibration
    state.kind, state.ended_us, ap.calibrating = "", ap.now_us, False
    for name in (_STORM, _STORM_TEXTS):
        ap.tasks.stop(name)


def _begin(ap: "Px4", kind: str) -> None:
    _say(ap, f"calibration started: 2 {kind}")


def _done(ap: "Px4", kind: str) -> None:
    _say(ap, f"calibration done: {kind}")
    _end(ap)


def _progress(ap: "Px4", kind: str) -> Task:
    yield COMMANDER_US
    _begin(ap, kind)
    yield FIRST_US
    for percent in range(0, 101, 10):
        _say(ap, f"progress <{percent}>")
        yield STEP_US if percent < 100 else FIRST_US
    _done(ap, kind)


def _gyro(ap: "Px4") -> Task:
    return _progress(ap, "gyro")


def _level(ap: "Px4") -> Task:
    return _progress(ap, "level")


def _hold_still(ap: "Px4") -> Task:
    """The vehicle lies as it always does."""
    _say(ap, "hold vehicle still on a pending side")
    yield 1_806_000
    _say(ap, "detected rest position, hold still...")
    yield 513_000
    _say(ap, "down orientation detected")
    yield FIRST_US


def _mag(ap: "Px4") -> Task:
    yield COMMANDER_US
    _begin(ap, "mag")
    yield FIRST_US
    _say(ap, f"pending: {' '.join(SIDES)}")
    yield FIRST_US
    if ap.stores.calibration.pose_stuck:
        yield from _hold_still(ap)
        _say(ap, "down orientation detected")
        yield FIRST_US
        _say(ap, "Rotate vehicle")
        while True:
            yield 1 << 40
    yield from _sides(ap, rotated=True)
    _done(ap, "mag")


def _accel(ap: "Px4") -> Task:
    yield COMMANDER_US
    _begin(ap, "accel")
    yield FIRST_US
    yield from _sides(ap, rotated=False)
    _done(ap, "accel")


def _sides(ap: "Px4", *, rotated: bool) -> Task:
    """One side after the other, as if somebody turned it; `rotated`: about each of them, too."""
    pending = list(SIDES)
    while pending:
        side = pending.pop()
        _say(ap, f"pending: {' '.join([*pending, side])}")
        yield FIRST_US
        _say(ap, "hold vehicle still on a pending side")
        yield TURN_US
        _say(ap, "detected rest position, hold still...")
        yield 513_000
        _say(ap, f"{side} orientation detected")
        yield FIRST_US
        yield from (_rotated if rotated else _measured)(ap, side, len(SIDES) - len(pending))
        yield FIRST_US


def _rotated(ap: "Px4", side: str, count: int) -> Task:
    """Turned about the axis that points down; progress within a side has the side's name before it."""
    _say(ap, "Rotate vehicle")
    yield TURN_US // 2
    _say(ap, f"{side} side calibration: progress <{100 * (count - 1) // len(SIDES)}>")
    yield TURNED_US
    _say(ap, f"{side} side done, rotate to a different side")
    _say(ap, f"progress <{100 * count // len(SIDES)}>")


def _measured(ap: "Px4", side: str, count: int) -> Task:
    """The last side is at 102 %."""
    _say(ap, f"Hold still, measuring {side} side")
    yield MEASURE_US
    _say(ap, f"{side} side result: [{' '.join(f'{a:.3f}' for a in GRAVITY_M_S2[side])}]")
    _say(ap, f"progress <{17 * count}>")
    _say(ap, f"{side} side done, rotate to a different side")


def _airspeed(ap: "Px4") -> Task:
    yield COMMANDER_US
    _begin(ap, "airspeed")
    yield FIRST_US
    _say(ap, "Ensure sensor is not measuring wind", Severity.CRITICAL)
    yield AIRSPEED_US + AIRSPEED_TELL_US  # there is no sensor
    _say(ap, "calibration failed: airspeed", Severity.CRITICAL)
    _end(ap)


def _cancel(ap: "Px4", command: Command, system: int, component: int) -> None:
    """Two acknowledgements that disagree, in either order; the truth is the text."""
    state = ap.stores.calibration
    state.cancels += 1
    first, second = Result.ACCEPTED, Result.TEMPORARILY_REJECTED
    if state.cancels % 2 == 0:
        first, second = second, first
    _answer(ap, command, first, system, component)
    _answer(ap, command, second, system, component, 2 * COMMANDER_US)
    for name in (_STORM, _STORM_TEXTS):
        ap.tasks.stop(name)
    ap.tasks.after(_CALIBRATION, CANCEL_US, lambda: _cancelled(ap), ap.now_us)


def _cancelled(ap: "Px4") -> None:
    _say(ap, "calibration cancelled", Severity.CRITICAL)
    _end(ap)


def _refuse(ap: "Px4", command: Command, system: int, component: int) -> None:
    """Another calibration meanwhile: a storm of refusals until the first one ends."""
    _answer(ap, command, Result.TEMPORARILY_REJECTED, system, component)
    ap.tasks.start(_STORM, _storm(ap, system, component), ap.now_us)
    ap.tasks.start(_STORM_TEXTS, _storm_texts(ap), ap.now_us)


def _storm(ap: "Px4", system: int, component: int) -> Task:
    while True:
        ap.acknowledge(PREFLIGHT_CALIBRATION, Result.DENIED, system, component)
        yield STORM_ACK_US


def _storm_texts(ap: "Px4") -> Task:
    while True:
        text = f"command denied during calibration: {PREFLIGHT_CALIBRATION}"
        ap.tell(text, "commander_cal_cmd_denied", PREFLIGHT_CALIBRATION, severity=Severity.CRITICAL, levels=0x32)
        yield STORM_TEXT_US
