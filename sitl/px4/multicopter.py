"""One simulated PX4 multicopter, put together from its parts.

Behaviour, texts and numbers are those measured on PX4 1.17 SITL (docs/autopilots.md "PX4").
"""

from sitl.common.autopilot import Autopilot, BootStep, BootTiming, Handler, stick_fields
from sitl.common.command import Command
from sitl.common.missions import FENCE, MISSION
from sitl.common.platform import Identity
from sitl.common.states import Stage
from sitl.common.streams import Streams
from sitl.common.vehicle_spec import VehicleSpec
from sitl.links.wire import Received
from sitl.physics.point_masses import PointMasses
from sitl.px4.announcer import Announcer
from sitl.px4.arming_checks import ArmingChecks
from sitl.px4.battery import Px4Battery
from sitl.px4.calibration import Px4Calibration
from sitl.px4.commander import Commander
from sitl.px4.commands import DO_SET_MODE, Px4Commands
from sitl.px4.delayed_answers import DelayedAnswers
from sitl.px4.failsafes import Px4Failsafes
from sitl.px4.fence import Px4Fence
from sitl.px4.ftp import Px4FtpServer
from sitl.px4.inputs import ControlInputs
from sitl.px4.mission_protocol import Px4Missions
from sitl.px4.modes import HOLD, OFFBOARD
from sitl.px4.navigator import Navigator
from sitl.px4.sd_log import SdLog
from sitl.px4.stream_rates import NORMAL_HZ, SITL_HZ
from sitl.px4.telemetry import Px4Parts, Px4Telemetry
from sitl.services.log_protocol import Px4LogServer
from sitl.services.parameter_protocol import Px4ParameterServer
from sitl.services.payload import Px4Payload
from sitl.services.shell import Px4Shell

GCS_TYPE = 6
"""MAV_TYPE of a ground station: PX4 counts no other heartbeats."""


class Px4(Autopilot):
    """A simulated PX4 multicopter: it builds its parts at power-on and ticks them in the right order."""

    BOOT = (
        BootStep(0.25, Stage.READY),
        BootStep(0.40, Stage.EKF_ALIGNED),
        BootStep(0.45, Stage.GPS_FIX),
        BootStep(0.80, Stage.HOME_SET),
        BootStep(0.85, Stage.POSITION_OK),
        BootStep(0.90, Stage.ALL_OK),
    )
    """A real PX4 takes 6 s for these steps."""
    ANY_COMPONENT = False

    telemetry: Px4Telemetry
    commander: Commander
    failsafes: Px4Failsafes
    calibration: Px4Calibration

    def __init__(
        self, index: int, spec: VehicleSpec, masses: PointMasses, *, timing: BootTiming, identity: Identity
    ) -> None:
        super().__init__(index, spec, masses, timing=timing, identity=identity)
        self.restart(0)

    def new_streams(self) -> Streams:
        """Return the rates of the link; PX4 sends telemetry without any request."""
        rates = SITL_HZ if self.platform.spec.sitl_rates else NORMAL_HZ
        return Streams({}, {name: round(1000 / hz) for name, hz in rates.items()})

    def power_on(self) -> None:
        """Build the parts that are new after every power-on."""
        platform = self.platform
        platform.state.mode = HOLD
        self._announcer = Announcer(platform)
        self._answers = DelayedAnswers(platform)
        self._inputs = ControlInputs(platform.params, platform.clock)
        self._battery = Px4Battery(platform.params, platform.clock)
        self._fence = Px4Fence(platform.plans, platform.body)
        self._navigator = Navigator(platform, self._announcer, self._inputs)
        sd_log = SdLog(platform.clock, self._announcer)
        self._checks = ArmingChecks(platform, self._announcer, self._inputs, self._battery, sd_log)
        self.calibration = Px4Calibration(platform, self._announcer, self._answers)
        self.commander = Commander(
            platform,
            announcer=self._announcer,
            navigator=self._navigator,
            inputs=self._inputs,
            checks=self._checks,
            battery=self._battery,
            sd_log=sd_log,
            calibration=self.calibration,
        )
        self.failsafes = Px4Failsafes(
            platform,
            commander=self.commander,
            announcer=self._announcer,
            inputs=self._inputs,
            battery=self._battery,
            fence=self._fence,
        )
        platform.plans.changed = self._plans_changed
        payload = Px4Payload(platform)
        self.telemetry = self._new_telemetry(payload)
        self._commands = Px4Commands(
            platform,
            commander=self.commander,
            navigator=self._navigator,
            checks=self._checks,
            fence=self._fence,
            announcer=self._announcer,
            answers=self._answers,
            payload=payload,
            telemetry=self.telemetry,
        )
        self.handlers = self._new_handlers()

    def _new_telemetry(self, payload: Px4Payload) -> Px4Telemetry:
        parts = Px4Parts(
            announcer=self._announcer,
            battery=self._battery,
            calibration=self.calibration,
            checks=self._checks,
            commander=self.commander,
            inputs=self._inputs,
            navigator=self._navigator,
            payload=payload,
        )
        return Px4Telemetry(self.platform, parts)

    def _new_handlers(self) -> dict[str, Handler]:
        platform = self.platform
        shell = Px4Shell(platform, lambda: self.commander.failsafe is not None)
        return {
            **self.common_handlers(),
            "HEARTBEAT": self._hear_gcs,
            "MANUAL_CONTROL": self._hear_sticks,
            "SET_MODE": self._set_mode,
            "SET_POSITION_TARGET_GLOBAL_INT": self._take_set_point,
            "SET_POSITION_TARGET_LOCAL_NED": self._take_set_point,
            **self._announcer.handlers(),
            **shell.handlers(),
            **Px4ParameterServer(platform).handlers(),
            **Px4LogServer(platform).handlers(),
            **Px4FtpServer(platform).handlers(),
            **Px4Missions(platform, self._announcer).handlers(),
        }

    def reached(self, stage: Stage, at_us: int) -> None:
        """Act on a stage of the boot."""
        if stage == Stage.READY:
            self.platform.streams.start_defaults(at_us)
        elif stage == Stage.HOME_SET:
            self.platform.state.set_home()

    def banner(self) -> None:
        """Send nothing: PX4 does not introduce itself."""

    def fly(self) -> None:
        """Do one tick of an armed vehicle."""
        self.commander.tick()

    def watch(self) -> None:
        """Do one tick of a booted vehicle: battery, failsafes, arming checks."""
        if self.platform.state.armed:
            self._battery.drain()
        self.failsafes.watch()
        self._checks.watch()

    def execute(self, command: Command) -> None:
        """Carry out a command and acknowledge it; calibrations are dialogues of their own."""
        if self.platform.state.stage < Stage.READY or not self.calibration.execute(command):
            self._commands.execute(command)

    def discharge(self, left: float) -> None:
        """Leave no more than this share in the battery."""
        self._battery.discharge(left)

    def lose_gps(self) -> None:
        """Take the GPS satellites away."""
        if self._inputs.gps_lost_us is None:
            self._inputs.gps_lost_us = self.platform.clock.now_us

    def find_gps(self) -> None:
        """Give the GPS satellites back."""
        self._inputs.gps_lost_us = None

    def _plans_changed(self, kind: int) -> None:
        if kind == FENCE:
            self._fence.changed()
        elif kind == MISSION:
            self.commander.mission.changed()

    def _hear_gcs(self, frame: Received) -> None:
        if frame.fields["type"] == GCS_TYPE:
            self.failsafes.hear_gcs()

    def _hear_sticks(self, frame: Received) -> None:
        if frame.fields["target"] in (0, self.platform.spec.system_id):
            self._inputs.hear_sticks(stick_fields(frame.fields))

    def _set_mode(self, frame: Received) -> None:
        """Take a SET_MODE (11); unlike DO_SET_MODE it has one acknowledgement, and that is true."""
        custom = frame.fields["custom_mode"]
        command = Command(DO_SET_MODE, (0.0,) * 7, None, frame.system, frame.component)
        self.platform.outbox.hold_back()
        self._answers.answer(command, self.commander.request_mode(custom >> 16 & 0xFF, custom >> 24 & 0xFF))

    def _take_set_point(self, frame: Received) -> None:
        """Count a set-point as part of the stream; only OFFBOARD flies to it."""
        # The stream has to run before OFFBOARD is accepted, so set-points count in every mode.
        self._inputs.hear_set_point()
        if self.platform.state.armed and self.platform.state.mode == OFFBOARD:
            self._navigator.take_set_point(frame)
