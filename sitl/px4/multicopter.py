"""One simulated PX4 multicopter: modes, arming, texts and events.

Behaviour, texts and numbers are those measured on PX4 1.17 SITL; `px4_flight` moves it, `px4_failsafes` takes over.
"""

from collections import deque
from datetime import UTC, datetime

from sitl.ardupilot.boot import PX4_BOOT
from sitl.common.autopilot import Autopilot, Command, Fields
from sitl.common.fence import Shape, shapes_of
from sitl.common.states import Phase, Result, Severity, Stage
from sitl.common.streams import Streams
from sitl.common.telemetry import UNIX_EPOCH_US
from sitl.px4 import (
    arming_checks as px4_checks,
)
from sitl.px4 import (
    commands as px4_commands,
)
from sitl.px4 import (
    failsafes as px4_failsafes,
)
from sitl.px4 import navigator as px4_flight
from sitl.px4.events import UNAVAILABLE, EventLog
from sitl.px4.failsafes import Failsafe
from sitl.px4.mission_mode import Px4Mission
from sitl.px4.modes import HOLD, MISSION, MODES, OFFBOARD, PASSING, TAKEOFF, base_mode, mode_of
from sitl.px4.stream_rates import NORMAL_HZ, SITL_HZ
from sitl.px4.telemetry import BUILDERS

GCS_TYPE = 6
HEARTBEAT_TIMEOUT_US = 2_500_000
"""A link is alive this long after a ground station's heartbeat."""
TEXT_KEPT_US = 5_000_000
LOG_CLOSES_US = 4_000_000
"""After a disarming (measured 4.0 and 4.3 s)."""
STICKS_SEEN_US = 500_000
ARMED_BY_COMMAND, BY_LANDING, BY_INACTION, BY_MISSION = 4, 6, 7, 5
"""arm_disarm_reason."""


class Px4(Autopilot):
    """PX4's manners."""

    BOOT = PX4_BOOT
    BUILDERS = BUILDERS

    def new_streams(self) -> Streams:
        """It streams at once, without being asked."""
        rates = SITL_HZ if self.spec.sitl_rates else NORMAL_HZ
        return Streams({}, {name: round(1000 / hz) for name, hz in rates.items()})

    def power_on(self) -> None:
        """Its own part of `restart`."""
        self.control = self.vehicles.px4
        self.k = int((self.control.rows == self.index).argmax())
        self.mode = self.intended = self.normal_mode = HOLD
        self.failsafe: Failsafe | None = None
        self.log = EventLog()
        self.flight = px4_flight.Flight(self)
        self.mission = Px4Mission(self)
        self.plans.changed = self.mission.changed
        self.shapes: tuple[Shape, ...] | None = None
        self.flew = False
        """It was in the air since it was armed."""
        self.fence_due_us = self.now_us
        self.armed_us = 0
        """Time with the motors on: what the battery is drained by."""
        self.most_charge = 1.0
        self.stream_us: int | None = None
        self.stream_since_us = 0
        self.sticks_us: int | None = None
        self.sticks: tuple[int, int, int, int] = (0, 0, 500, 0)
        self.gps_gone = False
        self.gcs_lost = False
        self.battery_warning = ""
        self.calibrating = False
        self._texts: deque[tuple[int, Severity, str]] = deque(maxlen=50)
        self._text_id = 0
        self._acks = 0
        self._report: px4_checks.Report | None = None
        self._report_due_us = 0
        self._log_closes_us: int | None = None
        """SDLOG_MODE 1: a log is open from the boot on; after a disarming it is closed, and opened by arming again."""

    @property
    def log_open(self) -> bool:
        """Whether it writes a log."""
        return self._log_closes_us is None or self.now_us < self._log_closes_us

    def reached(self, stage: Stage, at_us: int) -> None:
        """A stage of the boot was reached."""
        if stage == Stage.READY:
            self.streams.start_defaults(at_us)
        elif stage == Stage.HOME_SET:
            self.set_home()

    def banner(self) -> None:
        """PX4 says nothing of itself."""

    # Link

    def hear_gcs(self, system: int, kind: int) -> None:
        """A heartbeat; any ground station counts."""
        if kind != GCS_TYPE:
            return
        self.gcs_heard_us = self.now_us
        while self._texts:
            at_us, severity, text = self._texts.popleft()
            if self.now_us - at_us <= TEXT_KEPT_US:
                self._send_text(severity, text)
        if self.gcs_lost:
            self.gcs_lost = False
            self.tell("GCS connection regained", "commander_dl_regained")

    @property
    def gcs_alive(self) -> bool:
        """Whether a ground station's heartbeats come."""
        return self.gcs_heard_us is not None and self.now_us - self.gcs_heard_us <= HEARTBEAT_TIMEOUT_US

    def hear_sticks(self, system: int, fields: Fields) -> None:
        """MANUAL_CONTROL of whoever."""
        self.sticks_us = self.now_us
        self.sticks = (fields["x"], fields["y"], fields["z"], fields["r"])

    @property
    def sticks_alive(self) -> bool:
        """Whether somebody flies by hand."""
        return self.sticks_us is not None and self.now_us - self.sticks_us <= STICKS_SEEN_US

    def text(self, severity: Severity, text: str) -> None:
        """STATUSTEXT in chunks, as soon as a ground station hears it; too old ones are dropped."""
        if self.gcs_alive:
            self._send_text(severity, text)
        else:
            self._texts.append((self.now_us, severity, text))

    def _send_text(self, severity: Severity, text: str) -> None:
        self.send_chunks(severity, text.encode("ascii"), self._text_id)
        self._text_id = (self._text_id + 1) & 0xFFFF

    def event(self, name: str, *arguments: float, levels: int = px4_checks.LEVEL_INFO) -> None:
        """EVENT `name` (of the metadata) with its arguments."""
        self.send("EVENT", **self.log.add(name, arguments, levels, self.boot_ms))

    def tell(
        self, text: str, event: str, *arguments: float, severity: Severity = Severity.INFO, levels: int | None = None
    ) -> None:
        """A text and the EVENT that says the same: the tab tells stations to show only one of them."""
        self.text(severity, f"{text}\t")
        level = levels if levels is not None else 0x60 | int(severity)
        self.event(event, *arguments, levels=level)

    def resend_events(self, fields: Fields, system: int, component: int) -> None:
        """REQUEST_EVENT."""
        first, last = fields["first_sequence"], fields["last_sequence"]
        for step in range(min((last - first) & 0xFFFF, 0xFF) + 1):
            sequence = (first + step) & 0xFFFF
            kept = self.log.get(sequence)
            if kept is not None:
                self.send("EVENT", destination_system=system, destination_component=component, **kept)
                continue
            self.send(
                "RESPONSE_EVENT_ERROR",
                target_system=system,
                target_component=component,
                sequence=sequence,
                sequence_oldest_available=self.log.oldest,
                reason=UNAVAILABLE,
            )

    def execute(self, command: Command, system: int, component: int) -> None:
        """Do it and acknowledge it to `system`/`component`."""
        px4_commands.execute(self, command, system, component)

    def answer_later(self, command: int, result: Result, system: int, component: int, wait_us: int) -> None:
        """The commander's answer, with what was kept back until then."""
        kept, self.deferred = self.deferred or [], None

        def answer() -> None:
            self.acknowledge(command, result, system, component)
            for name, fields in kept:
                self.send(name, **fields)

        self._acks += 1
        self.tasks.after(f"ack {self._acks}", wait_us, answer, self.now_us)

    def legacy_set_mode(self, fields: Fields, system: int, component: int) -> None:
        """SET_MODE (11): one, true answer."""
        custom = fields["custom_mode"]
        self.deferred = []
        result = self.request_mode(custom >> 16 & 0xFF, custom >> 24 & 0xFF)
        self.answer_later(px4_commands.DO_SET_MODE, result, system, component, px4_commands.COMMANDER_US)

    def set_point(self, name: str, fields: Fields) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT or …_LOCAL_NED: part of the stream, obeyed in OFFBOARD only."""
        if self.stream_us is None or self.now_us - self.stream_us > 1_000_000:
            self.stream_since_us = self.now_us
        self.stream_us = self.now_us
        if self.armed and self.mode == OFFBOARD:
            self.flight.take_set_point(name, fields)

    @property
    def stream_alive(self) -> bool:
        """Whether set-points come."""
        limit_us = self.params["COM_OF_LOSS_T"] * 1e6 + px4_failsafes.STREAM_SLACK_US
        return self.stream_us is not None and self.now_us - self.stream_us <= limit_us

    def inside_fence(self, place_m: tuple[float, float, float]) -> bool:
        """Whether the fence in force allows to be there."""
        if self.shapes is None:
            self.shapes = tuple(
                shape for items in self.plans.in_force for shape in shapes_of(items, self.vehicles, self.index)
            )
        return all(shape.allows(place_m[0], place_m[1]) for shape in self.shapes)

    @property
    def mission_ready(self) -> bool:
        """Whether there is a feasible mission."""
        return self.plans.feasible

    # Modes

    def request_mode(self, main: int, sub: int) -> Result:
        """DO_SET_MODE as the commander judges it."""
        mode = mode_of(main, sub)
        if mode is None:
            self.text(Severity.CRITICAL, "Unsupported main mode\t")
            return Result.TEMPORARILY_REJECTED
        return self.set_mode(mode)

    def set_mode(self, mode: int) -> Result:
        """The operator wants a mode. On the ground every one is taken, in the air only what can be flown."""
        if self.armed and not self.can_run(mode):
            info = MODES.get(mode)
            name, number = (info.name, info.number) if info else ("External", 255)
            self.tell(
                f"Switching to {name} is currently not available",
                "commander_modeswitch_not_avail",
                mode,
                number,
                severity=Severity.CRITICAL,
            )
            return Result.TEMPORARILY_REJECTED
        self.intended = mode
        if mode not in PASSING:
            self.normal_mode = mode
        px4_failsafes.overruled(self)
        self.apply_mode(again=not mode == self.mode == HOLD)  # on its way to a place it is in Hold: it flies on
        return Result.ACCEPTED

    def can_run(self, mode: int) -> bool:
        """Whether the mode can be flown now."""
        return bool(px4_checks.check(self).can_run & px4_checks.bit(mode))

    def apply_mode(self, *, again: bool = False) -> None:
        """Fly what a failsafe wants, else what was asked for; `again`: begin it anew."""
        mode = self.failsafe.mode(self.now_us) if self.failsafe else self.intended
        if mode == self.mode and not again:
            return
        self.mission.flight.stop()
        self.plans.flying = mode == MISSION
        self.mode = mode
        if self.armed:
            self.flight.begin(mode)

    def base_mode(self) -> int:
        """HEARTBEAT.base_mode."""
        return base_mode(self.mode, armed=self.armed)

    def system_status(self) -> int:
        """HEARTBEAT.system_status: on the ground STANDBY only if it could be armed in this mode."""
        if self.calibrating:
            return 2
        if self.failsafe:
            return 5
        if self.armed:
            return 4
        return 3 if self.can_arm else 0

    # Arming

    @property
    def can_arm(self) -> bool:
        """Whether it could be armed in its mode."""
        return self.stage >= Stage.ALL_OK and bool(px4_checks.check(self).can_arm & px4_checks.bit(self.mode))

    def arm(self, reason: int = ARMED_BY_COMMAND) -> Result:
        """Start the motors, if the checks allow it: nothing can force it."""
        if self.armed:
            return Result.ACCEPTED
        if self.calibrating:
            self.tell(
                "Arming denied: calibrating",
                "commander_arm_denied_calibrating",
                severity=Severity.CRITICAL,
            )
            return Result.TEMPORARILY_REJECTED
        if not self.can_arm:
            self.tell(
                "Arming denied: Resolve system health failures first",
                "commander_arm_denied_resolve_failures",
                severity=Severity.CRITICAL,
            )
            return Result.TEMPORARILY_REJECTED
        self.armed, self.flew = True, False
        self.enter(Phase.GROUND)
        self.set_home()
        self.tell("Armed by external command", "commander_armed_by", reason)
        if not self.log_open:
            self._tell_log()
        self._log_closes_us = None
        self.flight.begin(self.mode)
        return Result.ACCEPTED

    def disarm(self, reason: int, text: str) -> None:
        """Stop the motors; in the air it falls. The mode before the return or landing is back."""
        self.armed = False
        self.enter(Phase.GROUND)
        self.vehicles.rest(self.index)
        self.control.rest(self.k)
        self.tell(f"Disarmed by {text}", "commander_disarmed_by", reason)
        self._log_closes_us = self.now_us + LOG_CLOSES_US
        self.failsafe = None
        self.armed_us = 0
        self.intended = self.normal_mode
        self.apply_mode()

    def _tell_log(self) -> None:
        """The name of a log is the time at which it was opened."""
        when = datetime.fromtimestamp((UNIX_EPOCH_US + self.now_us) / 1e6, tz=UTC)
        date, clock = (when.year, when.month, when.day), (when.hour, when.minute, when.second)
        name = "{}-{:02}-{:02}/{:02}_{:02}_{:02}.ulg".format(*date, *clock)
        self.tell(f"[logger] ./log/{name}", "logger_open_file_time", *date, *clock)

    # Time

    def watch(self) -> None:
        """One tick of a booted vehicle."""
        if self.armed:
            self.armed_us += self.elapsed_us
        px4_failsafes.watch(self)
        if self._report_due_us <= self.now_us:
            self._report_due_us = self.now_us + px4_checks.LOOK_US
            report = px4_checks.check(self)
            if report != self._report:
                self._report = report
                self._report_due_us = self.now_us + px4_checks.REPORT_US
                px4_checks.tell(self, report)

    def discharge(self, left: float) -> None:
        """Whatever SIM_BAT_MIN_PCT says."""
        self.most_charge = min(self.most_charge, left)

    @property
    def charge(self) -> float:
        """0 to 1: falls by half in SIM_BAT_DRAIN seconds with the motors on, down to SIM_BAT_MIN_PCT."""
        drained = 0.5 * self.armed_us / 1e6 / max(self.params["SIM_BAT_DRAIN"], 1.0)
        return min(max(1.0 - drained, min(self.params["SIM_BAT_MIN_PCT"] / 100.0, 1.0)), self.most_charge)

    def fly(self) -> None:
        """One tick of an armed vehicle."""
        if self.failsafe:
            self.apply_mode()
        if self.landed and self.phase == Phase.GROUND:
            self._stand()
        else:
            self.flight.tick()
            if self.flight.landing_detected():
                self.tell("Landing detected", "commander_landing_detected")
                self.mission.touched_down()

    def _stand(self) -> None:
        since_s = (self.now_us - self.phase_us) / 1e6
        if self.flew:
            delay_s = self.params["COM_DISARM_LAND"]
            if 0.0 < delay_s <= since_s:
                self.disarm(BY_LANDING, "landing")
        elif self.flight.wants_up():
            self.enter(Phase.SPOOL_UP)
        else:
            delay_s = self.params["COM_DISARM_PRFLT"]
            if 0.0 < delay_s <= since_s:
                self.disarm(BY_INACTION, "auto preflight disarming")

    def taken_off(self) -> None:
        """The climb after take-off is over: hold."""
        if self.intended == TAKEOFF:
            self.intended = self.normal_mode = HOLD
            self.apply_mode()

    def hold_after_mission(self) -> None:
        """The mission is over."""
        if self.intended == MISSION:
            self.intended = self.normal_mode = HOLD
            self.apply_mode()
