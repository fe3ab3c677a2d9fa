"""How a PX4 flies: take-off, hold, return, landing, orbit, joystick, set-points.

Constants are PX4's default parameters, or measured (docs/autopilots.md "PX4").
"""

import math
from dataclasses import dataclass

import numpy as np

from sitl.common.outbox import Fields
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Phase
from sitl.links.wire import ReceivedFrame
from sitl.physics.point_masses import Point
from sitl.physics.px4_position_control import CRUISE_M_S, MAX_SPEED_M_S, POSITION_P_HZ, SetpointKind
from sitl.px4.announcer import Announcer
from sitl.px4.inputs import ControlInputs

SPOOL_UP_US = 1_000_000  # COM_SPOOLUP_TIME
TAKEOFF_M_S = 1.5  # MPC_TKO_SPEED
CLIMB_M_S = 3.0  # MPC_Z_V_AUTO_UP
REACHED_M = 0.4
LIFTED_M = 0.3
LAND_SLOW_BELOW_M = 10.0  # MPC_LAND_ALT1
LAND_FAST_M_S, LAND_M_S = 1.5, 0.7  # MPC_Z_V_AUTO_DN, MPC_LAND_SPEED
STOP_M_S2 = 2.5
MIN_RETURN_M = 5.0
MAX_TARGET_M = 1e6
"""Numbers beyond this (and NaN) are not targets."""
STICK_M_S, STICK_UP_M_S, STICK_DOWN_M_S = 10.0, 3.0, 1.5  # MPC_VEL_MANUAL, MPC_Z_VEL_MAX_UP, _DN
# Other local frames are refused with a text: "coordinate frame N unsupported".
LOCAL_NED, BODY_NED = 1, 8
# MAV_FRAME. DO_REPOSITION ignores the frame: there z is always above mean sea level.
_AMSL, _RELATIVE = frozenset({0, 5}), frozenset({3, 6})
# Bits of POSITION_TARGET_TYPEMASK (common.xml).
_IGNORE_PLACE, _IGNORE_HEIGHT, _IGNORE_VELOCITY, _IGNORE_ACCEL, _IGNORE_YAW = 0x3, 0x4, 0x38, 0x1C0, 0x400


@dataclass(frozen=True)
class Orbit:
    """A circle to be flown (DO_ORBIT)."""

    x_m: float
    y_m: float
    z_m: float
    radius_m: float
    """A negative radius means counter-clockwise."""
    speed_m_s: float


class Navigator(Part):
    """Makes the set-points of one vehicle's position control. Which of its acts a mode begins is the commander's."""

    def __init__(self, platform: Platform, announcer: Announcer, inputs: ControlInputs) -> None:
        super().__init__(platform)
        self._announcer, self._inputs = announcer, inputs
        self.control = platform.body.masses.px4
        self.k = int((self.control.rows == platform.body.index).argmax())
        """The vehicle's row in `control`."""
        self.takeoff_m: float | None = None
        """Height of the take-off in the vehicle's frame; None stands for MIS_TAKEOFF_ALT."""
        self.orbit: Orbit | None = None
        self.cruise_m_s = CRUISE_M_S
        self.flew = False
        """The vehicle was in the air since it was armed."""

    def go(self, place_m: Point, *, yaw_rad: float | None = None) -> None:
        """Fly to a place by a trajectory, and stop there."""
        control, k, body = self.control, self.k, self._body
        # A trajectory that is under way goes on from where it is; a new one starts with the vehicle's place and speed.
        if control.follow[k] != SetpointKind.GOAL:
            control.begin(k, np.array(body.seen_m()), body.masses.velocity_m_s[body.index])
        control.steer(k, SetpointKind.GOAL, (0.0, 0.0, 0.0), hold_z=True)
        control.goal_m[k] = place_m
        control.cruise_m_s[k] = self.cruise_m_s
        body.turn_to(math.nan if yaw_rad is None else yaw_rad % (2.0 * math.pi))

    def change_speed(self, speed_m_s: float) -> None:
        """Fly with another speed from now on; 0 or less stands for the default."""
        self.cruise_m_s = min(speed_m_s, MAX_SPEED_M_S) if speed_m_s > 0.0 else CRUISE_M_S
        self.control.cruise_m_s[self.k] = self.cruise_m_s

    def hold(self) -> None:
        """Stop, and stay where braking ends."""
        x, y, z = self._body.seen_m()
        vx, vy, vz = self._body.velocity_m_s()
        ahead_s = math.hypot(vx, vy) / (2.0 * STOP_M_S2)
        self.go((x + vx * ahead_s, y + vy * ahead_s, z + vz * 0.5))

    def land(self) -> None:
        """Stop, and land where the vehicle is."""
        self.hold()
        x, y, _ = self.control.goal_m[self.k].tolist()
        self._sink(x, y)

    def _sink(self, x_m: float, y_m: float) -> None:
        self.go((x_m, y_m, 0.0))
        self.control.hold_z[self.k] = False
        self.control.velocity_feed_m_s[self.k, 2] = -LAND_FAST_M_S
        self._state.enter(Phase.LANDING)

    def rest(self) -> None:
        """Stop the motors and the position control."""
        self._body.rest()
        self.control.rest(self.k)

    def spool_up(self) -> bool:
        """Wait for the motors; True once they lift the vehicle."""
        if self._state.in_phase_us < SPOOL_UP_US:
            return False
        self._body.lift()
        self._state.enter(Phase.TAKEOFF)
        return True

    def climb(self) -> None:
        """Begin the climb of a take-off."""
        x, y, z = self._body.seen_m()
        if self.takeoff_m is None:
            rise_m = self._params["MIS_TAKEOFF_ALT"]
            self.takeoff_m = z + rise_m
            text = f"Using default takeoff altitude: {rise_m:.1f} m"
            self._announcer.announce(text, "navigator_takeoff_default_alt", rise_m)
        if self.takeoff_m <= z:
            text = "Already higher than takeoff altitude (not descending)"
            self._announcer.alert(text, "navigator_takeoff_already_higher")
        self.go((x, y, max(self.takeoff_m, z)))
        self.control.up_m_s[self.k] = TAKEOFF_M_S
        self._state.enter(Phase.TAKEOFF)

    def lift_off(self, *, climbs: bool) -> bool:
        """Do one tick of a take-off; `climbs` if the mode is Takeoff. True once its height is reached."""
        z = self._body.seen_m()[2]
        if not self.flew:
            if self._body.true_height_m < LIFTED_M:
                return False
            self.flew = True
            self._announcer.announce("Takeoff detected", "commander_takeoff_detected")
        if not climbs:
            self._state.enter(Phase.AIRBORNE)
        elif self.takeoff_m is None or z >= self.takeoff_m - REACHED_M:
            self.control.up_m_s[self.k] = CLIMB_M_S
            self.takeoff_m = None
            self._state.enter(Phase.AIRBORNE)
            return True
        return False

    def landing_detected(self) -> bool:
        """Return whether the vehicle has just been found to stand on the ground."""
        return self.flew and self._state.phase > Phase.SPOOL_UP and self._state.detect_ground()

    def wants_up(self) -> bool:
        """Return whether the set-points of OFFBOARD lead up from the ground."""
        goal, up = float(self.control.goal_m[self.k, 2]), float(self.control.velocity_feed_m_s[self.k, 2])
        by_height = self.control.hold_z[self.k] and goal > self._body.seen_m()[2] + LIFTED_M
        return bool(self._inputs.stream_alive and (by_height or up > 0.1))

    def come_home(self) -> None:
        """Climb if the vehicle is too low, fly home, land."""
        home_m, params = self._state.home_m, self._params
        x, y, z = self._body.seen_m()
        away_m = math.hypot(home_m[0] - x, home_m[1] - y)
        height_m = z - home_m[2]
        # Near home the return is flown lower: within a cone above home (RTL_CONE_ANG).
        cone_m = away_m / math.tan(math.radians(max(params["RTL_CONE_ANG"], 1)))
        min_m = min(params["RTL_RETURN_ALT"], max(cone_m, params["RTL_DESCEND_ALT"]))
        height_m = max(height_m, min_m)
        amsl_m = height_m + home_m[2] + self._spec.ground_amsl_m
        text = f"RTL: start return at {amsl_m:.0f} m ({height_m:.0f} m above destination)"
        self._announcer.announce(text, "vrtl_return_at", round(amsl_m), round(height_m))
        self.hold()
        self.control.goal_m[self.k, 2] = height_m + home_m[2]
        self._state.enter(Phase.RTL_CLIMB)

    def tick(self) -> None:
        """Continue a return or a landing."""
        phase = self._state.phase
        if phase in (Phase.RTL_CLIMB, Phase.RTL_HOME, Phase.RTL_LOITER):
            self._continue_return()
        elif phase == Phase.LANDING:
            height_m = self._body.seen_m()[2] - self._state.home_m[2]
            if height_m <= LAND_SLOW_BELOW_M:
                self.control.velocity_feed_m_s[self.k, 2] = -LAND_M_S

    def _continue_return(self) -> None:
        state, home_m = self._state, self._state.home_m
        goal = self.control.goal_m[self.k].tolist()
        x, y, z = self._body.seen_m()
        if state.phase == Phase.RTL_CLIMB:
            if abs(goal[2] - z) < REACHED_M:
                self.go((home_m[0], home_m[1], goal[2]))
                state.enter(Phase.RTL_HOME)
        elif state.phase == Phase.RTL_HOME:
            if math.hypot(goal[0] - x, goal[1] - y) < MIN_RETURN_M:
                self.go((home_m[0], home_m[1], min(goal[2], home_m[2] + self._params["RTL_DESCEND_ALT"])))
                state.enter(Phase.RTL_LOITER)
        elif abs(goal[2] - z) < REACHED_M and math.hypot(goal[0] - x, goal[1] - y) < REACHED_M:
            self._announcer.announce("RTL: land at destination", "rtl_land_at_destination")
            self._sink(home_m[0], home_m[1])

    def fly_orbit(self) -> None:
        """Do one tick of an orbit."""
        orbit = self.orbit
        if orbit is None:
            return
        control, k = self.control, self.k
        x, y, _ = self._body.seen_m()
        dx, dy = x - orbit.x_m, y - orbit.y_m
        away_m = max(math.hypot(dx, dy), 1e-6)
        ux, uy = dx / away_m, dy / away_m
        turn = -math.copysign(1.0, orbit.radius_m)
        outward = POSITION_P_HZ * (abs(orbit.radius_m) - away_m)
        outward = max(-orbit.speed_m_s, min(orbit.speed_m_s, outward))
        along = orbit.speed_m_s * turn
        control.steer(
            k, SetpointKind.VELOCITY, (along * -uy + outward * ux, along * ux + outward * uy, 0.0), hold_z=True
        )
        control.goal_m[k, 2] = orbit.z_m
        self._body.turn_to(math.atan2(-ux, -uy) % (2.0 * math.pi))

    def follow_joystick(self) -> None:
        """Do one tick with a joystick."""
        if not self._inputs.sticks_alive:
            return
        forward, right, throttle, _ = self._inputs.sticks
        east, north = self._body.to_earth(forward / 1000.0 * STICK_M_S, right / 1000.0 * STICK_M_S)
        push = (throttle - 500) / 500.0
        up = push * (STICK_UP_M_S if push > 0 else STICK_DOWN_M_S)
        self.control.steer(self.k, SetpointKind.VELOCITY, (east, north, up), hold_z=False)

    def take_set_point(self, frame: ReceivedFrame) -> None:
        """Fly to the target of a SET_POSITION_TARGET_GLOBAL_INT or …_LOCAL_NED, in OFFBOARD."""
        fields, body = frame.fields, False
        if frame.name == "SET_POSITION_TARGET_GLOBAL_INT":
            place = self._global_place(fields)
        else:
            place, body = self._local_place(fields), fields["coordinate_frame"] == BODY_NED
        if place is None:
            return
        mask = fields["type_mask"]
        has_velocity = not mask & _IGNORE_VELOCITY
        velocity = (fields["vy"], fields["vx"]) if has_velocity else (0.0, 0.0)
        if body:
            velocity = self._body.to_earth(fields["vx"], fields["vy"]) if has_velocity else velocity
        climb = -fields["vz"] if has_velocity else 0.0
        # Only the horizontal part of an acceleration is flown here.
        accel = (0.0, 0.0) if mask & _IGNORE_ACCEL else (fields["afy"], fields["afx"])
        if body:
            accel = self._body.to_earth(accel[1], accel[0])
        if not all(abs(number) <= MAX_TARGET_M for number in (*place, *velocity, climb, *accel)):
            return
        has_place = not mask & _IGNORE_PLACE
        if not has_place and not has_velocity:
            return
        follow = SetpointKind.POINT if has_place else SetpointKind.VELOCITY
        # A place without a height holds no height: only the vertical velocity counts then.
        hold_z = not mask & _IGNORE_HEIGHT
        self.control.steer(self.k, follow, (*velocity, climb), hold_z=hold_z, accel_m_s2=accel)
        self.control.goal_m[self.k] = place
        has_yaw = not mask & _IGNORE_YAW and math.isfinite(fields["yaw"])
        # Without a yaw the nose stays where it points, unlike ArduCopter's, which turns to the direction of travel.
        self._body.turn_to(fields["yaw"] % (2.0 * math.pi) if has_yaw else self._body.yaw_rad)

    def _global_place(self, fields: Fields) -> Point | None:
        frame = fields["coordinate_frame"]
        if frame not in _AMSL | _RELATIVE:
            text = f"SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame {frame}"
            self._announcer.text(MavSeverity.CRITICAL, text)
            return None
        if fields["type_mask"] & _IGNORE_PLACE:
            x, y = 0.0, 0.0
        else:
            x, y = self._body.to_local(fields["lat_int"] / 1e7, fields["lon_int"] / 1e7)
        # PX4 1.16.1 has the sign of home's height above its own origin wrong (measured), and so has this.
        zero_m = -self._spec.ground_amsl_m if frame in _AMSL else -self._state.home_m[2]
        return x, y, (fields["alt"] + zero_m if not fields["type_mask"] & _IGNORE_HEIGHT else 0.0)

    def _local_place(self, fields: Fields) -> Point | None:
        frame, mask = fields["coordinate_frame"], fields["type_mask"]
        if frame not in (LOCAL_NED, BODY_NED):
            text = f"SET_POSITION_TARGET_LOCAL_NED coordinate frame {frame} unsupported"
            self._announcer.text(MavSeverity.CRITICAL, text)
            return None
        x, y = (0.0, 0.0) if mask & _IGNORE_PLACE else (fields["y"], fields["x"])
        return x, y, 0.0 if mask & _IGNORE_HEIGHT else -fields["z"]
