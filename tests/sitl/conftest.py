"""A minimal ground station for the simulator's tests: says things to vehicles and keeps what they answer."""

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from sitl.common.missions import Item
from sitl.common.parameters import REAL32
from sitl.launch.fleet import SimFleet, VehicleSpec
from sitl.links.wire import LAYOUT_BY_NAME, Encoder, ReceivedFrame, cut
from sitl.px4.events import event_kinds

TICK_S = 0.05
GUIDED, RTL, LAND = 4, 6, 9
HOLD = 4 << 16 | 3 << 24
POSITION_ONLY, POSITION_VELOCITY, VELOCITY_ONLY = 0xDF8, 0xDC0, 0xDC7
LAT_DEG, LON_DEG = 52.0720, -0.6280


def specs(n: int = 1, autopilot: Any = "ardupilot") -> list[VehicleSpec]:
    return [VehicleSpec(i + 1, LAT_DEG + 0.0002 * i, LON_DEG, 110.0, 90.0, autopilot=autopilot) for i in range(n)]


@dataclass
class Ground:
    fleet: SimFleet
    encoder: Encoder = field(default_factory=lambda: Encoder(255, 190))
    heard: list[tuple[float, int, ReceivedFrame]] = field(default_factory=list)
    plain: list[bytes] = field(default_factory=list)
    raw: list[tuple[int, bytes]] = field(default_factory=list)

    def run(self, seconds: float, tick_s: float = TICK_S) -> None:
        for _ in range(round(seconds / tick_s)):
            self.fleet.step(tick_s)
            self.listen()

    def beat(self, seconds: float, index: int = 0, tick_s: float = TICK_S) -> None:
        """Run with the heartbeats of a ground station."""
        for _ in range(max(1, round(seconds))):
            self.say("HEARTBEAT", index, type=6)
            self.run(min(seconds, 1.0), tick_s)

    def listen(self) -> None:
        for index, datagram in self.fleet.drain():
            self.raw.append((index, datagram))
            frames = cut(datagram)
            if not frames:
                self.plain.append(datagram)
            self.heard += [(self.fleet.now_s, index, frame) for frame in frames]

    def say(self, name: str, index: int = 0, **fields: Any) -> None:
        target = {"target_system": self.fleet.specs[index].system_id} if name != "HEARTBEAT" else {}
        self.fleet.receive(index, self.encoder.frame(name, {**target, **fields}))

    def command(self, number: int, *p: float, index: int = 0, form: str = "LONG", frame: int = 6) -> int | None:
        """Result of the acknowledgement; None if there is none."""
        values = (*p, *(0.0,) * (7 - len(p)))
        fields: dict[str, Any] = {f"param{k + 1}": values[k] for k in range(4)}
        if form == "LONG":
            fields |= {f"param{k + 1}": values[k] for k in range(4, 7)}
        else:
            fields |= {"x": int(values[4]), "y": int(values[5]), "z": values[6], "frame": frame}
        since = len(self.heard)
        self.say(f"COMMAND_{form}", index, command=number, **fields)
        self.listen()
        acks = [f.fields["result"] for _, i, f in self.heard[since:] if f.name == "COMMAND_ACK" and i == index]
        return acks[-1] if acks else None

    def answers(self, number: int, *p: float, index: int = 0) -> list[str]:
        """What comes back at once, in order: 'ack 4' and status texts."""
        since = len(self.heard)
        self.command(number, *p, index=index)
        said = []
        for _, _, frame in self.heard[since:]:
            if frame.name == "COMMAND_ACK":
                said.append(f"ack {frame.fields['result']}")
            elif frame.name == "STATUSTEXT":
                said.append(f"{frame.fields['severity']} {text_of(frame)}")
        return said

    def acks(self, number: int, *p: float, wait_s: float = 0.3, index: int = 0, **how: Any) -> list[int]:
        """All acknowledgements of a command that come within `wait_s`."""
        since = len(self.heard)
        self.command(number, *p, index=index, **how)
        self.run(wait_s)
        found = [f.fields for _, i, f in self.heard[since:] if f.name == "COMMAND_ACK" and i == index]
        return [fields["result"] for fields in found if fields["command"] == number]

    def events(self, index: int = 0, since_s: float = 0.0) -> list[str]:
        """Names of the EVENTs that came."""
        names = {kind.id: name for name, kind in event_kinds().items()}
        return [names[fields["id"]] for fields in self.of("EVENT", index, since_s)]

    def param(self, name: str, value: float, index: int = 0) -> None:
        """PARAM_SET: as a float, or bytewise for PX4's integers."""
        table = self.fleet._pilots[index].platform.params
        kind = table.by_name(name).kind
        if self.fleet.specs[index].autopilot == "px4" and kind != REAL32:
            value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        self.say("PARAM_SET", index, param_id=name.encode(), param_value=value, param_type=kind)

    def item(self, command: int, east_m: float = 0.0, north_m: float = 0.0, z: float = 0.0, **more: Any) -> Item:
        """A mission item about the first vehicle's place; z above home."""
        lat, lon = self.fleet._pilots[0].platform.body.to_geodetic(east_m, north_m)
        return Item(command, **{"frame": 3, **more}, x=round(lat * 1e7), y=round(lon * 1e7), z=z)

    def upload(self, kind: int, items: list[Item], index: int = 0) -> int:
        """Result of the MISSION_ACK."""
        since = len(self.heard)
        self.say("MISSION_COUNT", index, count=len(items), mission_type=kind)
        asked = -1
        for _ in range(3 * len(items) + 3):
            self.listen()
            new = [f for _, i, f in self.heard[since:] if i == index]
            acks = [f.fields["type"] for f in new if f.name == "MISSION_ACK"]
            if acks:
                self.run(0.3)  # PX4 judges it a moment later
                return int(acks[0])
            seq = [f.fields["seq"] for f in new if f.name in ("MISSION_REQUEST", "MISSION_REQUEST_INT")][-1]
            if seq != asked:
                asked = seq
                self.say("MISSION_ITEM_INT", index, mission_type=kind, **items[seq].fields(seq))
        raise AssertionError("never acknowledged")

    def of(self, name: str, index: int = 0, since_s: float = 0.0) -> list[dict[str, Any]]:
        return [f.fields for t, i, f in self.heard if f.name == name and i == index and t >= since_s]

    def times(self, name: str, index: int = 0) -> list[float]:
        return [t for t, i, f in self.heard if f.name == name and i == index]

    def texts(self, index: int = 0, since_s: float = 0.0) -> list[str]:
        return [text_of(f) for t, i, f in self.heard if f.name == "STATUSTEXT" and i == index and t >= since_s]

    def ask(self, name: str, hz: float, index: int = 0) -> int | None:
        return self.command(511, LAYOUT_BY_NAME[name].msgid, 1e6 / hz, index=index)

    def mode(self, mode: int, index: int = 0) -> int | None:
        return self.command(176, 1, mode, index=index)

    def target(
        self,
        east_m: float,
        north_m: float,
        alt_m: float,
        velocity_enu: tuple[float, float, float] = (0.0, 0.0, 0.0),
        mask: int = POSITION_ONLY,
        index: int = 0,
    ) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT about the vehicle's own start place."""
        lat, lon = self.fleet._pilots[index].platform.body.to_geodetic(east_m, north_m)
        east, north, up = velocity_enu
        self.say(
            "SET_POSITION_TARGET_GLOBAL_INT",
            index,
            coordinate_frame=6,
            type_mask=mask,
            lat_int=round(lat * 1e7),
            lon_int=round(lon * 1e7),
            alt=alt_m,
            vx=north,
            vy=east,
            vz=-up,
        )

    def take_off(self, alt_m: float = 15.0, index: int = 0) -> None:
        """Ready, armed and at `alt_m`."""
        assert self.mode(GUIDED, index) == 0
        assert self.command(400, 1, index=index) == 0
        assert self.command(22, 0, 0, 0, 0, 0, 0, alt_m, index=index) == 0
        self.run(4.0 + alt_m / 2.0)
        assert abs(self.fleet.alt_rel_m[index] - alt_m) < 0.3


def text_of(frame: ReceivedFrame) -> str:
    return frame.fields["text"].rstrip(b"\0").decode("ascii")


@pytest.fixture
def powered() -> Callable[..., Ground]:
    """A station and n vehicles that were switched on just now."""
    return lambda n=1, **options: Ground(SimFleet(specs(n), **options))


@pytest.fixture
def booted(powered: Callable[..., Ground]) -> Callable[..., Ground]:
    """A station and n vehicles that are ready to be armed."""

    def make(n: int = 1, **options: Any) -> Ground:
        ground = powered(n, **options)
        ground.run(3.2)
        return ground

    return make


@pytest.fixture
def px4() -> Callable[..., Ground]:
    """A station that beats and n PX4 vehicles that are ready to be armed."""

    def make(n: int = 1, **options: Any) -> Ground:
        ground = Ground(SimFleet(specs(n, "px4"), **options))
        for _ in range(4):
            for index in range(n):
                ground.say("HEARTBEAT", index, type=6)
            ground.run(1.0)
        return ground

    return make


def px4_take_off(ground: Ground, alt_m: float = 15.0, index: int = 0) -> None:
    """Armed and holding at `alt_m`."""
    assert ground.command(400, 1, index=index) == 0
    amsl_m = ground.fleet.specs[index].ground_amsl_m + alt_m
    assert ground.command(22, 0, 0, 0, math.nan, math.nan, math.nan, amsl_m, index=index) == 0
    ground.beat(5.0 + alt_m / 1.5, index)
    assert abs(ground.fleet.alt_rel_m[index] - alt_m) < 0.5
    assert ground.fleet.mode[index] == HOLD
