"""MANUAL_CONTROL of an ArduCopter: a joystick that overrides the sticks of its receiver."""

from sitl.common.platform import Part, Platform
from sitl.physics.point_masses import Point

RELEASE = 32767
"""The value of an axis that is left to the receiver's stick."""
STICK_M_S, STICK_UP_M_S = 9.5, 2.0
"""Speed in LOITER with a stick at its end: 9.4 m/s measured, and 1.25 m/s upward at 800."""
# A stick at the bottom in LOITER: it sank at 2.5 m/s, silently (docs/autopilots.md "Dangerous things first").
STICK_DOWN_SINK_M_S = 2.5


class Joystick(Part):
    """The newest MANUAL_CONTROL, as long as it is in force."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._sticks = (RELEASE, RELEASE, RELEASE, RELEASE)
        self._last_heard_us: int | None = None

    def hear(self, sticks: tuple[int, int, int, int]) -> None:
        """Take x, y, z and r of a MANUAL_CONTROL."""
        self._last_heard_us = self._clock.now_us
        self._sticks = sticks

    @property
    def is_present(self) -> bool:
        """Whether a joystick has been heard and was not dropped since."""
        return self._last_heard_us is not None

    @property
    def shown(self) -> tuple[int, int, int, int]:
        """The sticks as RC_CHANNELS shows them."""
        return self._sticks if self._last_heard_us is not None else (RELEASE, RELEASE, RELEASE, RELEASE)

    def drop(self) -> None:
        """Return to the receiver's sticks."""
        self._last_heard_us = None

    def velocity_m_s(self) -> Point | None:
        """Return the velocity that the joystick demands; None once it is silent or has released the throttle."""
        x, y, z, _ = self._sticks
        if (
            self._last_heard_us is None
            or self._clock.now_us - self._last_heard_us > self._params["RC_OVERRIDE_TIME"] * 1e6
        ):
            return None
        if z == RELEASE:
            return None
        forward, right = (0.0 if v == RELEASE else v / 1000.0 * STICK_M_S for v in (x, y))
        push = (z - 500) / 500.0
        up = push * (STICK_UP_M_S if push > 0.0 else STICK_DOWN_SINK_M_S)
        return (*self._body.to_earth(forward, right), up)
