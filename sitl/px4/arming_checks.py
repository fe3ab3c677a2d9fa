"""PX4's arming checks: in which modes a vehicle could be armed and flown now, and why not in others.

The result is reported as EVENTs only (docs/autopilots.md "Events of PX4").
"""

from typing import NamedTuple

from sitl.common.platform import Part, Platform
from sitl.common.states import Stage
from sitl.px4.announcer import Announcer
from sitl.px4.battery import Px4Battery
from sitl.px4.inputs import ControlInputs
from sitl.px4.modes import EXTERNAL, MODES, TERMINATION
from sitl.px4.sd_log import SdLog

LOOK_US = 200_000
"""How often the checks run."""
REPORT_US = 2_000_000
"""Changes are reported at most this often."""
LEVELS_PROTOCOL, LEVELS_ERROR, LEVELS_CRITICAL, LEVELS_WARNING, LEVELS_INFO = 0x88, 0x33, 0x22, 0x44, 0x66
"""Values of log_levels, the severity of an EVENT."""

# Masks of navigation modes, and of health components, as recorded.
_ALWAYS, _WITH_POSITION, _WITH_STICKS = 0x80012A80, 0x807F3AB0, 0x8547
# The bits are groups of modes in arming_check_summary, an EVENT of log level 8.
_ALL = 0xFFFFFFFF
_MISSION_BIT, _OFFBOARD_BIT = 0x8, 0x4000
_SYSTEM, _LOCAL_POSITION, _COMMUNICATION, _BATTERY, _REMOTE_CONTROL, _GPS = 0x100000, 0x20000, 0x1000, 0x800, 0x80, 0x8
_PRESENT, _LOGGING = 0x3802180A, 0x400
"""Masks of health components; the logger is present only while a log is open."""
# health_component_index of an arming_check event.
_AT_GPS, _AT_REMOTE, _AT_BATTERY, _AT_LINKS, _AT_LOCAL, _AT_SYSTEM, _AT_GLOBAL = 3, 7, 11, 12, 17, 20, 24
_AT_ODID = 30
"""open_drone_id is bit 30 of health_component_t."""
ODID_REQUIRED = 2
"""Value of COM_ARM_ODID that refuses arming; 1 warns only."""


class CheckProblem(NamedTuple):
    """One arming_check event: a failed check, and the modes that it concerns."""

    event: str
    modes: int
    component: int
    levels: int


class CheckReport(NamedTuple):
    """The result of all checks."""

    errors: int
    warnings: int
    """Masks of the health components that failed their checks."""
    can_arm: int
    can_run: int
    """Masks of the modes that could be armed in, and flown, now."""
    problems: tuple[CheckProblem, ...]
    present: int = _PRESENT


class ArmingChecks(Part):
    """Runs the checks of one vehicle and reports changes of their result."""

    def __init__(
        self, platform: Platform, announcer: Announcer, inputs: ControlInputs, battery: Px4Battery, sd_log: SdLog
    ) -> None:
        super().__init__(platform)
        self._announcer, self._inputs, self._battery, self._sd_log = announcer, inputs, battery, sd_log
        self._report: CheckReport | None = None
        self._due_us = 0

    def watch(self) -> None:
        """Run the checks when they are due, and report a result that has changed."""
        now_us = self._clock.now_us
        if self._due_us <= now_us:
            self._due_us = now_us + LOOK_US
            report = self.check()
            if report != self._report:
                self._report = report
                # The reasons of a refused arming are in these EVENTs only, so each change is reported, but at most
                # every 2 s.
                self._due_us = now_us + REPORT_US
                self._send(report)

    def can_run(self, mode: int) -> bool:
        """Return whether a mode could be flown now."""
        return bool(self.check().can_run & bit(mode))

    def can_arm(self, mode: int) -> bool:
        """Return whether the vehicle could be armed in a mode now."""
        return self._state.stage >= Stage.ALL_OK and bool(self.check().can_arm & bit(mode))

    def check(self) -> CheckReport:
        """Run all checks on the present state."""
        problems: list[CheckProblem] = []
        errors = warnings = 0
        can_run = _WITH_POSITION
        if self._state.stage < Stage.HOME_SET or self._inputs.position_lost:
            can_run = _ALWAYS
            errors |= _LOCAL_POSITION | 0x1000000
            if self._inputs.position_lost:
                warnings |= _GPS
                problems.append(CheckProblem("check_estimator_gps_fix_too_low", 0x7E007C, _AT_GPS, LEVELS_WARNING))
            problems.append(CheckProblem("check_modes_local_pos", 0x7E007C, _AT_LOCAL, LEVELS_ERROR))
            problems.append(CheckProblem("check_modes_global_pos", 0x38, _AT_GLOBAL, LEVELS_ERROR))
        if self._plans.feasible:
            # Mission needs a position as well as a feasible mission.
            can_run |= _MISSION_BIT if can_run == _WITH_POSITION else 0
        else:
            problems.append(CheckProblem("check_modes_mission", _MISSION_BIT, _AT_SYSTEM, LEVELS_INFO))
        if self._inputs.stream_alive:
            can_run |= _OFFBOARD_BIT
        else:
            errors |= _SYSTEM
            problems.append(CheckProblem("check_modes_offboard_signal", _OFFBOARD_BIT, _AT_SYSTEM, LEVELS_ERROR))
        if self._inputs.sticks_alive:
            can_run |= _WITH_STICKS
        else:
            warnings |= _REMOTE_CONTROL
            problems.append(CheckProblem("check_modes_manual_control", _ALL, _AT_REMOTE, LEVELS_WARNING))
        can_arm = can_run
        if not self._announcer.gcs_alive:
            problems.append(CheckProblem("check_rc_dl_no_dllink", _ALL, _AT_LINKS, LEVELS_INFO))
            # Without a failsafe for it, a missing station is a remark; with one, it refuses arming.
            if self._params["NAV_DLL_ACT"] > 0:
                errors |= _COMMUNICATION
                can_arm = 0
        # No Remote ID transmitter is simulated, so the check always fails.
        if self._params["COM_ARM_ODID"] > 0:
            required = self._params["COM_ARM_ODID"] == ODID_REQUIRED
            can_arm = 0 if required else can_arm
            levels = LEVELS_ERROR if required else LEVELS_WARNING
            problems.append(CheckProblem("check_open_drone_id_missing", _ALL, _AT_ODID, levels))
        battery = self._battery.warning
        if battery:
            errors |= _BATTERY
            problems.append(CheckProblem(f"check_battery_{battery}", _ALL, _AT_BATTERY, LEVELS_CRITICAL))
            if battery != "low":
                can_arm = 0
        present = _PRESENT | (_LOGGING if self._sd_log.is_open else 0)
        return CheckReport(errors, warnings, can_arm, can_run, tuple(problems), present)

    def _send(self, report: CheckReport) -> None:
        event = self._announcer.event
        event("commander_arming_check_summary", 0, *report[:4], levels=LEVELS_PROTOCOL)
        for problem in report.problems:
            event(problem.event, problem.modes, problem.component, levels=problem.levels)
        event("commander_health_summary", 0, report.present, 0, 0, levels=LEVELS_PROTOCOL)


def bit(mode: int) -> int:
    """Return the bit of a mode in the masks."""
    if mode == TERMINATION:
        return 0x2000
    if mode in EXTERNAL:
        return 0
    return MODES[mode].bit if mode in MODES else 0
