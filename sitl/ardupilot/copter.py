"""One simulated ArduCopter: modes, arming, flight phases, failsafes.

The numbers and texts are those measured on ArduCopter 4.7 SITL.
"""

import math

from sitl.ardupilot import arming, guided, remote_id
from sitl.ardupilot import commands as ardupilot_commands
from sitl.ardupilot import failsafes as ardupilot_failsafes
from sitl.ardupilot.auto_mode import ARM_IN_AUTO, WITHOUT_THROTTLE, CopterMission
from sitl.ardupilot.boot import ARDUPILOT_BOOT, ARDUPILOT_BOOT_TEXT
from sitl.ardupilot.telemetry import BUILDERS
from sitl.common.autopilot import SIM_STATION_SYSID, Autopilot, Command, Fields
from sitl.common.fence import Shape
from sitl.common.manual import RELEASE, RELEASED
from sitl.common.states import (
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
    STABILIZE,
    Phase,
    Severity,
    Stage,
)
from sitl.common.streams import Streams

# REQUEST_DATA_STREAM groups, of the messages this simulator has (facts: ArduCopter, "Groups").
STREAM_GROUPS: dict[int, tuple[str, ...]] = {
    2: (
        "SYS_STATUS",
        "POWER_STATUS",
        "MEMINFO",
        "MISSION_CURRENT",
        "GPS_RAW_INT",
        "FENCE_STATUS",
        "POSITION_TARGET_GLOBAL_INT",
    ),
    3: ("RC_CHANNELS", "SERVO_OUTPUT_RAW"),
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    10: ("ATTITUDE",),
    11: ("VFR_HUD",),
    12: ("SYSTEM_TIME", "BATTERY_STATUS", "EKF_STATUS_REPORT", "VIBRATION"),
}
SPOOL_UP_US = 1_000_000
LANDED_DISARM_US = 1_100_000
PREARM_TEXT_US = 30_000_000
CHECK_GAP_US = 1_000_000
"""The pre-arm checks run once a second."""
TIMESYNC_US = 10_000_000
LAND_ALT_LOW_M = 10.0
REACHED_M = 0.4
STICK_DOWN_SINK_M_S = 2.5
MIN_SPEED_M_S = 0.1
STICK_M_S, STICK_UP_M_S = 9.5, 2.0
"""LOITER with a joystick at its end (measured 9.4 m/s; 1.25 m/s up at 800)."""
STICK_MODES = frozenset({2, 5, 7, 16})
"""ALT_HOLD, LOITER, CIRCLE, POSHOLD."""
PACK_SAG = 0.2
"""An empty lithium pack has lost this share of its voltage."""


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
        self.asked_m_s: guided.Point | None = None
        self.guided_kind = (False, False)
        """Whether places, and whether velocities, are flown to."""
        """The velocity of the newest target; None where it named a place."""
        self.shown_target_m: tuple[float, float, float] | None = None
        """What POSITION_TARGET_GLOBAL_INT shows: the last position target, even when velocities came later."""
        self.position_lost = self.aiding_stopped = False
        self.gps_back_us: int | None = None
        self.battery_level = 0
        """0 good, 1 low, 2 critical; latched."""
        self.battery_low_us: int | None = None
        self.fence_enabled = False
        """By DO_FENCE_ENABLE; the parameter does not show it."""
        self.fence_due_us = self.now_us
        self.shapes: tuple[Shape, ...] | None = None
        self.breached = self.breaches = 0
        self.breach_told = False
        self.sticks: tuple[int, int, int, int] = RELEASED
        self.sticks_us: int | None = None
        self.mission = CopterMission(self)
        self.plans.changed = lambda kind: ardupilot_failsafes.plans_changed(self, kind)
        self.plans.flying = False
        self._checked_us, self._checks_pass = -CHECK_GAP_US, False
        self.prearm_text_us = self.now_us + PREARM_TEXT_US
        self.timesync_us = self.now_us + TIMESYNC_US
        self.stores.remote_id.on = self.params["DID_ENABLE"] > 0

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
        ardupilot_failsafes.watch(self)
        remote_id.watch(self)

    def lose_gps(self) -> None:
        """No satellites."""
        super().lose_gps()
        self.gps_back_us = None

    def find_gps(self) -> None:
        """Satellites again."""
        if self.gps_lost_us is not None:
            self.gps_back_us = self.now_us
        super().find_gps()

    @property
    def fence_on(self) -> bool:
        """Whether the fence counts."""
        return self.fence_enabled or self.params["FENCE_ENABLE"] > 0

    @property
    def voltage_v(self) -> float:
        """Of the pack: constant in SITL unless its battery has a capacity; then it falls as a lithium pack's does."""
        full_v, capacity_mah = self.params["SIM_BATT_VOLTAGE"], self.params["SIM_BATT_CAP_AH"] * 1000.0
        if capacity_mah <= 0.0:
            return full_v
        return full_v * (1.0 - PACK_SAG * min(self.consumed_mah / capacity_mah, 1.0))

    def discharge(self, left: float) -> None:
        """Of its capacity; what was used before counts too."""
        self.consumed_mah = max(self.consumed_mah, self.params["BATT_CAPACITY"] * (1.0 - left))

    def event(self, name: str, *arguments: float, levels: int = 0x66) -> None:
        """ArduPilot has no EVENTs."""

    def resend_events(self, fields: Fields, system: int, component: int) -> None:
        """ArduPilot has no EVENTs."""

    def hear_sticks(self, system: int, fields: Fields) -> None:
        """MANUAL_CONTROL of its own station only; it counts as a heartbeat."""
        if system not in (int(self.params["MAV_GCS_SYSID"]), SIM_STATION_SYSID):
            return
        self.hear_gcs(system, 0)
        self.sticks_us = self.now_us
        self.sticks = (fields["x"], fields["y"], fields["z"], fields["r"])

    def hear_gcs(self, system: int, kind: int) -> None:
        """A heartbeat of its ground station, whatever the type."""
        if system not in (int(self.params["MAV_GCS_SYSID"]), SIM_STATION_SYSID):
            return
        self.gcs_heard_us = self.now_us
        if "gcs" in self.failsafes:
            self.failsafes.discard("gcs")
            self.text(Severity.WARNING, "GCS Failsafe Cleared")

    # Arming

    def prearm_problems(self) -> list[str]:
        """Why it cannot be armed, apart from modes that never can."""
        found = arming.problems(self) + self.stores.calibration.refusals(self.now_us)
        return [*found, "Downloading logs"] if self.logs.downloading else found

    def checks_passed(self) -> bool:
        """What the checks found when they last ran: maybe in another mode, up to a second ago."""
        if self.now_us - self._checked_us >= CHECK_GAP_US:
            self._checked_us, self._checks_pass = self.now_us, not self.prearm_problems()
        return self._checks_pass

    def say_prearm(self) -> None:
        """One line per failing check."""
        for problem in self.prearm_problems():
            self.text(Severity.CRITICAL, f"PreArm: {problem}")

    def arming_problems(self) -> list[str]:
        """Why it cannot be armed now."""
        if self.mode in NOT_ARMABLE or (
            self.mode == AUTO and self.mission.exists and not self._auto_option(ARM_IN_AUTO)
        ):
            return [f"{MODE_NAMES[self.mode]} mode not armable"]
        return self.prearm_problems()

    def _auto_option(self, bit: int) -> bool:
        return bool(int(self.params["AUTO_OPTIONS"]) & bit)

    def arm(self) -> None:
        """Start the motors. Home is where it stands."""
        self.armed = True
        self.enter(Phase.GROUND)
        self.set_home()
        self.plans.flying = self.mode == AUTO
        self.text(Severity.INFO, "Arming motors")

    def disarm(self) -> None:
        """Stop the motors; in the air it falls."""
        self.armed = False
        self.enter(Phase.GROUND)
        self.vehicles.rest(self.index)
        if self.mode == AUTO:
            self.mission.leave()
            self.plans.seq = 0
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
        if self.mode == AUTO:
            self.mission.leave()
        self.mode = mode
        self.load_speeds()
        self.guided_kind = (False, False)
        self.target_expires_us = self.asked_m_s = None
        self.shown_target_m = None
        self.vehicles.yaw_target_rad[self.index] = math.nan
        if self.armed:
            self._mode_in_flight(mode)
        if self.stage >= Stage.READY:
            self.once.append("HEARTBEAT")  # a change of mode is told at once (seen on 4.7)
        return True

    def load_speeds(self) -> None:
        """Speeds by parameter count from the next change of mode, or kind of target; DO_CHANGE_SPEED until then."""
        i, vehicles, params = self.index, self.vehicles, self.params
        vehicles.speed_m_s[i] = _between(params["WPNAV_SPEED"] / 100.0)
        vehicles.climb_m_s[i] = _between(params["WPNAV_SPEED_UP"] / 100.0)
        vehicles.descent_m_s[i] = _between(params["WPNAV_SPEED_DN"] / 100.0)

    def _mode_refusal(self, mode: int) -> str:
        if mode == AUTO and not self.mission.exists:
            return "init failed"
        if mode == AUTO_RTL:
            return "No landing sequence found"
        if mode in NEED_POSITION and not ardupilot_failsafes.ready(self):
            return "requires position"
        return ""

    def _mode_in_flight(self, mode: int) -> None:
        i, vehicles = self.index, self.vehicles
        self.plans.flying = mode == AUTO
        if self.landed:
            self.enter(Phase.GROUND)
            return
        vehicles.flying[i], vehicles.falling[i] = True, False
        self.enter(Phase.AIRBORNE)
        if mode in RETURN_MODES:
            self.begin_return()
        elif mode == LAND:
            self.begin_landing()
        elif mode == AUTO:
            self.mission.begin()
        elif mode in (GUIDED, BRAKE):
            vehicles.hold_here(i)
        elif mode in MANUAL_THROTTLE:
            vehicles.rest(i)
        elif not self._by_hand():
            vehicles.sink(i, STICK_DOWN_SINK_M_S)  # the throttle stick of SITL's default RC is at the bottom

    def _by_hand(self) -> bool:
        """Follow a joystick; False if there is none (any more): the RC's sticks count then."""
        x, y, z, _ = self.sticks
        if self.sticks_us is None or self.now_us - self.sticks_us > self.params["RC_OVERRIDE_TIME"] * 1e6:
            return False
        if z == RELEASE:
            return False
        forward, right = (0.0 if v == RELEASE else v / 1000.0 * STICK_M_S for v in (x, y))
        push = (z - 500) / 500.0
        up = push * (STICK_UP_M_S if push > 0.0 else STICK_DOWN_SINK_M_S)
        self.vehicles.set_velocity(self.index, (*guided.rotated(self, forward, right), up))
        return True

    # Flight

    def begin_return(self) -> None:
        """Climb, fly home, wait, land: RTL, or the RTL item of a mission."""
        i, vehicles = self.index, self.vehicles
        self.enter(Phase.RTL_CLIMB)
        vehicles.hold_here(i)
        lowest = self.params["RTL_ALT"] / 100.0 + self.home_m[2]
        vehicles.target_m[i, 2] = max(vehicles.target_m[i, 2], lowest)

    def start_mission(self) -> bool:
        """MISSION_START: on the ground nothing moves unless AUTO_OPTIONS lets it."""
        if self.mode != AUTO and not self.set_mode(AUTO):
            return False
        if self.armed and self.landed and self._auto_option(WITHOUT_THROTTLE):
            self.mission.begin()
        return True

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
        self.target_expires_us = self.asked_m_s = None
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
            down = self.mode in LANDING_MODES or (self.mode == AUTO and self.mission.flight.running)
            delay_us = LANDED_DISARM_US if down else self.params["DISARM_DELAY"] * 1e6
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
        if self.mode == AUTO:
            self.mission.tick()
        elif self.mode in STICK_MODES and self.sticks_us is not None and not self._by_hand():
            self.sticks_us = None
            vehicles.sink(i, STICK_DOWN_SINK_M_S)
        if self.target_expires_us is not None and self.now_us >= self.target_expires_us:
            self.hold()
        elif self.fence_on and self.asked_m_s is not None and self.mode == GUIDED:
            guided.heed_fence(self, self.asked_m_s)
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
                self.begin_landing(home=True)
        elif vehicles.seen(i)[2] <= LAND_ALT_LOW_M:
            vehicles.target_velocity_m_s[i, 2] = -self.params["LAND_SPEED"] / 100.0

    def begin_landing(self, *, home: bool = False) -> None:
        """Land here, or at home."""
        vehicles = self.vehicles
        vehicles.sink(self.index, float(vehicles.descent_m_s[self.index]))
        if home:
            vehicles.target_m[self.index, :2] = self.home_m[:2]
        self.enter(Phase.LANDING)
