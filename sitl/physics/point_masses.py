"""Acceleration-limited point masses: all vehicles of a run, stepped together.

Each vehicle has its own frame: ENU metres about the place where it was put down, z = 0 on the ground. The constants are
ArduCopter's default parameters, or what was measured on ArduCopter (docs/autopilots.md); PX4 vehicles are moved by
`px4_position_control`.
"""

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from sitl.physics.px4_position_control import DRAG_HZ, WINDY_DRAG_HZ, Px4Control
from sitl.physics.quantities import GRAVITY_M_S2, Array, Flags, no_longer
from sitl.physics.weather import Weather, WeatherSpec

Point = tuple[float, float, float]
"""East, north and up in a vehicle's frame: a place in metres, or a velocity in metres per second."""

SPEED_M_S = 10.0  # WPNAV_SPEED
CLIMB_M_S = 2.5  # WPNAV_SPEED_UP
DESCENT_M_S = 1.5  # WPNAV_SPEED_DN
ACCEL_M_S2 = 2.5  # WPNAV_ACCEL: never exceeded horizontally on the way to a place
ACCEL_Z_M_S2 = 2.0
BRAKE_M_S2 = 2.0  # planned deceleration: below ACCEL_M_S2, so that something is left to correct with
BRAKE_Z_M_S2 = 1.0  # WPNAV_ACCEL_Z
POSITION_GAIN_HZ = 1.5
MIN_FOLLOW_S, MAX_FOLLOW_S = 0.04, 0.5  # time between the set-points of a moving target
FOLLOW_GAIN_HZ, FOLLOW_S = 0.8, 0.8
"""Gains with which a moving target is followed: position error to velocity, velocity error to acceleration.

On patrol tours a real ArduCopter lags by 1.0 s² times the acceleration of its course: it flies too wide in curves and
is late where the course speeds up. It neither receives nor estimates that acceleration.
"""
FOLLOW_ACCEL_M_S2 = 3.5
"""Limit while following. With WPNAV_ACCEL a vehicle would never get back inside a circle that needs 2.2 m/s²."""
LEAN_M_S2 = GRAVITY_M_S2 * float(np.tan(np.deg2rad(30.0)))  # ANGLE_MAX
DRAG_PER_M = GRAVITY_M_S2 / 18.0**2
"""Drag in runs with wind: 18 m/s at 45 degrees of lean, as the simulated PX4s have it.

The drag of ArduPilot's own simulator is greater (15 m/s at that lean): in 3 m/s of wind real ArduCopters were 8 m off
on tours flown at 8 m/s, and 0.6 m off on tours flown at 6 m/s.
"""
GENTLE_M_S = 2.0  # a target this fast is approached with half the deceleration
YAW_RATE_RAD_S = np.deg2rad(60.0)
YAW_SPEED_M_S = 1.0  # a slower vehicle keeps its heading
MAX_STEP_S = 0.05
MAX_VERTICAL_M_S = 10.0
WIND_DRIFT = 0.3  # share of a gust's speed that moves a vehicle
FALL_M_S = 10.7  # measured: without thrust it falls 20 m in 3.2 s
# Measured on a real ArduCopter whose one motor failed at 34 m: on the ground after 4 s, at 12.9 m/s.
CRIPPLED_FALL_M_S, CRIPPLED_FALL_M_S2 = 12.9, 4.7
TUMBLE_RAD_S = np.pi
"""Rate at which a vehicle with a failed motor rolls over; assumed, not measured."""

# The ellipsoid that GPS and all autopilots use.
WGS84_A_M = 6378137.0
WGS84_E2 = 6.69437999014e-3


class VehicleStart(Protocol):
    """The place and kind of one vehicle, as far as physics needs them."""

    @property
    def lat_deg(self) -> float:
        """Latitude of the start place."""

    @property
    def lon_deg(self) -> float:
        """Longitude of the start place."""

    @property
    def heading_deg(self) -> float:
        """Heading of the nose at the start."""

    @property
    def autopilot(self) -> str:
        """Name of the autopilot: "ardupilot" or "px4"; PX4 has a position control of its own."""


def approach_speed(distance_m: Array, decel_m_s2: Array | float) -> Array:
    """Return the speed from which a stop within `distance_m` is still possible.

    It is a square-root profile with a linear end, as ArduPilot's `sqrt_controller`: the deceleration is at most
    `decel_m_s2` and the end is an exponential, so there is no overshoot.
    """
    linear_m = decel_m_s2 / POSITION_GAIN_HZ**2
    far = np.sqrt(np.maximum(2.0 * decel_m_s2 * (distance_m - 0.5 * linear_m), 0.0))
    return np.where(distance_m < linear_m, distance_m * POSITION_GAIN_HZ, far)


def within(numbers: Array, least: Array | float, most: Array | float) -> Array:
    """Return (n,) numbers limited to a range, as `np.clip` does, which takes three times as long for a few numbers."""
    limited: Array = np.minimum(np.maximum(numbers, least), most)
    return limited


def stopping_distance_m(speed_m_s: float, decel_m_s2: float) -> float:
    """Return the distance at which `approach_speed` equals `speed_m_s`: the way to the end of braking."""
    if speed_m_s <= decel_m_s2 / POSITION_GAIN_HZ:
        return speed_m_s / POSITION_GAIN_HZ
    return speed_m_s**2 / (2.0 * decel_m_s2) + decel_m_s2 / (2.0 * POSITION_GAIN_HZ**2)


class Origins:
    """Where the local frames of n vehicles begin, which is where they start: arrays of shape (n,)."""

    def __init__(self, starts: Sequence[VehicleStart]) -> None:
        self.lat_deg: Array = np.array([s.lat_deg for s in starts], dtype=np.float64)
        self.lon_deg: Array = np.array([s.lon_deg for s in starts], dtype=np.float64)
        lat_rad = np.deg2rad(self.lat_deg)
        bend = 1.0 - WGS84_E2 * np.sin(lat_rad) ** 2
        self.m_per_deg_lat: Array = np.deg2rad(WGS84_A_M * (1.0 - WGS84_E2) / bend**1.5)
        self.m_per_deg_lon: Array = np.deg2rad(WGS84_A_M * np.cos(lat_rad) / np.sqrt(bend))


class PointMasses:
    """State and targets of n vehicles as arrays of shape (n,) or (n, 3). Autopilots write targets through `Body`."""

    def __init__(self, starts: Sequence[VehicleStart], weather: WeatherSpec | None = None, seed: int = 0) -> None:
        n = len(starts)
        self.weather = Weather(weather or WeatherSpec(), n, seed)
        px4 = np.flatnonzero([s.autopilot == "px4" for s in starts])
        self.px4 = Px4Control(px4, WINDY_DRAG_HZ if self.weather.windy else DRAG_HZ)
        self.origins = Origins(starts)
        self._drifts: Flags = np.array([s.autopilot == "ardupilot" for s in starts], dtype=bool)
        """Gusts move ArduCopters; the control of PX4 has drag of its own."""
        self.position_m: Array = np.zeros((n, 3))
        self.velocity_m_s: Array = np.zeros((n, 3))
        self.accel_m_s2: Array = np.zeros((n, 3))
        self.yaw_rad: Array = np.deg2rad([s.heading_deg % 360.0 for s in starts])

        self.flying: Flags = np.zeros(n, dtype=bool)
        """The motors lift the vehicle; False on the ground."""
        self.falling: Flags = np.zeros(n, dtype=bool)
        """The vehicle is in the air without thrust."""
        self.crippled: Flags = np.zeros(n, dtype=bool)
        """A motor has failed: the others neither hold the vehicle level nor in the air."""
        self.tumble_rad: Array = np.zeros(n)
        """How far a crippled vehicle has rolled over."""
        self.target_m: Array = np.zeros((n, 3))
        """The target moves on with `target_velocity_m_s` by itself."""
        self.target_velocity_m_s: Array = np.zeros((n, 3))
        """Feed-forward of position control; without position control it is the demanded velocity."""
        self.follows_s: Array = np.zeros(n)
        """How much longer a stream of moving targets is expected to go on."""
        self.target_age_s: Array = np.full(n, np.inf)
        self.given_velocity_m_s: Array = np.zeros((n, 2))
        """Horizontal velocity of the newest target, as it was given."""
        self.hold_xy: Array = np.ones(n)
        """1.0 where the horizontal position is controlled, 0.0 where only the velocity is."""
        self.hold_z: Array = np.ones(n)
        self.yaw_target_rad: Array = np.full(n, np.nan)
        """Demanded heading; NaN turns the nose to the direction of travel."""
        self.speed_m_s: Array = np.full(n, SPEED_M_S)
        self.climb_m_s: Array = np.full(n, CLIMB_M_S)
        self.descent_m_s: Array = np.full(n, DESCENT_M_S)

    def step(self, dt_s: float) -> None:
        """Advance by `dt_s`, in equal substeps of at most MAX_STEP_S."""
        substeps = max(1, int(np.ceil(dt_s / MAX_STEP_S - 1e-9)))
        self.weather.step(dt_s)
        # Vehicles on the ground do not move: a fleet that waits costs nothing.
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
        lifted, sinks = self.flying & ~self.crippled, self.flying & self.crippled
        velocity = before + change if lifted.all() else np.where(lifted[:, None], before + change, before)
        if self.falling.any():
            velocity[self.falling, 2] = np.maximum(before[self.falling, 2] - GRAVITY_M_S2 * dt, -FALL_M_S)
        if sinks.any():
            fallen = before[sinks, 2] - CRIPPLED_FALL_M_S2 * dt
            velocity[sinks, 2] = np.maximum(fallen, -CRIPPLED_FALL_M_S)
            self.tumble_rad[sinks] += TUMBLE_RAD_S * dt
        position = self.position_m + (before + velocity) * (0.5 * dt)
        if self.weather.windy:
            position[:, :2] += self.weather.surprise_m_s * (self._drifts & self.flying)[:, None] * (WIND_DRIFT * dt)
        ground = (position[:, 2] <= 0.0) & (velocity[:, 2] <= 0.0)
        if ground.any():
            position[ground, 2] = 0.0
            velocity[ground] = 0.0
            self.tumble_rad[ground] = 0.0
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
        fed = self.target_velocity_m_s[:, :2]
        follows = self.follows_s > 0.0
        # Of a few vehicles each call of numpy costs the same, and mostly all of them follow, or none.
        some, all_follow = bool(follows.any()), bool(follows.all())
        closing = np.zeros(0)
        if not all_follow:
            # A single moving target is closed in on gently.
            closing = approach_speed(distance, BRAKE_M_S2 / (1.0 + np.hypot(fed[:, 0], fed[:, 1]) / GENTLE_M_S))
        if some:
            pulled = np.minimum(approach_speed(distance, ACCEL_M_S2), FOLLOW_GAIN_HZ * distance)
            closing = pulled if all_follow else np.where(follows, pulled, closing)
        correction = self.hold_xy * closing / distance
        wanted = fed + error * correction[:, None]
        speed = np.hypot(wanted[:, 0], wanted[:, 1])
        wanted *= np.minimum(1.0, self.speed_m_s / np.maximum(speed, 1e-9))[:, None]
        change = wanted - self.velocity_m_s[:, :2]
        if some:
            change *= np.where(follows, dt / FOLLOW_S, 1.0)[:, None]
        size = np.hypot(change[:, 0], change[:, 1])
        limit = np.where(follows, FOLLOW_ACCEL_M_S2, ACCEL_M_S2)
        change *= np.minimum(1.0, limit * dt / np.maximum(size, 1e-9))[:, None]
        return self._limited_by_lean(change, dt) if self.weather.windy else change

    def _limited_by_lean(self, change: Array, dt: float) -> Array:
        """Limit a change of velocity to what the largest lean gives against the drag of the air."""
        through_air = self.velocity_m_s[:, :2] - self.weather.wind_m_s
        drag = DRAG_PER_M * np.hypot(through_air[:, 0], through_air[:, 1])[:, None] * through_air
        left: Array = (no_longer(change / dt + drag, LEAN_M_S2) - drag) * dt
        return left

    def _vertical_change(self, dt: float) -> Array:
        error = self.target_m[:, 2] - self.seen_m[:, 2]
        correction = self.hold_z * np.copysign(approach_speed(np.abs(error), BRAKE_Z_M_S2), error)
        # A demanded velocity is not limited: measured, ArduCopter flies vz = -6 with WPNAV_SPEED_UP 250.
        wanted = self.target_velocity_m_s[:, 2] + within(correction, -self.descent_m_s, self.climb_m_s)
        wanted = within(wanted, -MAX_VERTICAL_M_S, MAX_VERTICAL_M_S)
        limit = ACCEL_Z_M_S2 * dt
        return within(wanted - self.velocity_m_s[:, 2], -limit, limit)

    def _turn(self, dt: float) -> None:
        v = self.velocity_m_s
        course = np.arctan2(v[:, 0], v[:, 1])
        moving = np.hypot(v[:, 0], v[:, 1]) > YAW_SPEED_M_S
        wanted = np.where(np.isnan(self.yaw_target_rad), np.where(moving, course, self.yaw_rad), self.yaw_target_rad)
        turn = (wanted - self.yaw_rad + np.pi) % (2.0 * np.pi) - np.pi
        limit = YAW_RATE_RAD_S * dt * self.flying
        self.yaw_rad = (self.yaw_rad + within(turn, -limit, limit)) % (2.0 * np.pi)

    @property
    def seen_m(self) -> Array:
        """(n, 3) places at which the vehicles believe to be."""
        return self.position_m + self.weather.gps_error_m if self.weather.noisy else self.position_m

    @property
    def lat_deg(self) -> Array:
        """(n,) true latitudes of the vehicles."""
        return self.origins.lat_deg + self.position_m[:, 1] / self.origins.m_per_deg_lat

    @property
    def lon_deg(self) -> Array:
        """(n,) true longitudes of the vehicles."""
        return self.origins.lon_deg + self.position_m[:, 0] / self.origins.m_per_deg_lon


class Body:
    """One vehicle's row of `PointMasses`: where it is, how it moves, and where its autopilot wants it to be.

    Places are ENU metres in the vehicle's own frame. `seen` is where the vehicle believes to be, GPS noise included.
    """

    def __init__(self, masses: PointMasses, index: int) -> None:
        self.masses, self.index = masses, index
        # As plain floats: with numpy's own numbers these conversions took three times as long.
        origins = masses.origins
        self._origin_lat_deg, self._origin_lon_deg = float(origins.lat_deg[index]), float(origins.lon_deg[index])
        self._m_per_deg_lat = float(origins.m_per_deg_lat[index])
        self._m_per_deg_lon = float(origins.m_per_deg_lon[index])

    def seen_m(self) -> Point:
        """Place at which the vehicle believes to be."""
        masses = self.masses
        x, y, z = masses.position_m[self.index].tolist()
        if masses.weather.noisy:
            dx, dy, dz = masses.weather.gps_error_m[self.index].tolist()
            return x + dx, y + dy, z + dz
        return x, y, z

    @property
    def true_height_m(self) -> float:
        """Height above the ground at the start place, without noise."""
        return float(self.masses.position_m[self.index, 2])

    @property
    def is_above_ground(self) -> bool:
        """Whether the vehicle is higher than the ground, or leaves it."""
        i, masses = self.index, self.masses
        return masses.position_m.item(i, 2) > 0.0 or masses.velocity_m_s.item(i, 2) > 0.0

    def fail_motor(self) -> None:
        """Let one motor fail; it does not recover."""
        self.masses.crippled[self.index] = True

    @property
    def is_crippled(self) -> bool:
        """Whether a motor has failed."""
        return bool(self.masses.crippled[self.index])

    @property
    def tumble_rad(self) -> float:
        """How far it has rolled over because a motor failed."""
        return float(self.masses.tumble_rad[self.index])

    def velocity_m_s(self) -> Point:
        """Velocity east, north and up."""
        vx, vy, vz = self.masses.velocity_m_s[self.index].tolist()
        return vx, vy, vz

    def accel_m_s2(self) -> Point:
        """Acceleration east, north and up."""
        ax, ay, az = self.masses.accel_m_s2[self.index].tolist()
        return ax, ay, az

    @property
    def yaw_rad(self) -> float:
        """Heading of the nose, clockwise from north."""
        return float(self.masses.yaw_rad[self.index])

    @property
    def target_m(self) -> Array:
        """(3,) view of the target's place; writing to it moves the target."""
        target: Array = self.masses.target_m[self.index]
        return target

    def turn_to(self, yaw_rad: float) -> None:
        """Turn the nose to a heading; NaN means the direction of travel."""
        self.masses.yaw_target_rad[self.index] = yaw_rad

    def lift(self) -> None:
        """Let the motors carry the vehicle."""
        self.masses.flying[self.index] = True

    def to_geodetic(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return latitude and longitude (degrees) of a place in the vehicle's frame."""
        return self._origin_lat_deg + y_m / self._m_per_deg_lat, self._origin_lon_deg + x_m / self._m_per_deg_lon

    def to_local(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """Return the place of a latitude and longitude in the vehicle's frame, metres east and north."""
        x = (lon_deg - self._origin_lon_deg) * self._m_per_deg_lon
        return x, (lat_deg - self._origin_lat_deg) * self._m_per_deg_lat

    def to_earth(self, forward: float, right: float) -> tuple[float, float]:
        """Return the east and north parts of a vector in body axes."""
        sin, cos = math.sin(self.yaw_rad), math.cos(self.yaw_rad)
        return forward * sin + right * cos, forward * cos - right * sin

    def hold_here(self) -> None:
        """Fly to the place where braking now ends, and stay there."""
        vx, vy, vz = (float(v) for v in self.masses.velocity_m_s[self.index])
        speed = float(np.hypot(vx, vy))
        ahead = stopping_distance_m(speed, BRAKE_M_S2) / speed if speed > 1e-6 else 0.0
        rise = np.copysign(stopping_distance_m(abs(vz), BRAKE_Z_M_S2), vz)
        x, y, z = self.seen_m()
        self.set_target((x + vx * ahead, y + vy * ahead, max(z + rise, 0.0)))

    def set_target(self, position_m: Point, velocity_m_s: Point = (0.0, 0.0, 0.0)) -> None:
        """Fly to a place that moves on with `velocity_m_s`.

        Moving places in quick succession are one moving target that is followed, not goals that are each reached.
        """
        i, masses = self.index, self.masses
        # Moving set-points at 2 to 25 Hz are a stream; a single one is a goal, approached without overshoot.
        age_s = float(masses.target_age_s[i])
        given = np.array(velocity_m_s[:2])
        streamed = MIN_FOLLOW_S < age_s <= MAX_FOLLOW_S and masses.hold_xy[i]
        both_move = given.any() and masses.given_velocity_m_s[i].any()
        masses.follows_s[i] = 1.5 * age_s if streamed and both_move else 0.0
        masses.given_velocity_m_s[i] = given
        masses.target_age_s[i] = 0.0
        masses.target_m[i] = position_m
        masses.target_velocity_m_s[i] = velocity_m_s
        masses.hold_xy[i] = masses.hold_z[i] = 1.0

    def set_velocity(self, velocity_m_s: Point) -> None:
        """Fly with a velocity; no position is held."""
        i, masses = self.index, self.masses
        masses.target_velocity_m_s[i] = velocity_m_s
        masses.hold_xy[i] = masses.hold_z[i] = 0.0

    def feed_velocity(self, velocity_m_s: Point) -> None:
        """Change the target's velocity and keep what is held."""
        self.masses.target_velocity_m_s[self.index] = velocity_m_s

    def sink(self, rate_m_s: float) -> None:
        """Keep the place where braking now ends, and go down at `rate_m_s`."""
        self.hold_here()
        self.masses.hold_z[self.index] = 0.0
        self.feed_descent(rate_m_s)

    def feed_descent(self, rate_m_s: float) -> None:
        """Change the rate of a descent."""
        self.masses.target_velocity_m_s[self.index, 2] = -rate_m_s

    def rest(self) -> None:
        """Switch the motors off, or let them idle; a vehicle in the air falls."""
        i, masses = self.index, self.masses
        masses.flying[i] = False
        masses.falling[i] = bool(masses.position_m[i, 2] > 0.0)
        masses.target_velocity_m_s[i] = 0.0
        if not masses.falling[i]:
            masses.velocity_m_s[i] = 0.0
            masses.accel_m_s2[i] = 0.0
