"""A whole station and scripted vehicles on a virtual clock, through a link that loses, repeats, swaps and delays.

A `Peer` is a vehicle made of a few functions: heartbeat, position and version are there; a test adds what its
autopilot says to which message. Everything the peers heard can be looked at.

    rig = ServiceRig(tmp_path, Peer(1, answers={"PARAM_REQUEST_READ": my_answer}), loss=0.2)
    rig.heard()
    rig.station.services....
    rig.until(lambda: job.over, 30.0)
"""

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.core.rigs.rig import scenario, toml
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.links import open_link
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.station.parts import StationConfig
from tui_gcs.core.station.station import Station

TICK_S = 0.02
ARDUPILOT, PX4 = 3, 12
GCS, GCS_COMPONENT = 255, 190
"""Who a LIVE station is on the wire."""

Fields = dict[str, Any]
Answer = Callable[["Peer", Fields], None]


@dataclass
class Peer:
    """One scripted vehicle."""

    system: int = 1
    autopilot: int = ARDUPILOT
    type: int = 2
    answers: dict[str, Answer] = field(default_factory=dict)
    """What it does when it hears a message, by name. COMMAND_LONG 511 and 512 are accepted unless this says else."""
    custom_mode: int = 0
    armed: bool = False
    alt_rel_mm: int = 0
    north_cm_s: int = 0
    silent: bool = False
    heard: list[tuple[float, str, Fields]] = field(default_factory=list)
    """(time, message name, fields) of everything it got, our heartbeats apart."""
    out: list[bytes] = field(default_factory=list)
    now: float = 0.0
    later: list[tuple[float, Callable[[], None]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.encoder = Encoder(self.system, 1)
        self._beat_s = self._place_s = 0.0

    def say(self, name: str, **fields: Any) -> None:
        """A message leaves."""
        if not self.silent:
            self.out.append(self.encoder.encode(name, **fields))

    def say_to_us(self, name: str, **fields: Any) -> None:
        """A message for this station leaves."""
        self.say(name, target_system=GCS, target_component=GCS_COMPONENT, **fields)

    def ack(self, command: int, result: int = 0, **fields: Any) -> None:
        """A COMMAND_ACK leaves."""
        self.say_to_us("COMMAND_ACK", command=command, result=result, **fields)

    def after(self, seconds: float, act: Callable[[], None]) -> None:
        """Do something a little later."""
        self.later.append((self.now + seconds, act))

    def hear(self, name: str, fields: Fields) -> None:
        """A message arrived."""
        self.heard.append((self.now, name, fields))
        answer = self.answers.get(name)
        if answer is not None:
            answer(self, fields)
        elif name == "COMMAND_LONG" and fields["command"] in (511, 512):
            self.ack(fields["command"])

    def got(self, name: str) -> list[Fields]:
        """The fields of all messages `name` it heard."""
        return [fields for _, n, fields in self.heard if n == name]

    def tick(self, now: float) -> None:
        """Say what is due."""
        self.now = now
        for due in [entry for entry in self.later if entry[0] <= now + 1e-9]:
            self.later.remove(due)
            due[1]()
        if now >= self._beat_s:
            self._beat_s = now + 1.0
            self.say(
                "HEARTBEAT",
                type=self.type,
                autopilot=self.autopilot,
                base_mode=0x80 * self.armed | 0x51,
                custom_mode=self.custom_mode,
                system_status=4 if self.armed else 3,
                mavlink_version=3,
            )
        if now >= self._place_s:
            self._place_s = now + 0.25
            self.say(
                "GLOBAL_POSITION_INT",
                time_boot_ms=round(now * 1000) + 60_000,
                lat=473_977_000 + self.system * 1000,
                lon=85_456_000,
                alt=488_000 + self.alt_rel_mm,
                relative_alt=self.alt_rel_mm,
                vx=self.north_cm_s,
                vy=0,
                vz=0,
                hdg=0,
            )


class ServiceRig:
    """One station, its services, and peers; `loss`, `duplicate`, `reorder` are probabilities per datagram and way."""

    def __init__(
        self,
        tmp_path: Path,
        *peers: Peer,
        loss: float = 0.0,
        duplicate: float = 0.0,
        reorder: float = 0.0,
        delay_s: float = 0.0,
        seed: int = 1,
        bytes_per_s: int | None = None,
        forward: tuple[str, ...] = (),
    ) -> None:
        self.peers = {peer.system: peer for peer in peers}
        self.loss, self.duplicate, self.reorder, self.delay_s = loss, duplicate, reorder, delay_s
        self.random = random.Random(seed)
        self.clock = VirtualClock()
        self.bus = MemoryBus()
        self.link = MemoryLink(spec=LinkSpec("memory", "memory", "", bytes_per_s=bytes_per_s))
        (tmp_path / "state").mkdir(mode=0o700, exist_ok=True)
        self.recorder, self.journal = TlogWriter(tmp_path / "run.tlog"), Journal(tmp_path / "run.jsonl")
        endpoints = tuple(Endpoint(open_link(name, self.clock), commands=False) for name in forward)
        state = tmp_path / "state"
        config = StationConfig(RunKind.LIVE, scenario(), toml(), "", judge_steps=False, folder=state, forward=endpoints)
        self.station = Station(config, self.clock, self.bus, [self.link], self.recorder, self.journal)
        attach_frontend(self.station)
        self._under_way: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0

    def vehicle(self, system: int = 1) -> Vehicle:
        """The station's picture of a peer."""
        return self.station.picture.fleet.vehicles[system]

    def step(self) -> None:
        """One tick of everything."""
        self.clock.advance(TICK_S)
        now = self.clock.now()
        for peer in self.peers.values():
            peer.tick(now)
        self._carry(now)
        self.station.tick()
        self._carry(now)

    def run(self, seconds: float) -> "ServiceRig":
        """Let time pass."""
        for _ in range(round(seconds / TICK_S)):
            self.step()
        return self

    def until(self, reached: Callable[[], bool], limit_s: float, what: str = "") -> float:
        """Let time pass until `reached`; how long it took. Fails after `limit_s`."""
        begin_s = self.clock.now()
        while not reached():
            assert self.clock.now() - begin_s <= limit_s, f"not within {limit_s} s: {what or reached}"
            self.step()
        return self.clock.now() - begin_s

    def heard(self) -> "ServiceRig":
        """All peers are vehicles with a position."""
        self.until(lambda: all(s in self.station.picture.fleet.vehicles for s in self.peers), 5.0, "all heard")
        return self.run(1.0)

    def texts(self, source: str = "") -> list[str]:
        """Event texts so far, of one source or of all."""
        return [e.text for e in self.station.records.events.since(0, 2000) if not source or e.source == source]

    def _carry(self, now: float) -> None:
        for peer in self.peers.values():
            out, peer.out = peer.out, []
            for data in out:
                self._send(now, lambda data=data, s=peer.system: self.link.inject(data, ("peer", s)))
        while self.link.sent:
            data, address = self.link.sent.popleft()
            if address[0] == "peer":
                self._send(now, lambda data=data, s=int(address[1]): self._reach(s, data))
        due = [entry for entry in self._under_way if entry[0] <= now + 1e-9]
        self._under_way = [entry for entry in self._under_way if entry[0] > now + 1e-9]
        for _, _, arrive in sorted(due, key=lambda entry: entry[:2]):
            arrive()

    def _send(self, now: float, arrive: Callable[[], None]) -> None:
        for _ in range(1 + (self.random.random() < self.duplicate)):
            if self.random.random() >= self.loss:
                late = TICK_S * 2 if self.random.random() < self.reorder else 0.0
                self._count += 1
                self._under_way.append((now + self.delay_s + late, self._count, arrive))

    def _reach(self, system: int, data: bytes) -> None:
        for frame in cut_datagram(data).frames:
            message = decode(frame)
            if message is not None and message.name != "HEARTBEAT":
                self.peers[system].hear(message.name, message.fields)
