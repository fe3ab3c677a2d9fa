"""PX4's calibration dialogues: everything is reported in texts that begin with [cal]; the acknowledgement comes first.

Measured on PX4 1.16.1 (docs/autopilots.md "Calibration of PX4"), compass and accelerometer to their end with sensors
that were made to turn as asked. PX4's own simulator rests on the ground for ever (`pose_stuck`).
"""

import math
from collections.abc import Callable

from sitl.common.command import Command
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Result
from sitl.common.tasks import Task
from sitl.px4.announcer import Announcer
from sitl.px4.delayed_answers import DelayedAnswers
from sitl.services.motor_test import MotorTest

# MAV_CMD (common.xml).
PREFLIGHT_CALIBRATION, MOTOR_TEST, ACTUATOR_TEST = 241, 209, 310
# Latency of the commander's answers, 1 to 20 ms (docs/autopilots.md "Acknowledgements of PX4").
ANSWER_US = 4_000
MAX_ACTUATOR_TEST_S = 3.0
# Gaps between the "[cal] progress" texts of a gyroscope, which took 1.1 s in all.
STEP_US = 101_000
PAUSE_US = 53_000
REST_US, STILL_US = 1_806_000, 513_000
"""Time until PX4 has detected that the vehicle rests, and until it knows the side."""
NEVER_US = 1 << 40
CANCEL_US = 300_000
SETTLE_US = 600_000
"""This long after a calibration has reported its end the next one is refused without a reason: the worker thread sleeps
so that the message can go out (gyro_calibration.cpp and its siblings), and counts as busy (Commander.cpp)."""
# Another 241 while one runs: twenty and more DENIED (docs/autopilots.md "Calibration of PX4").
STORM_ACK_US, STORM_TEXT_US = 12_000, 51_000
TURN_US = 3_000_000
"""Time that a simulated operator needs to turn the vehicle to the next side."""
SIDES = ("back", "front", "left", "right", "up", "down")
AIRSPEED_US, AIRSPEED_REPORT_US = 30_000_000, 5_000_000
"""Time to wait for a sensor, and then to report that there is none."""
MEASURE_US, TURNED_US = 2_970_000, 7_000_000
GRAVITY_M_S2 = {
    "back": (9.807, 0.0, 0.0),
    "front": (-9.807, 0.0, 0.0),
    "left": (0.0, 9.807, 0.0),
    "right": (0.0, -9.807, 0.0),
    "up": (0.0, 0.0, 9.807),
    "down": (0.0, 0.0, -9.807),
}
"""Accelerations (forward, right, down) while that side points down."""

_CALIBRATION, _STORM, _STORM_TEXTS = "calibration", "calibration storm", "calibration storm texts"


class Px4Calibration(Part):
    """The calibration dialogues and actuator tests of one vehicle."""

    def __init__(self, platform: Platform, announcer: Announcer, answers: DelayedAnswers) -> None:
        super().__init__(platform)
        self._announcer, self._answers = announcer, answers
        self.motor_test = MotorTest(platform.clock)
        self.pose_stuck = False
        """A test sets this to make a calibration wait for ever: the vehicle is never turned."""
        self._kind = ""
        """The calibration that is under way, or ""."""
        self._ended_us: int | None = None
        """When the last one ended."""
        self._cancels = 0

    @property
    def is_running(self) -> bool:
        """Whether a calibration is under way."""
        return bool(self._kind)

    def execute(self, command: Command) -> bool:
        """Carry out a command of these dialogues; False for all others."""
        if command.number == PREFLIGHT_CALIBRATION:
            self._calibrate(command)
        elif command.number in (MOTOR_TEST, ACTUATOR_TEST):
            if not self._state.armed and command.number == ACTUATOR_TEST:
                self._test_actuator(command)
            self._answer(command, Result.DENIED if self._state.armed else Result.ACCEPTED)
        else:
            return False
        return True

    def _answer(self, command: Command, result: Result, wait_us: int = ANSWER_US) -> None:
        self._answers.answer(command, result, wait_us)

    def _test_actuator(self, command: Command) -> None:
        """Turn one motor for a while; NaN as the time ends a test."""
        throttle, seconds, motor = command.p[0], command.p[1], command.p[4]
        output = int(motor) if motor in range(1, 5) and 0.0 <= throttle <= 1.0 else 0
        seconds = min(max(seconds, 0.0), MAX_ACTUATOR_TEST_S) if math.isfinite(seconds) else 0.0
        self.motor_test.start(output, throttle if output else 0.0, round(seconds * 1e6))

    def _calibrate(self, command: Command) -> None:
        p = command.p
        # PREFLIGHT_CALIBRATION with nothing but zeros cancels.
        cancel = not any(p)
        if self._kind:
            if cancel:
                self._cancel(command)
            else:
                self._refuse(command)
            return
        settling = self._ended_us is not None and self._clock.now_us - self._ended_us < SETTLE_US
        if self._state.armed or (settling and not cancel):
            self._answer(command, Result.TEMPORARILY_REJECTED)
            return
        self._answer(command, Result.ACCEPTED)
        started = {(0, 1): "gyro", (1, 1): "mag", (4, 1): "accel", (4, 2): "level", (5, 1): "airspeed"}
        # Other calibrations are accepted, and nothing happens.
        kind = next((kind for (at, value), kind in started.items() if p[at] == value), "")
        if not kind:
            return
        self._kind = kind
        dialogues: dict[str, Callable[[], Task]] = {
            "gyro": lambda: self._progress("gyro"),
            "mag": self._mag,
            "accel": self._accel,
            "level": lambda: self._progress("level"),
            "airspeed": self._airspeed,
        }
        self._tasks.start(_CALIBRATION, dialogues[kind](), self._clock.now_us)

    def _report(self, text: str, severity: MavSeverity = MavSeverity.INFO) -> None:
        self._announcer.text(severity, f"[cal] {text}")

    def _begin(self, kind: str) -> Task:
        yield ANSWER_US
        self._report(f"calibration started: 2 {kind}")
        yield PAUSE_US

    def _done(self, kind: str) -> None:
        self._report(f"calibration done: {kind}")
        self._end()

    def _end(self) -> None:
        self._kind, self._ended_us = "", self._clock.now_us
        self._stop_storm()

    def _stop_storm(self) -> None:
        for name in (_STORM, _STORM_TEXTS):
            self._tasks.stop(name)

    def _progress(self, kind: str) -> Task:
        yield from self._begin(kind)
        for percent in range(0, 101, 10):
            self._report(f"progress <{percent}>")
            yield STEP_US if percent < 100 else PAUSE_US
        self._done(kind)

    def _mag(self) -> Task:
        yield from self._begin("mag")
        self._report(f"pending: {' '.join(SIDES)}")
        yield PAUSE_US
        if self.pose_stuck:
            yield from self._wait_for_ever()
        yield from self._measure_sides(self._rotate_side)
        self._done("mag")

    def _wait_for_ever(self) -> Task:
        """Ask for rotations of a vehicle that lies as it always does."""
        yield from self._detect("down", REST_US)
        self._report("down orientation detected")
        yield PAUSE_US
        self._report("Rotate vehicle")
        while True:
            yield NEVER_US

    def _detect(self, side: str, rest_us: int) -> Task:
        """Find the side that points down, once the vehicle rests."""
        self._report("hold vehicle still on a pending side")
        yield rest_us
        self._report("detected rest position, hold still...")
        yield STILL_US
        self._report(f"{side} orientation detected")
        yield PAUSE_US

    def _accel(self) -> Task:
        yield from self._begin("accel")
        yield from self._measure_sides(self._measure_side)
        self._done("accel")

    def _measure_sides(self, measure: Callable[[str, int], Task]) -> Task:
        """Ask for one side after the other, as if an operator turned the vehicle each time."""
        pending = list(SIDES)
        while pending:
            side = pending.pop()
            self._report(f"pending: {' '.join([*pending, side])}")
            yield PAUSE_US
            yield from self._detect(side, TURN_US)
            yield from measure(side, len(SIDES) - len(pending))
            yield PAUSE_US

    def _rotate_side(self, side: str, count: int) -> Task:
        """Measure while the vehicle turns about the vertical; progress within a side begins with the side's name."""
        self._report("Rotate vehicle")
        yield TURN_US // 2
        self._report(f"{side} side calibration: progress <{100 * (count - 1) // len(SIDES)}>")
        yield TURNED_US
        self._report(f"{side} side done, rotate to a different side")
        self._report(f"progress <{100 * count // len(SIDES)}>")

    def _measure_side(self, side: str, count: int) -> Task:
        """Measure one side; the progress of the last one is 102 %."""
        self._report(f"Hold still, measuring {side} side")
        yield MEASURE_US
        self._report(f"{side} side result: [{' '.join(f'{a:.3f}' for a in GRAVITY_M_S2[side])}]")
        self._report(f"progress <{17 * count}>")
        self._report(f"{side} side done, rotate to a different side")

    def _airspeed(self) -> Task:
        yield from self._begin("airspeed")
        self._report("Ensure sensor is not measuring wind", MavSeverity.CRITICAL)
        # There is no sensor.
        yield AIRSPEED_US + AIRSPEED_REPORT_US
        self._report("calibration failed: airspeed", MavSeverity.CRITICAL)
        self._end()

    def _cancel(self, command: Command) -> None:
        """Send two acknowledgements that disagree, in either order; the truth is in the text."""
        self._cancels += 1
        first, second = Result.ACCEPTED, Result.TEMPORARILY_REJECTED
        # Both orders were seen, so both occur in turn.
        if self._cancels % 2 == 0:
            first, second = second, first
        self._answer(command, first)
        self._answer(command, second, 2 * ANSWER_US)
        self._stop_storm()
        self._tasks.after(_CALIBRATION, CANCEL_US, self._cancelled, self._clock.now_us)

    def _cancelled(self) -> None:
        self._report("calibration cancelled", MavSeverity.CRITICAL)
        self._end()

    def _refuse(self, command: Command) -> None:
        """Refuse a second calibration, again and again until the first one ends."""
        self._answer(command, Result.TEMPORARILY_REJECTED)
        self._tasks.start(_STORM, self._storm(command), self._clock.now_us)
        self._tasks.start(_STORM_TEXTS, self._storm_texts(), self._clock.now_us)

    def _storm(self, command: Command) -> Task:
        while True:
            self._outbox.answer(command, Result.DENIED)
            yield STORM_ACK_US

    def _storm_texts(self) -> Task:
        number = PREFLIGHT_CALIBRATION
        while True:
            text = f"command denied during calibration: {number}"
            self._announcer.alert(text, "commander_cal_cmd_denied", number, levels=0x32)
            yield STORM_TEXT_US
