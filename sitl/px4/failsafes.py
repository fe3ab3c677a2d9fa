"""When PX4 takes over: lost set-points, stations, sticks, battery, GPS, fence."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl.common.states import Severity
from sitl.px4.modes import HOLD, LAND, OFFBOARD, POSCTL, RTL, STICKS

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

STREAM_SLACK_US = 300_000
"""Set-points may pause so much longer than COM_OF_LOSS_T."""
GCS_SLACK_US = 2_500_000
GPS_PATIENCE_US = 5_000_000
"""Without GPS the position is believed for so long."""
FUSION_STOPPED_US = 2_200_000
STICKS_HOLD_S = 1.0
"""Hold before the return when sticks stop outside the modes that need them."""
_TO_HOLD, _TO_RTL, _TO_LAND, _TO_DESCEND = 5, 6, 7, 8
"""failsafe_action."""
_ACTIONS = {HOLD: _TO_HOLD, RTL: _TO_RTL, LAND: _TO_LAND}
_CAUSES = {"sticks": 1, "gcs": 2, "low": 3, "critical": 4, "emergency": 5}
_RANKS = {"fence": 1, "stream": 2, "sticks": 3, "gcs": 4, "critical": 5, "emergency": 6, "gps": 7}
_SEVERE = 0x42
"""log_levels."""
_OFFBOARD_ACTIONS = {3: RTL, 4: LAND, 5: HOLD}
"""COM_OBL_RC_ACT; below are modes flown by hand."""
_LINK_ACTIONS = {1: HOLD, 2: RTL, 3: LAND}
"""NAV_DLL_ACT and NAV_RCL_ACT."""
_FENCE_ACTIONS = {2: HOLD, 3: RTL, 5: LAND}
"""GF_ACTION; 1 only warns."""
FENCE_US = 100_000
_BATTERY_TEXT = {
    "low": (Severity.CRITICAL, "Low battery"),
    "critical": (Severity.CRITICAL, "Critical battery"),
    "emergency": (Severity.EMERGENCY, "Emergency battery level"),
}


@dataclass
class Failsafe:
    """Why and how PX4 flies by itself."""

    cause: str
    action: int
    """The mode it ends in."""
    hold_until_us: int
    resumes: bool = False
    """The operator's mode comes back when the cause is gone."""

    def mode(self, now_us: int) -> int:
        """What is flown now."""
        return HOLD if now_us < self.hold_until_us else self.action


def watch(ap: "Px4") -> None:
    """Look for what is missing, and act."""
    _watch_gcs(ap)
    if ap.gps_lost_us is not None or ap.gps_gone:
        _watch_gps(ap)
    if not ap.armed:
        ap.battery_warning = _battery_state(ap)  # shown by the checks; nothing is said
        return
    _watch_battery(ap)
    if ap.landed:
        return
    _watch_stream(ap)
    _watch_fence(ap)
    if ap.sticks_us is not None:
        _watch_sticks(ap)
    failsafe = ap.failsafe
    if failsafe and failsafe.hold_until_us and ap.now_us >= failsafe.hold_until_us:
        failsafe.hold_until_us = 0
        _say_action(ap, failsafe.cause, failsafe.action)
        ap.apply_mode()


def overruled(ap: "Px4") -> None:
    """The operator chose a mode: what acted before does not act again before its cause has gone."""
    ap.failsafe = None


def engage(ap: "Px4", cause: str, action: int, *, hold_s: float = 0.0, resumes: bool = False) -> None:
    """Take over, unless something worse already did; only once until the cause has gone."""
    if cause in ap.failsafes:
        return
    ap.failsafes.add(cause)
    if ap.failsafe and _RANKS[ap.failsafe.cause] >= _RANKS[cause]:
        return
    hold_us = ap.now_us + round(hold_s * 1e6) if hold_s and action != HOLD else 0
    ap.failsafe = Failsafe(cause, action, hold_us, resumes)
    if hold_us:
        _say_hold(ap, cause, action, round(hold_s))
    elif cause == "gps":
        _say_now(ap, "commander_failsafe_enter_autopilot_disengaged", _TO_DESCEND)
    else:
        _say_action(ap, cause, action)
    ap.apply_mode()


def _say_hold(ap: "Px4", cause: str, action: int, hold_s: int) -> None:
    event, arguments = "commander_failsafe_enter_generic_hold", [ap.intended, _ACTIONS[action], hold_s]
    if cause in _CAUSES:
        event = "commander_failsafe_enter_hold"
        arguments.append(_CAUSES[cause])
    text = f"Failsafe activated: entering Hold for {hold_s} seconds"
    ap.tell(text, event, *arguments, severity=Severity.CRITICAL, levels=_SEVERE)


def _say_action(ap: "Px4", cause: str, action: int) -> None:
    if cause in _CAUSES:
        _say_now(ap, "commander_failsafe_enter", _ACTIONS[action], _CAUSES[cause])
    else:
        _say_now(ap, "commander_failsafe_enter_generic", _ACTIONS.get(action, _TO_HOLD))


def _say_now(ap: "Px4", event: str, *arguments: int) -> None:
    ap.tell("Failsafe activated", event, ap.intended, *arguments, severity=Severity.CRITICAL, levels=_SEVERE)


def _gone(ap: "Px4", cause: str) -> None:
    """The cause has gone; most failsafes fly on all the same."""
    if cause not in ap.failsafes:
        return
    ap.failsafes.discard(cause)
    if ap.failsafe and ap.failsafe.cause == cause and ap.failsafe.resumes:
        ap.failsafe = None
        ap.apply_mode()


def _watch_stream(ap: "Px4") -> None:
    if ap.intended != OFFBOARD or ap.stream_alive:
        _gone(ap, "stream")
        return
    chosen = int(ap.params["COM_OBL_RC_ACT"])
    by_hand = POSCTL if ap.sticks_alive else RTL
    engage(ap, "stream", _OFFBOARD_ACTIONS.get(chosen, by_hand), resumes=True)


def _watch_fence(ap: "Px4") -> None:
    """GF_ACTION; in a mode chosen while it is outside it may stay there."""
    if not ap.plans.in_force or ap.now_us < ap.fence_due_us:
        return
    ap.fence_due_us = ap.now_us + FENCE_US
    if ap.inside_fence(ap.vehicles.seen(ap.index)):
        _gone(ap, "fence")
        return
    action = _FENCE_ACTIONS.get(int(ap.params["GF_ACTION"]))
    if "fence" in ap.failsafes:
        return
    ap.text(Severity.CRITICAL, "Geofence: approaching or outside geofence\t")
    if action is None:
        ap.failsafes.add("fence")
    else:
        engage(ap, "fence", action, hold_s=ap.params["COM_FAIL_ACT_T"])  # seen on 1.16.1: Hold at first


def _watch_gcs(ap: "Px4") -> None:
    if ap.gcs_heard_us is None:
        return
    silent_us = ap.now_us - ap.gcs_heard_us
    if silent_us <= ap.params["COM_DL_LOSS_T"] * 1e6 + GCS_SLACK_US:
        _gone(ap, "gcs")
        return
    if not ap.gcs_lost:
        ap.gcs_lost = True
        ap.tell("Connection to ground station lost", "commander_gcs_lost")
    action = _LINK_ACTIONS.get(int(ap.params["NAV_DLL_ACT"]))
    if action is not None and ap.armed and not ap.landed:
        engage(ap, "gcs", action, hold_s=ap.params["COM_FAIL_ACT_T"])


def _watch_sticks(ap: "Px4") -> None:
    if ap.sticks_alive:
        _gone(ap, "sticks")
        return
    if "sticks" in ap.failsafes:
        return
    ap.event("commander_rc_lost")
    hold_s = ap.params["COM_FAIL_ACT_T"] if ap.intended in STICKS else STICKS_HOLD_S
    action = _LINK_ACTIONS.get(int(ap.params["NAV_RCL_ACT"]), RTL)
    engage(ap, "sticks", action, hold_s=hold_s)


def _battery_state(ap: "Px4") -> str:
    charge = ap.charge
    for state, name in (("emergency", "BAT_EMERGEN_THR"), ("critical", "BAT_CRIT_THR"), ("low", "BAT_LOW_THR")):
        if charge <= ap.params[name]:
            return state
    return ""


def _watch_battery(ap: "Px4") -> None:
    state = _battery_state(ap)
    if state == ap.battery_warning:
        return
    ap.battery_warning = state
    if not state:
        return
    severity, text = _BATTERY_TEXT[state]
    ap.text(severity, f"{text}\t")
    if state == "low":
        ap.event("commander_failsafe_enter_low_bat", levels=0x64)
        return
    action = {1: RTL, 2: LAND, 3: RTL if state == "critical" else LAND}.get(int(ap.params["COM_LOW_BAT_ACT"]))
    if action is not None and not ap.landed:
        engage(ap, state, action, hold_s=ap.params["COM_FAIL_ACT_T"] if state == "critical" else 0.0)


def _watch_gps(ap: "Px4") -> None:
    if ap.gps_lost_us is None:
        if ap.gps_gone:
            ap.gps_gone = False
            _gone(ap, "gps")
        return
    if ap.gps_gone or ap.now_us - ap.gps_lost_us < GPS_PATIENCE_US:
        return
    ap.gps_gone = True
    ap.tasks.after("fusion", FUSION_STOPPED_US, lambda: ap.event("check_estimator_gnss_fusion_stopped"), ap.now_us)
    if ap.armed and not ap.landed:
        engage(ap, "gps", LAND)
