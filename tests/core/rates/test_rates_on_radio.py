"""Eight vehicles on one 57.6 kbit/s radio, signed, byte for byte (promise R18): simulated autopilots, real frames."""

import random
from collections import Counter, deque
from typing import Any

from sitl.launch.fleet import SimFleet, VehicleSpec
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.links.spec import parse_link
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import sign, ticks
from tui_gcs.core.rates.message_sets import LADDER
from tui_gcs.core.rates.rate_controller import RateController
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.commands import CommandService

TICK_S = 0.05
RADIO = parse_link("serial:radio:57600")
CAPACITY, BUDGET = 4032, 2822
"""B/s both ways, and 70 % of that for telemetry (docs/threats.md C.3)."""
HEARTBEAT, POSITION, ACK = 0, 33, 77
SECRET = bytes(range(32))
PICTURE = {HEARTBEAT, POSITION, 1, 24, 147, 245, 30, 74, 193}
"""Message ids that sets and heartbeats are made of."""


class Radio:
    """A half-duplex line of so many bytes a second: frames of both directions wait in one queue."""

    def __init__(self, loss: float) -> None:
        self.queue: deque[tuple[str, int, bytes, float]] = deque()
        self.credit = 0.0
        self.loss = loss
        self.chance = random.Random(1)
        self.most_waiting = 0

    def put(self, way: str, index: int, raw: bytes, now: float) -> None:
        self.queue.append((way, index, raw, now))

    def carry(self) -> list[tuple[str, int, bytes, float]]:
        """What got through in one tick."""
        self.most_waiting = max(self.most_waiting, sum(len(raw) for _, _, raw, _ in self.queue))
        self.credit = self.credit + CAPACITY * TICK_S if self.queue else 0.0
        through = []
        while self.queue and self.credit >= len(self.queue[0][2]):
            self.credit -= len(self.queue[0][2])
            through.append(self.queue.popleft())
        return [frame for frame in through if self.chance.random() >= self.loss]


class Ground:
    """Fleet, commands and rate controller of a station, and the vehicles at the other end of the radio."""

    def __init__(self, vehicles: int, *, loss: float = 0.0) -> None:
        self.clock = VirtualClock()
        self.stamp = ticks(self.clock.wall())
        events = EventLog(self.clock)
        frame = LocalFrame(Origin(lat_deg=52.07, lon_deg=-0.63, ground_amsl_m=110.0))
        self.fleet = VehicleRegistry(self.clock, events, frame, 255)
        self.commands = CommandService(self.clock, events)
        self.fleet.on_message("COMMAND_ACK", lambda v, f: self.commands.on_ack(v, f["command"], f["result"]))
        firmware = CommandEncoder(self, frame)
        self.controller = RateController(self.fleet, self.commands, firmware, {RADIO.name: RADIO}, self.clock, events)
        self.encoder = Encoder(255, 190)
        self.sim = SimFleet([VehicleSpec(i + 1, 52.07 + 0.0002 * i, -0.63, 110.0) for i in range(vehicles)])
        for _ in range(100):  # all vehicles are up before anybody listens: what they say at boot is not our matter
            self.sim.step(TICK_S)
        self.sim.drain()
        self.radio = Radio(loss)
        self.sent: list[tuple[float, int, int]] = []
        """(time, message id, bytes) of what the vehicles sent."""
        self.heard: Counter[int] = Counter()
        self.made_s = dict.fromkeys(range(vehicles), 0.0)
        """When the newest position that arrived was sent."""
        self.ages_s: list[float] = []
        self.measured_s = 0.0

    def signed(self, raw: bytes) -> bytes:
        self.stamp += 1
        return sign(raw, SECRET, 1, self.stamp)

    def ask(self, vehicle_id: int, name: str, **fields: Any) -> None:
        """As `Uplink.ask`."""
        raw = self.encoder.encode(name, target_system=vehicle_id, target_component=1, **fields)
        self.radio.put("down", vehicle_id - 1, self.signed(raw), self.clock.now())

    def run(self, seconds: float) -> "Ground":
        for _ in range(round(seconds / TICK_S)):
            self.clock.advance(TICK_S)
            self._step(self.clock.now())
        return self

    def _step(self, now: float) -> None:
        self.sim.step(TICK_S)
        for index, raw in self.sim.drain():
            if raw[0] == 0xFD:  # no boot texts
                frame = self.signed(raw)
                self.sent.append((now, message_id(frame), len(frame)))
                self.radio.put("up", index, frame, now)
        for way, index, raw, made_s in self.radio.carry():
            if way == "down":
                self.sim.receive(index, raw)
                continue
            self.heard[message_id(raw)] += 1
            self.fleet.intakes[""].datagrams(RADIO.name, [(raw, f"vehicle {index}")], now)
            if message_id(raw) == POSITION:
                self.made_s[index] = made_s
        self.fleet.tick()
        self.controller.tick()
        self.commands.tick(self.fleet.vehicles)
        self.ages_s += [now - made_s for made_s in self.made_s.values()]

    def begin_measuring(self) -> None:
        self.measured_s = self.clock.now()
        self.sent.clear()
        self.heard.clear()
        self.ages_s.clear()

    def most_bytes_per_s(self, window_s: float) -> float:
        """Of what the vehicles sent, in the worst window of that length."""
        window: deque[tuple[float, int]] = deque()
        inside = most = 0
        for t_s, _, size in self.sent:
            window.append((t_s, size))
            inside += size
            while window[0][0] <= t_s - window_s + 1e-6:
                inside -= window.popleft()[1]
            most = max(most, inside)
        return most / window_s

    def mean_bytes_per_s(self) -> float:
        """Of what the vehicles sent since measuring began, answers apart."""
        total = sum(size for _, message, size in self.sent if message in PICTURE)
        return total / (self.clock.now() - self.measured_s)

    def p95_age_s(self) -> float:
        return sorted(self.ages_s)[int(0.95 * len(self.ages_s))]


def message_id(raw: bytes) -> int:
    return int.from_bytes(raw[7:10], "little")


def test_eight_signed_vehicles_stay_within_a_radios_budget_and_their_positions_are_fresh() -> None:
    ground = Ground(8).run(30.0)
    assert ground.controller.plan(RADIO.name) == dict(dict(LADDER)["minimal"])
    ground.begin_measuring()
    ground.run(120.0)
    assert ground.most_bytes_per_s(10.0) <= BUDGET
    assert ground.most_bytes_per_s(1.0) <= BUDGET, "not even for a second"
    assert ground.p95_age_s() <= 1.0
    assert max(ground.ages_s) <= 1.5
    assert ground.heard[HEARTBEAT] >= 8 * 119, "more than 99 % of the heartbeats"
    assert ground.heard[ACK] == 0, "nothing is asked any more"
    assert 0.8 * 1794 <= ground.mean_bytes_per_s() <= 1794, "as calculated, or less: zeros at the end are not sent"


def test_while_everybody_joins_and_is_asked_the_radio_is_never_overfull() -> None:
    ground = Ground(8).run(30.0)
    assert ground.most_bytes_per_s(1.0) <= CAPACITY
    assert ground.radio.most_waiting <= CAPACITY / 2, "half a second of delay"
    assert all(vehicle.identity.identified for vehicle in ground.fleet.vehicles.values())


def test_at_10_percent_loss_each_way_it_is_the_same() -> None:
    ground = Ground(8, loss=0.1).run(45.0)
    ground.begin_measuring()
    ground.run(120.0)
    assert ground.most_bytes_per_s(1.0) <= BUDGET
    assert 0.8 * 1794 <= ground.mean_bytes_per_s() <= 1794
    assert ground.p95_age_s() <= 1.5


def test_twenty_vehicles_share_it_too() -> None:
    ground = Ground(20).run(90.0)
    assert ground.controller.plan(RADIO.name) == dict(dict(LADDER)["lean"])
    ground.begin_measuring()
    ground.run(120.0)
    assert ground.most_bytes_per_s(10.0) <= BUDGET
    assert ground.most_bytes_per_s(1.0) <= CAPACITY
    assert ground.p95_age_s() <= 1.5
