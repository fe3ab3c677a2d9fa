"""ArduCopter's failsafes: station lost, battery, position lost, fence. Texts and times are as measured.

See docs/autopilots.md "Failsafes of ArduCopter".
"""

from sitl.ardupilot.arming import Arming
from sitl.ardupilot.battery import LEVEL_NAMES, LOW
from sitl.ardupilot.fence import ALT_MAX, ALT_MIN, CIRCLE, POLYGON
from sitl.ardupilot.mode_controller import ModeController
from sitl.ardupilot.modes import LAND, NEED_POSITION, RTL
from sitl.ardupilot.parts import CopterParts
from sitl.ardupilot.position_estimate import BACK_US, CLEARED_US, KEPT_US, STOPPED_AIDING_US
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity, Phase

LAND_PAUSE_US = 4_500_000
"""Time between an EKF failsafe and the descent."""
RETURN_ACTIONS = frozenset({2, 3, 4, 6})
"""BATT_FS_*_ACT that return: RTL, SmartRTL or …, landing sequence or RTL."""
FENCE_US = 100_000
"""The fence is checked this often."""
_FENCE_NAMES = {ALT_MAX: "Max Alt", CIRCLE: "Circle", POLYGON: "Polygon", ALT_MIN: "Min Alt"}


class CopterFailsafes(Part):
    """Watches one vehicle and takes over when something is missing."""

    def __init__(self, platform: Platform, parts: CopterParts, modes: ModeController, arming: Arming) -> None:
        super().__init__(platform)
        self._modes, self._arming, self._flight = modes, arming, parts.flight
        self._battery, self._position, self._fence = parts.battery, parts.position, parts.fence
        self._fence_due_us = platform.clock.now_us
        self._was_breached = False

    def watch(self) -> None:
        """Do one tick of a booted vehicle."""
        state = self._state
        # It never trips if no station was ever heard (docs/autopilots.md "Failsafes of ArduCopter").
        if state.gcs_last_heard_us is not None and "gcs" not in state.failsafes and self._params["FS_GCS_ENABLE"] > 0:
            self._watch_gcs(self._clock.now_us - state.gcs_last_heard_us)
        self._watch_battery()
        self._watch_position()
        if state.armed and self._fence.is_on and self._clock.now_us >= self._fence_due_us:
            self._fence_due_us = self._clock.now_us + FENCE_US
            self._watch_fence()

    def hear_gcs(self) -> None:
        """Take a heartbeat of the vehicle's own ground station."""
        self._state.gcs_last_heard_us = self._clock.now_us
        if "gcs" in self._state.failsafes:
            self._state.failsafes.discard("gcs")
            # The mode stays RTL: the operator has to take the vehicle back.
            self._outbox.text(MavSeverity.WARNING, "GCS Failsafe Cleared")

    def act(self, text: str, mode: int | None) -> None:
        """Report a failsafe; on the ground stop the motors, in the air change to `mode`. None only reports."""
        self._outbox.text(MavSeverity.WARNING, text)
        if mode is None or not self._state.armed:
            return
        # On the ground a failsafe disarms instead of changing the mode.
        if self._state.landed:
            self._arming.disarm()
        else:
            self._modes.set_mode(mode)

    def _watch_gcs(self, silence_us: int) -> None:
        if silence_us > self._params["FS_GCS_TIMEOUT"] * 1e6:
            self._state.failsafes.add("gcs")
            self.act("GCS Failsafe", RTL)

    def _watch_battery(self) -> None:
        battery = self._battery
        level = battery.fallen_to() if self._state.armed else None
        if level is None:
            return
        volts, used_mah = battery.voltage_v, battery.consumed_mah
        self._outbox.text(
            MavSeverity.WARNING, f"Battery 1 is {LEVEL_NAMES[level]} {volts:.2f}V used {used_mah:.0f} mAh"
        )
        action = int(self._params["BATT_FS_LOW_ACT" if level == LOW else "BATT_FS_CRT_ACT"])
        if action <= 0:
            return
        self._state.failsafes.add("battery")
        self.act("Battery Failsafe", RTL if action in RETURN_ACTIONS else LAND)

    def _watch_position(self) -> None:
        position, state = self._position, self._state
        lost_us = position.without_gps_us
        if lost_us is None:
            self._watch_return_of_gps()
            return
        if lost_us >= KEPT_US and not position.lost:
            position.lost = True
            state.failsafes.add("ekf")
            self._outbox.text(MavSeverity.CRITICAL, "EKF variance")
            if state.armed and state.mode in NEED_POSITION | {LAND} and not state.landed:
                self._modes.set_mode(LAND)
                # LAND does not begin to descend at once: 4.5 s at this height were measured.
                self._land_later()
                self._outbox.text(MavSeverity.CRITICAL, "EKF Failsafe: changed to LAND Mode")
        if lost_us >= STOPPED_AIDING_US and not position.aiding_stopped:
            position.aiding_stopped = True
            self._outbox.text(MavSeverity.WARNING, "EKF3 IMU0 stopped aiding")

    def _land_later(self) -> None:
        """Stay at this height for LAND_PAUSE_US, then land."""
        state = self._state
        self._body.hold_here()
        state.enter(Phase.AIRBORNE)

        def land() -> None:
            if state.armed and state.mode == LAND and state.phase == Phase.AIRBORNE:
                self._flight.begin_landing()

        self._tasks.after("land", LAND_PAUSE_US, land, self._clock.now_us)

    def _watch_return_of_gps(self) -> None:
        back_us = self._position.with_gps_again_us
        if back_us is None:
            return
        if back_us >= BACK_US and self._position.lost:
            self._position.lost = self._position.aiding_stopped = False
        if back_us >= CLEARED_US:
            self._state.gps_back_us = None
            if "ekf" in self._state.failsafes:
                self._state.failsafes.discard("ekf")
                self._outbox.text(MavSeverity.CRITICAL, "EKF Failsafe Cleared")

    def _watch_fence(self) -> None:
        fence = self._fence
        broken = 0 if self._state.phase <= Phase.SPOOL_UP else fence.broken_at(*self._body.seen_m())
        new, fence.breached = broken & ~fence.breached, broken
        if new:
            fence.breaches += 1
            names = [_FENCE_NAMES[bit] for bit in (ALT_MAX, CIRCLE, POLYGON, ALT_MIN) if broken & bit]
            listed = " and ".join([", ".join(names[:-1]), names[-1]] if names[1:] else names)
            self._outbox.text(MavSeverity.NOTICE, f"{listed} fence{'s' if names[1:] else ''} breached")
            action = int(self._params["FENCE_ACTION"])
            # FENCE_ACTION 2 always lands; all other actions return here.
            if action == 2:
                self._modes.set_mode(LAND)
            elif action > 0:
                self._modes.set_mode(RTL)
        elif not broken and self._was_breached:
            self._outbox.text(MavSeverity.NOTICE, "Fence breach cleared")
        self._was_breached = bool(broken)
