"""PX4's failsafes: set-points, station, joystick, battery, GPS, fence. Texts and times are as measured.

See docs/autopilots.md "Sticks and failsafes of PX4".
"""

from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity
from sitl.px4.commander import Commander, Failsafe
from sitl.px4.modes import HOLD, LAND, OFFBOARD, POSCTL, RTL, STICKS
from sitl.px4.parts import Px4Parts

GCS_SLACK_US = 2_500_000
"""The station is lost this much later than COM_DL_LOSS_T after its last heartbeat."""
POSITION_KEPT_US = 5_000_000
"""Without GPS the position is believed for this long."""
# The estimator notices the loss of the GPS later than the receiver; the failsafe came after 5.2 s.
FUSION_STOPPED_US = 2_200_000
STICKS_HOLD_S = 1.0
"""Hold before the return when the sticks fall silent in a mode that does not need them."""
_TO_HOLD, _TO_RTL, _TO_LAND, _TO_DESCEND = 5, 6, 7, 8
"""Values of failsafe_action in the events of failsafes."""
_ACTIONS = {HOLD: _TO_HOLD, RTL: _TO_RTL, LAND: _TO_LAND}
_CAUSES = {"sticks": 1, "gcs": 2, "low": 3, "critical": 4, "emergency": 5}
_RANKS = {"fence": 1, "stream": 2, "sticks": 3, "gcs": 4, "critical": 5, "emergency": 6, "gps": 7}
_SEVERE = 0x42
"""Value of log_levels in the events of failsafes."""
_OFFBOARD_ACTIONS = {3: RTL, 4: LAND, 5: HOLD}
"""COM_OBL_RC_ACT; smaller values are modes that a pilot flies."""
_LINK_ACTIONS = {1: HOLD, 2: RTL, 3: LAND}
"""Modes by the values of NAV_DLL_ACT and NAV_RCL_ACT."""
_FENCE_ACTIONS = {2: HOLD, 3: RTL, 5: LAND}
"""Modes by the value of GF_ACTION; 1 only warns."""
FENCE_US = 100_000
"""The fence is checked this often."""
_BATTERY_TEXT = {
    "low": (MavSeverity.CRITICAL, "Low battery"),
    "critical": (MavSeverity.CRITICAL, "Critical battery"),
    "emergency": (MavSeverity.EMERGENCY, "Emergency battery level"),
}


class Px4Failsafes(Part):
    """Watches one vehicle and takes over when something is missing."""

    def __init__(self, platform: Platform, parts: Px4Parts, commander: Commander) -> None:
        super().__init__(platform)
        self._commander, self._announcer, self._inputs = commander, parts.announcer, parts.inputs
        self._battery, self._fence = parts.battery, parts.fence
        self._fence_due_us = platform.clock.now_us
        self._gcs_lost = False

    def watch(self) -> None:
        """Do one tick of a booted vehicle."""
        self._watch_gcs()
        if self._state.gps_lost_us is not None or self._inputs.position_lost:
            self._watch_gps()
        if not self._state.armed:
            # The checks report it, this does not.
            self._battery.warning = self._battery.present_warning()
            return
        self._watch_battery()
        if self._state.landed:
            return
        self._watch_stream()
        self._watch_fence()
        # A joystick that was never there cannot be lost.
        if self._inputs.had_sticks:
            self._watch_sticks()
        failsafe = self._commander.failsafe
        if failsafe and failsafe.hold_until_us and self._clock.now_us >= failsafe.hold_until_us:
            failsafe.hold_until_us = 0
            self._announce_action(failsafe.cause, failsafe.action)
            self._commander.apply_mode()

    def engage(self, cause: str, action: int, *, hold_s: float = 0.0, resumes: bool = False) -> None:
        """Take over with a mode, unless something worse already did; only once until the cause has gone."""
        commander = self._commander
        if cause in self._state.failsafes:
            return
        self._state.failsafes.add(cause)
        # A worse failsafe keeps its mode; the cause is remembered, so this one does not act later.
        if commander.failsafe and _RANKS[commander.failsafe.cause] >= _RANKS[cause]:
            return
        hold_until_us = self._clock.now_us + round(hold_s * 1e6) if hold_s and action != HOLD else 0
        commander.failsafe = Failsafe(cause, action, hold_until_us, resumes)
        if hold_until_us:
            self._announce_hold(cause, action, round(hold_s))
        elif cause == "gps":
            self._announce("commander_failsafe_enter_autopilot_disengaged", _TO_DESCEND)
        else:
            self._announce_action(cause, action)
        commander.apply_mode()

    def _announce_hold(self, cause: str, action: int, hold_s: int) -> None:
        event = "commander_failsafe_enter_generic_hold"
        arguments = [self._commander.intended, _ACTIONS[action], hold_s]
        if cause in _CAUSES:
            event = "commander_failsafe_enter_hold"
            arguments.append(_CAUSES[cause])
        text = f"Failsafe activated: entering Hold for {hold_s} seconds"
        self._announcer.alert(text, event, *arguments, levels=_SEVERE)

    def _announce_action(self, cause: str, action: int) -> None:
        if cause in _CAUSES:
            self._announce("commander_failsafe_enter", _ACTIONS[action], _CAUSES[cause])
        else:
            self._announce("commander_failsafe_enter_generic", _ACTIONS.get(action, _TO_HOLD))

    def _announce(self, event: str, *arguments: int) -> None:
        self._announcer.alert("Failsafe activated", event, self._commander.intended, *arguments, levels=_SEVERE)

    def _end(self, cause: str) -> None:
        """Take note that a cause is gone; most failsafes fly on all the same."""
        commander = self._commander
        if cause not in self._state.failsafes:
            return
        self._state.failsafes.discard(cause)
        if commander.failsafe and commander.failsafe.cause == cause and commander.failsafe.resumes:
            commander.failsafe = None
            commander.apply_mode()

    def _watch_stream(self) -> None:
        if self._commander.intended != OFFBOARD or self._inputs.stream_alive:
            self._end("stream")
            return
        chosen = int(self._params["COM_OBL_RC_ACT"])
        # COM_OBL_RC_ACT 0 is Position: without a joystick PX4 returns instead.
        with_pilot = POSCTL if self._inputs.sticks_alive else RTL
        self.engage("stream", _OFFBOARD_ACTIONS.get(chosen, with_pilot), resumes=True)

    def _watch_fence(self) -> None:
        """Act by GF_ACTION; in a mode that is chosen outside the fence the vehicle may stay there."""
        if not self._plans.in_force or self._clock.now_us < self._fence_due_us:
            return
        self._fence_due_us = self._clock.now_us + FENCE_US
        if self._fence.contains(*self._body.seen_m()[:2]):
            self._end("fence")
            return
        action = _FENCE_ACTIONS.get(int(self._params["GF_ACTION"]))
        if "fence" in self._state.failsafes:
            return
        self._announcer.text(MavSeverity.CRITICAL, "Geofence: approaching or outside geofence\t")
        if action is None:
            self._state.failsafes.add("fence")
        else:
            # Seen on 1.16.1: Hold at first.
            self.engage("fence", action, hold_s=self._params["COM_FAIL_ACT_T"])

    def hear_gcs(self) -> None:
        """Take a ground station's heartbeat."""
        self._announcer.hear_gcs()
        if self._gcs_lost:
            self._gcs_lost = False
            self._announcer.announce("GCS connection regained", "commander_dl_regained")

    def _watch_gcs(self) -> None:
        if self._state.gcs_last_heard_us is None:
            return
        silent_us = self._clock.now_us - self._state.gcs_last_heard_us
        if silent_us <= self._params["COM_DL_LOSS_T"] * 1e6 + GCS_SLACK_US:
            # Most failsafes stay in force when their cause is gone: a station that is heard again does not stop the
            # return.
            self._end("gcs")
            return
        # The loss is reported even if NAV_DLL_ACT is 0 and nothing is done about it.
        if not self._gcs_lost:
            self._gcs_lost = True
            self._announcer.announce("Connection to ground station lost", "commander_gcs_lost")
        action = _LINK_ACTIONS.get(int(self._params["NAV_DLL_ACT"]))
        if action is not None and self._state.armed and not self._state.landed:
            self.engage("gcs", action, hold_s=self._params["COM_FAIL_ACT_T"])

    def _watch_sticks(self) -> None:
        if self._inputs.sticks_alive:
            self._end("sticks")
            return
        if "sticks" in self._state.failsafes:
            return
        self._announcer.event("commander_rc_lost")
        hold_s = self._params["COM_FAIL_ACT_T"] if self._commander.intended in STICKS else STICKS_HOLD_S
        action = _LINK_ACTIONS.get(int(self._params["NAV_RCL_ACT"]), RTL)
        self.engage("sticks", action, hold_s=hold_s)

    def _watch_battery(self) -> None:
        warning = self._battery.present_warning()
        if warning == self._battery.warning:
            return
        self._battery.warning = warning
        if not warning:
            return
        severity, text = _BATTERY_TEXT[warning]
        self._announcer.text(severity, f"{text}\t")
        if warning == "low":
            self._announcer.event("commander_failsafe_enter_low_bat", levels=0x64)
            return
        worst = RTL if warning == "critical" else LAND
        action = {1: RTL, 2: LAND, 3: worst}.get(int(self._params["COM_LOW_BAT_ACT"]))
        if action is not None and not self._state.landed:
            self.engage(warning, action, hold_s=self._params["COM_FAIL_ACT_T"] if warning == "critical" else 0.0)

    def _watch_gps(self) -> None:
        inputs = self._inputs
        if self._state.gps_lost_us is None:
            if inputs.position_lost:
                inputs.position_lost = False
                self._end("gps")
            return
        if inputs.position_lost or self._clock.now_us - self._state.gps_lost_us < POSITION_KEPT_US:
            return
        inputs.position_lost = True

        def report() -> None:
            self._announcer.event("check_estimator_gnss_fusion_stopped")

        self._tasks.after("fusion", FUSION_STOPPED_US, report, self._clock.now_us)
        if self._state.armed and not self._state.landed:
            self.engage("gps", LAND)
