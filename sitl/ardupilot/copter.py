"""One simulated ArduCopter, put together from its parts.

Numbers and texts are those measured on ArduCopter 4.7 SITL (docs/autopilots.md "ArduCopter").
"""

from sitl.ardupilot.arming import Arming
from sitl.ardupilot.battery import CopterBattery
from sitl.ardupilot.calibration import CopterCalibration
from sitl.ardupilot.commands import CUSTOM_MODE_ENABLED, CopterCommands
from sitl.ardupilot.failsafes import CopterFailsafes
from sitl.ardupilot.ftp import ArduPilotFtpServer
from sitl.ardupilot.log_writer import LogWriter
from sitl.ardupilot.mission_protocol import ArduPilotMissions
from sitl.ardupilot.mode_controller import ModeController
from sitl.ardupilot.modes import STABILIZE
from sitl.ardupilot.parts import CopterParts
from sitl.ardupilot.telemetry import CopterTelemetry
from sitl.common.autopilot import Autopilot, BootStep, Handler, ignore, stick_fields
from sitl.common.states import MavSeverity, Phase, Stage
from sitl.common.streams import Streams
from sitl.links.wire import ReceivedFrame
from sitl.services.log_protocol import ArduPilotLogServer
from sitl.services.parameter_protocol import ArduPilotParameterServer
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
# Pre-arm texts come again every 30 s (docs/autopilots.md "Refusals and their texts").
PREARM_TEXT_US = 30_000_000
# ArduCopter asks every station for its time, unasked (docs/autopilots.md "Groups of streams").
TIMESYNC_US = 10_000_000
SIM_STATION_SYSID = 254
"""The station's system id in simulations; its heartbeats count like those of MAV_GCS_SYSID."""


GCS_SYSID_ENFORCE = 1
"""Bit of MAV_OPTIONS."""


class ArduCopter(Autopilot):
    """A simulated ArduCopter: it builds its parts at power-on and ticks them in the right order."""

    BOOT_TEXT = (b"\n\nInit ArduCopter V4.7.0-dev (cef8bcef)\n\nFree RAM: 0\n", b"0 ", b"Init Gyro", b"*", b"\n")
    BOOT = (
        BootStep(0.10, Stage.BEATING),
        BootStep(0.30, Stage.READY, ("ArduPilot Ready", "AHRS: DCM active")),
        BootStep(0.40, Stage.EKF_ACTIVE, ("EKF3 IMU0 initialised", "AHRS: EKF3 active")),
        BootStep(0.50, Stage.EKF_ALIGNED, ("EKF3 IMU0 tilt alignment complete",)),
        BootStep(0.60, Stage.GPS_FOUND, ("GPS 1: detected u-blox",)),
        BootStep(0.65, Stage.GPS_FIX),
        BootStep(0.75, Stage.HOME_SET, ("EKF3 IMU0 origin set",)),
        BootStep(0.85, Stage.PREARM_OK),
        BootStep(0.95, Stage.POSITION_OK, ("EKF3 IMU0 is using GPS",)),
        BootStep(1.00, Stage.ALL_OK),
    )
    """A real ArduCopter takes 42.5 s for these steps (docs/autopilots.md "Boot, arming, take-off")."""

    calibration: CopterCalibration

    _battery: CopterBattery | None = None
    """It is made at the first power-on; its charge outlives the others."""

    def new_streams(self) -> Streams:
        """Return the streams of REQUEST_DATA_STREAM; without a request only heartbeats are sent."""
        return Streams(STREAM_GROUPS)

    def power_on(self) -> None:
        """Build the parts that are new after every power-on."""
        platform = self.platform
        platform.state.mode = STABILIZE
        platform.plans.flying = False
        self._battery = battery = self._battery or CopterBattery(platform.params, platform.clock)
        battery.power_on()
        self._parts = parts = CopterParts(platform, battery)
        self.calibration, self.fence, self.mission = parts.calibration, parts.fence, parts.auto
        self.discharge = battery.discharge
        self.stop_draining = battery.stop_draining
        self.modes = ModeController(platform, parts)
        self.arming = Arming(platform, parts)
        self.failsafes = CopterFailsafes(platform, parts, self.modes, self.arming)
        self._prearm_text_us = platform.clock.now_us + PREARM_TEXT_US
        self._timesync_us = platform.clock.now_us + TIMESYNC_US
        self.telemetry = telemetry = CopterTelemetry(platform, parts, self.arming)
        self._log_writer = LogWriter(platform, battery, telemetry)
        self.execute = CopterCommands(platform, parts, self.modes, self.arming, telemetry, self._reboot).execute
        self.handlers = self._new_handlers()

    def _reboot(self) -> None:
        self.restart(self.platform.clock.now_us)

    def _new_handlers(self) -> dict[str, Handler]:
        platform, parts = self.platform, self._parts
        missions = ArduPilotMissions(platform, parts.guided.fly_to_item)
        return {
            **self.common_handlers(),
            "HEARTBEAT": self._hear_gcs,
            "MANUAL_CONTROL": self._hear_sticks,
            "SET_MODE": self._set_mode,
            "SET_POSITION_TARGET_GLOBAL_INT": parts.guided.take_set_point,
            "SET_POSITION_TARGET_LOCAL_NED": parts.guided.take_set_point,
            "MISSION_SET_CURRENT": self._set_current_item,
            "AUTOPILOT_VERSION_REQUEST": self._send_version,
            "REQUEST_EVENT": ignore,
            "ADSB_VEHICLE": parts.traffic.hear,
            "COMMAND_ACK": parts.calibration.hear_ack,
            **parts.remote_id.handlers(),
            **ArduPilotSerialPorts(platform).handlers(),
            **ArduPilotParameterServer(platform, self.banner).handlers(),
            **ArduPilotLogServer(platform).handlers(),
            **ArduPilotFtpServer(platform, missions, self.banner).handlers(),
            **missions.handlers(),
        }

    def _send_version(self, _: ReceivedFrame) -> None:
        """Answer the old request, which DroneKit sends."""
        self.telemetry.report("AUTOPILOT_VERSION")

    def reached(self, stage: Stage, at_us: int) -> None:
        """Act on a stage of the boot; its texts follow."""
        platform = self.platform
        if stage == Stage.BEATING:
            platform.streams.start("HEARTBEAT", 1000, at_us)
        elif stage == Stage.READY:
            # A mode set earlier was acknowledged, and is lost.
            platform.state.mode = STABILIZE
        elif stage == Stage.HOME_SET:
            platform.outbox.text(MavSeverity.INFO, f"Field Elevation Set: {platform.spec.ground_amsl_m:.0f}m")
            platform.state.set_home()

    def banner(self) -> None:
        """Send the three texts that come at boot and with a parameter list."""
        for text in ("ArduCopter V4.7.0-dev (cef8bcef)", self.platform.identity.uid, "Frame: QUAD/PLUS"):
            self.platform.outbox.text(MavSeverity.INFO, text)

    def fly(self) -> None:
        """Do one tick of an armed vehicle."""
        state = self.platform.state
        self._parts.battery.drain(state.current_a)
        if state.phase == Phase.GROUND:
            self.arming.stand()
        elif self._parts.flight.tick():
            self.modes.tick()
            self._parts.guided.tick()
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
        self._parts.remote_id.watch()
        self._log_writer.watch()

    def obeys(self, frame: ReceivedFrame) -> bool:
        """Return whether the sender counts; with bit 0 of MAV_OPTIONS the own station alone does (`accept_packet`)."""
        enforced = int(self.platform.params["MAV_OPTIONS"]) & GCS_SYSID_ENFORCE
        return not enforced or self._is_own_station(frame.system) or frame.system == self.platform.spec.system_id

    def _is_own_station(self, system: int) -> bool:
        # Heartbeats and joysticks of other system ids do not count: they cannot hide the loss of this station.
        return system in (int(self.platform.params["MAV_GCS_SYSID"]), SIM_STATION_SYSID)

    def _hear_gcs(self, frame: ReceivedFrame) -> None:
        # ArduPilot looks at the system id of a heartbeat only, not at its MAV_TYPE.
        if self._is_own_station(frame.system):
            self.failsafes.hear_gcs()

    def _hear_sticks(self, frame: ReceivedFrame) -> None:
        """Take a MANUAL_CONTROL of the vehicle's own station; it counts as a heartbeat."""
        if frame.fields["target"] != self.platform.spec.system_id or not self._is_own_station(frame.system):
            return
        self.failsafes.hear_gcs()
        self._parts.joystick.hear(stick_fields(frame.fields))

    def _set_current_item(self, frame: ReceivedFrame) -> None:
        # MISSION_SET_CURRENT with a number beyond the end is not answered.
        self._parts.auto.choose(frame.fields["seq"], restart=False)

    def _set_mode(self, frame: ReceivedFrame) -> None:
        # SET_MODE (11) is obeyed and never acknowledged.
        if frame.fields["base_mode"] & CUSTOM_MODE_ENABLED:
            self.modes.set_mode(frame.fields["custom_mode"] & 0xFF)
