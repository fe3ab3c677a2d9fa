"""GUIDED set-points: SET_POSITION_TARGET_GLOBAL_INT / _LOCAL_NED and DO_REPOSITION.

As measured: nothing is ever acknowledged, and what cannot be flown is dropped without a word.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sitl.ardupilot import failsafes as ardupilot_failsafes
from sitl.common.autopilot import Autopilot
from sitl.common.states import GUIDED, Phase
from sitl.physics.point_masses import BRAKE_M_S2, approach_speed

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter

Point = tuple[float, float, float]

FRAMES_AMSL = frozenset({0, 5})
FRAMES_RELATIVE = frozenset({3, 6})
FRAMES_TERRAIN = frozenset({10, 11})
LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED = 1, 7, 8, 9

FARTHEST_M = 3e7
"""Numbers beyond the size of the Earth (and NaN) are not targets."""

AVOID_FENCE = 1
"""AVOID_ENABLE, bit 0."""
CREEP_M_S, AT_MARGIN_M, CLOSE_M, LEAST_M_S = 2.0, 0.2, 0.05, 0.05
_IGNORE_POSITION, _IGNORE_VELOCITY, _IGNORE_ACCEL, _IGNORE_YAW = 0x007, 0x038, 0x1C0, 0x400


def global_target(ap: "ArduCopter", fields: dict[str, Any]) -> None:
    """SET_POSITION_TARGET_GLOBAL_INT."""
    velocity = _velocity(ap, fields, body=False)
    if fields["type_mask"] & _IGNORE_POSITION:
        _take(ap, fields, None, velocity)
        return
    position = place(ap, fields["coordinate_frame"], fields["lat_int"], fields["lon_int"], fields["alt"])
    if position is not None:
        _take(ap, fields, position, velocity)


def local_target(ap: "ArduCopter", fields: dict[str, Any]) -> None:
    """SET_POSITION_TARGET_LOCAL_NED: about the EKF origin, or offsets along NED or body axes."""
    frame = fields["coordinate_frame"]
    if frame not in (LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED):
        return
    body = frame in (BODY_NED, BODY_OFFSET_NED)
    velocity = _velocity(ap, fields, body=body)
    if fields["type_mask"] & _IGNORE_POSITION:
        _take(ap, fields, None, velocity)
        return
    east, north = rotated(ap, fields["x"], fields["y"]) if body else (fields["y"], fields["x"])
    x0, y0, z0 = (0.0, 0.0, 0.0) if frame == LOCAL_NED else ap.vehicles.seen(ap.index)
    _take(ap, fields, (x0 + east, y0 + north, z0 - fields["z"]), velocity)


def place(ap: Autopilot, frame: int, lat_1e7: int, lon_1e7: int, alt_m: float) -> Point | None:
    """Place in the vehicle's frame; None for frames and coordinates it does not take."""
    if abs(lat_1e7) > 900_000_000 or abs(lon_1e7) > 1_800_000_000 or not abs(alt_m) <= FARTHEST_M:
        return None
    x, y = ap.vehicles.to_local(ap.index, lat_1e7 / 1e7, lon_1e7 / 1e7)
    if frame in FRAMES_AMSL:
        return x, y, alt_m - ap.spec.ground_amsl_m
    if frame in FRAMES_RELATIVE:
        return x, y, alt_m + ap.home_m[2]
    if frame in FRAMES_TERRAIN:
        # Measured: without terrain data it believes the ground to be at sea level, stays and sinks.
        here = ap.vehicles.seen(ap.index)
        return here[0], here[1], alt_m - ap.spec.ground_amsl_m
    return None


def rotated(ap: Autopilot, forward: float, right: float) -> tuple[float, float]:
    """East and north of body axes."""
    yaw = float(ap.vehicles.yaw_rad[ap.index])
    sin, cos = math.sin(yaw), math.cos(yaw)
    return forward * sin + right * cos, forward * cos - right * sin


def _velocity(ap: Autopilot, fields: dict[str, Any], *, body: bool) -> Point | None:
    if fields["type_mask"] & _IGNORE_VELOCITY:
        return None
    if body:
        east, north = rotated(ap, fields["vx"], fields["vy"])
    else:
        east, north = fields["vy"], fields["vx"]
    return east, north, -fields["vz"]


def _take(ap: "ArduCopter", fields: dict[str, Any], position: Point | None, velocity: Point | None) -> None:
    """Follow a target, if mode and state allow it."""
    numbers = (position or ()) + (velocity or ())
    if not numbers or not all(abs(number) <= FARTHEST_M for number in numbers):
        return
    if not flies_guided(ap) or (position is not None and not ardupilot_failsafes.allowed(ap, position)):
        return
    if not fields["type_mask"] & _IGNORE_YAW and math.isfinite(fields["yaw"]):
        ap.vehicles.yaw_target_rad[ap.index] = fields["yaw"] % (2.0 * math.pi)
    elif position is not None:
        ap.vehicles.yaw_target_rad[ap.index] = math.nan
    fly(ap, position, velocity)


def flies_guided(ap: "ArduCopter") -> bool:
    """Set-points are obeyed only in GUIDED and off the ground."""
    return ap.mode == GUIDED and ap.armed and ap.phase in (Phase.TAKEOFF, Phase.AIRBORNE)


def fly(ap: "ArduCopter", position: Point | None, velocity: Point | None) -> None:
    """Hand a target to the position controller. Only velocities expire (GUID_TIMEOUT)."""
    ap.fly_target()
    kind = (position is not None, velocity is not None)
    if kind != ap.guided_kind:
        ap.guided_kind = kind
        if velocity is not None:  # the controller for velocities begins with WPNAV_SPEED
            ap.load_speeds()
    ap.target_expires_us = None
    ap.asked_m_s = None if position is not None else velocity
    if velocity is not None:
        ap.target_expires_us = ap.now_us + round(ap.params["GUID_TIMEOUT"] * 1e6)
    if position is None:
        ap.vehicles.set_velocity(ap.index, velocity or (0.0, 0.0, 0.0))
        if ap.fence_on and velocity is not None:
            heed_fence(ap, velocity)
        return
    ap.vehicles.set_target(ap.index, position, velocity or (0.0, 0.0, 0.0))
    ap.shown_target_m = position


def heed_fence(ap: "ArduCopter", asked_m_s: Point) -> None:
    """A velocity towards the fence: it brakes to stand `AVOID_MARGIN` before it, then creeps out all the same.

    Measured at a circle of 40 m, asked for 5 and 6 m/s: slower from 8 m before it on, 0.3 m/s at 38.2 m, then out with
    up to 2 m/s, breached at 40.0 m, 41.1 m at most. Places beyond a fence are dropped before this.
    """
    speed = math.hypot(*asked_m_s[:2])
    if not int(ap.params["AVOID_ENABLE"]) & AVOID_FENCE or speed < LEAST_M_S:
        return
    margin_m = ap.params["AVOID_MARGIN"]
    clear_m = _clear_m(ap, (asked_m_s[0] / speed, asked_m_s[1] / speed), speed * speed / BRAKE_M_S2 + speed + margin_m)
    gap_m = clear_m - margin_m
    limit = float(approach_speed(np.array(gap_m), BRAKE_M_S2)) if gap_m > AT_MARGIN_M else CREEP_M_S
    share = min(1.0, limit / speed)
    east, north, up = asked_m_s
    ap.vehicles.target_velocity_m_s[ap.index] = (east * share, north * share, up)


def _clear_m(ap: "ArduCopter", direction: tuple[float, float], farthest_m: float) -> float:
    """How far it may go that way; infinite if `farthest_m` is still inside."""
    x, y, z = ap.vehicles.seen(ap.index)

    def broken(way_m: float) -> bool:
        return bool(ardupilot_failsafes.fence_broken(ap, x + direction[0] * way_m, y + direction[1] * way_m, z))

    if not broken(farthest_m):
        return math.inf
    inside_m, outside_m = 0.0, farthest_m
    while outside_m - inside_m > CLOSE_M:
        middle_m = (inside_m + outside_m) / 2.0
        inside_m, outside_m = (inside_m, middle_m) if broken(middle_m) else (middle_m, outside_m)
    return inside_m
