"""PX4's arming checks: which modes could be armed and flown now, and why others not, told as EVENTs."""

from typing import TYPE_CHECKING, NamedTuple

from sitl.common.states import Stage
from sitl.px4.modes import EXTERNAL, MODES, TERMINATION

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

LOOK_US = 200_000
"""How often the checks run."""
REPORT_US = 2_000_000
"""Changes are told at most this often."""
LEVEL_PROTOCOL, LEVEL_ERROR, LEVEL_CRITICAL, LEVEL_WARNING, LEVEL_INFO = 0x88, 0x33, 0x22, 0x44, 0x66

# Masks of navigation modes, and of health components, as recorded.
_ALWAYS, _WITH_POSITION, _WITH_STICKS = 0x80012A80, 0x807F3AB0, 0x8547
_ALL = 0xFFFFFFFF
_SYSTEM, _LOCAL_POSITION, _BATTERY, _REMOTE_CONTROL, _MISSION_BIT, _OFFBOARD_BIT = (
    0x100000,
    0x20000,
    0x800,
    0x80,
    0x8,
    0x4000,
)
_GPS, _COMMUNICATION = 0x8, 0x1000
_PRESENT, _LOGGING = 0x3802180A, 0x400
"""Of health components; the logger only while a log is open."""
# health_component_index of an arming_check event.
_AT_GPS, _AT_REMOTE, _AT_BATTERY, _AT_LINKS, _AT_LOCAL, _AT_SYSTEM, _AT_GLOBAL = 3, 7, 11, 12, 17, 20, 24
_AT_ODID = 30
"""open_drone_id is bit 30 of health_component_t."""
ODID_REQUIRED = 2
"""COM_ARM_ODID: 1 warns only."""


class Problem(NamedTuple):
    """One arming_check event."""

    event: str
    modes: int
    component: int
    levels: int


class Report(NamedTuple):
    """What the checks found."""

    errors: int
    warnings: int
    can_arm: int
    can_run: int
    problems: tuple[Problem, ...]
    present: int = _PRESENT


def check(ap: "Px4") -> Report:
    """Look at everything."""
    problems: list[Problem] = []
    errors = warnings = 0
    can_run = _WITH_POSITION
    if ap.stage < Stage.HOME_SET or ap.gps_gone:
        can_run = _ALWAYS
        errors |= _LOCAL_POSITION | 0x1000000
        if ap.gps_gone:
            warnings |= _GPS
            problems.append(Problem("check_estimator_gps_fix_too_low", 0x7E007C, _AT_GPS, LEVEL_WARNING))
        problems.append(Problem("check_modes_local_pos", 0x7E007C, _AT_LOCAL, LEVEL_ERROR))
        problems.append(Problem("check_modes_global_pos", 0x38, _AT_GLOBAL, LEVEL_ERROR))
    if ap.mission_ready:
        can_run |= _MISSION_BIT if can_run == _WITH_POSITION else 0
    else:
        problems.append(Problem("check_modes_mission", _MISSION_BIT, _AT_SYSTEM, LEVEL_INFO))
    if ap.stream_alive:
        can_run |= _OFFBOARD_BIT
    else:
        errors |= _SYSTEM
        problems.append(Problem("check_modes_offboard_signal", _OFFBOARD_BIT, _AT_SYSTEM, LEVEL_ERROR))
    if ap.sticks_alive:
        can_run |= _WITH_STICKS
    else:
        warnings |= _REMOTE_CONTROL
        problems.append(Problem("check_modes_manual_control", _ALL, _AT_REMOTE, LEVEL_WARNING))
    can_arm = can_run
    if not ap.gcs_alive:
        problems.append(Problem("check_rc_dl_no_dllink", _ALL, _AT_LINKS, LEVEL_INFO))
        if ap.params["NAV_DLL_ACT"] > 0:
            errors |= _COMMUNICATION
            can_arm = 0
    if ap.params["COM_ARM_ODID"] > 0:  # there is no such transmitter
        required = ap.params["COM_ARM_ODID"] == ODID_REQUIRED
        can_arm = 0 if required else can_arm
        levels = LEVEL_ERROR if required else LEVEL_WARNING
        problems.append(Problem("check_open_drone_id_missing", _ALL, _AT_ODID, levels))
    battery = ap.battery_warning
    if battery:
        errors |= _BATTERY
        problems.append(Problem(f"check_battery_{battery}", _ALL, _AT_BATTERY, LEVEL_CRITICAL))
        if battery != "low":
            can_arm = 0
    present = _PRESENT | (_LOGGING if ap.log_open else 0)
    return Report(errors, warnings, can_arm, can_run, tuple(problems), present)


def bit(mode: int) -> int:
    """A mode's bit in the masks."""
    if mode == TERMINATION:
        return 0x2000
    if mode in EXTERNAL:
        return 0
    return MODES[mode].bit if mode in MODES else 0


def tell(ap: "Px4", report: Report) -> None:
    """All of it, as EVENTs."""
    ap.event("commander_arming_check_summary", 0, *report[:4], levels=LEVEL_PROTOCOL)
    for problem in report.problems:
        ap.event(problem.event, problem.modes, problem.component, levels=problem.levels)
    ap.event("commander_health_summary", 0, report.present, 0, 0, levels=LEVEL_PROTOCOL)
