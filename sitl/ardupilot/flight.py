"""Take-off, return and landing of an ArduCopter, in whichever mode they are flown."""

import math

from sitl.common.platform import Part, Platform
from sitl.common.states import Phase

# The rotors need this long until they lift the vehicle.
SPOOL_UP_US = 1_000_000
LAND_ALT_LOW_M = 10.0
"""Below this height a landing continues with LAND_SPEED."""
REACHED_M = 0.4


class CopterFlight(Part):
    """The phases of a flight that take several ticks."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._takeoff_m = 0.0

    def take_off(self, height_m: float) -> None:
        """Spool the motors up, then climb to a height in the vehicle's frame."""
        self._takeoff_m = height_m
        self._state.enter(Phase.SPOOL_UP)

    def climb(self, height_m: float) -> None:
        """Climb on the spot, or take off if the vehicle is on the ground."""
        if self._state.landed:
            self.take_off(height_m)
            return
        self._takeoff_m = height_m
        x, y, z = self._body.seen_m()
        self._body.set_target((x, y, max(height_m, z)))

    def begin_return(self) -> None:
        """Climb, fly home, wait and land: the mode RTL, or the RTL item of a mission."""
        self._state.enter(Phase.RTL_CLIMB)
        self._body.hold_here()
        min_m = self._params["RTL_ALT"] / 100.0 + self._state.home_m[2]
        self._body.target_m[2] = max(self._body.target_m[2], min_m)

    def begin_landing(self, *, home: bool = False) -> None:
        """Land where the vehicle is, or at home."""
        body = self._body
        # The first part of a landing uses the speed of descents, the last 10 m LAND_SPEED.
        body.sink(float(body.masses.descent_m_s[body.index]))
        if home:
            body.target_m[:2] = self._state.home_m[:2]
        self._state.enter(Phase.LANDING)

    def tick(self) -> bool:
        """Continue take-off, return or landing; False while the motors spool up."""
        state, body = self._state, self._body
        if state.phase == Phase.SPOOL_UP:
            # The motors need a second before they lift; set-points are not obeyed meanwhile.
            if state.in_phase_us >= SPOOL_UP_US:
                x, y, _ = body.seen_m()
                body.set_target((x, y, self._takeoff_m))
                body.lift()
                state.enter(Phase.TAKEOFF)
            return False
        if state.phase == Phase.TAKEOFF and body.seen_m()[2] >= self._takeoff_m - REACHED_M:
            state.enter(Phase.AIRBORNE)
        elif state.phase >= Phase.RTL_CLIMB:
            self._continue_return()
        return True

    def _continue_return(self) -> None:
        state, body, home_m = self._state, self._body, self._state.home_m
        dx, dy, dz = (body.target_m - body.seen_m()).tolist()
        if state.phase == Phase.RTL_CLIMB:
            if abs(dz) < REACHED_M:
                body.set_target((home_m[0], home_m[1], float(body.target_m[2])))
                state.enter(Phase.RTL_HOME)
        elif state.phase == Phase.RTL_HOME:
            if math.hypot(dx, dy) < REACHED_M:
                state.enter(Phase.RTL_LOITER)
        elif state.phase == Phase.RTL_LOITER:
            if state.in_phase_us >= self._params["RTL_LOIT_TIME"] * 1000:
                self.begin_landing(home=True)
        elif body.seen_m()[2] <= LAND_ALT_LOW_M:
            body.feed_descent(self._params["LAND_SPEED"] / 100.0)
