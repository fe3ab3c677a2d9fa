"""Physics: acceleration-limited point masses, all vehicles stepped together.

Each vehicle has its own frame: ENU metres about the place where it was put down, z = 0 on the ground.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from sitl.links.signing import SigningSpec
from sitl.physics.px4_position_control import DRAG_HZ, WINDY_DRAG_HZ, Px4Control
from sitl.physics.quantities import GRAVITY_M_S2, Array, Flags, no_longer
from sitl.physics.weather import Weather, WeatherSpec

AutopilotName = Literal["ardupilot", "px4"]

SPEED_M_S = 10.0  # WPNAV_SPEED
CLIMB_M_S = 2.5  # WPNAV_SPEED_UP
DESCENT_M_S = 1.5  # WPNAV_SPEED_DN
ACCEL_M_S2 = 2.5  # WPNAV_ACCEL: never exceeded horizontally on the way to a place
ACCEL_Z_M_S2 = 2.0
BRAKE_M_S2 = 2.0  # planned deceleration: below ACCEL_M_S2, so that there is something left to correct with
BRAKE_Z_M_S2 = 1.0  # WPNAV_ACCEL_Z
POSITION_GAIN_HZ = 1.5
MIN_FOLLOW_S, MAX_FOLLOW_S = 0.04, 0.5  # time between set-points that follow a moving target
FOLLOW_GAIN_HZ, FOLLOW_S = 0.8, 0.8
"""A stream of moving places is followed like that: position errors to velocities, velocity errors to accelerations.

The real one, on patrol tours, is left behind by 1.0 s^2 times its course's acceleration: outside in curves, late where
it speeds up. It takes no acceleration along, nor guesses one.
"""
FOLLOW_ACCEL_M_S2 = 3.5
"""Its lean allows more; with WPNAV_ACCEL it would circle outside of what turns at 2.2 m/s2 for ever."""
LEAN_M_S2 = GRAVITY_M_S2 * float(np.tan(np.deg2rad(30.0)))  # ANGLE_MAX
DRAG_1_M = GRAVITY_M_S2 / 18.0**2
"""In runs with wind: 18 m/s at 45 degrees of lean, as the simulated PX4s. ArduPilot's own simulator drags more (15 m/s
at that lean): real ArduCopters on tours at 8 m/s were 8 m off in 3 m/s of wind, and 0.6 m at 6 m/s."""
GENTLE_M_S = 2.0  # a target this fast is approached with half the deceleration
YAW_RATE_RAD_S = np.deg2rad(60.0)
YAW_SPEED_M_S = 1.0  # slower than this a vehicle keeps its heading
MAX_STEP_S = 0.05
MAX_VERTICAL_M_S = 10.0
WIND_DRIFT = 0.3  # a gust carries a vehicle away with this share of its speed
FALL_M_S = 10.7  # measured: thrust lost, 20 m to the ground in 3.2 s

WGS84_A_M = 6378137.0
WGS84_E2 = 6.69437999014e-3


@dataclass(frozen=True)
class VehicleSpec:
    """One simulated vehicle and where it stands."""

    system_id: int
    lat_deg: float
    lon_deg: float
    ground_amsl_m: float
    heading_deg: float = 0.0
    signing: SigningSpec = field(default_factory=SigningSpec)
    autopilot: AutopilotName = "ardupilot"
    sitl_rates: bool = False
    """PX4: stream as fast as its SITL start script wants (368 frames/s) instead of a real vehicle's rates."""


def approach_speed(distance_m: Array, decel_m_s2: Array | float) -> Array:
    """Speed from which a stop at `distance_m` is still possible.

    Square-root profile with a linear end, as ArduPilot's `sqrt_controller`: the deceleration is at most
    `decel_m_s2` and the end is an exponential, so there is no overshoot.
    """
    linear_m = decel_m_s2 / POSITION_GAIN_HZ**2
    far = np.sqrt(np.maximum(2.0 * decel_m_s2 * (distance_m - 0.5 * linear_m), 0.0))
    return np.where(distance_m < linear_m, distance_m * POSITION_GAIN_HZ, far)


def stopping_distance_m(speed_m_s: float, decel_m_s2: float) -> float:
    """Distance at which `approach_speed` equals `speed_m_s`: where braking now would end."""
    if speed_m_s <= decel_m_s2 / POSITION_GAIN_HZ:
        return speed_m_s / POSITION_GAIN_HZ
    return speed_m_s**2 / (2.0 * decel_m_s2) + decel_m_s2 / (2.0 * POSITION_GAIN_HZ**2)


class Vehicles:
    """State and targets of n vehicles (struct of arrays). The autopilots write the targets."""

    def __init__(self, specs: Sequence[VehicleSpec], weather: WeatherSpec | None = None, seed: int = 0) -> None:
        n = len(specs)
        self.weather = Weather(weather or WeatherSpec(), n, seed)
        px4 = np.flatnonzero([s.autopilot == "px4" for s in specs])
        self.px4 = Px4Control(px4, WINDY_DRAG_HZ if self.weather.windy else DRAG_HZ)
        lat_rad = np.deg2rad([s.lat_deg for s in specs])
        bend = 1.0 - WGS84_E2 * np.sin(lat_rad) ** 2
        self.origin_lat_deg: Array = np.array([s.lat_deg for s in specs], dtype=np.float64)
        self.origin_lon_deg: Array = np.array([s.lon_deg for s in specs], dtype=np.float64)
        self.ground_amsl_m: Array = np.array([s.ground_amsl_m for s in specs], dtype=np.float64)
        self.m_per_deg_lat: Array = np.deg2rad(WGS84_A_M * (1.0 - WGS84_E2) / bend**1.5)
        self.m_per_deg_lon: Array = np.deg2rad(WGS84_A_M * np.cos(lat_rad) / np.sqrt(bend))

        self._drifts: Flags = np.array([s.autopilot == "ardupilot" for s in specs], dtype=bool)
        """PX4's control has drag of its own."""
        self.position_m: Array = np.zeros((n, 3))
        self.velocity_m_s: Array = np.zeros((n, 3))
        self.accel_m_s2: Array = np.zeros((n, 3))
        self.yaw_rad: Array = np.deg2rad([s.heading_deg % 360.0 for s in specs])

        self.flying: Flags = np.zeros(n, dtype=bool)
        """Motors lift; False on the ground."""
        self.falling: Flags = np.zeros(n, dtype=bool)
        """No thrust."""
        self.target_m: Array = np.zeros((n, 3))
        """Moves on with `target_velocity_m_s` by itself."""
        self.target_velocity_m_s: Array = np.zeros((n, 3))
        """Fed forward. Without position control this is the demanded velocity."""
        self.follows_s: Array = np.zeros(n)
        """A stream of moving places is believed to go on for so long."""
        self.target_age_s: Array = np.full(n, np.inf)
        self._said_velocity_m_s: Array = np.zeros((n, 2))
        self.hold_xy: Array = np.ones(n)
        """1.0: position controlled horizontally, 0.0: velocity only."""
        self.hold_z: Array = np.ones(n)
        self.yaw_target_rad: Array = np.full(n, np.nan)
        """NaN: nose to the direction of travel."""
        self.speed_m_s: Array = np.full(n, SPEED_M_S)
        self.climb_m_s: Array = np.full(n, CLIMB_M_S)
        self.descent_m_s: Array = np.full(n, DESCENT_M_S)

    def step(self, dt_s: float) -> None:
        """Advance by `dt_s`, in equal substeps of at most MAX_STEP_S."""
        substeps = max(1, int(np.ceil(dt_s / MAX_STEP_S - 1e-9)))
        self.weather.step(dt_s)
        if not (self.flying.any() or self.falling.any()):
            return
        for _ in range(substeps):
            self._substep(dt_s / substeps)

    def _substep(self, dt: float) -> None:
        before = self.velocity_m_s
        change = np.empty_like(before)
        change[:, :2] = self._horizontal_change(dt)
        change[:, 2] = self._vertical_change(dt)
        rows = self.px4.rows
        if rows.size:
            change[rows] = self.px4.change(dt, self.seen_m[rows], before[rows], self.weather.wind_m_s[rows])
        self._move_targets(dt)
        velocity = np.where(self.flying[:, None], before + change, before)
        if self.falling.any():
            velocity[self.falling, 2] = np.maximum(before[self.falling, 2] - GRAVITY_M_S2 * dt, -FALL_M_S)
        position = self.position_m + (before + velocity) * (0.5 * dt)
        if self.weather.windy:
            position[:, :2] += self.weather.surprise_m_s * (self._drifts & self.flying)[:, None] * (WIND_DRIFT * dt)
        ground = (position[:, 2] <= 0.0) & (velocity[:, 2] <= 0.0)
        position[ground, 2] = 0.0
        velocity[ground] = 0.0
        self.falling &= ~ground
        self.accel_m_s2 = (velocity - before) / dt
        self.position_m, self.velocity_m_s = position, velocity
        self._turn(dt)

    def _move_targets(self, dt: float) -> None:
        self.target_m += self.target_velocity_m_s * (self.flying[:, None] * dt)
        self.follows_s -= dt
        self.target_age_s += dt

    def _horizontal_change(self, dt: float) -> Array:
        error = self.target_m[:, :2] - self.seen_m[:, :2]
        distance = np.maximum(np.hypot(error[:, 0], error[:, 1]), 1e-9)
        carried = self.target_velocity_m_s[:, :2]
        # A single moving target is closed in on gently.
        decel = BRAKE_M_S2 / (1.0 + np.hypot(carried[:, 0], carried[:, 1]) / GENTLE_M_S)
        follows = self.follows_s > 0.0
        closing = approach_speed(distance, decel)
        pulled = np.minimum(approach_speed(distance, ACCEL_M_S2), FOLLOW_GAIN_HZ * distance)
        closing = np.where(follows, pulled, closing)
        correction = self.hold_xy * closing / distance
        wanted = carried + error * correction[:, None]
        speed = np.hypot(wanted[:, 0], wanted[:, 1])
        wanted *= np.minimum(1.0, self.speed_m_s / np.maximum(speed, 1e-9))[:, None]
        change = (wanted - self.velocity_m_s[:, :2]) * np.where(follows, dt / FOLLOW_S, 1.0)[:, None]
        size = np.hypot(change[:, 0], change[:, 1])
        limit = np.where(follows, FOLLOW_ACCEL_M_S2, ACCEL_M_S2)
        change *= np.minimum(1.0, limit * dt / np.maximum(size, 1e-9))[:, None]
        return self._as_it_can_lean(change, dt) if self.weather.windy else change

    def _as_it_can_lean(self, change: Array, dt: float) -> Array:
        """What is left of a change of velocity when the air drags: more than its lean gives is not to be had."""
        through_air = self.velocity_m_s[:, :2] - self.weather.wind_m_s
        drag = DRAG_1_M * np.hypot(through_air[:, 0], through_air[:, 1])[:, None] * through_air
        left: Array = (no_longer(change / dt + drag, LEAN_M_S2) - drag) * dt
        return left

    def _vertical_change(self, dt: float) -> Array:
        error = self.target_m[:, 2] - self.seen_m[:, 2]
        correction = self.hold_z * np.copysign(approach_speed(np.abs(error), BRAKE_Z_M_S2), error)
        # A demanded velocity is not limited: measured, ArduCopter flies vz = -6 with WPNAV_SPEED_UP 250.
        wanted = self.target_velocity_m_s[:, 2] + np.clip(correction, -self.descent_m_s, self.climb_m_s)
        wanted = np.clip(wanted, -MAX_VERTICAL_M_S, MAX_VERTICAL_M_S)
        limit = ACCEL_Z_M_S2 * dt
        return np.clip(wanted - self.velocity_m_s[:, 2], -limit, limit)

    def _turn(self, dt: float) -> None:
        v = self.velocity_m_s
        course = np.arctan2(v[:, 0], v[:, 1])
        moving = np.hypot(v[:, 0], v[:, 1]) > YAW_SPEED_M_S
        wanted = np.where(np.isnan(self.yaw_target_rad), np.where(moving, course, self.yaw_rad), self.yaw_target_rad)
        turn = (wanted - self.yaw_rad + np.pi) % (2.0 * np.pi) - np.pi
        limit = YAW_RATE_RAD_S * dt * self.flying
        self.yaw_rad = (self.yaw_rad + np.clip(turn, -limit, limit)) % (2.0 * np.pi)

    def hold_here(self, i: int) -> None:
        """Target = the place where braking now ends."""
        vx, vy, vz = (float(v) for v in self.velocity_m_s[i])
        speed = float(np.hypot(vx, vy))
        ahead = stopping_distance_m(speed, BRAKE_M_S2) / speed if speed > 1e-6 else 0.0
        rise = np.copysign(stopping_distance_m(abs(vz), BRAKE_Z_M_S2), vz)
        x, y, z = self.seen(i)
        self.set_target(i, (x + vx * ahead, y + vy * ahead, max(z + rise, 0.0)))

    def set_target(
        self, i: int, position_m: tuple[float, float, float], velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        """Fly to a place that moves on with `velocity_m_s`.

        Places that move and follow each other closely are followed, not flown to one by one.
        """
        age_s = float(self.target_age_s[i])
        said = np.array(velocity_m_s[:2])
        streamed = MIN_FOLLOW_S < age_s <= MAX_FOLLOW_S and self.hold_xy[i]
        both_move = said.any() and self._said_velocity_m_s[i].any()
        self.follows_s[i] = 1.5 * age_s if streamed and both_move else 0.0
        self._said_velocity_m_s[i] = said
        self.target_age_s[i] = 0.0
        self.target_m[i] = position_m
        self.target_velocity_m_s[i] = velocity_m_s
        self.hold_xy[i] = self.hold_z[i] = 1.0

    def set_velocity(self, i: int, velocity_m_s: tuple[float, float, float]) -> None:
        """Fly with a velocity; positions are not held."""
        self.target_velocity_m_s[i] = velocity_m_s
        self.hold_xy[i] = self.hold_z[i] = 0.0

    def sink(self, i: int, rate_m_s: float) -> None:
        """Keep the place where braking now ends, go down at `rate_m_s`."""
        self.hold_here(i)
        self.hold_z[i] = 0.0
        self.target_velocity_m_s[i, 2] = -rate_m_s

    def rest(self, i: int) -> None:
        """Motors off or idle. In the air it falls."""
        self.flying[i] = False
        self.falling[i] = bool(self.position_m[i, 2] > 0.0)
        self.target_velocity_m_s[i] = 0.0
        if not self.falling[i]:
            self.velocity_m_s[i] = 0.0
            self.accel_m_s2[i] = 0.0

    @property
    def seen_m(self) -> Array:
        """(n, 3) where the vehicles believe to be."""
        return self.position_m + self.weather.gps_error_m if self.weather.noisy else self.position_m

    def seen(self, i: int) -> tuple[float, float, float]:
        """Where vehicle i believes to be, in its frame."""
        x, y, z = self.position_m[i].tolist()
        if self.weather.noisy:
            dx, dy, dz = self.weather.gps_error_m[i].tolist()
            return x + dx, y + dy, z + dz
        return x, y, z

    @property
    def lat_deg(self) -> Array:
        """(n,) true latitudes."""
        return self.origin_lat_deg + self.position_m[:, 1] / self.m_per_deg_lat

    @property
    def lon_deg(self) -> Array:
        """(n,) true longitudes."""
        return self.origin_lon_deg + self.position_m[:, 0] / self.m_per_deg_lon

    def to_geodetic(self, i: int, x_m: float, y_m: float) -> tuple[float, float]:
        """Latitude and longitude (degrees) of a place in vehicle i's frame."""
        lat = float(self.origin_lat_deg[i] + y_m / self.m_per_deg_lat[i])
        return lat, float(self.origin_lon_deg[i] + x_m / self.m_per_deg_lon[i])

    def to_local(self, i: int, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """Place in vehicle i's frame, metres east and north."""
        x = (lon_deg - self.origin_lon_deg[i]) * self.m_per_deg_lon[i]
        return float(x), float((lat_deg - self.origin_lat_deg[i]) * self.m_per_deg_lat[i])
