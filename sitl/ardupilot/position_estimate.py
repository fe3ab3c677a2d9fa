"""How long ArduCopter's EKF keeps its position without GPS, and when it has it again."""

from sitl.common.platform import Part, Platform
from sitl.common.states import Stage

KEPT_US = 8_000_000
"""The EKF keeps its position for this long without GPS."""
# The text "EKF3 IMU0 stopped aiding" came 15 s after the GPS was lost.
STOPPED_AIDING_US = 15_000_000
BACK_US, CLEARED_US = 600_000, 1_200_000
"""After the GPS is back: the position is used again; the failsafe is cleared."""


class PositionEstimate(Part):
    """Whether the EKF has a position that modes may use."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self.lost = False
        self.aiding_stopped = False

    @property
    def is_usable(self) -> bool:
        """Whether modes that need a position may be used."""
        return self._state.stage >= Stage.POSITION_OK and not self.lost

    @property
    def without_gps_us(self) -> int | None:
        """How long there has been no GPS; None while there is."""
        lost_us = self._state.gps_lost_us
        return None if lost_us is None else self._clock.now_us - lost_us

    @property
    def with_gps_again_us(self) -> int | None:
        """How long the GPS has been back; None without an outage, and once the outage is forgotten."""
        back_us = self._state.gps_back_us
        return None if back_us is None else self._clock.now_us - back_us
