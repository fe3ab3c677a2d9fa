"""Other stations at the endpoints of a forwarder: vehicles over a square area, a door that notes what it gets.

The area is 200 m by 200 m with a pond (no-fly) of 20 m radius in the middle, band 20-90 m; home lies 488 m above the
sea. Vehicles: 1 (ArduCopter) at (50, 50), 2 (PX4) at (150, 50), 3 (ArduCopter, network north) at (50, 150).
"""

from types import SimpleNamespace
from typing import Any

from fastcrc.crc16 import mcrf4xx
from hypothesis import strategies as st

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.forwarder import Endpoint, Forwarder
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Zone
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.mavlink.dialect import layout
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import Frame, StreamCutter, cut_datagram, decode
from tui_gcs.core.mavlink.sources import Address, Source
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.scenario.model import Limits, OperatingArea

HOME_AMSL_M = 488.0
LOCAL = LocalFrame(Origin(47.397742, 8.545594, HOME_AMSL_M))
SQUARE = Rectangle(centre_m=(100.0, 100.0), width_m=200.0, height_m=200.0)
POND = Zone(name="pond", role=Role.NO_FLY, shape=Circle(centre_m=(100.0, 100.0), radius_m=20.0))
QGC: Address = ("192.0.2.7", 14550)
OUT: Address = ("192.0.2.9", 14550)
OWN = 255
TEXT = {"severity": 6, "text": "hello", "id": 0, "chunk_seq": 0}
KEY = {"target_system": 1, "target_component": 1, "secret_key": [7] * 32, "initial_timestamp": 1}


def guard() -> Guard:
    return Guard(Limits(), OperatingArea(SQUARE, 20.0, 90.0), (POND,))


def vehicle(number: int, autopilot: int, place: Vec3, network: str = "", *, armed: bool = True) -> Vehicle:
    """A vehicle that is heard, in the air if armed."""
    path = Path(Source(network, "radio", ("198.51.100.1", 14550)), PathState.USED, 0.0)
    made = Vehicle(number, number % 1000, network, path, autopilot, type=2)
    made.telemetry.position_m = place
    made.telemetry.fix = (0, 0, 0, round(1e3 * (place[2] + HOME_AMSL_M)), round(1e3 * place[2]), 0, 0, 0, 0)
    made.telemetry.armed, made.telemetry.landed_state = armed, 2 if armed else 1
    return made


class RecordingUplink:
    """Takes everything, unless told why not."""

    def __init__(self) -> None:
        self.taken: list[tuple[int, bytes, str, str]] = []
        self.asked: list[tuple[int, str, dict[str, Any]]] = []
        self.why_not = ""

    def foreign(self, vehicle_id: int, raw: bytes, order: Order) -> str:
        if not self.why_not:
            self.taken.append((vehicle_id, raw, order.what, order.by))
        return self.why_not

    def ask(self, vehicle_id: int, name: str, **fields: Any) -> str:
        self.asked.append((vehicle_id, name, fields))
        return ""

    @property
    def whats(self) -> list[str]:
        return [what for _, _, what, _ in self.taken]


def link(name: str, *, partner: Address | None = None, network: str = "", stream: bool = False) -> MemoryLink:
    """A listening endpoint, or with `partner` one that talks to nobody else."""
    made = MemoryLink(spec=LinkSpec(name, scheme="memory", place="", network=network), stream=stream)
    made.partners = [] if partner is None else [partner]
    return made


class Rig:
    """A forwarder between three vehicles and the stations at `links`."""

    def __init__(self, *links: MemoryLink, commands: bool = False) -> None:
        self.clock = VirtualClock()
        self.events = EventLog(self.clock)
        self.uplink = RecordingUplink()
        self.vehicles = {
            1: vehicle(1, 3, (50.0, 50.0, 30.0)),
            2: vehicle(2, 12, (150.0, 50.0, 30.0)),
            1003: vehicle(1003, 3, (50.0, 150.0, 30.0), "north"),
        }
        fleet = SimpleNamespace(vehicles=self.vehicles, frame=LOCAL)
        self.links = links
        endpoints = [Endpoint(each, commands) for each in links]
        networks = {"": 0, "north": 1}
        self.forwarder = Forwarder(endpoints, fleet, self.uplink, guard(), networks, OWN, 190, self.clock, self.events)
        self._encoders: dict[tuple[int, int], Encoder] = {}

    def frame(self, name: str, system: int = 252, component: int = 190, **fields: Any) -> bytes:
        """A frame of `system`/`component`."""
        encoder = self._encoders.setdefault((system, component), Encoder(system, component))
        return encoder.encode(name, **fields)

    def say(self, name: str, *, system: int = 252, component: int = 190, at: Address = QGC, **fields: Any) -> bytes:
        """Another station sends a message to the first endpoint, which is read at once."""
        raw = self.frame(name, system, component, **fields)
        self.links[0].inject(raw, at)
        self.forwarder.tick()
        return raw

    def beat(self, *, system: int = 252, at: Address = QGC, component: int = 190) -> None:
        """Another station's heartbeat."""
        self.say("HEARTBEAT", system=system, component=component, at=at, **heartbeat(6, 8))

    def command(self, command: int, *params: float, to: int = 1, **more: Any) -> bytes:
        """Another station asks with a COMMAND_LONG."""
        return self.say("COMMAND_LONG", **command_long(command, *params, to=to), **more)

    def texts(self) -> list[str]:
        return [event.text for event in self.events.since(0, 2000)]


def heartbeat(vehicle_type: int = 2, autopilot: int = 3) -> dict[str, int]:
    rest = {"base_mode": 81, "custom_mode": 4, "system_status": 4, "mavlink_version": 3}
    return {"type": vehicle_type, "autopilot": autopilot} | rest


def command_long(command: int, *params: float, to: int = 1) -> dict[str, float]:
    values = (*params, *[0.0] * 7)[:7]
    named = {f"param{i}": value for i, value in enumerate(values, 1)}
    return {"target_system": to, "target_component": 1, "command": command, "confirmation": 0} | named


def ack(to: int, component: int = 190) -> dict[str, int]:
    answer = {"command": 400, "result": 0, "progress": 0, "result_param2": 0}
    return answer | {"target_system": to, "target_component": component}


def frames(made: MemoryLink, to: Address | None = None) -> list[Frame]:
    """What was sent on an endpoint (to one partner), in order; forgotten thereby."""
    cutter, found = StreamCutter(), []
    for data, address in made.sent:
        if to is None or address == to:
            found += cutter.feed(data) if made.stream else cut_datagram(data).frames
    made.sent.clear()
    return found


def messages(made: MemoryLink, to: Address | None = None) -> list[Any]:
    """The same, decoded."""
    return [decode(frame) for frame in frames(made, to)]


def unknown_frame(msgid: int = 54321) -> bytes:
    """A frame of a message that no dialect has; nobody can check its CRC."""
    return b"\xfd\x04\x00\x00\x09\x01\x01" + msgid.to_bytes(3, "little") + b"\x01\x02\x03\x04\xaa\xbb"


def hold(flight: Rig, **more: Any) -> bytes:
    """Another station asks vehicle 1 to hold."""
    return flight.command(193, 0, **more)


ANY_MESSAGE = st.sampled_from([11, 20, 23, 39, 44, 45, 47, 66, 73, 75, 76, 110, 119, 0, 1, 33, 69, 84, 86, 256, 253, 7])


@st.composite
def any_frame(draw: st.DrawFn) -> bytes:
    """A frame with a good CRC and anything in it, from anybody."""
    msgid = draw(ANY_MESSAGE)
    known = layout(msgid)
    assert known is not None
    payload = bytearray(draw(st.binary(min_size=1, max_size=known.size + 2)))
    if 0 <= known.target_system_at < len(payload):
        payload[known.target_system_at] = draw(st.sampled_from([0, 1, 2, 3, OWN]))
    if msgid in (75, 76) and len(payload) > 29:
        payload[28:30] = draw(st.integers(0, 600)).to_bytes(2, "little")
    source = draw(st.sampled_from([0, 1, 3, 252, OWN]))
    body = bytes((len(payload), 0, 0, 0, source, 190)) + msgid.to_bytes(3, "little") + payload
    return b"\xfd" + body + mcrf4xx(body + known.extra).to_bytes(2, "little")
