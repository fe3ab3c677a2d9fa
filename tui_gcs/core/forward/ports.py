"""Forwarding ports: the stations at one endpoint, the systems behind them, and the limits of what they may send."""

import math
from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any

from tui_gcs.core.base.token_bucket import TokenBucket
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links import Link
from tui_gcs.core.links.closed import ClosedLink
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import Frame, StreamCutter, cut_datagram
from tui_gcs.core.mavlink.sources import Address

# Programs on one forward port: each costs a copy of every frame.
MAX_PARTNERS = 16
MAX_SYSTEMS = 64
"""Systems and components remembered behind one partner."""
SILENT_S = 60.0
"""Partners, and systems behind them, from which nothing valid came for this long are forgotten."""
MAX_FRAMES_PER_S = 50.0
"""Frames of other stations for vehicles, per endpoint; as many at once after a pause."""
MAX_ANSWERS_PER_S, MAX_ANSWERED = 20.0, 64
"""Answers to refused requests per endpoint, and how many different ones are remembered (docs/threats.md B.6-49)."""
FLUSH_S = 0.5
"""A stream that pauses this long within a frame has lost the rest of it."""
PACK_BYTES = 1200
"""Frames that leave together share datagrams up to this size, as PX4 sends them: it fits every network's MTU."""


@dataclass
class Partner:
    """One station, or a router with stations behind it."""

    address: Address
    last_heard_s: float
    """When something valid came from it last; minus infinity: never."""
    stays: bool
    """It is the one partner of a point-to-point link."""
    systems: dict[tuple[int, int], float] = field(default_factory=dict)
    """(system, component) heard from it, and when last."""
    refused: Counter[str] = field(default_factory=Counter)
    """Frames of it that were not passed on, by reason."""
    passed: int = 0
    """Frames of it that reached a vehicle."""
    waiting: list[bytes] = field(default_factory=list)
    waiting_bytes: int = 0

    def is_for(self, system: int, component: int) -> bool:
        """Whether a frame for this system (not 0) and component (0: all of them) is to go to this partner."""
        if component:
            return (system, component) in self.systems
        return any(known == system for known, _ in self.systems)

    def heard(self, system: int, component: int, now: float) -> None:
        """Note a valid frame of this system and component."""
        self.last_heard_s = now
        if (system, component) in self.systems or len(self.systems) < MAX_SYSTEMS:
            self.systems[(system, component)] = now

    def forget(self, now: float) -> None:
        """Drop systems that are silent."""
        for key in [key for key, last_heard_s in self.systems.items() if now - last_heard_s > SILENT_S]:
            del self.systems[key]


@dataclass
class EndpointStream:
    """The frame cutter of one sender's byte stream."""

    last_heard_s: float
    cutter: StreamCutter = field(default_factory=StreamCutter)
    bad_crc: int = 0
    """Wrong CRCs reported so far."""


class Port:
    """An endpoint at work: its partners, streams and limits."""

    def __init__(self, link: Link, commands: bool, encoder: Encoder, now: float) -> None:
        """`encoder` makes our own answers, with this link's own sequence."""
        self.link = link
        self.commands = commands
        self.encoder = encoder
        self._vehicle_encoders: dict[tuple[int, int], Encoder] = {}
        self.ordinary = TokenBucket(MAX_FRAMES_PER_S, MAX_FRAMES_PER_S, now)
        self.stops = TokenBucket(MAX_FRAMES_PER_S, MAX_FRAMES_PER_S, now)
        """Apart from the others, so that no upload keeps a hold waiting."""
        self.answers = TokenBucket(MAX_ANSWERS_PER_S, MAX_ANSWERS_PER_S, now)
        self._answered: dict[Hashable, float] = {}
        """When each refused request was answered last."""
        self.partners: dict[Address, Partner] = {}
        self.reported: dict[str, tuple[float, str]] = {}
        """(when, text) of the last event, by cause."""
        self.refused: Counter[str] = Counter()
        """Frames from here that were not passed on, by reason; also those of partners that are gone, and of others."""
        self.passed = 0
        """Frames from here that reached a vehicle."""
        self.suppressed: Counter[str] = Counter()
        """Events left out since then, by cause."""
        self._streams: dict[Address, EndpointStream] = {}
        self.keep_partners(now)

    @property
    def is_closed(self) -> bool:
        """Whether an operator has closed the endpoint."""
        return self.link.is_closed

    def close(self, by: str) -> None:
        """Close the link for good; partners and counts stay as they are, for operators to see."""
        link, closed = self.link, ClosedLink(self.link.spec, by)
        link.close()
        closed.bytes_in, closed.bytes_out = link.bytes_in, link.bytes_out
        closed.send_refused = link.send_refused
        self.link = closed
        self._streams.clear()
        for partner in self.partners.values():
            partner.waiting.clear()
            partner.waiting_bytes = 0

    def keep_partners(self, now: float) -> None:
        """Keep the link's own partner, if it has one, and forget silent ones."""
        fixed = self.link.partners
        for address in fixed:
            if address not in self.partners:
                self.partners[address] = Partner(address, -math.inf, stays=True)
        for partner in list(self.partners.values()):
            partner.forget(now)
            gone = partner.address not in fixed if partner.stays else now - partner.last_heard_s > SILENT_S
            if gone:
                del self.partners[partner.address]

    def partner(self, address: Address, now: float) -> Partner | None:
        """The partner that sends from `address`: known, or new if there is room. To be called for valid frames only."""
        known = self.known(address)
        if known is None and len(self.partners) < MAX_PARTNERS:
            known = self.partners[address] = Partner(address, now, stays=False)
        return known

    def known(self, address: Address) -> Partner | None:
        """The partner that sends from `address`; None if it is none."""
        # On a serial line or a TCP connection everything comes from the one partner at its other end.
        return self.partners.get(address) or next((p for p in self.partners.values() if p.stays), None)

    def count_refused(self, address: Address, reason: str, frames: int) -> None:
        """Count what came from `address` and was not passed on."""
        self.refused[reason] += frames
        if (partner := self.known(address)) is not None:
            partner.refused[reason] += frames

    def count_passed(self, address: Address) -> None:
        """Count a frame that came from `address` and reached a vehicle."""
        self.passed += 1
        if (partner := self.known(address)) is not None:
            partner.passed += 1

    def cut(self, data: bytes, address: Address, now: float) -> tuple[list[Frame], int]:
        """(good frames, how many with a wrong CRC) in what came from `address`."""
        if not self.link.stream:
            done = cut_datagram(data)
            return done.frames, done.bad_crc
        if not data:  # begins anew
            self._streams.pop(address, None)
            return [], 0
        stream = self._streams.get(address)
        if stream is None:
            if len(self._streams) >= MAX_PARTNERS:
                del self._streams[min(self._streams, key=lambda known: self._streams[known].last_heard_s)]
            stream = self._streams[address] = EndpointStream(now)
        stream.last_heard_s = now
        return self._of_stream(stream, stream.cutter.feed(data))

    def flush(self, now: float) -> list[tuple[list[Frame], int, Address]]:
        """(frames, wrong CRCs, sender) of streams that paused within a frame; forgets streams that ended."""
        flushed = []
        for address, stream in list(self._streams.items()):
            if now - stream.last_heard_s > SILENT_S:
                del self._streams[address]
            elif now - stream.last_heard_s > FLUSH_S:
                flushed.append((*self._of_stream(stream, stream.cutter.flush()), address))
        return flushed

    @staticmethod
    def _of_stream(stream: EndpointStream, frames: list[Frame]) -> tuple[list[Frame], int]:
        bad_crc = stream.cutter.bad_crc - stream.bad_crc
        stream.bad_crc = stream.cutter.bad_crc
        return frames, bad_crc

    def may_answer(self, request: Hashable, every_s: float, now: float) -> bool:
        """Whether a refused request may be answered: the same one every `every_s`, all together not too often."""
        if now - self._answered.get(request, -math.inf) < every_s or not self.answers.has_one(now):
            return False
        self.answers.take()
        if len(self._answered) >= MAX_ANSWERED:
            del self._answered[min(self._answered, key=lambda known: self._answered[known])]
        self._answered[request] = now
        return True

    def send_own(self, to: Address, name: str, **fields: Any) -> None:
        """Answer a station in this station's own name."""
        self.link.send(self.encoder.encode(name, **fields), to)

    def send_as(self, vehicle: Vehicle, to: Address, name: str, *, component: int = 0, **fields: Any) -> None:
        """Answer a station in the name of `vehicle`, or of another `component` of it.

        Only for what is refused or collected here, which the vehicle never gets to see.
        """
        source = (vehicle.system, component or vehicle.component)
        encoder = self._vehicle_encoders.setdefault(source, Encoder(*source))
        self.link.send(encoder.encode(name, **fields), to)

    def put(self, partner: Partner, raw: bytes) -> None:
        """Queue a frame to leave with the next ones."""
        if partner.waiting_bytes + len(raw) > PACK_BYTES:
            self.send_waiting(partner)
        partner.waiting.append(raw)
        partner.waiting_bytes += len(raw)

    def send_waiting(self, partner: Partner) -> None:
        """Send the queued frames of a partner."""
        if partner.waiting:
            self.link.send(b"".join(partner.waiting), partner.address)
            partner.waiting.clear()
            partner.waiting_bytes = 0
