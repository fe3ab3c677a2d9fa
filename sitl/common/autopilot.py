"""The base of both simulated autopilots: boot, tick, and the MAVLink endpoint.

Times are integer microseconds of simulated time; nothing here reads a real clock. `ardupilot.copter` and
`px4.multicopter` add what differs.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, NamedTuple

from sitl.common.command import Command, command_of
from sitl.common.fence import Fence
from sitl.common.files import FileTree
from sitl.common.flight_state import FlightState
from sitl.common.logs import Logs
from sitl.common.mission_flight import MissionFlight
from sitl.common.missions import FENCE, MISSION, Plans
from sitl.common.outbox import Fields, Outbox, VehicleClock
from sitl.common.parameters import ParameterTable
from sitl.common.platform import Identity, Platform
from sitl.common.states import MavSeverity, Stage
from sitl.common.streams import Streams
from sitl.common.tasks import Tasks
from sitl.common.telemetry import Telemetry
from sitl.common.vehicle_spec import VehicleSpec
from sitl.links.signing import Signer
from sitl.links.wire import ReceivedFrame, cut
from sitl.physics.point_masses import Body, PointMasses

Handler = Callable[[ReceivedFrame], None]
"""What is called with a received message."""


class BootStep(NamedTuple):
    """One step of a boot: its share of the boot time, the stage reached, the status texts sent."""

    share: float
    stage: Stage
    texts: tuple[str, ...] = ()


class BootTiming(NamedTuple):
    """How long a vehicle takes to boot, and how long after the others it is switched on."""

    boot_us: int
    jitter_us: int


class Autopilot(ABC):
    """One simulated vehicle as a MAVLink endpoint: `receive` takes datagrams, `tick` makes `platform.outbox` fill."""

    BOOT_TEXT: ClassVar[tuple[bytes, ...]] = ()
    """Plain-text datagrams at power-on, which are not MAVLink."""
    BOOT: ClassVar[Sequence[BootStep]]
    """The boot from power-on to readiness."""
    ANY_COMPONENT: ClassVar[bool] = True
    """Whether messages for another component of this system are obeyed."""
    AUTOPILOT_COMPONENT: ClassVar[int] = 1

    telemetry: Telemetry
    fence: Fence
    mission: MissionFlight
    handlers: Mapping[str, Handler]
    """Messages that are looked at, by name."""
    execute: Callable[[Command], None]
    """Carries out a command and acknowledges it."""
    discharge: Callable[[float], None]
    """Leaves no more than this share (0 to 1) in the battery."""
    stop_draining: Callable[[], None]
    """From now on only `discharge` takes of the battery."""

    def __init__(
        self, index: int, spec: VehicleSpec, masses: PointMasses, *, timing: BootTiming, identity: Identity
    ) -> None:
        self.index = index
        self.dead = False
        """The autopilot has failed: it neither hears nor sends nor controls anything."""
        self._timing = timing
        clock, body, logs = VehicleClock(), Body(masses, index), Logs(spec)
        signer = Signer(spec.signing, px4=spec.autopilot == "px4" or spec.signing.px4)
        streams = Streams({})
        self.platform = Platform(
            spec=spec,
            identity=identity,
            body=body,
            clock=clock,
            outbox=Outbox(spec.system_id, signer, clock),
            tasks=Tasks(),
            params=ParameterTable(spec.system_id, spec.autopilot),
            plans=Plans(),
            logs=logs,
            files=FileTree(),
            streams=streams,
            state=FlightState(clock, body, streams, logs),
        )
        self.restart(0)

    def restart(self, now_us: int) -> None:
        """Power on or reboot: parameters, plans, logs, files and the battery outlive it, everything else is new."""
        platform = self.platform
        platform.clock.power_on(now_us)
        # Long answers and retries from before the reboot end with it.
        platform.tasks.clear()
        platform.logs.power_on(now_us)
        platform.outbox.power_on()
        streams = self.new_streams()
        state = FlightState(platform.clock, platform.body, streams, platform.logs)
        self.platform = replace(platform, streams=streams, state=state)
        self._boot_texts_due = True
        self._boot_steps = [
            (now_us + self._timing.jitter_us + round(step.share * self._timing.boot_us), step.stage, step.texts)
            for step in self.BOOT
        ]
        self.power_on()
        platform.plans.changed = self._plans_changed
        platform.body.rest()

    @abstractmethod
    def new_streams(self) -> Streams:
        """Return the message rates of a link on which no station has requested any."""

    @abstractmethod
    def power_on(self) -> None:
        """Build the autopilot's own parts on the new platform: all that the class declares without a value."""

    @abstractmethod
    def reached(self, stage: Stage, at_us: int) -> None:
        """Act on a stage of the boot; its texts follow."""

    def banner(self) -> None:  # noqa: B027 - only one autopilot does it
        """Send the texts with which the autopilot introduces itself; PX4 has none."""

    @abstractmethod
    def fly(self) -> None:
        """Do one tick of an armed vehicle."""

    @abstractmethod
    def watch(self) -> None:
        """Do one tick of a booted vehicle: failsafes and what is sent without a request."""

    def tick(self, now_us: int) -> None:
        """Advance to `now_us`, and send what is due."""
        platform = self.platform
        platform.clock.advance(now_us)
        if self.dead:
            return
        if self._boot_steps:
            self._boot()
        if platform.state.armed:
            self.fly()
        if platform.state.stage >= Stage.READY:
            self.watch()
        if platform.tasks.next_us <= now_us:
            platform.tasks.run(now_us)
        for name in platform.streams.due(now_us):
            self.telemetry.report(name)

    def _plans_changed(self, kind: int) -> None:
        if kind == FENCE:
            self.fence.changed()
        elif kind == MISSION:
            self.mission.changed()

    def _boot(self) -> None:
        platform, state = self.platform, self.platform.state
        if self._boot_texts_due:
            self._boot_texts_due = False
            platform.outbox.send_plain(self.BOOT_TEXT)
        while self._boot_steps and self._boot_steps[0][0] <= platform.clock.now_us:
            at_us, state.stage, texts = self._boot_steps.pop(0)
            self.reached(state.stage, at_us)
            for text in texts:
                platform.outbox.text(MavSeverity.INFO, text)
            if state.stage == Stage.READY:
                self.banner()

    def receive(self, datagram: bytes) -> None:
        """Handle all frames of one datagram that are for this vehicle; anything else is skipped."""
        platform = self.platform
        for frame in cut(datagram):
            handler = self.handlers.get(frame.name)
            # System 0 is a broadcast: real vehicles carry out such commands, too.
            if handler is None or frame.fields.get("target_system", 0) not in (0, platform.spec.system_id):
                continue
            if not self.ANY_COMPONENT and frame.fields.get("target_component", 0) not in (0, self.AUTOPILOT_COMPONENT):
                continue
            if not self.obeys(frame):
                continue
            # Checked last: an accepted signature moves the time of its stream.
            if platform.outbox.signer.accepts(frame.raw):
                handler(frame)

    def obeys(self, frame: ReceivedFrame) -> bool:
        """Return whether frames of this sender are handled: of all senders, unless an autopilot is set otherwise."""
        return True

    def common_handlers(self) -> dict[str, Handler]:
        """Return the handlers of messages that both autopilots treat alike."""
        return {
            "COMMAND_LONG": lambda frame: self.execute(command_of(frame)),
            "COMMAND_INT": lambda frame: self.execute(command_of(frame)),
            "REQUEST_DATA_STREAM": self._request_data_stream,
            "TIMESYNC": self._timesync,
            "SETUP_SIGNING": self._setup_signing,
        }

    def _request_data_stream(self, frame: ReceivedFrame) -> None:
        f, platform = frame.fields, self.platform
        rate_hz = f["req_message_rate"] if f["start_stop"] else 0
        platform.streams.ask_stream(f["req_stream_id"], rate_hz, platform.clock.now_us)

    def _timesync(self, frame: ReceivedFrame) -> None:
        if frame.fields["tc1"] == 0:
            ours_ns = self.platform.clock.since_power_on_us * 1000
            self.platform.outbox.send("TIMESYNC", tc1=ours_ns, ts1=frame.fields["ts1"])

    def _setup_signing(self, frame: ReceivedFrame) -> None:
        """Take a signing key. It is never acknowledged: the frames sent from now on show it."""
        outbox = self.platform.outbox
        if outbox.signer.px4:
            # PX4 takes keys over USB only (docs/autopilots.md "Signing of PX4").
            return
        if self.platform.state.armed:
            outbox.text(MavSeverity.WARNING, "ERROR: Won't setup signing when armed")
            return
        outbox.signer.take(bytes(frame.fields["secret_key"]), frame.fields["initial_timestamp"])


def ignore(_: ReceivedFrame) -> None:
    """Take a message without any effect; its signature counts all the same."""


def stick_fields(fields: Fields) -> tuple[int, int, int, int]:
    """Return x, y, z and r of a MANUAL_CONTROL."""
    return fields["x"], fields["y"], fields["z"], fields["r"]
