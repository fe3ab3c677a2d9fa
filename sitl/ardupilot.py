"""One simulated ArduCopter: modes, arming, flight phases, failsafes.

The numbers and texts are those measured on ArduCopter 4.7 SITL.
"""

import math

from sitl import ardupilot_commands, arming, guided
from sitl.ardupilot_telemetry import BUILDERS
from sitl.autopilot import SIM_STATION_SYSID, Autopilot, Command, Fields
from sitl.boot import ARDUPILOT_BOOT, ARDUPILOT_BOOT_TEXT
from sitl.modes import (
    AUTO,
    AUTO_RTL,
    BRAKE,
    GUIDED,
    LAND,
    LANDING_MODES,
    MANUAL_THROTTLE,
    MODE_NAMES,
    NEED_POSITION,
    NOT_ARMABLE,
    RETURN_MODES,
    RTL,
    STABILIZE,
    Phase,
    Severity,
    Stage,
)
from sitl.streams import Streams

# REQUEST_DATA_STREAM groups, of the messages this simulator has (facts: ArduCopter, "Groups").
STREAM_GROUPS: dict[int, tuple[str, ...]] = {
    2: ("SYS_STATUS", "MISSION_CURRENT", "GPS_RAW_INT", "POSITION_TARGET_GLOBAL_INT"),
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    10: ("ATTITUDE",),
    11: ("VFR_HUD",),
    12: ("SYSTEM_TIME", "BATTERY_STATUS", "EKF_STATUS_REPORT"),
}
SPOOL_UP_US = 1_000_000
LANDED_DISARM_US = 1_100_000
PREARM_TEXT_US = 30_000_000
TIMESYNC_US = 10_000_000
LAND_ALT_LOW_M = 10.0
REACHED_M = 0.4
STICK_DOWN_SINK_M_S = 2.5
MIN_SPEED_M_S = 0.1


def _between(speed_m_s: float) -> float:
    return min(max(speed_m_s, MIN_SPEED_M_S), ardupilot_commands.MAX_SPEED_M_S)


class ArduCopter(Autopilot):
    """ArduCopter's manners."""

    BOOT_TEXT = ARDUPILOT_BOOT_TEXT
    BOOT = ARDUPILOT_BOOT
    BUILDERS = BUILDERS

    def new_streams(self) -> Streams:
        """Nothing is sent unasked but heartbeats."""
        return Streams(STREAM_GROUPS)

    def power_on(self) -> None:
        """Its own part of `restart`."""
        self.mode = STABILIZE
        self.takeoff_m = 0.0
        self.target_expires_us: int | None = None
        self.shown_target_m: tuple[float, float, float] | None = None
        """What POSITION_TARGET_GLOBAL_INT shows: the last position target, even when velocities came later."""
        self.prearm_text_us = self.now_us + PREARM_TEXT_US
        self.timesync_us = self.now_us + TIMESYNC_US

    def reached(self, stage: Stage, at_us: int) -> None:
        """A stage of the boot was reached; its texts follow."""
        if stage == Stage.BEATING:
            self.streams.start("HEARTBEAT", 1000, at_us)
        elif stage == Stage.READY:
            self.mode = STABILIZE  # a mode set earlier was acknowledged and is lost
        elif stage == Stage.HOME_SET:
            self.text(Severity.INFO, f"Field Elevation Set: {self.spec.ground_amsl_m:.0f}m")
            self.set_home()

    def execute(self, command: Command, system: int, component: int) -> None:
        """Do it and acknowledge it to `system`/`component`."""
        ardupilot_commands.execute(self, command, system, component)

    def legacy_set_mode(self, fields: Fields, system: int, component: int) -> None:
        """SET_MODE (11): obeyed, never acknowledged."""
        if fields["base_mode"] & ardupilot_commands.CUSTOM_MODE_ENABLED:
            self.set_mode(fields["custom_mode"] & 0xFF)

    def set_point(self, name: str, fields: Fields) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT or …_LOCAL_NED."""
        if name == "SET_POSITION_TARGET_GLOBAL_INT":
            guided.global_target(self, fields)
        else:
            guided.local_target(self, fields)

    def banner(self) -> None:
        """The three texts that come at boot and with a parameter list."""
        for text in ("ArduCopter V4.7.0-dev (cef8bcef)", self.uid, "Frame: QUAD/PLUS"):
            self.text(Severity.INFO, text)

    def watch(self) -> None:
        """Failsafes and what is said unasked."""
        if self.now_us >= self.timesync_us:
            self.timesync_us += TIMESYNC_US
            self.send("TIMESYNC", tc1=0, ts1=(self.now_us - self.power_on_us) * 1000)
        if self.now_us >= self.prearm_text_us:
            self.prearm_text_us += PREARM_TEXT_US
            if not self.armed:
                self.say_prearm()
        if self.gcs_heard_us is not None and "gcs" not in self.failsafes and self.params["FS_GCS_ENABLE"] > 0:
            self._watch_gcs(self.now_us - self.gcs_heard_us)

    def _watch_gcs(self, silence_us: int) -> None:
        if silence_us > self.params["FS_GCS_TIMEOUT"] * 1e6:
            self.failsafes.add("gcs")
            self._failsafe("GCS Failsafe", RTL)

    def _failsafe(self, text: str, mode: int) -> None:
        self.text(Severity.WARNING, text)
        if not self.armed:
            return
        if self.phase in (Phase.GROUND, Phase.SPOOL_UP):
            self.disarm()
        else:
            self.set_mode(mode)

    def event(self, name: str, *arguments: float, levels: int = 0x66) -> None:
        """ArduPilot has no EVENTs."""

    def resend_events(self, fields: Fields, system: int, component: int) -> None:
        """ArduPilot has no EVENTs."""

    def hear_sticks(self, system: int, fields: Fields) -> None:
        """MANUAL_CONTROL counts as a heartbeat of its station."""
        self.hear_gcs(system, 0)

    def hear_gcs(self, system: int, kind: int) -> None:
        """A heartbeat of its ground station, whatever the type."""
        if system not in (int(self.params["MAV_GCS_SYSID"]), SIM_STATION_SYSID):
            return
        self.gcs_heard_us = self.now_us
        if "gcs" in self.failsafes:
            self.failsafes.discard("gcs")
            self.text(Severity.WARNING, "GCS Failsafe Cleared")

    def watch_battery(self) -> None:
        """BATT_FS_*."""
        if "battery" in self.failsafes or self.params["BATT_FS_LOW_ACT"] <= 0:
            return
        if self.params["BATT_CAPACITY"] - self.consumed_mah < self.params["BATT_LOW_MAH"]:
            self.failsafes.add("battery")
            self.text(Severity.WARNING, f"Battery 1 is low 12.60V used {self.consumed_mah:.0f} mAh")
            self._failsafe("Battery Failsafe", LAND if self.params["BATT_FS_LOW_ACT"] == 1 else RTL)

    # Arming

    def prearm_problems(self) -> list[str]:
        """Why it cannot be armed, apart from modes that never can."""
        return arming.problems(self.stage, self.mode, self.params, self.failsafes)

    def say_prearm(self) -> None:
        """One line per failing check."""
        for problem in self.prearm_problems():
            self.text(Severity.CRITICAL, f"PreArm: {problem}")

    def arming_problems(self) -> list[str]:
        """Why it cannot be armed now."""
        if self.mode in NOT_ARMABLE:
            return [f"{MODE_NAMES[self.mode]} mode not armable"]
        return self.prearm_problems()

    def arm(self) -> None:
        """Start the motors. Home is where it stands."""
        self.armed = True
        self.enter(Phase.GROUND)
        self.set_home()
        self.text(Severity.INFO, "Arming motors")

    def disarm(self) -> None:
        """Stop the motors; in the air it falls."""
        self.armed = False
        self.enter(Phase.GROUND)
        self.vehicles.rest(self.index)
        self.text(Severity.INFO, "Disarming motors")

    # Modes

    def set_mode(self, mode: int) -> bool:
        """Change mode; False (and a text) if refused."""
        name = MODE_NAMES.get(mode)
        if name is None:
            self.text(Severity.WARNING, f"No such mode {mode}")
            return False
        if mode == self.mode:
            return True
        if self.armed:
            reason = self._mode_refusal(mode)
            if reason:
                self.text(Severity.WARNING, f"Mode change to {name} failed: {reason}")
                return False
        self.mode = mode
        self._load_speeds()
        self.target_expires_us = None
        self.shown_target_m = None
        self.vehicles.yaw_target_rad[self.index] = math.nan
        if self.armed:
            self._mode_in_flight(mode)
        return True

    def _load_speeds(self) -> None:
        """Speeds by parameter count from the next change of mode; DO_CHANGE_SPEED until then."""
        i, vehicles, params = self.index, self.vehicles, self.params
        vehicles.speed_m_s[i] = _between(params["WPNAV_SPEED"] / 100.0)
        vehicles.climb_m_s[i] = _between(params["WPNAV_SPEED_UP"] / 100.0)
        vehicles.descent_m_s[i] = _between(params["WPNAV_SPEED_DN"] / 100.0)

    def _mode_refusal(self, mode: int) -> str:
        if mode == AUTO:
            return "init failed"
        if mode == AUTO_RTL:
            return "No landing sequence found"
        if mode in NEED_POSITION and self.stage < Stage.POSITION_OK:
            return "requires position"
        return ""

    def _mode_in_flight(self, mode: int) -> None:
        i, vehicles = self.index, self.vehicles
        if self.landed:
            self.enter(Phase.GROUND)
            return
        vehicles.flying[i], vehicles.falling[i] = True, False
        self.enter(Phase.AIRBORNE)
        if mode in RETURN_MODES:
            self.enter(Phase.RTL_CLIMB)
            vehicles.hold_here(i)
            lowest = self.params["RTL_ALT"] / 100.0 + self.home_m[2]
            vehicles.target_m[i, 2] = max(vehicles.target_m[i, 2], lowest)
        elif mode == LAND:
            self._land()
        elif mode in (GUIDED, BRAKE):
            vehicles.hold_here(i)
        elif mode in MANUAL_THROTTLE:
            vehicles.rest(i)
        else:
            vehicles.sink(i, STICK_DOWN_SINK_M_S)  # the throttle stick of SITL's default RC is at the bottom

    # Flight

    def take_off(self, alt_m: float) -> bool:
        """NAV_TAKEOFF to `alt_m` above home; False where the real one refuses."""
        i = self.index
        if not self.armed or self.mode != GUIDED or not self.landed:
            return False
        if not (math.isfinite(alt_m) and alt_m + self.home_m[2] > self.vehicles.seen(i)[2]):
            return False
        self.takeoff_m = alt_m + self.home_m[2]
        self.enter(Phase.SPOOL_UP)
        return True

    def hold(self) -> None:
        """Stop and stay, in GUIDED."""
        self.target_expires_us = None
        self.vehicles.hold_here(self.index)

    def fly_target(self) -> None:
        """A set-point was taken: it ends a climb after take-off."""
        if self.phase == Phase.TAKEOFF:
            self.enter(Phase.AIRBORNE)

    def fly(self) -> None:
        """One tick of an armed vehicle."""
        i, vehicles, since_us = self.index, self.vehicles, self.now_us - self.phase_us
        phase = self.phase
        if phase == Phase.GROUND:
            delay_us = LANDED_DISARM_US if self.mode in LANDING_MODES else self.params["DISARM_DELAY"] * 1e6
            if delay_us > 0 and since_us >= delay_us:
                self.disarm()
            return
        if phase == Phase.SPOOL_UP:
            if since_us >= SPOOL_UP_US:
                x, y, _ = vehicles.seen(i)
                vehicles.set_target(i, (x, y, self.takeoff_m))
                vehicles.flying[i] = True
                self.enter(Phase.TAKEOFF)
            return
        if phase == Phase.TAKEOFF and vehicles.seen(i)[2] >= self.takeoff_m - REACHED_M:
            self.enter(Phase.AIRBORNE)
        elif phase >= Phase.RTL_CLIMB:
            self._fly_home(since_us)
        if self.target_expires_us is not None and self.now_us >= self.target_expires_us:
            self.hold()
        self.detect_ground()

    def _fly_home(self, since_us: int) -> None:
        i, vehicles = self.index, self.vehicles
        dx, dy, dz = (vehicles.target_m[i] - vehicles.seen(i)).tolist()
        if self.phase == Phase.RTL_CLIMB:
            if abs(dz) < REACHED_M:
                vehicles.set_target(i, (self.home_m[0], self.home_m[1], float(vehicles.target_m[i, 2])))
                self.enter(Phase.RTL_HOME)
        elif self.phase == Phase.RTL_HOME:
            if math.hypot(dx, dy) < REACHED_M:
                self.enter(Phase.RTL_LOITER)
        elif self.phase == Phase.RTL_LOITER:
            if since_us >= self.params["RTL_LOIT_TIME"] * 1000:
                self._land(home=True)
        elif vehicles.seen(i)[2] <= LAND_ALT_LOW_M:
            vehicles.target_velocity_m_s[i, 2] = -self.params["LAND_SPEED"] / 100.0

    def _land(self, *, home: bool = False) -> None:
        vehicles = self.vehicles
        vehicles.sink(self.index, float(vehicles.descent_m_s[self.index]))
        if home:
            vehicles.target_m[self.index, :2] = self.home_m[:2]
        self.enter(Phase.LANDING)
