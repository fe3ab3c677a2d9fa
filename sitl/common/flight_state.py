"""The state of one vehicle's flight: stage of the boot, armed or not, mode, phase, home."""

from sitl.common.logs import Logs
from sitl.common.outbox import VehicleClock
from sitl.common.states import Phase, Stage
from sitl.common.streams import Streams
from sitl.physics.point_masses import Body, Point

LAND_DETECT_US = 1_000_000
HOVER_CURRENT_A = 28.0
IDLE_CURRENT_A = 1.0


class FlightState:
    """What all parts of an autopilot read and change about the flight. It is as new after every power-on."""

    def __init__(self, clock: VehicleClock, body: Body, streams: Streams, logs: Logs) -> None:
        self.stage = Stage.OFF
        self.mode = 0
        """Mode that is flown, as in HEARTBEAT.custom_mode."""
        self.phase = Phase.GROUND
        self.phase_us = clock.now_us
        """When this phase began."""
        self.home_m: Point = (0.0, 0.0, 0.0)
        """Home in the vehicle's frame; its z is the zero of relative altitude."""
        self.failsafes: set[str] = set()
        """Names of the failsafes with a cause that is present."""
        self.gcs_last_heard_us: int | None = None
        """When a heartbeat of the ground station came last."""
        self.gps_lost_us: int | None = None
        """Since when the GPS has no satellites; None while it has."""
        self.gps_back_us: int | None = None
        """When the satellites came back after an outage; the autopilot may forget it."""
        self._clock, self._body, self._streams, self._logs = clock, body, streams, logs
        self._armed = False
        self._touched_us: int | None = None

    @property
    def armed(self) -> bool:
        """Whether the motors are on."""
        return self._armed

    @armed.setter
    def armed(self, on: bool) -> None:
        if on != self._armed:
            self._armed = on
            self._logs.motors(self._clock.now_us, on=on)

    @property
    def landed(self) -> bool:
        """Whether the vehicle is on the ground as far as its autopilot knows."""
        return self.phase in (Phase.GROUND, Phase.SPOOL_UP)

    @property
    def in_phase_us(self) -> int:
        """How long this phase has lasted."""
        return self._clock.now_us - self.phase_us

    @property
    def current_a(self) -> float:
        """Current that the battery delivers now."""
        if not self._armed:
            return 0.0
        return HOVER_CURRENT_A if self.phase > Phase.SPOOL_UP else IDLE_CURRENT_A

    def enter(self, phase: Phase) -> None:
        """Begin a phase of the flight."""
        self.phase = phase
        self.phase_us = self._clock.now_us
        self._touched_us = None

    def set_home(self) -> None:
        """Make the vehicle's present place its home, and report it once."""
        self.home_m = self._body.seen_m()
        self._streams.send_once("GPS_GLOBAL_ORIGIN", "HOME_POSITION")

    def lose_gps(self) -> None:
        """Take the satellites of the GPS away."""
        self.gps_lost_us = self._clock.now_us if self.gps_lost_us is None else self.gps_lost_us
        self.gps_back_us = None

    def find_gps(self) -> None:
        """Give the satellites of the GPS back."""
        # Only a GPS that comes back clears a failsafe; one that was never lost must not.
        if self.gps_lost_us is not None:
            self.gps_back_us = self._clock.now_us
        self.gps_lost_us = None

    def detect_ground(self) -> bool:
        """Enter GROUND and return True once the vehicle has stood on the ground for LAND_DETECT_US."""
        # A crippled vehicle goes on trying to climb with full throttle: no autopilot takes that for a landing.
        if self._body.is_above_ground or self._body.is_crippled:
            self._touched_us = None
        elif self._touched_us is None:
            self._touched_us = self._clock.now_us
        # A bounce would count as a landing without this time.
        elif self._clock.now_us - self._touched_us >= LAND_DETECT_US:
            self._body.rest()
            self.enter(Phase.GROUND)
            return True
        return False
