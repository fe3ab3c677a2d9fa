"""ArduCopter's calibration dialogues and motor test: PREFLIGHT_CALIBRATION, ACCELCAL_VEHICLE_POS, DO_START_MAG_CAL.

This module acknowledges these commands, some of them long after they came. Times and texts were measured on
ArduCopter 4.7 (docs/autopilots.md "Calibration of ArduCopter").
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from sitl.common.command import Command
from sitl.common.outbox import Fields
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Result
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame
from sitl.services.motor_test import MotorTest

# MAV_CMD (common.xml).
MOTOR_TEST, PREFLIGHT_CALIBRATION, PREFLIGHT_STORAGE = 209, 241, 245
# MAV_CMD of ardupilotmega.xml.
START_MAG_CAL, ACCEPT_MAG_CAL, CANCEL_MAG_CAL, FIXED_MAG_CAL_YAW, VEHICLE_POS = 42424, 42425, 42426, 42006, 42429
POSES = 6
"""Level, left, right, nose down, nose up, back."""
SUCCESS, FAILURE = 16_777_215, 16_777_216
"""Positions in ACCELCAL_VEHICLE_POS that mean the end of a calibration; repeated every second until the next boot."""
# All times below were measured with a stopwatch on the wire (docs/autopilots.md "Calibration of ArduCopter").
POSE_EVERY_US = 1_050_000
# Each pose was sampled for 0.6 s before the next was asked for.
SAMPLE_US = 600_000
# ACK after 0.53 s; the text "Initialising ArduPilot" came at once.
INITIALISING_US, GYRO_US = 30_000, 500_000
# IN_PROGRESS at once, ACCEPTED after 0.75 s.
BARO_US = 750_000
# ACCEPTED after 1.1 s, with "Trim OK".
LEVEL_US = 1_080_000
SIMPLE_US = 1_040_000
# Within 5 s of another calibration of the accelerometers it answers TEMPORARILY_REJECTED.
ACCEL_PAUSE_US = 5_000_000
UNHEALTHY_US = 3_000_000
"""After a calibration of the accelerometers the GPS is not trusted for this long, because samples were missed."""
# A real one went on until the station sent a COMMAND_ACK message; left for 77 s its binary ended.
COMPASSMOT_US = 5_000_000
# 48.9 s for three compasses, 39 s for one.
THREE_COMPASSES_US, ONE_COMPASS_US = 48_900_000, 39_000_000
COMPASSES = 3
# param2 or param5 of 241: take the calibration that is stored.
ACCEPT_STORED = 76
MAX_MOTOR_TEST_S = 600.0
MOTOR_OUTPUTS: dict[float, int] = {1: 3, 2: 1, 3: 4, 4: 2}
"""Outputs by the motor numbers of a test, clockwise from the front; 1 and 4 were measured on a quadrotor "+"."""
REBOOT_ACCELS = "Accels calibrated requires reboot"
REBOOT_COMPASS = "Compass calibrated requires reboot"
COMPASS_RUNNING = "Compass calibration running"
GPS_UNHEALTHY = "GPS 1: not healthy"

_ACCEL, _COMPASS, _COMPASSMOT = "accelerometer calibration", "compass calibration", "compassmot"


@dataclass
class CompassCalibration:
    """The calibration of one compass."""

    number: int
    started_us: int
    lasts_us: int

    def done(self, now_us: int) -> bool:
        """Return whether it has a report instead of progress."""
        return now_us - self.started_us >= self.lasts_us

    def percent(self, now_us: int) -> int:
        """Return the progress; 100 is never shown."""
        return min(100 * (now_us - self.started_us) // self.lasts_us, 99)


class CopterCalibration(Part):
    """The calibration dialogues of one vehicle since its last boot."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self.motor_test = MotorTest(platform.clock)
        self.pose_stuck = False
        """A test sets this to make a calibration fail: the vehicle is never turned."""
        self._pose = 0
        """The pose that the operator is asked for; 0 without a dialogue."""
        self._accels_us: int | None = None
        """When the accelerometers were calibrated last."""
        self._unhealthy_until_us = 0
        self._compasses: list[CompassCalibration] = []
        self._problems: set[str] = set()
        """Reasons that refuse arming until a reboot."""
        self._compassmot = False
        self._handlers: dict[int, Callable[[Command], None]] = {
            MOTOR_TEST: self._test_motor,
            PREFLIGHT_CALIBRATION: self._calibrate,
            PREFLIGHT_STORAGE: lambda command: self._outbox.answer(command, Result.DENIED),
            FIXED_MAG_CAL_YAW: lambda command: self._outbox.answer(command, Result.ACCEPTED),
            START_MAG_CAL: self._start_compasses,
            ACCEPT_MAG_CAL: self._end_compasses,
            CANCEL_MAG_CAL: self._end_compasses,
            VEHICLE_POS: self._take_pose,
        }

    def execute(self, command: Command) -> bool:
        """Carry out a command of these dialogues; False for all others."""
        handler = self._handlers.get(command.number)
        if handler is None:
            return False
        handler(command)
        return True

    def refusals(self) -> list[str]:
        """Return why the vehicle must not be armed."""
        found = sorted(self._problems)
        if any(not compass.done(self._clock.now_us) for compass in self._compasses):
            found.append(COMPASS_RUNNING)
        if self._clock.now_us < self._unhealthy_until_us:
            found.append(GPS_UNHEALTHY)
        return found

    @property
    def motors_turn(self) -> bool:
        """Whether heartbeats have the armed bit although the vehicle is disarmed."""
        return self._compassmot or self.motor_test.running

    def _calibrate(self, command: Command) -> None:
        p = command.p
        # Every dialogue needs a disarmed vehicle, and compassmot counts as armed.
        if self._state.armed or self._compassmot:
            self._outbox.answer(command, Result.FAILED)
            self._outbox.text(MavSeverity.NOTICE, "Disarm to allow calibration")
        elif p[4] == 1:
            self._report_initialising()
            self._answer_later(command, GYRO_US)
            self._tasks.after(_ACCEL, GYRO_US + 20_000, self._begin_poses, self._clock.now_us)
        elif p[4] == 2:
            self._accels_calibrated()
            self._report_initialising()
            self._answer_later(command, LEVEL_US, "Trim OK: roll=0.00 pitch=-0.00 yaw=0.00")
        elif p[4] == 4:
            if self._accels_us is not None and self._clock.now_us - self._accels_us < ACCEL_PAUSE_US:
                self._outbox.answer(command, Result.TEMPORARILY_REJECTED)
                return
            self._accels_calibrated()
            self._answer_later(command, SIMPLE_US)
        elif ACCEPT_STORED in (p[4], p[1]):
            self._outbox.answer(command, Result.ACCEPTED)
        elif p[0] == 1:
            self._report_initialising()
            self._answer_later(command, GYRO_US)
        elif p[2] == 1:
            self._outbox.answer(command, Result.IN_PROGRESS)
            self._outbox.text(MavSeverity.INFO, "Updating barometer calibration")
            self._outbox.text(MavSeverity.INFO, "Barometer calibration complete")
            self._answer_later(command, BARO_US)
        elif p[5] == 1:
            self._start_compassmot()
        else:
            self._outbox.answer(command, Result.UNSUPPORTED)

    def _answer_later(self, command: Command, wait_us: int, *texts: str) -> None:
        """Acknowledge a command after a while, then send texts."""

        def act() -> None:
            self._outbox.answer(command, Result.ACCEPTED)
            for text in texts:
                self._outbox.text(MavSeverity.INFO, text)

        self._tasks.after("calibration", wait_us, act, self._clock.now_us)

    def _report_initialising(self) -> None:
        # Every calibration begins with that of the gyros, which is reported first.
        def report() -> None:
            self._outbox.text(MavSeverity.INFO, "Initialising ArduPilot")

        self._tasks.after("initialising", INITIALISING_US, report, self._clock.now_us)

    def _accels_calibrated(self) -> None:
        self._accels_us = self._clock.now_us
        # Measured: "GPS 1: not healthy" refuses arming for 3 s after level and simple calibrations.
        self._unhealthy_until_us = self._clock.now_us + UNHEALTHY_US

    def _begin_poses(self) -> None:
        if self._pose == 0 or self._pose > POSES:
            self._pose = 1
            self._outbox.text(MavSeverity.CRITICAL, "Place vehicle level and press any key.")
        self._tasks.start(_ACCEL, self._ask_for_pose(), self._clock.now_us)

    def _ask_for_pose(self) -> Task:
        # The request is repeated every second, and nothing cancels it.
        while True:
            self._outbox.send("COMMAND_LONG", command=VEHICLE_POS, param1=float(self._pose))
            yield POSE_EVERY_US

    def _take_pose(self, command: Command) -> None:
        """Take the operator's report that the vehicle lies as asked."""
        if not 1 <= self._pose <= POSES or command.p[0] != self._pose:
            self._outbox.answer(command, Result.FAILED)
            return
        self._outbox.answer(command, Result.ACCEPTED)
        # A vehicle that is never turned fails at its second pose.
        if self.pose_stuck and self._pose > 1:
            self._end_poses(FAILURE)
        else:
            self._tasks.after(_ACCEL, SAMPLE_US, self._next_pose, self._clock.now_us)

    def _next_pose(self) -> None:
        self._pose += 1
        if self._pose > POSES:
            self._end_poses(SUCCESS)
        else:
            self._tasks.start(_ACCEL, self._ask_for_pose(), self._clock.now_us)

    def _end_poses(self, outcome: int) -> None:
        """Report the outcome, every second until the next boot."""
        self._pose = outcome
        self._accels_us = self._clock.now_us
        if outcome == SUCCESS:
            self._outbox.text(MavSeverity.INFO, "Trim OK: roll=-0.00 pitch=-0.00 yaw=0.00")
            self._outbox.text(MavSeverity.CRITICAL, "Calibration successful")
            self._problems.add(REBOOT_ACCELS)
        else:
            self._outbox.text(MavSeverity.CRITICAL, "Calibration FAILED")
            self._problems.add("3D Accel calibration needed")
        self._tasks.start(_ACCEL, self._ask_for_pose(), self._clock.now_us)

    def _start_compasses(self, command: Command) -> None:
        """Calibrate the compasses of a mask; 0 is all. Progress and reports are sent only on request."""
        now_us = self._clock.now_us
        if self._state.armed or self._compassmot:
            self._outbox.answer(command, Result.FAILED)
            self._outbox.text(MavSeverity.NOTICE, "Disarm to allow compass calibration")
            return
        self._outbox.answer(command, Result.ACCEPTED)
        # A second start during a calibration is acknowledged, and changes nothing.
        if any(not compass.done(now_us) for compass in self._compasses):
            return
        mask = int(command.p[0]) if math.isfinite(command.p[0]) else 0
        chosen = [n for n in range(COMPASSES) if mask == 0 or mask & 1 << n]
        # However the calibration ends.
        self._problems.add(REBOOT_COMPASS)
        lasts_us = ONE_COMPASS_US if len(chosen) == 1 else THREE_COMPASSES_US
        self._compasses = [CompassCalibration(n, now_us, lasts_us) for n in chosen]
        self._tasks.after(_COMPASS, lasts_us, self._compasses_done, now_us)

    def _compasses_done(self) -> None:
        for compass in self._compasses:
            self._outbox.text(MavSeverity.INFO, f"Mag({compass.number}) good orientation: 0 1.2")

    def _end_compasses(self, command: Command) -> None:
        """Accept or cancel a compass calibration; neither is reported by a text."""
        self._outbox.answer(command, Result.ACCEPTED)
        self._compasses = []
        self._tasks.stop(_COMPASS)

    def mag_cal_progress(self) -> Fields | None:
        """Send MAG_CAL_PROGRESS for every compass but the last, and return that one's; None without any."""
        now_us = self._clock.now_us
        running = [compass for compass in self._compasses if not compass.done(now_us)]
        every: list[Fields] = [
            {
                "compass_id": compass.number,
                "cal_mask": self._compass_mask(),
                "cal_status": 2 if compass.percent(now_us) < 30 else 3,
                "attempt": 1,
                "completion_pct": compass.percent(now_us),
                "completion_mask": (255,) * (compass.percent(now_us) // 10)
                + (0,) * (10 - compass.percent(now_us) // 10),
            }
            for compass in running
        ]
        return self._send_all_but_last("MAG_CAL_PROGRESS", every)

    def mag_cal_report(self) -> Fields | None:
        """Send MAG_CAL_REPORT for every compass but the last, and return that one's; None without any.

        Reports are repeated until the calibration is accepted or cancelled.
        """
        done = [compass for compass in self._compasses if compass.done(self._clock.now_us)]
        every: list[Fields] = [
            {
                "compass_id": compass.number,
                "cal_mask": self._compass_mask(),
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
        return self._send_all_but_last("MAG_CAL_REPORT", every)

    def _compass_mask(self) -> int:
        return sum(1 << compass.number for compass in self._compasses)

    def _send_all_but_last(self, name: str, every: list[Fields]) -> Fields | None:
        for fields in every[:-1]:
            self._outbox.send(name, **fields)
        return every[-1] if every else None

    def _start_compassmot(self) -> None:
        # Measured: its acknowledgements are addressed to system 0, and only a COMMAND_ACK of a station ends it.
        self._compassmot = True
        self._outbox.send("COMMAND_ACK", command=PREFLIGHT_CALIBRATION, result=int(Result.ACCEPTED))
        self._outbox.text(MavSeverity.INFO, "Starting calibration")
        self._outbox.text(MavSeverity.INFO, "Current")
        self._tasks.start(_COMPASSMOT, self._turn_motors(), self._clock.now_us)

    def _turn_motors(self) -> Task:
        while True:
            yield COMPASSMOT_US
            self._outbox.text(MavSeverity.INFO, "Initialising ArduPilot")

    def hear_ack(self, frame: ReceivedFrame) -> None:
        """Take a COMMAND_ACK of a station: it ends compassmot."""
        if self._compassmot:
            self._compassmot = False
            self._tasks.stop(_COMPASSMOT)
            result = int(Result.ACCEPTED)
            self._outbox.reply(frame, "COMMAND_ACK", command=PREFLIGHT_CALIBRATION, result=result)
            self._outbox.text(MavSeverity.NOTICE, "Failed")

    def _test_motor(self, command: Command) -> None:
        """Turn one motor for some seconds; heartbeats have the armed bit meanwhile."""
        seconds = command.p[3]
        if self._state.armed or not math.isfinite(seconds) or not 0.0 <= seconds <= MAX_MOTOR_TEST_S:
            self._outbox.answer(command, Result.FAILED)
            return
        motor, throttle = command.p[0], command.p[2] / 100.0
        self.motor_test.start(MOTOR_OUTPUTS.get(motor, 0), min(max(throttle, 0.0), 1.0), round(seconds * 1e6))
        self._outbox.answer(command, Result.ACCEPTED)
