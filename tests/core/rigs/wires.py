"""The rig with several links: vehicles heard over wires of different delay and loss, and strangers beside them.

`Wired(…, wires=[Wire("near"), Wire("far", delay_s=0.8)])` is a `Rig` whose vehicles are heard over both.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from fastcrc.crc16 import mcrf4xx

from sitl.launch.fleet import SimFleet, VehicleSpec
from tests.core.rigs.rig import Rig
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.bus import FLEET, MemoryBus
from tui_gcs.core.protocol.common import StationStatus
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.signing.keystore import KeyStore
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.station.station import Station
from tui_gcs.rehearsal.lock_step import TICK_S, TOKEN

Place = Callable[[int, int], Address | None]
"""place(fleet, index): the address at which that vehicle is heard on a wire; None: not at all."""


def first_fleet(fleet: int, index: int) -> Address | None:
    """The vehicles of the scenario, each at an address of its own; strangers (further fleets) are not heard."""
    return ("sim", index) if fleet == 0 else None


@dataclass
class Wire:
    """One link and what it does to datagrams."""

    name: str
    delay_s: float = 0.0
    place: Place = first_fleet
    up: bool = True
    loses: Callable[[str, bytes], bool] = lambda way, data: False
    numbers: bool = False
    """The vehicle numbers the frames of this link by themselves, as autopilots do."""
    network: str = ""
    secure: bool = False
    high_latency: bool = False
    seen: list[tuple[float, bytes]] = field(default_factory=list)
    """What the station sent over it."""

    def __post_init__(self) -> None:
        spec = LinkSpec(
            self.name, "memory", "", network=self.network, secure=self.secure, high_latency=self.high_latency
        )
        self.link = MemoryLink(spec=spec)
        self._up: deque[tuple[float, bytes, Address]] = deque()
        self._down: deque[tuple[float, bytes, Address]] = deque()
        self._count: dict[Address, int] = {}

    def from_vehicle(self, now: float, data: bytes, address: Address) -> None:
        if self.numbers and data[0] == 0xFD:
            self._count[address] = count = (self._count.get(address, 76) + 1) & 255
            data = renumbered(data, count)
        if self.up and not self.loses("up", data):
            self._up.append((now + self.delay_s, data, address))

    def arrive(self, now: float) -> None:
        while self._up and self._up[0][0] <= now + 1e-9:
            _, data, address = self._up.popleft()
            if self.up:
                self.link.inject(data, address)

    def from_station(self, now: float) -> list[tuple[bytes, Address]]:
        """What reaches vehicles now."""
        while self.link.sent:
            data, address = self.link.sent.popleft()
            self.seen.append((now, data))
            if self.up and not self.loses("down", data):
                self._down.append((now + self.delay_s, data, address))
        out = []
        while self._down and self._down[0][0] <= now + 1e-9:
            _, data, address = self._down.popleft()
            if self.up:
                out.append((data, address))
        return out


def renumbered(raw: bytes, seq: int) -> bytes:
    """An unsigned version 2 frame with another sequence number."""
    layout = dialect.layout(int.from_bytes(raw[7:10], "little"))
    assert layout is not None
    body = raw[1:4] + bytes((seq,)) + raw[5:-2]
    return b"\xfd" + body + int(mcrf4xx(body + layout.extra)).to_bytes(2, "little")


@dataclass
class Wired(Rig):
    """A rig whose vehicles are heard over `wires`."""

    wires: list[Wire] = field(default_factory=lambda: [Wire("near"), Wire("far")])
    keys: KeyStore | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self.fleets = [self.sim]
        self.boot_station()

    def boot_station(self) -> None:
        """The station anew, as after `kill -9`, on the same wires."""
        self.bus = MemoryBus()
        config = self.station.config
        config.keys = KeyStore(self.keys.directory) if self.keys is not None else None
        config.stamps = TimestampStore(self.keys.directory) if self.keys is not None else None
        links = [wire.link for wire in self.wires]
        for link in links:
            link.receive()
            link.sent.clear()
        self.station = Station(config, self.clock, self.bus, list(links), self.recorder, self.journal)
        self.frontend = attach_frontend(self.station)
        self.bus.subscribe(FLEET, self._on_frame)

    # ---------------------------------------------------------------- time

    def step(self) -> None:
        self.clock.advance(TICK_S)
        now = self.clock.now()
        for number, fleet in enumerate(self.fleets):
            fleet.step(TICK_S)
            for index, data in fleet.drain():
                for wire in self.wires:
                    address = wire.place(number, index)
                    if address is not None:
                        wire.from_vehicle(now, data, address)
        for wire in self.wires:
            wire.arrive(now)
        self.tick()

    def tick(self) -> None:
        self.station.tick()
        now = self.clock.now()
        for wire in self.wires:
            before = len(wire.seen)
            for data, address in wire.from_station(now):
                for number, fleet in enumerate(self.fleets):
                    for index in range(len(fleet)):
                        if wire.place(number, index) == address:
                            fleet.receive(index, data)
            for _, data in wire.seen[before:]:
                self._note(data)

    # ---------------------------------------------------------------- who is there

    def stranger(self, system: int = 1, *, age_s: float = 0.0, uid: str = "", token: str = TOKEN, **spec: Any) -> int:
        """Another vehicle with its own power switch, on for `age_s`; the number of its fleet, for `Wire.place`."""
        home = self.sim.specs[0]
        fleet = SimFleet(
            [VehicleSpec(system, home.lat_deg, home.lon_deg, home.ground_amsl_m, **spec)], seed=99, token=token
        )
        if uid:
            fleet._pilots[0].platform.identity.uid = uid
        for _ in range(round(age_s / 0.1)):
            fleet.step(0.1)
        fleet.drain()
        self.fleets.append(fleet)
        return len(self.fleets) - 1

    def remove(self, fleet: int) -> None:
        """The stranger is switched off."""
        for index in range(len(self.fleets[fleet])):
            self.fleets[fleet].silence(index)

    def same_uid(self, uid: str = "\0" * 20) -> None:
        """Simulated boards that all have one hardware id, or none."""
        for fleet in self.fleets:
            for pilot in fleet._pilots:
                pilot.platform.identity.uid = uid

    # ---------------------------------------------------------------- what is known

    def vehicle(self, number: int = 1) -> Vehicle:
        return self.station.picture.fleet.vehicles[number]

    def status(self) -> StationStatus:
        return self.station.publisher.status()

    def names(self, wire: Wire, since_s: float = -1.0) -> list[str]:
        """Messages that the station sent over a wire."""
        return [dialect.label(int.from_bytes(raw[7:10], "little")) for t, raw in wire.seen if t > since_s]

    def commands(self, wire: Wire, since_s: float = -1.0) -> list[int]:
        """MAV_CMD of the COMMAND_LONGs that the station sent over a wire."""
        out = []
        for t, raw in wire.seen:
            if t > since_s and raw[7:10] == b"\x4c\0\0":
                layout = dialect.layout(76)
                assert layout is not None
                fields = dialect.fields_of(layout, dialect.payload_values(layout, raw))
                out.append(int(fields["command"]))
        return out


# ---------------------------------------------------------------- what tests say of them

MakeWired = Callable[..., Wired]
"""The fixture `wired`."""
LOST_TEXT = "LOST: nothing heard for 3.5 s"


def at(port: int) -> Callable[[int, int], Address | None]:
    """Vehicles of every fleet behind one router: all at one address each by index."""
    return lambda fleet, index: ("router", port + index)


def apart(fleet: int, index: int) -> Address:
    """Every fleet at addresses of its own."""
    return (f"fleet {fleet}", index)


def only(number: int) -> Callable[[int, int], Address | None]:
    """Only that fleet is heard on this wire."""
    return lambda fleet, index: (f"fleet {number}", index) if fleet == number else None
