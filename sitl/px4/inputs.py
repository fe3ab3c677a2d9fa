"""What steers a PX4 from outside: the set-point stream of OFFBOARD, a joystick, and the GPS."""

from sitl.common.platform import Part, Platform

STREAM_SLACK_US = 300_000
"""Set-points may pause this much longer than COM_OF_LOSS_T."""
STICKS_ALIVE_US = 500_000
"""A joystick is alive this long after a MANUAL_CONTROL."""


class ControlInputs(Part):
    """When set-points and MANUAL_CONTROL came last, and whether the position is believed."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self.sticks: tuple[int, int, int, int] = (0, 0, 500, 0)
        """x, y, z and r of the newest MANUAL_CONTROL."""
        self.position_lost = False
        """The position is no longer believed, because there was no GPS for too long."""
        self._sticks_us: int | None = None
        self._stream_us: int | None = None

    def hear_set_point(self) -> None:
        """Count a set-point as part of the stream."""
        self._stream_us = self._clock.now_us

    def hear_sticks(self, sticks: tuple[int, int, int, int]) -> None:
        """Take a MANUAL_CONTROL; PX4 obeys any sender."""
        self._sticks_us = self._clock.now_us
        self.sticks = sticks

    @property
    def stream_alive(self) -> bool:
        """Whether set-points arrive in time."""
        # Measured: OFFBOARD is left 1.3 to 2.1 s after the last set-point.
        limit_us = self._params["COM_OF_LOSS_T"] * 1e6 + STREAM_SLACK_US
        return self._stream_us is not None and self._clock.now_us - self._stream_us <= limit_us

    @property
    def had_sticks(self) -> bool:
        """Whether a joystick was heard since the boot."""
        return self._sticks_us is not None

    @property
    def sticks_alive(self) -> bool:
        """Whether a joystick is heard now."""
        return self._sticks_us is not None and self._clock.now_us - self._sticks_us <= STICKS_ALIVE_US
