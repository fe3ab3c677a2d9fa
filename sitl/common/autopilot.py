"""What all simulated autopilots have in common: boot, link, streams, battery, home, phases of a flight.

Times are integer microseconds of simulated time; nothing here reads a clock. `ardupilot` and `px4` add the manners.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

from sitl.ardupilot.boot import BootStep
from sitl.common.dialogue_state import Stores
from sitl.common.logs import Logs
from sitl.common.missions import Plans
from sitl.common.parameters import ParameterTable
from sitl.common.states import Phase, Severity, Stage
from sitl.common.streams import Streams
from sitl.common.tasks import Tasks
from sitl.links.signing import Signer
from sitl.links.wire import Encoder
from sitl.physics.point_masses import Vehicles, VehicleSpec
from sitl.services.ftp_files import Tree

LAND_DETECT_US = 1_000_000
CHUNK_BYTES = 50
"""Of a STATUSTEXT."""
HOVER_CURRENT_A = 28.0
IDLE_CURRENT_A = 1.0
SIM_STATION_SYSID = 254
"""The station's system id for simulated vehicles; its heartbeats count like those of MAV_GCS_SYSID."""

Fields = dict[str, Any]


class Command(NamedTuple):
    """COMMAND_LONG or COMMAND_INT. For COMMAND_INT p5 and p6 are x and y (1e-7 degrees) and `frame` is set."""

    number: int
    p: tuple[float, float, float, float, float, float, float]
    """param1 … param7."""
    frame: int | None


class Autopilot(ABC):
    """State of vehicle `index`; puts datagrams into `out`."""

    BOOT_TEXT: ClassVar[tuple[bytes, ...]] = ()
    """Plain-text datagrams at power-on: not MAVLink."""
    BOOT: ClassVar[Sequence[BootStep]]
    """What happens between power-on and readiness."""
    BUILDERS: ClassVar[Mapping[str, Callable[[Any], Fields | None]]]
    """Field values of everything it reports; None when there is nothing to report yet."""
    AT_ANY_STAGE: ClassVar[frozenset[str]] = frozenset({"HEARTBEAT", "AUTOPILOT_VERSION"})
    """Messages that exist before it has booted."""

    def __init__(
        self, index: int, spec: VehicleSpec, vehicles: Vehicles, *, boot_us: int, jitter_us: int, token: bytes, uid: str
    ) -> None:
        self.index = index
        self.spec = spec
        self.vehicles = vehicles
        self.token = token
        self.uid = uid
        self.params = ParameterTable(spec.system_id, spec.autopilot)
        self.encoder = Encoder(spec.system_id)
        self.signer = Signer(spec.signing, px4=spec.autopilot == "px4" or spec.signing.px4)
        self.out: list[bytes] = []
        self.deferred: list[tuple[str, Fields]] | None = None
        """Messages kept back until a command is acknowledged; None: nothing is."""
        self.tasks = Tasks()
        self.plans = Plans()
        self.logs = Logs(spec.autopilot)
        self.files: Tree | None = None
        """What it serves by MAVFTP; made with the first request."""
        self._armed = False
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
        self.elapsed_us = 0
        """Since the tick before this one."""
        self.stage = Stage.OFF
        self.chunked = 0
        """The id of the last text that needed several chunks."""
        self.armed = False
        self.phase = Phase.GROUND
        self.phase_us = now_us
        self.touched_us: int | None = None
        self.home_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self.failsafes: set[str] = set()
        self.gcs_heard_us: int | None = None
        self.gps_lost_us: int | None = None
        """Since when there is no GPS."""
        self.tasks.clear()
        self.stores = Stores()
        self.logs.power_on(now_us)
        self.streams = self.new_streams()
        self.signer.power_on(now_us)
        self.encoder.sequence = 0
        self.once: list[str] = []
        """Messages to be sent once, with the next tick."""
        self._boot_texts_due = True
        self._boot_steps = [
            (now_us + self._jitter_us + round(step.share * self._boot_us), step.stage, step.texts) for step in self.BOOT
        ]
        self.power_on()
        self.vehicles.rest(self.index)

    @property
    def armed(self) -> bool:
        """Motors on. They make logs grow."""
        return self._armed

    @armed.setter
    def armed(self, on: bool) -> None:
        if on != self._armed:
            self._armed = on
            self.logs.motors(self.now_us, on=on)

    # What a personality adds

    mode: int
    """custom_mode."""

    @abstractmethod
    def new_streams(self) -> Streams:
        """The rates of a link that nobody has asked for anything."""

    @abstractmethod
    def power_on(self) -> None:
        """Its own part of `restart`."""

    @abstractmethod
    def reached(self, stage: Stage, at_us: int) -> None:
        """A stage of the boot was reached; its texts follow."""

    @abstractmethod
    def banner(self) -> None:
        """What it says of itself at boot."""

    @abstractmethod
    def fly(self) -> None:
        """One tick of an armed vehicle."""

    @abstractmethod
    def watch(self) -> None:
        """One tick of a booted vehicle: failsafes and what is said unasked."""

    @abstractmethod
    def hear_gcs(self, system: int, kind: int) -> None:
        """A heartbeat of somebody of MAV_TYPE `kind`."""

    @abstractmethod
    def hear_sticks(self, system: int, fields: Fields) -> None:
        """MANUAL_CONTROL."""

    @abstractmethod
    def event(self, name: str, *arguments: float, levels: int = 0x66) -> None:
        """EVENT `name` of the metadata; only PX4 sends them."""

    @abstractmethod
    def resend_events(self, fields: Fields, system: int, component: int) -> None:
        """REQUEST_EVENT."""

    @abstractmethod
    def execute(self, command: Command, system: int, component: int) -> None:
        """Do it and acknowledge it to `system`/`component`."""

    @abstractmethod
    def legacy_set_mode(self, fields: Fields, system: int, component: int) -> None:
        """SET_MODE (11)."""

    @abstractmethod
    def set_point(self, name: str, fields: Fields) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT or …_LOCAL_NED."""

    @abstractmethod
    def discharge(self, left: float) -> None:
        """From now on no more than this share (0 to 1) is in the battery."""

    def lose_gps(self) -> None:
        """No satellites."""
        self.gps_lost_us = self.now_us if self.gps_lost_us is None else self.gps_lost_us

    def find_gps(self) -> None:
        """Satellites again."""
        self.gps_lost_us = None

    # Sending

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

    def acknowledge(self, command: int, result: int, system: int, component: int) -> None:
        """COMMAND_ACK to who asked."""
        self.send("COMMAND_ACK", command=command, result=int(result), target_system=system, target_component=component)

    def text(self, severity: Severity, text: str) -> None:
        """Queue a STATUSTEXT; a long one in chunks."""
        raw = text.encode("ascii")
        if len(raw) <= CHUNK_BYTES:
            self.send("STATUSTEXT", severity=int(severity), text=raw)
            return
        self.chunked = self.chunked % 0xFFFF + 1
        self.send_chunks(severity, raw, self.chunked)

    def send_chunks(self, severity: Severity, raw: bytes, text_id: int) -> None:
        """A text as STATUSTEXTs of one id."""
        for number, start in enumerate(range(0, len(raw), CHUNK_BYTES)):
            chunk = raw[start : start + CHUNK_BYTES]
            self.send("STATUSTEXT", severity=int(severity), text=chunk, id=text_id, chunk_seq=number)

    def report(self, name: str) -> bool:
        """Send message `name` now; False if there is nothing to send."""
        if self.stage < Stage.READY and name not in self.AT_ANY_STAGE:
            return False
        fields = self.BUILDERS[name](self)
        if fields is None:
            return False
        self.send(name, **fields)
        return True

    @property
    def boot_ms(self) -> int:
        """Milliseconds since power-on: time_boot_ms."""
        return (self.now_us - self.power_on_us) // 1000

    # Time

    def tick(self, now_us: int) -> None:
        """Advance to `now_us` and report what is due."""
        self.elapsed_us = now_us - self.now_us
        self.now_us = now_us
        if self.dead:
            return
        if self._boot_steps:
            self._boot()
        if self.armed:
            self.consumed_mah += self.current_a * self.elapsed_us / 3.6e6
            self.fly()
        if self.stage >= Stage.READY:
            self.watch()
        if self.tasks.next_us <= now_us:
            self.tasks.run(now_us)
        due = self.streams.due(now_us)
        if self.once:
            due, self.once = self.once + due, []
        for name in due:
            self.report(name)

    def _boot(self) -> None:
        if self._boot_texts_due:
            self._boot_texts_due = False
            self.out.extend(() if self.silent else self.BOOT_TEXT)
        while self._boot_steps and self._boot_steps[0][0] <= self.now_us:
            at_us, self.stage, texts = self._boot_steps.pop(0)
            self.reached(self.stage, at_us)
            for text in texts:
                self.text(Severity.INFO, text)
            if self.stage == Stage.READY:
                self.banner()

    def set_home(self) -> None:
        """Home is where the vehicle is now: also the zero of relative altitude. Sent once."""
        x, y, z = self.vehicles.seen(self.index)
        self.home_m = (x, y, z)
        self.once += ["GPS_GLOBAL_ORIGIN", "HOME_POSITION"]

    @property
    def current_a(self) -> float:
        """Battery current."""
        if not self.armed:
            return 0.0
        return HOVER_CURRENT_A if self.phase > Phase.SPOOL_UP else IDLE_CURRENT_A

    # Flight

    @property
    def landed(self) -> bool:
        """On the ground as far as the autopilot knows."""
        return self.phase in (Phase.GROUND, Phase.SPOOL_UP)

    def enter(self, phase: Phase) -> None:
        """Begin a phase of the flight."""
        self.phase = phase
        self.phase_us = self.now_us
        self.touched_us = None

    def detect_ground(self) -> bool:
        """True once it has stood on the ground for LAND_DETECT_US."""
        i, vehicles = self.index, self.vehicles
        if vehicles.position_m[i, 2] > 0.0 or vehicles.velocity_m_s[i, 2] > 0.0:
            self.touched_us = None
        elif self.touched_us is None:
            self.touched_us = self.now_us
        elif self.now_us - self.touched_us >= LAND_DETECT_US:
            vehicles.rest(i)
            self.enter(Phase.GROUND)
            return True
        return False
