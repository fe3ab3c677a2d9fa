"""Arming of an ArduCopter: the checks with their texts, and what arming and disarming change."""

from sitl.ardupilot.auto_mode import ARM_IN_AUTO, AutoMode
from sitl.ardupilot.battery import CopterBattery
from sitl.ardupilot.boot import NOT_BOOTED
from sitl.ardupilot.calibration import CopterCalibration
from sitl.ardupilot.modes import AUTO, LANDING_MODES, MODE_NAMES, NEED_POSITION, NOT_ARMABLE
from sitl.ardupilot.position_estimate import PositionEstimate
from sitl.ardupilot.remote_id import RemoteId
from sitl.common.platform import Platform
from sitl.common.states import Phase, Severity, Stage

MIN_ANGLE_CD, MAX_ANGLE_CD = 1000, 8000
CHECK_GAP_US = 1_000_000
"""The pre-arm checks run once a second."""
LANDED_DISARM_US = 1_100_000


class Arming:
    """Decides whether a vehicle may be armed, and arms and disarms it."""

    def __init__(
        self,
        platform: Platform,
        *,
        auto: AutoMode,
        battery: CopterBattery,
        position: PositionEstimate,
        remote_id: RemoteId,
        calibration: CopterCalibration,
    ) -> None:
        self._platform, self._state = platform, platform.state
        self._params, self._clock, self._outbox = platform.params, platform.clock, platform.outbox
        self._auto, self._battery, self._position = auto, battery, position
        self._remote_id, self._calibration = remote_id, calibration
        self._checked_us, self._checks_pass = -CHECK_GAP_US, False

    def problems(self) -> list[str]:
        """Return why the vehicle cannot be armed, apart from modes in which it never can.

        A position is needed only by modes that use one: the same vehicle is ready in STABILIZE long before GUIDED.
        """
        found = self._failing_checks() + self._calibration.refusals()
        # A download that was not ended by LOG_REQUEST_END refuses arming for good
        # (docs/autopilots.md "Logs of ArduCopter").
        return [*found, "Downloading logs"] if self._platform.logs.downloading else found

    def _failing_checks(self) -> list[str]:
        state, params = self._state, self._params
        if state.stage < Stage.READY:
            return list(NOT_BOOTED)
        found: list[str] = []
        # The PREARM bit depends on the mode: a station has to set GUIDED first, then wait for the bit
        # (docs/autopilots.md "Boot, arming, take-off").
        if state.mode in NEED_POSITION and (state.stage < Stage.ALL_OK or self._position.lost):
            found.append("Need Position Estimate")
        elif state.stage < Stage.PREARM_OK:
            found.append("AHRS: waiting for home")
        if not MIN_ANGLE_CD <= params["ANGLE_MAX"] <= MAX_ANGLE_CD:
            found.append("Check ANGLE_MAX")
        if state.mode == AUTO and not self._auto.exists:
            found.append("Mode requires mission")
        if self._battery.voltage_v < params["BATT_ARM_VOLT"]:
            found.append("Battery 1 below minimum arming voltage")
        # A failsafe that is in force refuses arming: "gcs" until the station is heard again, "battery" until the
        # battery is reset.
        if "gcs" in state.failsafes:
            found.append("GCS failsafe on")
        if "battery" in state.failsafes:
            found.append("Battery failsafe")
        if why := self._remote_id.problem():
            found.append(why)
        return found

    def checks_passed(self) -> bool:
        """Return what the checks found when they ran last: up to a second ago, maybe in another mode."""
        if self._clock.now_us - self._checked_us >= CHECK_GAP_US:
            self._checked_us, self._checks_pass = self._clock.now_us, not self.problems()
        return self._checks_pass

    def report_problems(self) -> None:
        """Send one text for each failing check."""
        for problem in self.problems():
            self._outbox.text(Severity.CRITICAL, f"PreArm: {problem}")

    def refusals(self) -> list[str]:
        """Return why the vehicle cannot be armed now."""
        mode = self._state.mode
        if mode in NOT_ARMABLE or (mode == AUTO and self._auto.exists and not self._auto.allows(ARM_IN_AUTO)):
            return [f"{MODE_NAMES[mode]} mode not armable"]
        return self.problems()

    def arm(self) -> None:
        """Start the motors; home is where the vehicle stands."""
        state = self._state
        state.armed = True
        state.enter(Phase.GROUND)
        # Home moves with every arming, and with it the zero of relative altitude.
        state.set_home()
        self._platform.plans.flying = state.mode == AUTO
        self._outbox.text(Severity.INFO, "Arming motors")

    def disarm(self) -> None:
        """Stop the motors; a vehicle in the air falls."""
        state = self._state
        state.armed = False
        state.enter(Phase.GROUND)
        self._platform.body.rest()
        if state.mode == AUTO:
            self._auto.leave()
            self._platform.plans.seq = 0
        self._outbox.text(Severity.INFO, "Disarming motors")

    def stand(self) -> None:
        """Do one tick of an armed vehicle on the ground: it disarms after a while, sooner after a landing."""
        state = self._state
        # Measured: 1.1 s after a landing by RTL, LAND or a mission; DISARM_DELAY (10 s) in all other modes.
        has_landed = state.mode in LANDING_MODES or (state.mode == AUTO and self._auto.is_running)
        delay_us = LANDED_DISARM_US if has_landed else self._params["DISARM_DELAY"] * 1e6
        if delay_us > 0 and state.in_phase_us >= delay_us:
            self.disarm()
