"""One simulated ArduCopter: boot, modes, arming, flight phases, failsafes.

Times are integer microseconds of simulated time; nothing here reads a clock. The numbers and texts are those
measured on ArduCopter 4.7 SITL.
"""

import math
from typing import Any

from sitl import arming
from sitl.boot import BOOT_STEPS, BOOT_TEXT
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
from sitl.parameters import ParameterTable
from sitl.signing import Signer
from sitl.streams import Streams
from sitl.vehicle import Vehicles, VehicleSpec
from sitl.wire import Encoder

SPOOL_UP_US = 1_000_000
LAND_DETECT_US = 1_000_000
LANDED_DISARM_US = 1_100_000
PREARM_TEXT_US = 30_000_000
TIMESYNC_US = 10_000_000
LAND_ALT_LOW_M = 10.0
REACHED_M = 0.4
STICK_DOWN_SINK_M_S = 2.5
HOVER_CURRENT_A = 28.0
IDLE_CURRENT_A = 1.0
MIN_SPEED_M_S, MAX_SPEED_M_S = 0.1, 10.0
SIM_STATION_SYSID = 254
"""The station's system id for simulated vehicles; its heartbeats count like those of MAV_GCS_SYSID."""


def _between(speed_m_s: float) -> float:
    return min(max(speed_m_s, MIN_SPEED_M_S), MAX_SPEED_M_S)


class Autopilot:
    """State machine of vehicle `index`; puts datagrams into `out`."""

    def __init__(
        self, index: int, spec: VehicleSpec, vehicles: Vehicles, *, boot_us: int, jitter_us: int, token: bytes, uid: str
    ) -> None:
        self.index = index
        self.spec = spec
        self.vehicles = vehicles
        self.token = token
        self.uid = uid
        self.params = ParameterTable(spec.system_id)
        self.encoder = Encoder(spec.system_id)
        self.signer = Signer(spec.signing)
        self.out: list[bytes] = []
        self.deferred: list[tuple[str, dict[str, Any]]] | None = None
        """Messages kept back until a command is acknowledged; None: nothing is."""
        self.silent = False
        self.dead = False
        self.consumed_mah = 0.0
        self._boot_us = boot_us
        self._jitter_us = jitter_us
        self.restart(0)

    def restart(self, now_us: int) -> None:
        """Power on or reboot: everything but the parameters and the battery is as new."""
        self.power_on_us = now_us
        self.now_us = now_us
        self.stage = Stage.OFF
        self.mode = STABILIZE
        self.armed = False
        self.phase = Phase.GROUND
        self.phase_us = now_us
        self.touched_us: int | None = None
        self.takeoff_m = 0.0
        self.home_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self.target_expires_us: int | None = None
        self.shown_target_m: tuple[float, float, float] | None = None
        """What POSITION_TARGET_GLOBAL_INT shows: the last position target, even when velocities came later."""
        self.failsafes: set[str] = set()
        self.gcs_heard_us: int | None = None
        self.prearm_text_us = now_us + PREARM_TEXT_US
        self.timesync_us = now_us + TIMESYNC_US
        self.streams = Streams()
        self.signer.power_on(now_us)
        self.once: list[str] = []
        """Messages to be sent once, with the next tick."""
        self._boot_texts_due = True
        self._boot_steps = [
            (now_us + self._jitter_us + round(share * self._boot_us), stage, texts)
            for share, stage, texts in BOOT_STEPS
        ]
        self.vehicles.rest(self.index)

    def send(self, name: str, **fields: Any) -> None:
        """Queue one frame (nothing leaves while the link is silent)."""
        if self.deferred is not None:
            self.deferred.append((name, fields))
            return
        frame = self.signer.sign(self.encoder.frame(name, fields), self.now_us)
        if not self.silent:
            self.out.append(frame)

    def flush(self) -> None:
        """Send what was kept back."""
        kept, self.deferred = self.deferred or [], None
        for name, fields in kept:
            self.send(name, **fields)

    def text(self, severity: Severity, text: str) -> None:
        """Queue a STATUSTEXT (one chunk: at most 50 characters)."""
        self.send("STATUSTEXT", severity=int(severity), text=text.encode("ascii")[:50])

    @property
    def boot_ms(self) -> int:
        """Milliseconds since power-on: time_boot_ms."""
        return (self.now_us - self.power_on_us) // 1000

    # Time

    def tick(self, now_us: int) -> list[str]:
        """Advance to `now_us`; returns the names of the messages that are due."""
        elapsed_us = now_us - self.now_us
        self.now_us = now_us
        if self.dead:
            return []
        if self._boot_steps:
            self._boot()
        if self.armed:
            self._drain_battery(elapsed_us)
            self._fly()
        if self.stage >= Stage.READY:
            self._watch()
        due = self.streams.due(now_us)
        if self.once:
            due, self.once = self.once + due, []
        return due

    def _boot(self) -> None:
        if self._boot_texts_due:
            self._boot_texts_due = False
            self.out.extend(() if self.silent else BOOT_TEXT)
        while self._boot_steps and self._boot_steps[0][0] <= self.now_us:
            at_us, self.stage, texts = self._boot_steps.pop(0)
            if self.stage == Stage.BEATING:
                self.streams.start("HEARTBEAT", 1000, at_us)
            elif self.stage == Stage.READY:
                self.mode = STABILIZE  # a mode set earlier was acknowledged and is lost
            elif self.stage == Stage.HOME_SET:
                self.text(Severity.INFO, f"Field Elevation Set: {self.spec.ground_amsl_m:.0f}m")
                self.set_home()
            for text in texts:
                self.text(Severity.INFO, text)
            if self.stage == Stage.READY:
                self.banner()

    def banner(self) -> None:
        """The three texts that come at boot and with a parameter list."""
        for text in ("ArduCopter V4.7.0-dev (cef8bcef)", self.uid, "Frame: QUAD/PLUS"):
            self.text(Severity.INFO, text)

    def set_home(self) -> None:
        """Home is where the vehicle is now: also the zero of relative altitude. Sent once."""
        x, y, z = self.vehicles.position_m[self.index].tolist()
        self.home_m = (x, y, z)
        self.once += ["GPS_GLOBAL_ORIGIN", "HOME_POSITION"]

    def _watch(self) -> None:
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

    def hear_gcs(self, system: int) -> None:
        """A heartbeat of a ground station."""
        if system not in (int(self.params["MAV_GCS_SYSID"]), SIM_STATION_SYSID):
            return
        self.gcs_heard_us = self.now_us
        if "gcs" in self.failsafes:
            self.failsafes.discard("gcs")
            self.text(Severity.WARNING, "GCS Failsafe Cleared")

    def _drain_battery(self, elapsed_us: int) -> None:
        current_a = self.current_a
        self.consumed_mah += current_a * elapsed_us / 3.6e6
        if "battery" in self.failsafes or self.params["BATT_FS_LOW_ACT"] <= 0:
            return
        if self.params["BATT_CAPACITY"] - self.consumed_mah < self.params["BATT_LOW_MAH"]:
            self.failsafes.add("battery")
            self.text(Severity.WARNING, f"Battery 1 is low 12.60V used {self.consumed_mah:.0f} mAh")
            self._failsafe("Battery Failsafe", LAND if self.params["BATT_FS_LOW_ACT"] == 1 else RTL)

    @property
    def current_a(self) -> float:
        """Battery current."""
        if not self.armed:
            return 0.0
        return HOVER_CURRENT_A if self.phase > Phase.SPOOL_UP else IDLE_CURRENT_A

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
        self._enter(Phase.GROUND)
        self.set_home()
        self.text(Severity.INFO, "Arming motors")

    def disarm(self) -> None:
        """Stop the motors; in the air it falls."""
        self.armed = False
        self._enter(Phase.GROUND)
        self.vehicles.rest(self.index)
        self.text(Severity.INFO, "Disarming motors")

    @property
    def landed(self) -> bool:
        """On the ground as far as the autopilot knows."""
        return self.phase in (Phase.GROUND, Phase.SPOOL_UP)

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
            self._enter(Phase.GROUND)
            return
        vehicles.flying[i], vehicles.falling[i] = True, False
        self._enter(Phase.AIRBORNE)
        if mode in RETURN_MODES:
            self._enter(Phase.RTL_CLIMB)
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

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self.phase_us = self.now_us
        self.touched_us = None

    # Flight

    def take_off(self, alt_m: float) -> bool:
        """NAV_TAKEOFF to `alt_m` above home; False where the real one refuses."""
        i = self.index
        if not self.armed or self.mode != GUIDED or not self.landed:
            return False
        if not (math.isfinite(alt_m) and alt_m + self.home_m[2] > self.vehicles.position_m[i, 2]):
            return False
        self.takeoff_m = alt_m + self.home_m[2]
        self._enter(Phase.SPOOL_UP)
        return True

    def hold(self) -> None:
        """Stop and stay, in GUIDED."""
        self.target_expires_us = None
        self.vehicles.hold_here(self.index)

    def fly_target(self) -> None:
        """A set-point was taken: it ends a climb after take-off."""
        if self.phase == Phase.TAKEOFF:
            self._enter(Phase.AIRBORNE)

    def _fly(self) -> None:
        i, vehicles, since_us = self.index, self.vehicles, self.now_us - self.phase_us
        phase = self.phase
        if phase == Phase.GROUND:
            delay_us = LANDED_DISARM_US if self.mode in LANDING_MODES else self.params["DISARM_DELAY"] * 1e6
            if delay_us > 0 and since_us >= delay_us:
                self.disarm()
            return
        if phase == Phase.SPOOL_UP:
            if since_us >= SPOOL_UP_US:
                x, y, _ = vehicles.position_m[i].tolist()
                vehicles.set_target(i, (x, y, self.takeoff_m))
                vehicles.flying[i] = True
                self._enter(Phase.TAKEOFF)
            return
        if phase == Phase.TAKEOFF and vehicles.position_m[i, 2] >= self.takeoff_m - REACHED_M:
            self._enter(Phase.AIRBORNE)
        elif phase >= Phase.RTL_CLIMB:
            self._fly_home(since_us)
        if self.target_expires_us is not None and self.now_us >= self.target_expires_us:
            self.hold()
        self._detect_ground()

    def _fly_home(self, since_us: int) -> None:
        i, vehicles = self.index, self.vehicles
        dx, dy, dz = (vehicles.target_m[i] - vehicles.position_m[i]).tolist()
        if self.phase == Phase.RTL_CLIMB:
            if abs(dz) < REACHED_M:
                vehicles.set_target(i, (self.home_m[0], self.home_m[1], float(vehicles.target_m[i, 2])))
                self._enter(Phase.RTL_HOME)
        elif self.phase == Phase.RTL_HOME:
            if math.hypot(dx, dy) < REACHED_M:
                self._enter(Phase.RTL_LOITER)
        elif self.phase == Phase.RTL_LOITER:
            if since_us >= self.params["RTL_LOIT_TIME"] * 1000:
                self._land(home=True)
        elif vehicles.position_m[i, 2] <= LAND_ALT_LOW_M:
            vehicles.target_velocity_m_s[i, 2] = -self.params["LAND_SPEED"] / 100.0

    def _land(self, *, home: bool = False) -> None:
        vehicles = self.vehicles
        vehicles.sink(self.index, float(vehicles.descent_m_s[self.index]))
        if home:
            vehicles.target_m[self.index, :2] = self.home_m[:2]
        self._enter(Phase.LANDING)

    def _detect_ground(self) -> None:
        i, vehicles = self.index, self.vehicles
        if vehicles.position_m[i, 2] > 0.0 or vehicles.velocity_m_s[i, 2] > 0.0:
            self.touched_us = None
        elif self.touched_us is None:
            self.touched_us = self.now_us
        elif self.now_us - self.touched_us >= LAND_DETECT_US:
            vehicles.rest(i)
            self._enter(Phase.GROUND)
