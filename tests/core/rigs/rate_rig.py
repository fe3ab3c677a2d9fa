"""Autopilots that obey (or not) what the rate controller requests, without frames: for tests of requests and timing."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.links.spec import parse_link
from tui_gcs.core.mavlink.sources import Slot, Source, Stream
from tui_gcs.core.rates.rate_controller import RateController
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.commands import ACCEPTED, FAILED, CommandService

TICK_S = 0.05
ARDUPILOT, PX4 = 3, 12
SET_INTERVAL, REQUEST_MESSAGE = 511, 512
RADIO, LAN = "serial:radio:57600", "udpin:127.0.0.1:14550"
SATELLITE = "udpout:127.0.0.1:5000"
OFF = -1.0
SIGNED_FRAME = bytes((0xFD, 0, 1))
"""As far as anybody looks: version 2, with the flag "signed"."""


@dataclass
class Pilot:
    """One vehicle and what it really sends, per link."""

    vehicle: Vehicle
    talks: bool = True
    answers: bool = True
    refuses: set[int] = field(default_factory=set)
    interval_s: dict[tuple[str, int], float] = field(default_factory=dict)
    """By (link, message id); interval requests count on the link they came over."""
    due_s: dict[tuple[str, int], float] = field(default_factory=dict)

    def start(self, link: str, message: int, hz: float) -> None:
        """Sends a message at `hz` from now on; 0: not any more."""
        self.interval_s.pop((link, message), None)
        if hz > 0:
            self.interval_s[(link, message)] = 1 / hz

    def hz(self, link: str, message: int) -> float:
        interval_s = self.interval_s.get((link, message))
        return 1 / interval_s if interval_s else 0.0

    def send_due(self, now: float) -> None:
        if not self.talks:
            return
        for path in self.vehicle.used_paths():
            for key, interval_s in self.interval_s.items():
                if key[0] != path.source.link:
                    continue
                while now >= self.due_s.get(key, now) - 1e-9:
                    self.due_s[key] = self.due_s.get(key, now) + interval_s
                    self._say(path, key[1], now)

    def _say(self, path: Path, message: int, now: float) -> None:
        if message not in path.slots:
            stream = next(iter(path.streams))
            path.slots[message] = Slot(stream, self.vehicle.id, 1, message)
        slot = path.slots[message]
        slot.count += 1
        slot.t_s = slot.stream.last_heard_s = now
        if message == 0:
            self.vehicle.telemetry.heartbeat_s = now


@dataclass
class Asked:
    """One COMMAND_LONG that went out."""

    t_s: float
    vehicle: int
    link: str
    command: int
    message: int
    interval_us: float


class Bench:
    """A rate controller, its command service and a fleet; `run` moves time in 50 ms ticks as the station does."""

    def __init__(self, *links: str) -> None:
        self.clock = VirtualClock()
        self.events = EventLog(self.clock)
        self.commands = CommandService(self.clock, self.events)
        self.vehicles: dict[int, Vehicle] = {}
        self.pilots: dict[int, Pilot] = {}
        self.asked: list[Asked] = []
        specs = {spec.name: spec for spec in map(parse_link, links)}
        firmware = CommandEncoder(self, LocalFrame(Origin(lat_deg=52.0, lon_deg=0.0, ground_amsl_m=0.0)))
        fleet: Any = SimpleNamespace(vehicles=self.vehicles)
        self.controller = RateController(fleet, self.commands, firmware, specs, self.clock, self.events)
        self._acks: list[tuple[float, int, int, int]] = []

    def add(self, number: int, link: str, *, autopilot: int = ARDUPILOT, signed: bool = False, **sends: float) -> Pilot:
        """A vehicle is heard: it beats at 1 Hz and sends what `sends` says, e.g. `m30=50`."""
        path = self.way(number, link, signed=signed)
        vehicle = Vehicle(number, number, "", path, autopilot, 2, paths=[path])
        self.vehicles[number] = vehicle
        pilot = self.pilots[number] = Pilot(vehicle)
        pilot.start(link, 0, 1.0)
        for name, hz in sends.items():
            pilot.start(link, int(name[1:]), hz)
        return pilot

    def way(self, number: int, link: str, *, signed: bool = False) -> Path:
        """A path of a vehicle over a link."""
        source = Source("", link, ("vehicle", number))
        stream = Stream(source)
        path = Path(source, PathState.USED, self.clock.now(), [stream], stream)
        if signed:
            path.slots[0] = Slot(stream, number, 1, 0)
            path.slots[0].raw = SIGNED_FRAME
        return path

    def fleet(self, n: int, link: str, **how: Any) -> "Bench":
        """Vehicles 1…n on a link."""
        for number in range(1, n + 1):
            self.add(number, link, **how)
        return self

    def run(self, seconds: float) -> "Bench":
        for _ in range(round(seconds / TICK_S)):
            self.clock.advance(TICK_S)
            now = self.clock.now()
            for pilot in self.pilots.values():
                pilot.send_due(now)
            due, self._acks = [a for a in self._acks if a[0] <= now], [a for a in self._acks if a[0] > now]
            for _, number, command, result in due:
                self.commands.on_ack(self.vehicles[number], command, result)
            self.controller.tick()
            self.commands.tick(self.vehicles)
        return self

    def ask(self, vehicle_id: int, name: str, **fields: Any) -> None:
        """As `Uplink.ask`: the command reaches the vehicle, which answers within a tick."""
        assert name == "COMMAND_LONG"
        pilot = self.pilots[vehicle_id]
        command, message, interval_us = fields["command"], int(fields["param1"]), fields["param2"]
        link, now = pilot.vehicle.link, self.clock.now()
        self.asked.append(Asked(now, vehicle_id, link, command, message, interval_us))
        if not (pilot.talks and pilot.answers):
            return
        refused = message in pilot.refuses
        self._acks.append((now + TICK_S, vehicle_id, command, FAILED if refused else ACCEPTED))
        if refused:
            return
        if command == REQUEST_MESSAGE:
            pilot.vehicle.identity.identified = True
        else:
            pilot.start(link, message, 1e6 / interval_us if interval_us > 0 else 0)

    def intervals(self, number: int = 1, since_s: float = 0.0) -> list[tuple[int, float]]:
        """(message, interval in µs) asked of a vehicle, in order."""
        return [
            (a.message, a.interval_us)
            for a in self.asked
            if a.vehicle == number and a.command == SET_INTERVAL and a.t_s > since_s
        ]

    def times(self, message: int, number: int = 1) -> list[float]:
        """When a vehicle was asked for a message."""
        found = [a for a in self.asked if a.vehicle == number and a.command == SET_INTERVAL and a.message == message]
        return [round(a.t_s, 2) for a in found]

    def sends(self, link: str, number: int = 1) -> dict[int, float]:
        """What a vehicle really sends on a link, Hz by message id, its heartbeat apart."""
        pilot = self.pilots[number]
        return {m: round(pilot.hz(name, m), 3) for name, m in pilot.interval_s if name == link and m != 0}

    def hear_radio(self, txbuf: int, link: str = RADIO, **other: int) -> None:
        """The link's radio reports."""
        rest = {"rssi": 190, "remrssi": 180, "noise": 40, "remnoise": 45, "rxerrors": 0, "fixed": 0}
        self.controller.radio_status(link, rest | {"txbuf": txbuf} | other)

    def texts(self) -> list[str]:
        return [event.text for event in self.events.since(0)]
