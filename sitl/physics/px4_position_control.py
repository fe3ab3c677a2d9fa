"""PX4's multicopter position control, all PX4 vehicles of a run together.

A position error becomes a velocity (P), a velocity error an acceleration (PI), and the air drags. The simulator that
PX4 was measured in (SIH: 1 kg, 1 N per m/s) flies circles of 60 m at 8 m/s 2 m too wide and 0.25 s late with position
and velocity set-points, and at 87 % of the speed with velocities alone. An acceleration in the set-point is a
feed-forward: it is added to what the errors ask for. If it contains the drag, a real PX4 keeps within 1 m of a patrol
tour; without it, it is 5 m off. Missions and DO_REPOSITION follow a trajectory that waits for the vehicle.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from sitl.physics.quantities import GRAVITY_M_S2, Array, no_longer

POSITION_P_HZ, POSITION_Z_P_HZ = 0.95, 1.0  # MPC_XY_P, MPC_Z_P
VELOCITY_P_HZ, VELOCITY_I_HZ2, VELOCITY_D = 1.8, 0.4, 0.2  # MPC_XY_VEL_*_ACC
VELOCITY_Z_P_HZ = 4.0  # MPC_Z_VEL_P_ACC
DRAG_HZ = 1.0  # SIH_KDV over SIH_MASS
WINDY_DRAG_HZ = 0.5
"""Drag in runs with wind. With SIH's drag, 8 m/s against 3 m/s of wind take 11 m/s², and 45 degrees of lean give 9.8:
such a vehicle is 8 m off whatever the set-point. A multicopter that flies 18 m/s at that lean has half the drag."""
MAX_SPEED_M_S = 12.0  # MPC_XY_VEL_MAX
CRUISE_M_S = 5.0  # MPC_XY_CRUISE
MAX_TILT_RAD = np.deg2rad(45.0)  # MPC_TILTMAX_AIR
MAX_LEAN_M_S2 = GRAVITY_M_S2 * float(np.tan(MAX_TILT_RAD))
ACCEL_M_S2, JERK_M_S3 = 3.0, 4.0  # MPC_ACC_HOR, MPC_JERK_AUTO
MAX_BEHIND_M = 2.0  # MPC_XY_ERR_MAX: a trajectory waits for a vehicle that is so far behind
UP_M_S, DOWN_M_S = 3.0, 1.5  # MPC_Z_V_AUTO_UP, _DN
ACCEL_Z_M_S2 = 3.0


class SetpointKind(IntEnum):
    """How the set-point of a vehicle is meant."""

    GOAL = 0
    """Fly to `goal_m` by a trajectory and stop there."""
    POINT = 1
    """`goal_m` is where to be now, `velocity_feed_m_s` how it moves."""
    VELOCITY = 2
    """Fly with `velocity_feed_m_s`."""


def trajectory_speed(distance_m: Array) -> Array:
    """Return the speed from which a stop within `distance_m` keeps to the limits of acceleration and jerk."""
    b = 4.0 * ACCEL_M_S2**2 / JERK_M_S3
    return 0.5 * (np.sqrt(b * b + 8.0 * ACCEL_M_S2 * distance_m) - b)


class Px4Control:
    """Set-points and control state; index k is the k-th PX4 vehicle, `rows[k]` its index among all vehicles."""

    def __init__(self, rows: NDArray[np.intp], drag_hz: float = DRAG_HZ) -> None:
        n = len(rows)
        self.rows, self._drag_hz = rows, drag_hz
        self.follow: NDArray[np.int8] = np.zeros(n, dtype=np.int8)
        self.goal_m: Array = np.zeros((n, 3))
        self.velocity_feed_m_s: Array = np.zeros((n, 3))
        self.accel_feed_m_s2: Array = np.zeros((n, 2))
        """(n, 2) acceleration feed-forward, on top of what the errors ask for."""
        self.hold_z: NDArray[np.bool_] = np.ones(n, dtype=bool)
        """False where only the vertical velocity is controlled, not the height."""
        self.cruise_m_s: Array = np.full(n, CRUISE_M_S)
        self.up_m_s: Array = np.full(n, UP_M_S)
        self.down_m_s: Array = np.full(n, DOWN_M_S)
        self._path_m: Array = np.zeros((n, 2))
        self._path_m_s: Array = np.zeros((n, 2))
        self._integral_m_s2: Array = np.zeros((n, 2))

    def begin(self, k: int, position_m: Array, velocity_m_s: Array) -> None:
        """Start a trajectory with the vehicle's place and speed."""
        self._path_m[k] = position_m[:2]
        self._path_m_s[k] = velocity_m_s[:2]

    def steer(
        self,
        k: int,
        follow: SetpointKind,
        velocity_m_s: tuple[float, float, float],
        *,
        hold_z: bool,
        accel_m_s2: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Set how a vehicle's set-point is meant, and its feed-forwards; the place is set in `goal_m`."""
        self.follow[k] = follow
        self.velocity_feed_m_s[k] = velocity_m_s
        self.accel_feed_m_s2[k] = accel_m_s2
        self.hold_z[k] = hold_z

    def rest(self, k: int) -> None:
        """Forget integral and trajectory of a vehicle that stands on the ground."""
        self._integral_m_s2[k] = 0.0
        self._path_m_s[k] = 0.0

    def change(self, dt_s: float, position_m: Array, velocity_m_s: Array, wind_m_s: Array) -> Array:
        """Return the (n, 3) change of velocity over `dt_s`; `position_m` (n, 3) is as seen, the velocity is true."""
        out = np.empty_like(velocity_m_s)
        out[:, :2] = self._horizontal(dt_s, position_m[:, :2], velocity_m_s[:, :2], wind_m_s)
        out[:, 2] = self._vertical(dt_s, position_m[:, 2], velocity_m_s[:, 2])
        return out

    def _horizontal(self, dt: float, position: Array, velocity: Array, wind: Array) -> Array:
        by_path = (self.follow == SetpointKind.GOAL)[:, None]
        if by_path.any():
            self._advance(dt, position)
        wanted_m = np.where(by_path, self._path_m, self.goal_m[:, :2])
        feed = np.where(by_path, self._path_m_s, self.velocity_feed_m_s[:, :2])
        controlled = (self.follow != SetpointKind.VELOCITY)[:, None]
        wanted = no_longer(feed + controlled * POSITION_P_HZ * (wanted_m - position), MAX_SPEED_M_S)
        error = wanted - velocity
        lean = self.accel_feed_m_s2 + VELOCITY_P_HZ * error + self._integral_m_s2
        limited = no_longer(lean, MAX_LEAN_M_S2)
        # The integral stands still while the lean is at its limit (anti-windup).
        free = np.all(lean == limited, axis=1)[:, None]
        self._integral_m_s2 += np.where(free, VELOCITY_I_HZ2 * dt * error, 0.0)
        change: Array = (limited - self._drag_hz * (velocity - wind)) * (dt / (1.0 + VELOCITY_D))
        return change

    def _advance(self, dt: float, position: Array) -> None:
        """Move the trajectories on; a trajectory waits for a vehicle that is behind."""
        left = self.goal_m[:, :2] - self._path_m
        distance = np.maximum(np.hypot(left[:, 0], left[:, 1]), 1e-9)
        speed = np.minimum(self.cruise_m_s, trajectory_speed(distance))
        wanted = left * (speed / distance)[:, None]
        self._path_m_s += no_longer(wanted - self._path_m_s, ACCEL_M_S2 * dt)
        gap = self._path_m - position
        # The trajectory waits only for a vehicle that is behind it, not for one that is ahead.
        behind = np.where(np.sum(gap * self._path_m_s, axis=1) > 0.0, np.hypot(gap[:, 0], gap[:, 1]), 0.0)
        share = 1.0 - np.clip(behind / MAX_BEHIND_M, 0.0, 1.0)
        self._path_m += self._path_m_s * (dt * share)[:, None]

    def _vertical(self, dt: float, height: Array, climb: Array) -> Array:
        correction = np.where(self.hold_z, POSITION_Z_P_HZ * (self.goal_m[:, 2] - height), 0.0)
        wanted = np.clip(self.velocity_feed_m_s[:, 2] + correction, -self.down_m_s, self.up_m_s)
        limit = ACCEL_Z_M_S2 * dt
        change: Array = np.clip(VELOCITY_Z_P_HZ * dt * (wanted - climb), -limit, limit)
        return change
