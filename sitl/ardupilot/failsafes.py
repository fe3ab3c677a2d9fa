"""When ArduCopter takes over: station lost, battery, position lost, fence. Texts and times as measured."""

from typing import TYPE_CHECKING

from sitl.common import missions
from sitl.common.fence import Shape, shapes_of
from sitl.common.states import LAND, NEED_POSITION, RTL, Phase, Severity, Stage

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter

POSITION_PATIENCE_US = 8_000_000
"""Without GPS the position is believed for so long."""
LAND_PAUSE_US = 4_500_000
STOPPED_AIDING_US = 15_000_000
POSITION_BACK_US, CLEARED_US = 600_000, 1_200_000
RETURN_ACTIONS = frozenset({2, 3, 4, 6})
"""BATT_FS_*_ACT: return, SmartRTL or …, landing sequence or return."""
FENCE_US = 100_000
_ALT_MAX, _CIRCLE, _POLYGON, _ALT_MIN = 1, 2, 4, 8
"""FENCE_TYPE."""
_NAMES = {_ALT_MAX: "Max Alt", _CIRCLE: "Circle", _POLYGON: "Polygon", _ALT_MIN: "Min Alt"}
_LEVELS = ("low", "critical")
_BATTERY_LEVELS = ((2, "BATT_CRT_VOLT", "BATT_CRT_MAH"), (1, "BATT_LOW_VOLT", "BATT_LOW_MAH"))


def watch(ap: "ArduCopter") -> None:
    """One tick of a booted vehicle."""
    if ap.gcs_heard_us is not None and "gcs" not in ap.failsafes and ap.params["FS_GCS_ENABLE"] > 0:
        _watch_gcs(ap, ap.now_us - ap.gcs_heard_us)
    _watch_battery(ap)
    if ap.gps_lost_us is not None or ap.gps_back_us is not None:
        _watch_position(ap)
    if ap.armed and ap.fence_on and ap.now_us >= ap.fence_due_us:
        ap.fence_due_us = ap.now_us + FENCE_US
        _watch_fence(ap)


def act(ap: "ArduCopter", text: str, mode: int | None) -> None:
    """Say it; on the ground stop the motors, in the air change the mode. No mode: only say it."""
    ap.text(Severity.WARNING, text)
    if mode is None or not ap.armed:
        return
    if ap.landed:
        ap.disarm()
    else:
        ap.set_mode(mode)


def _watch_gcs(ap: "ArduCopter", silence_us: int) -> None:
    if silence_us > ap.params["FS_GCS_TIMEOUT"] * 1e6:
        ap.failsafes.add("gcs")
        act(ap, "GCS Failsafe", RTL)


# Battery


def _watch_battery(ap: "ArduCopter") -> None:
    """Latched: only a reset of the battery (42651) or a reboot ends it."""
    level = _battery_level(ap)
    if level <= ap.battery_level:
        ap.battery_low_us = None if level == 0 else ap.battery_low_us
        return
    if ap.battery_low_us is None:
        ap.battery_low_us = ap.now_us
    by_charge = _left_mah(ap) < ap.params["BATT_LOW_MAH" if level == 1 else "BATT_CRT_MAH"]
    if not by_charge and ap.now_us - ap.battery_low_us < ap.params["BATT_LOW_TIMER"] * 1e6:
        return
    ap.battery_level, ap.battery_low_us = level, None
    if not ap.armed:
        return
    ap.text(
        Severity.WARNING,
        f"Battery 1 is {_LEVELS[level - 1]} {ap.voltage_v:.2f}V used {ap.consumed_mah:.0f} mAh",
    )
    action = int(ap.params["BATT_FS_LOW_ACT" if level == 1 else "BATT_FS_CRT_ACT"])
    if action <= 0:
        return
    ap.failsafes.add("battery")
    act(ap, "Battery Failsafe", RTL if action in RETURN_ACTIONS else LAND)


def _left_mah(ap: "ArduCopter") -> float:
    return ap.params["BATT_CAPACITY"] - ap.consumed_mah


def _battery_level(ap: "ArduCopter") -> int:
    """0 good, 1 low, 2 critical: what the voltage or the charge says now."""
    volts, left = ap.voltage_v, _left_mah(ap)
    for level, least_volt, least_mah in _BATTERY_LEVELS:
        if volts < ap.params[least_volt] or left < ap.params[least_mah]:
            return level
    return 0


# Position


def _watch_position(ap: "ArduCopter") -> None:
    if ap.gps_lost_us is None:
        _position_back(ap)
        return
    lost_us = ap.now_us - ap.gps_lost_us
    if lost_us >= POSITION_PATIENCE_US and not ap.position_lost:
        ap.position_lost = True
        ap.failsafes.add("ekf")
        ap.text(Severity.CRITICAL, "EKF variance")
        if ap.armed and ap.mode in NEED_POSITION | {LAND} and not ap.landed:
            ap.set_mode(LAND)
            _land_later(ap)
            ap.text(Severity.CRITICAL, "EKF Failsafe: changed to LAND Mode")
    if lost_us >= STOPPED_AIDING_US and not ap.aiding_stopped:
        ap.aiding_stopped = True
        ap.text(Severity.WARNING, "EKF3 IMU0 stopped aiding")


def _land_later(ap: "ArduCopter") -> None:
    """It stays at its height at first."""
    ap.vehicles.hold_here(ap.index)
    ap.enter(Phase.AIRBORNE)

    def land() -> None:
        if ap.armed and ap.mode == LAND and ap.phase == Phase.AIRBORNE:
            ap.begin_landing()

    ap.tasks.after("land", LAND_PAUSE_US, land, ap.now_us)


def _position_back(ap: "ArduCopter") -> None:
    back_us = ap.now_us - (ap.gps_back_us or 0)
    if back_us >= POSITION_BACK_US and ap.position_lost:
        ap.position_lost = ap.aiding_stopped = False
    if back_us >= CLEARED_US:
        ap.gps_back_us = None
        if "ekf" in ap.failsafes:
            ap.failsafes.discard("ekf")
            ap.text(Severity.CRITICAL, "EKF Failsafe Cleared")


# Fence


def fence_shapes(ap: "ArduCopter") -> tuple[Shape, ...]:
    """The stored polygons and circles."""
    if ap.shapes is None:
        ap.shapes = shapes_of(ap.plans.fence, ap.vehicles, ap.index)
    return ap.shapes


def fence_broken(ap: "ArduCopter", x: float, y: float, z: float) -> int:
    """FENCE_TYPE bits of the fences that do not allow to be there (metres in the vehicle's frame)."""
    chosen = int(ap.params["FENCE_TYPE"])
    height_m = z - ap.home_m[2]
    away_m = ((x - ap.home_m[0]) ** 2 + (y - ap.home_m[1]) ** 2) ** 0.5
    broken = 0
    if chosen & _ALT_MAX and height_m > ap.params["FENCE_ALT_MAX"]:
        broken |= _ALT_MAX
    if chosen & _ALT_MIN and height_m < ap.params["FENCE_ALT_MIN"]:
        broken |= _ALT_MIN
    if chosen & _CIRCLE and away_m > ap.params["FENCE_RADIUS"]:
        broken |= _CIRCLE
    if chosen & _POLYGON and not all(shape.allows(x, y) for shape in fence_shapes(ap)):
        broken |= _POLYGON
    return broken


def allowed(ap: "ArduCopter", place_m: tuple[float, float, float]) -> bool:
    """Whether a target may be there."""
    return not (ap.fence_on and fence_broken(ap, *place_m))


def _watch_fence(ap: "ArduCopter") -> None:
    broken = 0 if ap.phase <= Phase.SPOOL_UP else fence_broken(ap, *ap.vehicles.seen(ap.index))
    new, ap.breached = broken & ~ap.breached, broken
    if new:
        ap.breaches += 1
        names = [_NAMES[bit] for bit in (_ALT_MAX, _CIRCLE, _POLYGON, _ALT_MIN) if broken & bit]
        said = " and ".join([", ".join(names[:-1]), names[-1]] if names[1:] else names)
        ap.text(Severity.NOTICE, f"{said} fence{'s' if names[1:] else ''} breached")
        action = int(ap.params["FENCE_ACTION"])
        if action == 2:
            ap.set_mode(LAND)
        elif action > 0:
            ap.set_mode(RTL)
    elif not broken and ap.breach_told:
        ap.text(Severity.NOTICE, "Fence breach cleared")
    ap.breach_told = bool(broken)


def plans_changed(ap: "ArduCopter", kind: int) -> None:
    """Somebody changed a stored plan."""
    if kind == missions.FENCE:
        ap.shapes = None
    elif kind == missions.MISSION:
        ap.mission.changed()


def ready(ap: "ArduCopter") -> bool:
    """Whether its position can be used."""
    return ap.stage >= Stage.POSITION_OK and not ap.position_lost
