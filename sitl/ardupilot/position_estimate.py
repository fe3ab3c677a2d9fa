"""How long ArduCopter's EKF keeps its position without GPS, and when it has it again."""

from sitl.common.flight_state import FlightState
from sitl.common.outbox import VehicleClock
from sitl.common.states import Stage

KEPT_US = 8_000_000
"""The EKF keeps its position for this long without GPS."""
STOPPED_AIDING_US = 15_000_000
BACK_US, CLEARED_US = 600_000, 1_200_000
"""After the GPS is back: the position is used again; the failsafe is cleared."""


class PositionEstimate:
    """Whether the EKF has a position that modes may use."""

    def __init__(self, clock: VehicleClock, state: FlightState) -> None:
        self._clock, self._state = clock, state
        self.lost = False
        self.aiding_stopped = False
        self._gps_lost_us: int | None = None
        self._gps_back_us: int | None = None

    @property
    def has_gps(self) -> bool:
        """Whether the GPS has satellites."""
        return self._gps_lost_us is None

    @property
    def is_usable(self) -> bool:
        """Whether modes that need a position may be used."""
        return self._state.stage >= Stage.POSITION_OK and not self.lost

    @property
    def without_gps_us(self) -> int | None:
        """How long there has been no GPS; None while there is."""
        return None if self._gps_lost_us is None else self._clock.now_us - self._gps_lost_us

    @property
    def with_gps_again_us(self) -> int | None:
        """How long the GPS has been back; None without an outage, and once `settle` was called."""
        return None if self._gps_back_us is None else self._clock.now_us - self._gps_back_us

    def lose_gps(self) -> None:
        """Take the satellites of the GPS away."""
        self._gps_lost_us = self._clock.now_us if self._gps_lost_us is None else self._gps_lost_us
        self._gps_back_us = None

    def find_gps(self) -> None:
        """Give the satellites of the GPS back."""
        if self._gps_lost_us is not None:
            # Only a GPS that comes back clears the failsafe; one that was never lost must not.
            self._gps_back_us = self._clock.now_us
        self._gps_lost_us = None

    def recover(self) -> None:
        """Let modes use the position again."""
        self.lost = self.aiding_stopped = False

    def settle(self) -> None:
        """Forget the outage once its failsafe is cleared."""
        self._gps_back_us = None
