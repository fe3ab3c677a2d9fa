"""Set-points in GUIDED: SET_POSITION_TARGET_GLOBAL_INT and _LOCAL_NED, and the targets of DO_REPOSITION.

Set-points are never acknowledged, and those that cannot be flown are dropped silently
(docs/autopilots.md "Set-points in GUIDED").
"""

import math

import numpy as np

from sitl.ardupilot.fence import CopterFence
from sitl.ardupilot.modes import GUIDED
from sitl.common.missions import Item
from sitl.common.outbox import Fields
from sitl.common.parameters import ParameterTable
from sitl.common.platform import Part, Platform
from sitl.common.states import Phase
from sitl.links.wire import ReceivedFrame
from sitl.physics.point_masses import BRAKE_M_S2, Body, Point, approach_speed

# MAV_FRAME_GLOBAL and _GLOBAL_INT; the other two pairs are relative to home and above the terrain.
FRAMES_AMSL = frozenset({0, 5})
FRAMES_RELATIVE = frozenset({3, 6})
FRAMES_TERRAIN = frozenset({10, 11})
# MAV_FRAME of SET_POSITION_TARGET_LOCAL_NED.
LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED = 1, 7, 8, 9

MAX_TARGET_M = 3e7
"""Numbers beyond the size of the Earth (and NaN) are not targets."""
# Asked for 12 or 99 m/s it never flew faster than 10.3.
MIN_SPEED_M_S, MAX_SPEED_M_S = 0.1, 10.0

AVOID_FENCE = 1
"""Bit of AVOID_ENABLE: slow down before the fence."""
CREEP_M_S, AT_MARGIN_M, CLOSE_M, MIN_AVOID_SPEED_M_S = 2.0, 0.2, 0.05, 0.05
"""Avoidance of the fence: greatest speed at its margin, how near counts as there, resolution of the search for the
fence along a course, and the speed below which nothing is done. See `_heed_fence` for what was measured.
"""
# Bits of POSITION_TARGET_TYPEMASK (common.xml).
_IGNORE_POSITION, _IGNORE_VELOCITY, _IGNORE_ACCEL, _IGNORE_YAW = 0x007, 0x038, 0x1C0, 0x400


class GuidedController(Part):
    """Takes the targets of GUIDED and hands them to the position controller."""

    def __init__(self, platform: Platform, fence: CopterFence) -> None:
        super().__init__(platform)
        self._fence = fence
        self.shown_target_m: Point | None = None
        """The last position target. POSITION_TARGET_GLOBAL_INT reports it even while velocities are flown."""
        self._velocity_m_s: Point | None = None
        """The velocity of the newest target; None if that was a place."""
        self._kind = (False, False)
        """Whether targets have a place, and whether they have a velocity."""
        self._expires_us: int | None = None

    def clear(self) -> None:
        """Forget all targets, as a change of mode does."""
        self._kind = (False, False)
        self._expires_us = self._velocity_m_s = None
        self.shown_target_m = None
        self._body.turn_to(math.nan)

    def hold(self) -> None:
        """Brake, and stay where braking ends."""
        self._expires_us = self._velocity_m_s = None
        self._body.hold_here()

    @property
    def is_flying(self) -> bool:
        """Whether set-points are obeyed: only in GUIDED, and off the ground."""
        state = self._state
        return state.mode == GUIDED and state.armed and state.phase in (Phase.TAKEOFF, Phase.AIRBORNE)

    def tick(self) -> None:
        """End a velocity that has expired (GUID_TIMEOUT), or keep it inside the fence."""
        if self._expires_us is not None and self._clock.now_us >= self._expires_us:
            self.hold()
        elif self._fence.is_on and self._velocity_m_s is not None and self._state.mode == GUIDED:
            self._heed_fence(self._velocity_m_s)

    def fly_to_item(self, item: Item) -> bool:
        """Fly to a guided way-point of the mission protocol, in GUIDED only; whether it is taken."""
        place = self.place(item.frame, item.x, item.y, item.z)
        if place is None or self._state.mode != GUIDED or not self._fence.allows(place):
            return False
        if self.is_flying:
            self.fly(place, None)
        return True

    def take_set_point(self, frame: ReceivedFrame) -> None:
        """Take a SET_POSITION_TARGET_GLOBAL_INT or …_LOCAL_NED."""
        if frame.name == "SET_POSITION_TARGET_GLOBAL_INT":
            self._take_global(frame.fields)
        else:
            self._take_local(frame.fields)

    def _take_global(self, fields: Fields) -> None:
        velocity = self._velocity(fields, body=False)
        if fields["type_mask"] & _IGNORE_POSITION:
            self._take(fields, None, velocity)
            return
        position = self.place(fields["coordinate_frame"], fields["lat_int"], fields["lon_int"], fields["alt"])
        if position is not None:
            self._take(fields, position, velocity)

    def _take_local(self, fields: Fields) -> None:
        """Take a target about the EKF origin, or an offset along NED or body axes."""
        frame = fields["coordinate_frame"]
        if frame not in (LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED):
            return
        body = frame in (BODY_NED, BODY_OFFSET_NED)
        velocity = self._velocity(fields, body=body)
        if fields["type_mask"] & _IGNORE_POSITION:
            self._take(fields, None, velocity)
            return
        east, north = self._body.to_earth(fields["x"], fields["y"]) if body else (fields["y"], fields["x"])
        x0, y0, z0 = (0.0, 0.0, 0.0) if frame == LOCAL_NED else self._body.seen_m()
        self._take(fields, (x0 + east, y0 + north, z0 - fields["z"]), velocity)

    def place(self, frame: int, lat_1e7: int, lon_1e7: int, alt_m: float) -> Point | None:
        """Return a place in the vehicle's frame; None for frames and coordinates that ArduCopter does not take."""
        if abs(lat_1e7) > 900_000_000 or abs(lon_1e7) > 1_800_000_000 or not abs(alt_m) <= MAX_TARGET_M:
            return None
        x, y = self._body.to_local(lat_1e7 / 1e7, lon_1e7 / 1e7)
        ground_amsl_m = self._spec.ground_amsl_m
        if frame in FRAMES_AMSL:
            return x, y, alt_m - ground_amsl_m
        if frame in FRAMES_RELATIVE:
            return x, y, alt_m + self._state.home_m[2]
        if frame in FRAMES_TERRAIN:
            # Measured: without terrain data it takes the ground to be at sea level, stays where it is, and sinks.
            here = self._body.seen_m()
            return here[0], here[1], alt_m - ground_amsl_m
        return None

    def _velocity(self, fields: Fields, *, body: bool) -> Point | None:
        if fields["type_mask"] & _IGNORE_VELOCITY:
            return None
        if body:
            east, north = self._body.to_earth(fields["vx"], fields["vy"])
        else:
            east, north = fields["vy"], fields["vx"]
        return east, north, -fields["vz"]

    def _take(self, fields: Fields, position: Point | None, velocity: Point | None) -> None:
        """Fly to a target, if mode, state and fence allow it."""
        # NaN fails every comparison, so this drops it together with what is too far.
        numbers = (position or ()) + (velocity or ())
        if not numbers or not all(abs(number) <= MAX_TARGET_M for number in numbers):
            return
        # Dropped silently in any other mode, and outside the fence: stations learn of it by telemetry only.
        if not self.is_flying or (position is not None and not self._fence.allows(position)):
            return
        if not fields["type_mask"] & _IGNORE_YAW and math.isfinite(fields["yaw"]):
            self._body.turn_to(fields["yaw"] % (2.0 * math.pi))
        # A place without a yaw turns the nose to the direction of travel again; a velocity keeps the yaw.
        elif position is not None:
            self._body.turn_to(math.nan)
        self.fly(position, velocity)

    def fly(self, position: Point | None, velocity: Point | None) -> None:
        """Hand a target to the position controller. Only velocities expire (GUID_TIMEOUT)."""
        # A target ends the climb after take-off.
        if self._state.phase == Phase.TAKEOFF:
            self._state.enter(Phase.AIRBORNE)
        kind = (position is not None, velocity is not None)
        if kind != self._kind:
            self._kind = kind
            # The controller for velocities begins with WPNAV_SPEED.
            if velocity is not None:
                load_speeds(self._params, self._body)
        self._expires_us = None
        self._velocity_m_s = None if position is not None else velocity
        if velocity is not None:
            # Velocities end after 3 s without a new one; places never do, so a lost station leaves the vehicle at its
            # last target.
            self._expires_us = self._clock.now_us + round(self._params["GUID_TIMEOUT"] * 1e6)
        if position is None:
            self._body.set_velocity(velocity or (0.0, 0.0, 0.0))
            if self._fence.is_on and velocity is not None:
                self._heed_fence(velocity)
            return
        self._body.set_target(position, velocity or (0.0, 0.0, 0.0))
        self.shown_target_m = position

    def _heed_fence(self, velocity_m_s: Point) -> None:
        """Slow down a velocity that leads toward the fence.

        The vehicle brakes so that it would stand `AVOID_MARGIN` before the fence, then creeps out all the same.
        Measured at a circle of 40 m with 5 and 6 m/s: slower from 8 m before it on, 0.3 m/s at 38.2 m, then out with
        up to 2 m/s, breached at 40.0 m, 41.1 m at most. Places beyond a fence are dropped before this.
        """
        speed = math.hypot(*velocity_m_s[:2])
        if not int(self._params["AVOID_ENABLE"]) & AVOID_FENCE or speed < MIN_AVOID_SPEED_M_S:
            return
        margin_m = self._params["AVOID_MARGIN"]
        direction = (velocity_m_s[0] / speed, velocity_m_s[1] / speed)
        clear_m = self._clear_m(direction, speed * speed / BRAKE_M_S2 + speed + margin_m)
        gap_m = clear_m - margin_m
        limit = float(approach_speed(np.array(gap_m), BRAKE_M_S2)) if gap_m > AT_MARGIN_M else CREEP_M_S
        share = min(1.0, limit / speed)
        east, north, up = velocity_m_s
        self._body.feed_velocity((east * share, north * share, up))

    def _clear_m(self, direction: tuple[float, float], max_m: float) -> float:
        """Return the distance to the fence in a direction; infinity if `max_m` is still inside."""
        x, y, z = self._body.seen_m()

        def broken(way_m: float) -> bool:
            return bool(self._fence.broken_at(x + direction[0] * way_m, y + direction[1] * way_m, z))

        if not broken(max_m):
            return math.inf
        inside_m, outside_m = 0.0, max_m
        while outside_m - inside_m > CLOSE_M:
            middle_m = (inside_m + outside_m) / 2.0
            inside_m, outside_m = (inside_m, middle_m) if broken(middle_m) else (middle_m, outside_m)
        return inside_m


def load_speeds(params: ParameterTable, body: Body) -> None:
    """Fly with the speeds of the parameters again.

    They count from the next change of mode or kind of target; until then DO_CHANGE_SPEED does.
    """
    i, masses = body.index, body.masses
    masses.speed_m_s[i] = _limited(params["WPNAV_SPEED"] / 100.0)
    masses.climb_m_s[i] = _limited(params["WPNAV_SPEED_UP"] / 100.0)
    masses.descent_m_s[i] = _limited(params["WPNAV_SPEED_DN"] / 100.0)


def _limited(speed_m_s: float) -> float:
    return min(max(speed_m_s, MIN_SPEED_M_S), MAX_SPEED_M_S)
