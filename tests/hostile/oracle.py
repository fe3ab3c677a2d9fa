"""What must be true whatever comes in on a link (docs/threats.md B.6): a station under attack, beside one that is not.

Both fly the same vehicles, with the same seed, on the same virtual time. Whatever the twin does not do either, the
attack did: frames sent, changed columns, events, counters.
"""

import gc
import os
import re
import struct
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

from sitl.launch.fleet import SimFleet
from sitl.links.signing import SigningSpec, time_of
from tests.core.rigs.rig import Rig, scenario, toml
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.links import Link
from tui_gcs.core.links.base import MAX_BYTES_PER_RECEIVE
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.mavlink.dialect import label
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram
from tui_gcs.core.mavlink.signing import SigningKey
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import FLEET, MemoryBus
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.signing.keystore import KeyStore
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.station.station import Station
from tui_gcs.rehearsal.lock_step import LINK, TOKEN, simulated_vehicles

STRANGER: Address = ("stranger", 1)
KEY = bytes(range(1, 33))
MAX_STEP_S = 0.25
MAX_GROWTH_MB = 32
PER_TICK = 1800
"""Hostile datagrams per tick of 50 ms: a station takes 2048 at a time, and the vehicles' are among them."""
BYTES_PER_TICK = 10 * MAX_BYTES_PER_RECEIVE
"""Hostile bytes per tick of 50 ms: as many as a socket gives to a station that asks it 200 times a second."""
STATE = [
    "link",
    "address",
    "component",
    "telemetry.armed",
    "telemetry.custom_mode",
    "telemetry.system_status",
    "telemetry.heartbeat_s",
    "telemetry.position_s",
    "telemetry.position_m",
    "telemetry.velocity_m_s",
    "telemetry.heading_deg",
    "telemetry.lat_deg",
    "telemetry.lon_deg",
    "telemetry.alt_amsl_m",
    "telemetry.battery_pct",
    "telemetry.battery_v",
    "telemetry.gps_fix",
    "telemetry.satellites",
    "telemetry.prearm_ok",
    "telemetry.landed_state",
    "identity.signing",
    "identity.blocked",
    "identity.untrusted",
    "integrity.reboots",
    "telemetry.home_m",
    "loss_pct",
]
REQUEST_MESSAGE = (512).to_bytes(2, "little")
WHO_ARE_YOU = (struct.pack("<f", 148), struct.pack("<f", 33))
"""First parameters: AUTOPILOT_VERSION and GLOBAL_POSITION_INT."""
WRITES = frozenset({"os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.symlink", "os.link", "os.truncate"})
FORBIDDEN = frozenset({"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "socket.connect"})


@dataclass
class Watched(Rig):
    """A rig whose links, keys and partners can be chosen, and that notes each datagram that was sent."""

    keyed: tuple[int, ...] = ()
    """These vehicles sign, and the station holds their key."""
    signs: tuple[int, ...] = ()
    """These sign, and the station has no key of theirs."""
    stream: bool = False
    """The link is a byte stream, as TCP or a serial line."""
    more_links: Callable[[], list[Link]] = list
    partners: Callable[[], tuple[Endpoint, ...]] = tuple
    """Other stations that hear the vehicles."""
    wire: list[tuple[float, Address, bytes]] = field(default_factory=list)
    moved: dict[int, Address] = field(default_factory=dict)
    """By index: where a vehicle is heard from now, and where it hears."""
    on_way: Callable[[bytes, Address], None] | None = None
    """In place of the link's `inject`, for what vehicles send."""
    slowest_s: float = 0.0
    """CPU time of the slowest step of the station."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.link = MemoryLink(LINK, stream=self.stream)
        stored = time_of(self.clock.wall()) - 1_000_000
        specs = [
            replace(spec, signing=SigningSpec(KEY, stored)) if spec.system_id in self.keyed + self.signs else spec
            for spec in simulated_vehicles(self.scenario)
        ]
        self.sim = SimFleet(specs, seed=self.scenario.seed, token=TOKEN)
        self.start()

    def start(self) -> None:
        """A new station, as after a crash."""
        store, stamps = None, None
        if self.keyed:
            store, stamps = KeyStore(self.log_dir / "keys"), TimestampStore(self.log_dir / "keys")
            if not store.keys:
                store.add(SigningKey("ours", KEY))
                for system in self.keyed:
                    store.assign("ours", "", system)
        self.forward = self.partners()
        self.further = self.more_links()
        config = replace(self.station.config, keys=store, stamps=stamps, forward=self.forward)
        self.bus = MemoryBus()
        links = [self.link, *self.further]
        self.station = Station(config, self.clock, self.bus, links, self.recorder, self.journal)
        self.frontend = attach_frontend(self.station)
        self.bus.subscribe(FLEET, self._on_frame)

    def step(self) -> None:
        self.clock.advance(0.05)
        self.sim.step(0.05)
        for index, data in self.sim.drain():
            (self.on_way or self.link.inject)(data, self.moved.get(index, ("sim", index)))
        self.tick()

    def tick(self) -> None:
        began_s = time.process_time()
        self.station.tick()
        self.slowest_s = max(self.slowest_s, time.process_time() - began_s)
        homes = {address: index for index, address in self.moved.items()}
        while self.link.sent:
            data, address = self.link.sent.popleft()
            self.wire.append((self.clock.now(), address, data))
            if address[0] == "sim":
                self._note(data)
            index = homes.get(address, int(address[1]) if address[0] == "sim" else -1)
            if 0 <= index < len(self.sim) and (index not in self.moved or address in homes):
                self.sim.receive(index, data)

    def status(self) -> m.StationStatus:
        """What consoles would be shown."""
        return m.decode(m.encode(self.station.publisher.status()), m.StationStatus)


class Oracle:
    """One attack: `inject` and `say` what is hostile, `run` both stations, and `holds` in the end."""

    def __init__(
        self, folder: Path, vehicles: int = 2, *, flying: bool = True, others: Iterable[int] = (2,), **how: Any
    ):
        """`others`: vehicles that nothing of this may touch."""
        self.folder = folder
        self.others = tuple(others)
        (folder / "attacked").mkdir(parents=True)
        (folder / "twin").mkdir()
        self.flight = Watched(scenario(vehicles), toml(), folder / "attacked", **how)
        self.twin = Watched(scenario(vehicles), toml(), folder / "twin", **how)
        for rig in (self.flight, self.twin):
            rig.flying() if flying else rig.ready()
            rig.wire.clear()
            rig.sent.clear()
            rig.slowest_s = 0.0
        self.encoders: dict[tuple[int, int], Encoder] = {}
        self.begun_s = self.flight.clock.now()
        self.first_event = self.flight.station.records.events.since(0, 2000)[-1].seq
        self.judged = False
        gc.collect()  # what tests before left is not looked through in the middle of a step
        self.before_mb = rss_mb()
        self.changed: list[str] = []
        watch_files(self.changed, folder)

    # ---------------------------------------------------------------- the attack

    def inject(self, data: bytes, address: Address = STRANGER) -> None:
        """Bytes arrive at the station's link."""
        self.flight.link.inject(data, address)

    def frame(self, name: str, system: int = 1, component: int = 1, **fields: Any) -> bytes:
        """A frame, well made."""
        encoder = self.encoders.setdefault((system, component), Encoder(system, component))
        return encoder.encode(name, **fields)

    def say(
        self, name: str, system: int = 1, component: int = 1, address: Address | None = None, **fields: Any
    ) -> None:
        """A frame arrives; without `address` from where that vehicle really is."""
        at = address if address is not None else ("sim", self.flight.sim_index[system])
        self.inject(self.frame(name, system, component, **fields), at)

    def run(self, seconds: float, each: Callable[[], None] | None = None) -> "Oracle":
        """Let time pass for both; `each` is called before every tick."""
        for _ in range(round(seconds / 0.05)):
            if each is not None:
                each()
            self.flight.step()
            self.twin.step()
            self._compare_others()
        return self

    def flood(self, datagrams: Iterable[tuple[bytes, Address]]) -> "Oracle":
        """All of these arrive, as fast as the station takes them."""
        waiting = iter(datagrams)
        one = next(waiting, None)
        while one is not None:
            count = size = 0
            while one is not None and count < PER_TICK and size < BYTES_PER_TICK:
                self.flight.link.inject(*one)
                count, size = count + 1, size + len(one[0])
                one = next(waiting, None)
            self.run(0.05)
        return self

    def both(self, do: Callable[[Watched], object]) -> None:
        """What happens anyway, attack or not."""
        do(self.flight)
        do(self.twin)

    @property
    def now(self) -> float:
        return self.flight.clock.now()

    @property
    def vehicle(self) -> Vehicle:
        """Vehicle 1 as the attacked station knows it."""
        return self.flight.station.picture.fleet.vehicles[1]

    # ---------------------------------------------------------------- what came of it

    def dropped(self) -> Counter[str]:
        """What was counted beyond what the twin counts, links' counters included."""
        return _counts(self.flight) - _counts(self.twin)

    def new_events(self) -> list[m.JournalEvent]:
        """Events that the twin does not have."""
        ordinary = Counter((e.source, e.text) for e in self.twin.events() if e.t_s >= self.begun_s)
        new = []
        for event in self.flight.station.records.events.since(self.first_event, 2000):
            if ordinary[(event.source, event.text)]:
                ordinary[(event.source, event.text)] -= 1
            else:
                new.append(event)
        return new

    def told(self, text: str) -> list[m.JournalEvent]:
        """Those of them that match."""
        return [event for event in self.new_events() if re.search(text, event.text)]

    def sent(self) -> list[tuple[float, Address, str, bytes]]:
        """(time, address, message, payload) of what the twin did not send.

        Without the question who it is: a vehicle whose frames are not numbered in one row is asked, as are those for
        whom an attack speaks from their own address.
        """
        extra = Counter(_frames(self.flight)) - Counter(_frames(self.twin))
        return sorted((frame for frame in extra.elements() if not _asks_vehicle_1(frame)), key=str)

    def unsent(self) -> list[tuple[float, Address, str, bytes]]:
        """What only the twin sent."""
        return sorted((Counter(_frames(self.twin)) - Counter(_frames(self.flight))).elements(), key=str)

    def holds(
        self,
        *,
        counted: str | None = None,
        told: str | None = None,
        sends: Callable[[Address, str], bool] | None = None,
        less: Callable[[Address, str], bool] | None = None,
    ) -> None:
        """The verdict. `counted`/`told`: what names the cause; `sends`/`less` allow (address, message) sent or not.

        None for `counted` and `told` where there is nothing to be refused. The station lives on a little first.
        """
        self.run(1.2)
        if told is not None and not self.told(told):  # what was refused before the attack is told again later
            self.run(30.0)
        self.judged = True
        watch_files(None, self.folder)
        assert self.flight.frame is not None and self.now - self.flight.frame.t_s < 0.2, "alive: fleet frames go on"
        assert self.flight.slowest_s < MAX_STEP_S, f"a step took {self.flight.slowest_s * 1e3:.0f} ms"
        gc.collect()
        assert rss_mb() - self.before_mb < MAX_GROWTH_MB, f"grew by {rss_mb() - self.before_mb:.0f} MB"
        assert self.changed == [], f"outside of the state directory: {self.changed[:5]}"
        wrong = [frame for frame in self.sent() if sends is None or not sends(frame[1], frame[2])]
        assert wrong == [], "frames sent because of it"
        missing = [frame for frame in self.unsent() if less is None or not less(frame[1], frame[2])]
        assert missing == [], "frames not sent because of it"
        for number in self.others:
            vehicle = self.flight.station.picture.fleet.vehicles[number]
            assert vehicle.freshness(self.now) is Freshness.OK, f"vehicle {number} is updated"
        if counted is not None:
            assert self.dropped()[counted] > 0, f"{counted!r} not among {dict(self.dropped())}"
        if told is not None:
            assert self.told(told), f"{told!r} not among {[e.text for e in self.new_events()]}"
        per_cause = Counter((e.source, re.sub(r"[\d.]+", "#", e.text)) for e in self.new_events())
        most = self.now - self.begun_s + 1.0
        assert all(count <= most for count in per_cause.values()), f"more than a line a second: {per_cause}"

    def _compare_others(self) -> None:
        for number in self.others:
            here, there = (rig.station.picture.fleet.vehicles[number] for rig in (self.flight, self.twin))
            for name in STATE:
                a, b = attrgetter(name)(here), attrgetter(name)(there)
                assert a == b or (a != a and b != b) or repr(a) == repr(b), f"vehicle {number}: {name} is {a}, not {b}"

    def close(self) -> None:
        watch_files(None, self.folder)
        self.flight.close()
        self.twin.close()


def _counts(rig: Watched) -> Counter[str]:
    status = rig.status()
    total = Counter(status.dropped)
    for link in status.links:
        total += Counter({"junk bytes": link.bad, "bad CRC": link.bad_crc, "kernel drops": link.kernel_drops})
    return total


def _asks_vehicle_1(frame: tuple[float, Address, str, bytes]) -> bool:
    _, address, name, payload = frame
    asks = name == "COMMAND_LONG" and payload[28:30] == REQUEST_MESSAGE and payload[:4] in WHO_ARE_YOU
    return asks and address == ("sim", 0)


def _frames(rig: Watched) -> list[tuple[float, Address, str, bytes]]:
    return [
        (round(t_s, 3), address, label(frame.msgid), frame.payload)
        for t_s, address, data in rig.wire
        for frame in cut_datagram(data).frames
    ]


def rss_mb() -> float:
    """Resident memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


# ---------------------------------------------------------------- files: one hook for the whole process

_watched: list[tuple[list[str], str]] = []


def watch_files(changed: list[str] | None, allowed: Path) -> None:
    """Note in `changed` what this process writes outside of `allowed`, starts or connects to; None ends that."""
    if not _hooked:
        sys.addaudithook(_audit)
        _hooked.append(True)
    _watched.clear()
    if changed is not None:
        _watched.append((changed, str(allowed.resolve())))


_hooked: list[bool] = []


def _audit(event: str, args: tuple[Any, ...]) -> None:
    if not _watched:
        return
    changed, allowed = _watched[0]
    if event == "open":
        path, mode, flags = args
        writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        if writes and not isinstance(path, int) and not str(path).startswith(allowed):
            changed.append(f"open {path} {mode}")
    elif event in WRITES and not str(args[0]).startswith(allowed):
        changed.append(f"{event} {args[0]}")
    elif event in FORBIDDEN:
        changed.append(event)
