"""Arming of an ArduCopter: the checks with their texts, and what arming and disarming change."""

from sitl.ardupilot.auto_mode import ARM_IN_AUTO
from sitl.ardupilot.modes import AUTO, LANDING_MODES, MODE_NAMES, NEED_POSITION, NOT_ARMABLE
from sitl.ardupilot.parts import CopterParts
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Phase, Stage

# ArduCopter refuses to arm with a lean angle outside of 10 to 80 degrees; the parameter is in centidegrees.
MIN_ANGLE_CD, MAX_ANGLE_CD = 1000, 8000
CHECK_GAP_US = 1_000_000
"""The pre-arm checks run once a second."""
# After a landing it disarms sooner than one that never left the ground, which waits for DISARM_DELAY.
LANDED_DISARM_US = 1_100_000
NOT_BOOTED = (
    "Hardware safety switch",
    "Gyros not healthy",
    "EKF attitude is bad",
    "Compass not healthy",
    "AHRS: EKF3 not started",
    "Battery 1 unhealthy",
)
"""Arming checks that fail before 'ArduPilot Ready'."""


class Arming(Part):
    """Decides whether a vehicle may be armed, and arms and disarms it."""

    def __init__(self, platform: Platform, parts: CopterParts) -> None:
        super().__init__(platform)
        self._auto, self._battery, self._position = parts.auto, parts.battery, parts.position
        self._remote_id, self._calibration = parts.remote_id, parts.calibration
        self._checked_us, self._checks_pass = -CHECK_GAP_US, False

    def problems(self) -> list[str]:
        """Return why the vehicle cannot be armed, apart from modes in which it never can.

        A position is needed only by modes that use one: the same vehicle is ready in STABILIZE long before GUIDED.
        """
        found = self._failing_checks() + self._calibration.refusals()
        # A download that was not ended by LOG_REQUEST_END refuses arming for good
        # (docs/autopilots.md "Logs of ArduCopter").
        return [*found, "Downloading logs"] if self._logs.downloading else found

    def _failing_checks(self) -> list[str]:
        state, params = self._state, self._params
        if state.stage < Stage.READY:
            return list(NOT_BOOTED)
        # The PREARM bit depends on the mode: a station has to set GUIDED first, then wait for the bit
        # (docs/autopilots.md "Boot, arming, take-off").
        no_position = state.mode in NEED_POSITION and (state.stage < Stage.ALL_OK or self._position.lost)
        remote_id = self._remote_id.problem()
        failing = {
            "Need Position Estimate": no_position,
            "AHRS: waiting for home": not no_position and state.stage < Stage.PREARM_OK,
            "Check ANGLE_MAX": not MIN_ANGLE_CD <= params["ANGLE_MAX"] <= MAX_ANGLE_CD,
            "Mode requires mission": state.mode == AUTO and not self._auto.exists,
            # A failsafe that is in force refuses arming: "gcs" until the station is heard again, "battery" until the
            # battery is reset.
            "GCS failsafe on": "gcs" in state.failsafes,
            "Battery failsafe": "battery" in state.failsafes,
            remote_id: bool(remote_id),
        }
        return [*(text for text, fails in failing.items() if fails), *self._battery.refusals()]

    def checks_passed(self) -> bool:
        """Return what the checks found when they ran last: up to a second ago, maybe in another mode."""
        if self._clock.now_us - self._checked_us >= CHECK_GAP_US:
            self._checked_us, self._checks_pass = self._clock.now_us, not self.problems()
        return self._checks_pass

    def report_problems(self) -> None:
        """Send one text for each failing check."""
        for problem in self.problems():
            self._outbox.text(MavSeverity.CRITICAL, f"PreArm: {problem}")

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
        self._plans.flying = state.mode == AUTO
        self._outbox.text(MavSeverity.INFO, "Arming motors")

    def disarm(self) -> None:
        """Stop the motors; a vehicle in the air falls."""
        state = self._state
        state.armed = False
        state.enter(Phase.GROUND)
        self._body.rest()
        if state.mode == AUTO:
            self._auto.leave()
            self._plans.seq = 0
        self._outbox.text(MavSeverity.INFO, "Disarming motors")

    def stand(self) -> None:
        """Do one tick of an armed vehicle on the ground: it disarms after a while, sooner after a landing."""
        state = self._state
        # Measured: 1.1 s after a landing by RTL, LAND or a mission; DISARM_DELAY (10 s) in all other modes.
        has_landed = state.mode in LANDING_MODES or (state.mode == AUTO and self._auto.running)
        delay_us = LANDED_DISARM_US if has_landed else self._params["DISARM_DELAY"] * 1e6
        if delay_us > 0 and state.in_phase_us >= delay_us:
            self.disarm()
