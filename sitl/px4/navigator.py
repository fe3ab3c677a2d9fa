"""Where a PX4 flies to: take-off, hold, return, landing, orbit, set-points."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sitl.common.autopilot import Fields
from sitl.common.states import Phase, Severity
from sitl.physics.px4_position_control import CRUISE_M_S, MAX_SPEED_M_S, POSITION_P_HZ, Follow
from sitl.px4.modes import LAND, MISSION, OFFBOARD, ORBIT, RTL, STICKS, TAKEOFF

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

Point = tuple[float, float, float]

SPOOL_UP_US = 1_000_000  # COM_SPOOLUP_TIME
TAKEOFF_M_S = 1.5  # MPC_TKO_SPEED
REACHED_M = 0.4
LIFTED_M = 0.3
LAND_SLOW_BELOW_M = 10.0  # MPC_LAND_ALT1
LAND_FAST_M_S, LAND_M_S = 1.5, 0.7  # MPC_Z_V_AUTO_DN, MPC_LAND_SPEED
STOP_M_S2 = 2.5
MIN_RETURN_M = 5.0
MAX_M = 1e6
"""Farther is no target."""
STICK_M_S, STICK_UP_M_S, STICK_DOWN_M_S = 10.0, 3.0, 1.5  # MPC_VEL_MANUAL, MPC_Z_VEL_MAX_UP, _DN
LOCAL_NED, BODY_NED = 1, 8
_AMSL, _RELATIVE = frozenset({0, 5}), frozenset({3, 6})
_IGNORE_PLACE, _IGNORE_HEIGHT, _IGNORE_VELOCITY, _IGNORE_ACCEL, _IGNORE_YAW = 0x3, 0x4, 0x38, 0x1C0, 0x400


@dataclass(frozen=True)
class Circle:
    """An orbit."""

    x_m: float
    y_m: float
    z_m: float
    radius_m: float
    """Negative: counter-clockwise."""
    speed_m_s: float


class Flight:
    """The set-points of one vehicle."""

    def __init__(self, ap: "Px4") -> None:
        self.ap = ap
        self.takeoff_m: float | None = None
        """Height of the take-off in the vehicle's frame; None: MIS_TAKEOFF_ALT."""
        self.circle: Circle | None = None
        self.cruise_m_s = CRUISE_M_S

    # Basic targets

    def go(self, place_m: Point, *, yaw_rad: float | None = None) -> None:
        """Fly there by a trajectory and stop."""
        ap, control, k = self.ap, self.ap.control, self.ap.k
        if control.follow[k] != Follow.GOAL:
            control.begin(k, np.array(ap.vehicles.seen(ap.index)), ap.vehicles.velocity_m_s[ap.index])
        control.follow[k] = Follow.GOAL
        control.goal_m[k] = place_m
        control.feed_m_s[k] = 0.0
        control.push_m_s2[k] = 0.0
        control.hold_z[k] = True
        control.cruise_m_s[k] = self.cruise_m_s
        ap.vehicles.yaw_target_rad[ap.index] = math.nan if yaw_rad is None else yaw_rad % (2.0 * math.pi)

    def change_speed(self, speed_m_s: float) -> None:
        """DO_CHANGE_SPEED; not positive: the default."""
        self.cruise_m_s = min(speed_m_s, MAX_SPEED_M_S) if speed_m_s > 0.0 else CRUISE_M_S
        self.ap.control.cruise_m_s[self.ap.k] = self.cruise_m_s

    def hold(self) -> None:
        """Stop and stay."""
        x, y, z = self.ap.vehicles.seen(self.ap.index)
        vx, vy, vz = self.ap.vehicles.velocity_m_s[self.ap.index].tolist()
        ahead_s = math.hypot(vx, vy) / (2.0 * STOP_M_S2)
        self.go((x + vx * ahead_s, y + vy * ahead_s, z + vz * 0.5))

    def land(self) -> None:
        """Stop and go down."""
        self.hold()
        x, y, _ = self.ap.control.goal_m[self.ap.k].tolist()
        self._sink(x, y)

    def _sink(self, x_m: float, y_m: float) -> None:
        ap, control, k = self.ap, self.ap.control, self.ap.k
        self.go((x_m, y_m, 0.0))
        control.hold_z[k] = False
        control.feed_m_s[k, 2] = -LAND_FAST_M_S
        ap.enter(Phase.LANDING)

    # Modes

    def begin(self, mode: int) -> None:
        """The mode has begun, with the motors on."""
        ap = self.ap
        if ap.landed:
            return  # what leads up is looked at every tick
        if mode == TAKEOFF:
            self._climb()
            return
        ap.enter(Phase.AIRBORNE)
        if mode == RTL:
            self.come_home()
        elif mode == LAND:
            self.land()
        elif mode == MISSION:
            ap.mission.begin()
        elif mode != ORBIT or self.circle is None:
            self.hold()

    def wants_up(self) -> bool:
        """On the ground with the motors on: whether its mode leads up."""
        ap = self.ap
        if ap.mode == TAKEOFF or (ap.mode == MISSION and ap.mission_ready):
            return True
        if ap.mode == OFFBOARD:
            goal, up = float(ap.control.goal_m[ap.k, 2]), float(ap.control.feed_m_s[ap.k, 2])
            by_height = ap.control.hold_z[ap.k] and goal > ap.vehicles.seen(ap.index)[2] + LIFTED_M
            return bool(ap.stream_alive and (by_height or up > 0.1))
        return ap.mode in STICKS and ap.sticks_alive and ap.sticks[2] > 600

    def tick(self) -> None:
        """Fly on."""
        ap = self.ap
        phase = ap.phase
        if phase == Phase.SPOOL_UP:
            if ap.now_us - ap.phase_us >= SPOOL_UP_US:
                ap.vehicles.flying[ap.index] = True
                ap.enter(Phase.TAKEOFF)
                if ap.mode == TAKEOFF:
                    self._climb()
                elif ap.mode == MISSION:
                    ap.mission.begin()
                    ap.enter(Phase.TAKEOFF)
            return
        if phase == Phase.TAKEOFF:
            self._lift()
        elif phase in (Phase.RTL_CLIMB, Phase.RTL_HOME, Phase.RTL_LOITER):
            self._return_on()
        elif phase == Phase.LANDING:
            height_m = ap.vehicles.seen(ap.index)[2] - ap.home_m[2]
            if height_m <= LAND_SLOW_BELOW_M:
                ap.control.feed_m_s[ap.k, 2] = -LAND_M_S
        if ap.mode == MISSION and phase != Phase.TAKEOFF:
            ap.mission.flight.tick()
        elif ap.mode == ORBIT:
            self._circle_on()
        elif ap.mode in STICKS:
            self._by_hand()

    def landing_detected(self) -> bool:
        """Whether it has just been found to stand on the ground."""
        return self.ap.flew and self.ap.phase > Phase.SPOOL_UP and self.ap.detect_ground()

    # Take-off

    def _climb(self) -> None:
        ap = self.ap
        x, y, z = ap.vehicles.seen(ap.index)
        if self.takeoff_m is None:
            rise_m = ap.params["MIS_TAKEOFF_ALT"]
            self.takeoff_m = z + rise_m
            ap.tell(
                f"Using default takeoff altitude: {rise_m:.1f} m",
                "navigator_takeoff_default_alt",
                rise_m,
            )
        if self.takeoff_m <= z:
            ap.tell(
                "Already higher than takeoff altitude (not descending)",
                "navigator_takeoff_already_higher",
                severity=Severity.CRITICAL,
            )
        self.go((x, y, max(self.takeoff_m, z)))
        ap.control.up_m_s[ap.k] = TAKEOFF_M_S
        ap.enter(Phase.TAKEOFF)

    def _lift(self) -> None:
        ap = self.ap
        z = ap.vehicles.seen(ap.index)[2]
        if not ap.flew:
            if float(ap.vehicles.position_m[ap.index, 2]) < LIFTED_M:
                return
            ap.flew = True
            ap.tell("Takeoff detected", "commander_takeoff_detected")
        if ap.mode != TAKEOFF:
            ap.enter(Phase.AIRBORNE)
        elif self.takeoff_m is None or z >= self.takeoff_m - REACHED_M:
            ap.control.up_m_s[ap.k] = 3.0
            self.takeoff_m = None
            ap.enter(Phase.AIRBORNE)
            ap.taken_off()

    # Return

    def come_home(self) -> None:
        """Climb if it has to, fly home, land."""
        ap = self.ap
        x, y, z = ap.vehicles.seen(ap.index)
        away_m = math.hypot(ap.home_m[0] - x, ap.home_m[1] - y)
        height_m = z - ap.home_m[2]
        cone_m = away_m / math.tan(math.radians(max(ap.params["RTL_CONE_ANG"], 1)))
        least_m = min(ap.params["RTL_RETURN_ALT"], max(cone_m, ap.params["RTL_DESCEND_ALT"]))
        height_m = max(height_m, least_m)
        amsl_m = height_m + ap.home_m[2] + ap.spec.ground_amsl_m
        ap.tell(
            f"RTL: start return at {amsl_m:.0f} m ({height_m:.0f} m above destination)",
            "vrtl_return_at",
            round(amsl_m),
            round(height_m),
        )
        self.hold()
        ap.control.goal_m[ap.k, 2] = height_m + ap.home_m[2]
        ap.enter(Phase.RTL_CLIMB)

    def _return_on(self) -> None:
        ap = self.ap
        goal = ap.control.goal_m[ap.k].tolist()
        x, y, z = ap.vehicles.seen(ap.index)
        if ap.phase == Phase.RTL_CLIMB:
            if abs(goal[2] - z) < REACHED_M:
                self.go((ap.home_m[0], ap.home_m[1], goal[2]))
                ap.enter(Phase.RTL_HOME)
        elif ap.phase == Phase.RTL_HOME:
            if math.hypot(goal[0] - x, goal[1] - y) < MIN_RETURN_M:
                self.go((ap.home_m[0], ap.home_m[1], min(goal[2], ap.home_m[2] + ap.params["RTL_DESCEND_ALT"])))
                ap.enter(Phase.RTL_LOITER)
        elif abs(goal[2] - z) < REACHED_M and math.hypot(goal[0] - x, goal[1] - y) < REACHED_M:
            ap.tell("RTL: land at destination", "rtl_land_at_destination")
            self._sink(ap.home_m[0], ap.home_m[1])

    # Orbit, sticks

    def _circle_on(self) -> None:
        circle = self.circle
        if circle is None:
            return
        ap, control, k = self.ap, self.ap.control, self.ap.k
        x, y, _ = ap.vehicles.seen(ap.index)
        dx, dy = x - circle.x_m, y - circle.y_m
        away_m = max(math.hypot(dx, dy), 1e-6)
        ux, uy = dx / away_m, dy / away_m
        turn = -math.copysign(1.0, circle.radius_m)
        outward = POSITION_P_HZ * (abs(circle.radius_m) - away_m)
        outward = max(-circle.speed_m_s, min(circle.speed_m_s, outward))
        control.follow[k] = Follow.VELOCITY
        control.push_m_s2[k] = 0.0
        control.hold_z[k] = True
        control.goal_m[k, 2] = circle.z_m
        control.feed_m_s[k] = (
            circle.speed_m_s * turn * -uy + outward * ux,
            circle.speed_m_s * turn * ux + outward * uy,
            0.0,
        )
        ap.vehicles.yaw_target_rad[ap.index] = math.atan2(-ux, -uy) % (2.0 * math.pi)

    def _by_hand(self) -> None:
        ap, control, k = self.ap, self.ap.control, self.ap.k
        if not ap.sticks_alive:
            return
        forward, right, throttle, _ = ap.sticks
        east, north = _rotated(ap, forward / 1000.0 * STICK_M_S, right / 1000.0 * STICK_M_S)
        push = (throttle - 500) / 500.0
        control.follow[k] = Follow.VELOCITY
        control.push_m_s2[k] = 0.0
        control.hold_z[k] = False
        control.feed_m_s[k] = (east, north, push * (STICK_UP_M_S if push > 0 else STICK_DOWN_M_S))

    # Set-points

    def take_set_point(self, name: str, fields: Fields) -> None:
        """SET_POSITION_TARGET_*, in OFFBOARD."""
        if name == "SET_POSITION_TARGET_GLOBAL_INT":
            place, body = self._global(fields), False
        else:
            place, body = self._local(fields), fields["coordinate_frame"] == BODY_NED
        if place is None:
            return
        mask = fields["type_mask"]
        by_velocity = not mask & _IGNORE_VELOCITY
        velocity = (fields["vy"], fields["vx"]) if by_velocity else (0.0, 0.0)
        if body:
            velocity = _rotated(self.ap, fields["vx"], fields["vy"]) if by_velocity else velocity
        climb = -fields["vz"] if by_velocity else 0.0
        # Only the level part of an acceleration is flown here.
        push = (0.0, 0.0) if mask & _IGNORE_ACCEL else (fields["afy"], fields["afx"])
        if body:
            push = _rotated(self.ap, push[1], push[0])
        numbers = [*place, *velocity, climb, *push]
        if not all(abs(number) <= MAX_M for number in numbers):
            return
        ap, control, k = self.ap, self.ap.control, self.ap.k
        if mask & _IGNORE_PLACE:
            if not by_velocity:
                return
            control.follow[k] = Follow.VELOCITY
        else:
            control.follow[k] = Follow.POINT
        control.hold_z[k] = not mask & _IGNORE_HEIGHT
        control.goal_m[k] = place
        control.feed_m_s[k] = (*velocity, climb)
        control.push_m_s2[k] = push
        if not mask & _IGNORE_YAW and math.isfinite(fields["yaw"]):
            ap.vehicles.yaw_target_rad[ap.index] = fields["yaw"] % (2.0 * math.pi)
        else:
            ap.vehicles.yaw_target_rad[ap.index] = ap.vehicles.yaw_rad[ap.index]

    def _global(self, fields: Fields) -> Point | None:
        ap, frame = self.ap, fields["coordinate_frame"]
        if frame not in _AMSL | _RELATIVE:
            ap.text(Severity.CRITICAL, f"SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame {frame}")
            return None
        if fields["type_mask"] & _IGNORE_PLACE:
            x, y = 0.0, 0.0
        else:
            x, y = ap.vehicles.to_local(ap.index, fields["lat_int"] / 1e7, fields["lon_int"] / 1e7)
        # 1.16.1 has the sign of home's height above its own origin wrong (measured).
        zero_m = -ap.spec.ground_amsl_m if frame in _AMSL else -ap.home_m[2]
        return x, y, (fields["alt"] + zero_m if not fields["type_mask"] & _IGNORE_HEIGHT else 0.0)

    def _local(self, fields: Fields) -> Point | None:
        frame, mask = fields["coordinate_frame"], fields["type_mask"]
        if frame not in (LOCAL_NED, BODY_NED):
            text = f"SET_POSITION_TARGET_LOCAL_NED coordinate frame {frame} unsupported"
            self.ap.text(Severity.CRITICAL, text)
            return None
        x, y = (0.0, 0.0) if mask & _IGNORE_PLACE else (fields["y"], fields["x"])
        return x, y, 0.0 if mask & _IGNORE_HEIGHT else -fields["z"]


def _rotated(ap: "Px4", forward: float, right: float) -> tuple[float, float]:
    """East and north of body axes."""
    yaw = float(ap.vehicles.yaw_rad[ap.index])
    sin, cos = math.sin(yaw), math.cos(yaw)
    return forward * sin + right * cos, forward * cos - right * sin
