"""A million stops at 30 % loss each way, and as many starts, in lock-step.

The station's own fleet, firmware, uplink and command service on a virtual clock, bytes both ways, and ArduCopters of a
few lines. Heartbeats and positions are lost, late and out of order like everything else. What counts is what a vehicle
did and when, which the station can only learn from those.
"""

import random
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from tests.bench.row import Row
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.ardupilot import AUTO, BRAKE, GUIDED
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.mavlink.commands import CMD_ARM_DISARM, CMD_REQUEST_MESSAGE, CMD_SET_MODE, CMD_TAKEOFF
from tui_gcs.core.mavlink.dialect import MavlinkMessage
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.scenario.load import load
from tui_gcs.core.station.parts import StationConfig
from tui_gcs.core.station.station import Station
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction

LOSS = 0.3
TICK_S = 0.05
DELAY_TICKS = (1, 2, 3, 4)
"""One way, one of them: frames overtake each other."""
MAX_DELAY_S = DELAY_TICKS[-1] * TICK_S
BEAT_TICKS, POSITION_TICKS = 20, 10
"""1 Hz and 2 Hz."""
VEHICLES = 200
COMMANDS = 1_000_000
STOP_LIMIT_S, STOP_FAILURES_PER_MILLION = 10.0, 10
START_LIMIT_S = 2.0
SCENARIO = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
SOUTH_1E7, WEST_1E7 = 520_720_000, -6_280_000
"""Inside the scenario's area."""
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"


@dataclass(frozen=True)
class State:
    """What a vehicle does."""

    armed: bool = True
    mode: int = GUIDED
    height_m: int = 0
    speed_cm_s: int = 0

    def shows(self, vehicle: Vehicle) -> bool:
        """Whether the station sees it like that."""
        flies_so = (
            vehicle.telemetry.alt_rel_m == self.height_m and vehicle.telemetry.ground_speed_m_s * 100 == self.speed_cm_s
        )
        return flies_so and vehicle.telemetry.armed == self.armed and vehicle.telemetry.custom_mode == self.mode


PARKED, ARMED, FLYING = State(armed=False), State(), State(height_m=30, speed_cm_s=500)
Ask = Callable[[Firmware, Vehicle], VehicleAction]
ORDERS: dict[RetryClass, tuple[tuple[State, Ask], ...]] = {
    RetryClass.STOP: (
        (FLYING, lambda firmware, v: firmware.hold(v, lambda: v.telemetry.position_m)),
        (replace(FLYING, mode=AUTO), lambda firmware, v: firmware.hold(v, lambda: v.telemetry.position_m)),
        (FLYING, lambda firmware, v: firmware.land(v)),
        (ARMED, lambda firmware, v: firmware.disarm(v)),
    ),
    RetryClass.START: (
        (PARKED, lambda firmware, v: firmware.arm(v, _nothing)),
        (ARMED, lambda firmware, v: firmware.take_off(v, 30.0, _nothing)),
        (FLYING, lambda firmware, v: firmware.mission_start(v)),
    ),
}
"""What is asked of a vehicle in which state; they take turns."""


def _nothing(action: VehicleAction, outcome: Outcome, why: str) -> None:
    """Who asks looks at the vehicle."""


@dataclass
class Copter:
    """One vehicle and the command it is given."""

    system: int
    state: State = PARKED
    turn: int = 0
    begun_s: float | None = None
    """When the command was given; None while the station has yet to see the state that it is for."""
    ended_s: float | None = None
    outcome: Outcome | None = None
    effects_s: list[float] = field(default_factory=list)
    """When it changed what it does; a copy that finds it done has no effect."""
    out: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._encoder = Encoder(self.system, 1)

    def beat(self) -> None:
        """Its heartbeat leaves."""
        base_mode = 0x51 | 0x80 * self.state.armed
        self._say("HEARTBEAT", type=2, autopilot=3, base_mode=base_mode, custom_mode=self.state.mode)

    def place(self, now_s: float) -> None:
        """Its position leaves."""
        height_mm = self.state.height_m * 1000
        self._say(
            "GLOBAL_POSITION_INT",
            time_boot_ms=round(now_s * 1000),
            lat=SOUTH_1E7,
            lon=WEST_1E7,
            alt=height_mm,
            relative_alt=height_mm,
            vx=self.state.speed_cm_s,
            vy=0,
            vz=0,
            hdg=0,
        )

    def hear(self, message: MavlinkMessage, now_s: float) -> None:
        """A message of the station arrives."""
        if message.name == SETPOINT:
            self._become(replace(self.state, speed_cm_s=0) if self.state.mode == GUIDED else self.state, now_s)
            return
        command, first, second = (message.fields[name] for name in ("command", "param1", "param2"))
        if command == CMD_REQUEST_MESSAGE:
            self.beat()
        else:
            self._become(self._after(command, first, second), now_s)
        self._say("COMMAND_ACK", command=command, result=0)

    def _after(self, command: int, first: float, second: float) -> State:
        """What it does after a command."""
        if command == CMD_SET_MODE:
            return replace(self.state, mode=int(second), speed_cm_s=0 if second == BRAKE else self.state.speed_cm_s)
        if command == CMD_ARM_DISARM:
            return replace(self.state, armed=first == 1)
        assert command == CMD_TAKEOFF
        return replace(self.state, height_m=30)

    def _become(self, state: State, now_s: float) -> None:
        if state != self.state:
            self.state = state
            self.effects_s.append(now_s)

    def _say(self, name: str, **fields: int) -> None:
        more = {"system_status": 4, "mavlink_version": 3} if name == "HEARTBEAT" else {}
        self.out.append(self._encoder.encode(name, **fields, **more))


@dataclass
class Tally:
    """What became of them all."""

    commands: int = 0
    confirmed: int = 0
    took_effect: int = 0
    late: int = 0
    """Not confirmed within a stop's limit."""
    longest_s: float = 0.0
    """From the order to its end."""
    late_effects: int = 0
    """Took effect later than a start may, delay apart."""
    second_effects: int = 0
    untrue: int = 0
    """Told as done, and was not."""
    sent_after_end: int = 0
    most_copies: int = 0


class Air:
    """A station, and vehicles at the other end of bad links."""

    def __init__(self, retry: RetryClass, seed: int, vehicles: int = VEHICLES) -> None:
        self.retry = retry
        self.tally = Tally()
        self._random = random.Random(seed)
        self._clock = VirtualClock()
        self._link = MemoryLink()
        config = StationConfig(RunKind.LIVE, load(SCENARIO), "", "")
        self._station = Station(config, self._clock, MemoryBus(), [self._link], _Unrecorded(), _Unwritten())
        attach_frontend(self._station)
        self._copters = {system: Copter(system, turn=system) for system in range(1, vehicles + 1)}
        self._ticks = 0
        self._down: defaultdict[int, list[tuple[Copter, bytes]]] = defaultdict(list)
        self._up: defaultdict[int, list[tuple[Copter, MavlinkMessage]]] = defaultdict(list)
        """Under way, by the tick in which they arrive."""

    def run(self, commands: int) -> Tally:
        """Give so many commands, one after the other to each vehicle; as many as that, or a few more, are judged."""
        for copter in self._copters.values():
            self._reset(copter)
        while self.tally.commands < commands:
            self._step()
        return self.tally

    # ---------------------------------------------------------------- time

    def _step(self) -> None:
        self._ticks += 1
        self._clock.advance(TICK_S)
        now = self._clock.now()
        for copter in self._copters.values():
            if (self._ticks + copter.system) % POSITION_TICKS == 0:
                copter.place(now)
                if (self._ticks + copter.system) % BEAT_TICKS == 0:
                    copter.beat()
                self._leave(copter)
        for copter, message in self._up.pop(self._ticks, ()):
            copter.hear(message, now)
            self._leave(copter)
        for copter, data in self._down.pop(self._ticks, ()):
            self._link.inject(data, ("copter", copter.system))
        self._station.receive()
        self._station.picture.fleet.tick()
        self._station.comms.commands.tick(self._station.picture.fleet.vehicles)
        for copter in self._copters.values():
            self._turn(copter, now)
        self._send()

    def _leave(self, copter: Copter) -> None:
        """What the vehicle said goes on its way to the station."""
        for data in copter.out:
            if self._random.random() >= LOSS:
                self._down[self._ticks + self._random.choice(DELAY_TICKS)].append((copter, data))
        copter.out.clear()

    def _send(self) -> None:
        """What the station said goes on its way to the vehicles."""
        while self._link.sent:
            data, address = self._link.sent.popleft()
            copter = self._copters[int(address[1])]
            (frame,) = cut_datagram(data).frames
            message = decode(frame)
            assert message is not None and message.fields["target_system"] == copter.system
            asks = message.fields.get("command") == CMD_REQUEST_MESSAGE
            self.tally.sent_after_end += not asks and (copter.begun_s is None or copter.ended_s is not None)
            if self._random.random() >= LOSS:
                self._up[self._ticks + self._random.choice(DELAY_TICKS)].append((copter, message))

    # ---------------------------------------------------------------- commands

    def _turn(self, copter: Copter, now: float) -> None:
        """Begin what can be begun, judge what is over and can have no more effects."""
        if copter.begun_s is None:
            vehicle = self._station.picture.fleet.vehicles.get(copter.system)
            if copter.effects_s:
                self.tally.second_effects += 1
                self._reset(copter)
            elif vehicle is not None and vehicle.identity.confirmed and copter.state.shows(vehicle):
                self._begin(copter, vehicle, now)
        elif copter.ended_s is not None:
            quiet_s = (
                copter.ended_s if self.retry is RetryClass.STOP else max(copter.ended_s, copter.begun_s + START_LIMIT_S)
            )
            if now > quiet_s + MAX_DELAY_S + TICK_S:
                self._judge(copter, copter.begun_s, copter.ended_s)
                copter.turn += 1
                self._reset(copter)

    def _reset(self, copter: Copter) -> None:
        """Its pilot makes it ready for the next command; what comes to it now is of the one before."""
        orders = ORDERS[self.retry]
        copter.state = orders[copter.turn % len(orders)][0]
        copter.begun_s = copter.ended_s = copter.outcome = None
        copter.effects_s = []

    def _begin(self, copter: Copter, vehicle: Vehicle, now: float) -> None:
        orders = ORDERS[self.retry]
        action = orders[copter.turn % len(orders)][1](self._station.comms.firmware.of(vehicle), vehicle)
        assert action.retry is self.retry

        def ended(action: VehicleAction, outcome: Outcome, why: str) -> None:
            copter.ended_s, copter.outcome = self._clock.now(), outcome
            self.tally.most_copies = max(self.tally.most_copies, action.sent)

        action.on_done = ended
        copter.begun_s = now
        self._station.comms.commands.submit(action)

    def _judge(self, copter: Copter, begun_s: float, ended_s: float) -> None:
        tally = self.tally
        confirmed = copter.outcome is Outcome.CONFIRMED
        tally.commands += 1
        tally.confirmed += confirmed
        tally.took_effect += bool(copter.effects_s)
        tally.late += not confirmed or ended_s - begun_s > STOP_LIMIT_S
        tally.longest_s = max(tally.longest_s, ended_s - begun_s)
        tally.late_effects += any(t > begun_s + START_LIMIT_S + MAX_DELAY_S + 1e-6 for t in copter.effects_s)
        tally.second_effects += max(0, len(copter.effects_s) - 1)
        tally.untrue += confirmed and not copter.effects_s


class _Unrecorded(TlogWriter):
    """A log that is not kept: it would have a gigabyte."""

    def __init__(self) -> None: ...

    def write_many(self, wall_s: float, raws: list[bytes]) -> None: ...


class _Unwritten(Journal):
    """The same of the journal."""

    def __init__(self) -> None: ...

    def write(self, record: dict[str, object]) -> None: ...


def commands(folder: Path) -> Iterator[Row]:
    """A million of each."""
    stops = Air(RetryClass.STOP, 1).run(COMMANDS)
    yield Row("stops not confirmed in 10 s, 30 % loss, of 1e6", stops.late, "", STOP_FAILURES_PER_MILLION)
    yield Row("the longest that a stop took", stops.longest_s, "s")
    starts = Air(RetryClass.START, 2).run(COMMANDS)
    yield Row("starts that took effect after 2 s and the delay, of 1e6", starts.late_effects, "", 0)
    yield Row("second effects of one start", starts.second_effects, "", 0)
    yield Row("starts that took effect, of 1e6", starts.took_effect, "")
    yield Row("told as done and was not, of 2e6", stops.untrue + starts.untrue, "", 0)
    yield Row("copies sent after the end, of 2e6", stops.sent_after_end + starts.sent_after_end, "", 0)
    yield Row("copies of a start, at most", starts.most_copies, "", 3)
