"""One simulated ArduCopter, put together from its parts.

Numbers and texts are those measured on ArduCopter 4.7 SITL (docs/autopilots.md "ArduCopter").
"""

from sitl.ardupilot.arming import Arming
from sitl.ardupilot.auto_mode import AutoMode
from sitl.ardupilot.battery import CopterBattery
from sitl.ardupilot.boot import BOOT, BOOT_TEXT
from sitl.ardupilot.calibration import CopterCalibration
from sitl.ardupilot.commands import CUSTOM_MODE_ENABLED, CommandTargets, CopterCommands
from sitl.ardupilot.failsafes import CopterFailsafes
from sitl.ardupilot.fence import CopterFence
from sitl.ardupilot.flight import CopterFlight
from sitl.ardupilot.ftp import ArduPilotFtpServer
from sitl.ardupilot.guided import GuidedController
from sitl.ardupilot.joystick import Joystick
from sitl.ardupilot.mission_protocol import ArduPilotMissions
from sitl.ardupilot.mode_controller import ModeController
from sitl.ardupilot.modes import STABILIZE
from sitl.ardupilot.position_estimate import PositionEstimate
from sitl.ardupilot.remote_id import RemoteId
from sitl.ardupilot.telemetry import CopterParts, CopterTelemetry
from sitl.ardupilot.traffic import Traffic
from sitl.common.autopilot import Autopilot, BootTiming, Handler, ignore, stick_fields
from sitl.common.command import Command
from sitl.common.missions import FENCE, MISSION
from sitl.common.platform import Identity
from sitl.common.states import Phase, Severity, Stage
from sitl.common.streams import Streams
from sitl.common.vehicle_spec import VehicleSpec
from sitl.links.wire import Received
from sitl.physics.point_masses import PointMasses
from sitl.services.log_protocol import ArduPilotLogServer
from sitl.services.parameter_protocol import ArduPilotParameterServer
from sitl.services.payload import ArduPilotPayload
from sitl.services.shell import ArduPilotSerialPorts

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
"""Streams of REQUEST_DATA_STREAM with the messages that this simulator has (docs/autopilots.md "Groups of streams")."""
PREARM_TEXT_US = 30_000_000
TIMESYNC_US = 10_000_000
SIM_STATION_SYSID = 254
"""The station's system id in simulations; its heartbeats count like those of MAV_GCS_SYSID."""


class ArduCopter(Autopilot):
    """A simulated ArduCopter: it builds its parts at power-on and ticks them in the right order."""

    BOOT_TEXT = BOOT_TEXT
    BOOT = BOOT

    telemetry: CopterTelemetry
    modes: ModeController
    arming: Arming
    failsafes: CopterFailsafes
    calibration: CopterCalibration

    def __init__(
        self, index: int, spec: VehicleSpec, masses: PointMasses, *, timing: BootTiming, identity: Identity
    ) -> None:
        super().__init__(index, spec, masses, timing=timing, identity=identity)
        self._battery = CopterBattery(self.platform.params, self.platform.clock)
        self.restart(0)

    def new_streams(self) -> Streams:
        """Return the streams of REQUEST_DATA_STREAM; without a request only heartbeats are sent."""
        return Streams(STREAM_GROUPS)

    def power_on(self) -> None:
        """Build the parts that are new after every power-on."""
        platform, battery = self.platform, self._battery
        platform.state.mode = STABILIZE
        platform.plans.flying = False
        battery.power_on()
        self._fence = CopterFence(platform)
        self._position = PositionEstimate(platform.clock, platform.state)
        self._joystick = Joystick(platform)
        self._guided = GuidedController(platform, self._fence)
        self._flight = CopterFlight(platform)
        self._auto = AutoMode(platform, self._flight)
        self._remote_id = RemoteId(platform)
        self.calibration = CopterCalibration(platform)
        self.modes = ModeController(
            platform,
            flight=self._flight,
            guided=self._guided,
            auto=self._auto,
            joystick=self._joystick,
            position=self._position,
        )
        self.arming = Arming(
            platform,
            auto=self._auto,
            battery=battery,
            position=self._position,
            remote_id=self._remote_id,
            calibration=self.calibration,
        )
        self.failsafes = CopterFailsafes(
            platform,
            modes=self.modes,
            arming=self.arming,
            flight=self._flight,
            battery=battery,
            position=self._position,
            fence=self._fence,
        )
        platform.plans.changed = self._plans_changed
        self._prearm_text_us = platform.clock.now_us + PREARM_TEXT_US
        self._timesync_us = platform.clock.now_us + TIMESYNC_US
        payload, traffic = ArduPilotPayload(platform), Traffic(platform.params, platform.clock)
        self.telemetry = self._new_telemetry(payload, traffic)
        self._commands = self._new_commands(payload)
        self.handlers = self._new_handlers(traffic)

    def _new_telemetry(self, payload: ArduPilotPayload, traffic: Traffic) -> CopterTelemetry:
        parts = CopterParts(
            arming=self.arming,
            auto=self._auto,
            battery=self._battery,
            calibration=self.calibration,
            fence=self._fence,
            guided=self._guided,
            joystick=self._joystick,
            payload=payload,
            position=self._position,
            remote_id=self._remote_id,
            traffic=traffic,
        )
        return CopterTelemetry(self.platform, parts)

    def _new_commands(self, payload: ArduPilotPayload) -> CopterCommands:
        targets = CommandTargets(
            modes=self.modes,
            arming=self.arming,
            guided=self._guided,
            auto=self._auto,
            fence=self._fence,
            battery=self._battery,
            payload=payload,
            telemetry=self.telemetry,
            reboot=lambda: self.restart(self.platform.clock.now_us),
        )
        return CopterCommands(self.platform, targets)

    def _new_handlers(self, traffic: Traffic) -> dict[str, Handler]:
        platform = self.platform
        missions = ArduPilotMissions(platform)
        return {
            **self.common_handlers(),
            "HEARTBEAT": self._hear_gcs,
            "MANUAL_CONTROL": self._hear_sticks,
            "SET_MODE": self._set_mode,
            "SET_POSITION_TARGET_GLOBAL_INT": self._guided.take_set_point,
            "SET_POSITION_TARGET_LOCAL_NED": self._guided.take_set_point,
            "MISSION_SET_CURRENT": self._set_current_item,
            "REQUEST_EVENT": ignore,
            "ADSB_VEHICLE": traffic.hear,
            "COMMAND_ACK": self.calibration.hear_ack,
            **self._remote_id.handlers(),
            **ArduPilotSerialPorts(platform.outbox).handlers(),
            **ArduPilotParameterServer(platform, self.banner).handlers(),
            **ArduPilotLogServer(platform).handlers(),
            **ArduPilotFtpServer(platform, missions, self.banner).handlers(),
            **missions.handlers(),
        }

    def reached(self, stage: Stage, at_us: int) -> None:
        """Act on a stage of the boot; its texts follow."""
        platform = self.platform
        if stage == Stage.BEATING:
            platform.streams.start("HEARTBEAT", 1000, at_us)
        elif stage == Stage.READY:
            # A mode set earlier was acknowledged, and is lost.
            platform.state.mode = STABILIZE
        elif stage == Stage.HOME_SET:
            platform.outbox.text(Severity.INFO, f"Field Elevation Set: {platform.spec.ground_amsl_m:.0f}m")
            platform.state.set_home()

    def banner(self) -> None:
        """Send the three texts that come at boot and with a parameter list."""
        for text in ("ArduCopter V4.7.0-dev (cef8bcef)", self.platform.identity.uid, "Frame: QUAD/PLUS"):
            self.platform.outbox.text(Severity.INFO, text)

    def fly(self) -> None:
        """Do one tick of an armed vehicle."""
        state = self.platform.state
        self._battery.drain(state.current_a)
        if state.phase == Phase.GROUND:
            self.arming.stand()
        elif self._flight.tick():
            self.modes.tick()
            self._guided.tick()
            state.detect_ground()

    def watch(self) -> None:
        """Do one tick of a booted vehicle: texts, failsafes, Remote ID."""
        clock, outbox = self.platform.clock, self.platform.outbox
        if clock.now_us >= self._timesync_us:
            self._timesync_us += TIMESYNC_US
            # ArduCopter requests the time of stations; this is one of the few messages that it sends without a request.
            outbox.send("TIMESYNC", tc1=0, ts1=clock.since_power_on_us * 1000)
        if clock.now_us >= self._prearm_text_us:
            self._prearm_text_us += PREARM_TEXT_US
            # The failing checks are repeated every 30 s while disarmed.
            if not self.platform.state.armed:
                self.arming.report_problems()
        self.failsafes.watch()
        self._remote_id.watch()

    def execute(self, command: Command) -> None:
        """Carry out a command and acknowledge it; calibrations are dialogues of their own."""
        if self.platform.state.stage < Stage.READY or not self.calibration.execute(command):
            self._commands.execute(command)

    def discharge(self, left: float) -> None:
        """Leave no more than this share of the capacity; charge that was used before counts, too."""
        self._battery.discharge(left)

    def lose_gps(self) -> None:
        """Take the GPS satellites away."""
        self._position.lose_gps()

    def find_gps(self) -> None:
        """Give the GPS satellites back."""
        self._position.find_gps()

    def _plans_changed(self, kind: int) -> None:
        if kind == FENCE:
            self._fence.changed()
        elif kind == MISSION:
            self._auto.changed()

    def _is_own_station(self, system: int) -> bool:
        # Heartbeats and joysticks of other system ids do not count: they cannot hide the loss of this station.
        return system in (int(self.platform.params["MAV_GCS_SYSID"]), SIM_STATION_SYSID)

    def _hear_gcs(self, frame: Received) -> None:
        # ArduPilot looks at the system id of a heartbeat only, not at its MAV_TYPE.
        if self._is_own_station(frame.system):
            self.failsafes.hear_gcs()

    def _hear_sticks(self, frame: Received) -> None:
        """Take a MANUAL_CONTROL of the vehicle's own station; it counts as a heartbeat."""
        if frame.fields["target"] != self.platform.spec.system_id or not self._is_own_station(frame.system):
            return
        self.failsafes.hear_gcs()
        self._joystick.hear(stick_fields(frame.fields))

    def _set_current_item(self, frame: Received) -> None:
        # MISSION_SET_CURRENT with a number beyond the end is not answered.
        self._auto.jump(frame.fields["seq"], restart=False)

    def _set_mode(self, frame: Received) -> None:
        # SET_MODE (11) is obeyed and never acknowledged.
        if frame.fields["base_mode"] & CUSTOM_MODE_ENABLED:
            self.modes.set_mode(frame.fields["custom_mode"] & 0xFF)
