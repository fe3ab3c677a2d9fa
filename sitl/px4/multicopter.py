"""One simulated PX4 multicopter, put together from its parts.

Behaviour, texts and numbers are those measured on PX4 1.17 SITL (docs/autopilots.md "PX4").
"""

from sitl.common.autopilot import Autopilot, BootStep, Handler, stick_fields
from sitl.common.command import Command
from sitl.common.states import Stage
from sitl.common.streams import Streams
from sitl.links.wire import ReceivedFrame
from sitl.px4.calibration import Px4Calibration
from sitl.px4.commander import Commander
from sitl.px4.commands import DO_SET_MODE, Px4Commands
from sitl.px4.failsafes import Px4Failsafes
from sitl.px4.ftp import Px4FtpServer
from sitl.px4.log_writer import Px4LogWriter
from sitl.px4.mission_protocol import Px4Missions
from sitl.px4.modes import HOLD, OFFBOARD
from sitl.px4.parts import Px4Parts
from sitl.px4.stream_rates import NORMAL_HZ, SITL_HZ
from sitl.px4.telemetry import Px4Telemetry
from sitl.services.log_protocol import Px4LogServer
from sitl.services.parameter_protocol import Px4ParameterServer
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

    calibration: Px4Calibration

    def new_streams(self) -> Streams:
        """Return the rates of the link; PX4 sends telemetry without any request."""
        rates = SITL_HZ if self.platform.spec.sitl_rates else NORMAL_HZ
        return Streams({}, {name: round(1000 / hz) for name, hz in rates.items()})

    def power_on(self) -> None:
        """Build the parts that are new after every power-on."""
        platform = self.platform
        platform.state.mode = HOLD
        self._parts = parts = Px4Parts(platform)
        self._commander = Commander(platform, parts)
        self.failsafes = Px4Failsafes(platform, parts, self._commander)
        self.calibration, self.fence, self.mission = parts.calibration, parts.fence, self._commander.mission
        self.discharge = parts.battery.discharge
        self.stop_draining = parts.battery.stop_draining
        self.telemetry = telemetry = Px4Telemetry(platform, parts, self._commander)
        self._log_writer = Px4LogWriter(platform, parts, self._commander, telemetry)
        self.execute = Px4Commands(platform, parts, self._commander, telemetry).execute
        self.handlers = self._new_handlers()

    def _new_handlers(self) -> dict[str, Handler]:
        platform, announcer = self.platform, self._parts.announcer
        shell = Px4Shell(platform, lambda: self._commander.failsafe is not None)
        return {
            **self.common_handlers(),
            "HEARTBEAT": self._hear_gcs,
            "MANUAL_CONTROL": self._hear_sticks,
            "SET_MODE": self._set_mode,
            "SET_POSITION_TARGET_GLOBAL_INT": self._take_set_point,
            "SET_POSITION_TARGET_LOCAL_NED": self._take_set_point,
            **announcer.handlers(),
            **shell.handlers(),
            **Px4ParameterServer(platform).handlers(),
            **Px4LogServer(platform).handlers(),
            **Px4FtpServer(platform).handlers(),
            **Px4Missions(platform, announcer).handlers(),
        }

    def reached(self, stage: Stage, at_us: int) -> None:
        """Act on a stage of the boot."""
        if stage == Stage.READY:
            self.platform.streams.start_defaults(at_us)
        elif stage == Stage.HOME_SET:
            self.platform.state.set_home()

    def fly(self) -> None:
        """Do one tick of an armed vehicle."""
        self._commander.tick()

    def watch(self) -> None:
        """Do one tick of a booted vehicle: battery, failsafes, arming checks, its log."""
        if self.platform.state.armed:
            self._parts.battery.drain()
        self.failsafes.watch()
        self._parts.checks.watch()
        self._log_writer.watch()

    def _hear_gcs(self, frame: ReceivedFrame) -> None:
        if frame.fields["type"] == GCS_TYPE:
            self.failsafes.hear_gcs()

    def _hear_sticks(self, frame: ReceivedFrame) -> None:
        if frame.fields["target"] in (0, self.platform.spec.system_id):
            self._parts.inputs.hear_sticks(stick_fields(frame.fields))

    def _set_mode(self, frame: ReceivedFrame) -> None:
        """Take a SET_MODE (11); unlike DO_SET_MODE it has one acknowledgement, and that is true."""
        custom = frame.fields["custom_mode"]
        command = Command(DO_SET_MODE, (0.0,) * 7, None, frame.system, frame.component)
        self.platform.outbox.hold_back()
        self._parts.answers.answer(command, self._commander.request_mode(custom >> 16 & 0xFF, custom >> 24 & 0xFF))

    def _take_set_point(self, frame: ReceivedFrame) -> None:
        """Count a set-point as part of the stream; only OFFBOARD flies to it."""
        # The stream has to run before OFFBOARD is accepted, so set-points count in every mode.
        self._parts.inputs.hear_set_point()
        if self.platform.state.armed and self.platform.state.mode == OFFBOARD:
            self._parts.navigator.take_set_point(frame)
