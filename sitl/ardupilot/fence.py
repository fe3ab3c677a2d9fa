"""ArduCopter's fence: altitude, circle around home, polygons and circles of the stored plan."""

from sitl.common.fence import Fence
from sitl.common.platform import Platform
from sitl.physics.point_masses import Point

ALT_MAX, CIRCLE, POLYGON, ALT_MIN = 1, 2, 4, 8
"""Bits of FENCE_TYPE and of a breach."""


class CopterFence(Fence):
    """The fence of one vehicle, and which parts of it are breached."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self.enabled = False
        """DO_FENCE_ENABLE has switched it on; the parameter does not show that."""
        self.breached = 0
        """FENCE_TYPE bits of what is breached now."""
        self.breaches = 0
        """Number of breaches so far."""

    @property
    def is_on(self) -> bool:
        """Whether the fence is in force."""
        return self.enabled or self._params["FENCE_ENABLE"] > 0

    def allows(self, place_m: Point) -> bool:
        """Return whether a target may be at a place."""
        return not (self.is_on and self.broken_at(*place_m))

    def broken_at(self, x: float, y: float, z: float) -> int:
        """Return the FENCE_TYPE bits of the fences that forbid a place (metres in the vehicle's frame)."""
        chosen, home_m = int(self._params["FENCE_TYPE"]), self._state.home_m
        height_m = z - home_m[2]
        away_m = ((x - home_m[0]) ** 2 + (y - home_m[1]) ** 2) ** 0.5
        broken = 0
        if chosen & ALT_MAX and height_m > self._params["FENCE_ALT_MAX"]:
            broken |= ALT_MAX
        if chosen & ALT_MIN and height_m < self._params["FENCE_ALT_MIN"]:
            broken |= ALT_MIN
        if chosen & CIRCLE and away_m > self._params["FENCE_RADIUS"]:
            broken |= CIRCLE
        if chosen & POLYGON and not self.contains(x, y):
            broken |= POLYGON
        return broken
