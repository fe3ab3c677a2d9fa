"""The hot path: bytes from links to the newest frame of each message, checked once, decoded only where it is used.

A fleet of 250 sends some 9,000 frames a second, so everything that happens to each of them is in one loop here, and
everything that is rare (version 1, unknown ids, junk, first frame of a kind) is in functions beside it. The owner of a
frame is looked up once per kind: a `Slot` per (source, system, component, message id) holds what is done with it.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from typing import Protocol

from fastcrc.crc16 import mcrf4xx

from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.mavlink import checksum, dialect
from tui_gcs.core.mavlink.frames import MAGIC_V1, MAGIC_V2, SIGNED, Frame, FrameScan, is_text, scan_step
from tui_gcs.core.mavlink.sources import CALL, KEEP, STATE, Address, Slot, Source, Stream

_MAGICS = (MAGIC_V2, MAGIC_V1)
NEXT_SEQ = (*range(1, 256), 0)
"""The sequence number after each."""
KIND = slice(5, 10)
"""System, component and message id in a version 2 frame."""
CHECKED = slice(None, -13)
"""The part of a signed frame that the CRC ends: all before the signature."""
MAX_SLOTS = 32768
"""Per network: 255 vehicles with about 100 messages each are 25,000. More is a flood, of at most 30 MB."""
FULL_RECHECK_S = 1.0
"""A full table is searched for room this often: the search costs more than a frame."""
MAX_SOURCES = 1024
"""Per network. Addresses of accepted vehicles are never forgotten."""
MAX_FAILED_STARTS = 32
"""Places in a datagram where a frame might begin and none does; then the rest is junk. Without this limit a flood of
datagrams that are nothing but such places would cost 1 ms each (1,500 bytes). Noise in a frame makes one or two."""
MAX_STRANGER_DATAGRAM_BYTES = 8192
"""For sources without a vehicle: routers and PX4 pack about 1,400 bytes; 64 KiB of 8-byte frames are a flood."""
MAX_STRANGER_FRAMES = 40
"""Frames read per datagram of a source without a vehicle (our simulator sends one, PX4 a dozen); the rest is junk."""
MAX_STRANGER_STEPS = 256
"""The same per piece of a byte stream, which may have been queued for a while."""
MAX_STEPS = 1024
"""Steps off the fast path (junk, version 1, unknown ids) per piece, from a source with a vehicle: 16 KiB of real
frames."""
STRANGER_FRAMES_PER_S, STRANGER_FRAMES_PER_NETWORK_PER_S = 10, 500
"""Frames of sources without a vehicle that are recorded and passed on, per source and in all."""
PIECE_BYTES = 2048
"""Longer pieces are cut in slices of this size, because each cut copies what follows."""
MAX_HELD_BYTES = 4096
"""Bytes kept of an unfinished frame on a byte stream (docs/threats.md B.6-8); a whole frame has at most 280."""
FLUSH_S = 0.5
"""A byte stream that is silent for this long in the middle of a frame does not complete it (docs/threats.md B.6-9)."""
DIALECT_HINT_AFTER = 20
"""Whole frames of one message with a wrong CRC that are reported as a differing dialect: noise is spread
(docs/threats.md B.6-13)."""
# A forger may use any message id: only so many are counted one by one.
MAX_COUNTED_IDS = 64

SlotsAt = dict[Address, dict[bytes, Slot]]
Batch = Sequence[tuple[bytes, Address]]
OddPiece = Callable[[bytes, int, Address], None]
"""Called with a piece that is not just good frames of known kinds, how far those reach, and its sender."""


class FrameRouter(Protocol):
    """The part that knows the owners of frames: the vehicle registry."""

    def place(self, slot: Slot, source: Source) -> None:
        """Set what is done with a slot's frames: `route`, `call`, `gate`, `owner`."""
        ...

    def must_keep(self, slot: Slot) -> bool:
        """Return whether a slot is kept when the table is full."""
        ...

    def report_oddity(self, source: Source, what: str) -> None:
        """Report what must not pass silently: "downgrade", "dialect differs: NAME", "table full"."""
        ...


class Intake:
    """All frames of one network, that is of one space of system ids."""

    def __init__(self, network: str, owner: FrameRouter) -> None:
        """Ask `owner` what is done with each kind of frame."""
        self.network = network
        self.sources: dict[tuple[str, Address], Source] = {}
        self._slots_at: defaultdict[str, dict[Address, dict[bytes, Slot]]] = defaultdict(dict)
        """Slots of sources with vehicles, by link and address: the one look-up that every datagram costs."""
        self._received: Counter[str] = Counter()
        self.dropped = RejectionCounter()
        self.past: Counter[str] = Counter()
        """Frames, junk bytes and so on of sources that were forgotten."""
        self._owner = owner
        self._dirty: list[Slot] = []
        self._slots = 0
        self._full_until_s = float("-inf")
        self._holding: set[Source] = set()
        self._next_demotion_s = float("-inf")
        self._stranger_frames, self._stranger_window_end_s = 0, float("-inf")
        """Frames of all sources without a vehicle within the present second, and when that ends."""

    def datagrams(self, link: str, batch: list[tuple[bytes, Address]], now: float) -> list[bytes]:
        """Take datagrams, each with its whole frames. Returns the accepted frames in order, as they came."""
        taken: list[bytes] = []

        def odd(data: bytes, at: int, address: Address) -> None:
            self._take_rest(data, at, self.source(link, address), now, taken)

        self._run(self._slots_at[link], batch, now, taken, odd)
        self._received[link] += len(batch)
        return taken

    def chunks(self, link: str, batch: list[tuple[bytes, Address]], now: float) -> list[bytes]:
        """Take pieces of byte streams (TCP, serial line). An empty piece means that the stream ends or begins anew."""
        taken: list[bytes] = []
        for data, address in batch:
            source = self.sources.get((link, address)) or self.source(link, address)
            source.gone = not data
            if not data:
                self._restart(source)
                continue
            self._received[link] += 1
            source.last_heard_s = now
            self._stream(source, source.held + data, now, taken, final=False)
        return taken

    def settle(self) -> None:
        """Hand the newest frame of everything that changed to its owner."""
        dirty = self._dirty.copy()
        self._dirty.clear()
        for slot in dirty:
            # Placed anew meanwhile: its call has had a newer frame.
            if slot.route == CALL:
                continue
            slot.route = STATE
            call = slot.call
            # `slot.call` is an attribute that holds a function: looking up and calling in one expression is slower.
            call(slot, slot.t_s)

    def tick(self, now: float) -> None:
        """Give up on byte streams that fell silent in the middle of a frame."""
        if now >= self._next_demotion_s:
            self._next_demotion_s = now + 1.0
            self._demote()
        for source in [s for s in self._holding if now - s.last_heard_s > FLUSH_S]:
            self._stream(source, source.held, now, [], final=True)

    def source(self, link: str, address: Address) -> Source:
        """Return the source of that address, made if need be."""
        found = self.sources.get((link, address))
        if found is None:
            if len(self.sources) >= MAX_SOURCES:
                self._forget_a_source()
            found = self.sources[(link, address)] = Source(self.network, link, address)
        return found

    def counts(self, link: str) -> Counter[str]:
        """Return what came in on a link: datagrams (pieces of a stream), frames, junk bytes, bad CRCs, text bytes."""
        total = Counter({key.removeprefix(f"{link} "): n for key, n in self.past.items() if key.startswith(f"{link} ")})
        for source in self.sources.values():
            if source.link == link:
                for what, count in _counted(source):
                    if count:
                        total[what] += count
        total["datagrams"] = self._received[link]
        return total

    def _run(self, slots_at: SlotsAt, batch: Batch, now: float, taken: list[bytes], odd: OddPiece) -> None:
        """Take good version 2 frames of known kinds from the front of each piece; `odd` gets the pieces with more.

        Written for speed, as it runs for every frame: no calls but the CRC's, no copy where a datagram is one frame.
        """
        take, dirty, next_seq, v2, kind = taken.append, self._dirty.append, NEXT_SEQ, MAGIC_V2, KIND
        # Locals are faster than globals and attributes, in a loop that runs for every frame.
        crc, begin, low, high, checked_part = mcrf4xx, checksum.BEFORE_MAGIC, checksum.LOW, checksum.HIGH, CHECKED
        for data, address in batch:
            slots = slots_at.get(address)
            if slots is None:
                odd(data, 0, address)
                continue
            rest: bytes | None = data
            while rest is not None:
                try:
                    slot = slots[rest[kind]]
                except KeyError:  # or too short
                    break
                flags = rest[2]
                if not flags:
                    end = rest[1] + 12  # 10 bytes of head, 2 of CRC
                elif flags == SIGNED:
                    end = rest[1] + 25  # 13 more of signature
                else:
                    break
                if end == len(rest):
                    raw, rest = rest, None
                elif end < len(rest) <= PIECE_BYTES:
                    raw = rest[:end]
                    rest = rest[end:]
                else:
                    break
                checked = raw[checked_part] if flags else raw
                if crc(checked, begin) != low[checked[-2]] ^ high[checked[-1]] ^ slot.residue or raw[0] != v2:
                    rest = raw + (rest or b"")
                    break
                if slot.gate is None or slot.gate(raw):
                    stream = slot.stream
                    seq = raw[4]
                    if seq == stream.expected_seq:
                        stream.expected_seq = next_seq[seq]
                    else:
                        stream.resync(seq)
                    stream.last_heard_s = slot.t_s = now
                    slot.raw = raw
                    slot.count += 1
                    if not slot.route:
                        take(raw)
                    elif slot.route == STATE:
                        # Until it is settled, once in the list is enough.
                        slot.route = KEEP
                        dirty(slot)
                        take(raw)
                    else:
                        call = slot.call
                        if call(slot, now) is not False:
                            take(raw)
            if rest:
                odd(data, len(data) - len(rest), address)

    def _take_known(self, data: bytes, slots: dict[bytes, Slot], now: float, taken: list[bytes]) -> int:
        """Take the good frames of known kinds at the front of `data` and return how far they reach."""
        reached = [len(data)]
        self._run({"": slots}, [(data, "")], now, taken, lambda _data, at, _address: reached.append(at))
        return reached[-1]

    def _take_rest(self, data: bytes, at: int, source: Source, now: float, taken: list[bytes]) -> None:
        """Take a datagram from `at` on, where something else than a good frame of a known kind begins."""
        size = len(data)
        if not size:
            return
        if source.vehicle_count:
            self._slots_at[source.link][source.address] = source.slots
        elif size > MAX_STRANGER_DATAGRAM_BYTES:
            source.junk_bytes += size
            return
        # No good frame ever came from there, so that its junk is not searched for one.
        if not source.streams and data[0] not in _MAGICS:
            if is_text(data):
                source.text_bytes += size
            else:
                source.junk_bytes += size
            return
        done, tries, steps = FrameScan(used=at), 0, 0
        while done.used < size:
            if self._take_ahead(data, done, source, now, taken):
                continue
            scan_step(data, done, final=True)
            self._take_scanned(done, source, now, taken)
            steps += 1
            tries += not done.in_sync
            if tries >= MAX_FAILED_STARTS or steps >= (MAX_STEPS if source.vehicle_count else MAX_STRANGER_FRAMES):
                done.junk_bytes += size - done.used
                break
        if at == 0 and done.junk_bytes and not done.good and is_text(data):
            source.text_bytes += size
        else:
            source.junk_bytes += done.junk_bytes

    def _stream(self, source: Source, data: bytes, now: float, taken: list[bytes], *, final: bool) -> None:
        """Take bytes of a stream, with what was held back before them."""
        size = len(data)
        done, steps = FrameScan(in_sync=source.in_sync), 0
        while done.used < size:
            if self._take_ahead(data, done, source, now, taken):
                continue
            before = done.used
            scan_step(data, done, final=final)
            self._take_scanned(done, source, now, taken)
            if done.used == before:
                break
            steps += 1
            if steps >= (MAX_STEPS if source.vehicle_count else MAX_STRANGER_STEPS):
                done.junk_bytes += size - done.used
                done.used, done.in_sync = size, False
        rest = data[done.used :]
        if len(rest) > MAX_HELD_BYTES:
            done.junk_bytes += len(rest)
            rest = b""
        source.held, source.in_sync = rest, done.in_sync
        source.junk_bytes += done.junk_bytes
        if rest:
            self._holding.add(source)
        else:
            self._holding.discard(source)

    def _take_ahead(self, data: bytes, done: FrameScan, source: Source, now: float, taken: list[bytes]) -> bool:
        """Take good frames of known kinds by the fast path, if the source has a vehicle; return whether any came."""
        if not (done.in_sync and source.vehicle_count):
            return False
        ahead = self._take_known(data[done.used : done.used + PIECE_BYTES], source.slots, now, taken)
        done.used += ahead
        return ahead > 0

    def _take_scanned(self, done: FrameScan, source: Source, now: float, taken: list[bytes]) -> None:
        """Take what one `scan_step` found, or count what it refused."""
        if done.bad_crc:
            done.bad_crc = 0
            self._bad_crc(source, done.bad_msgid)
        for frame in done.frames:
            if self._take(frame, source, now):
                taken.append(frame.raw)
        done.frames.clear()

    def _take(self, frame: Frame, source: Source, now: float) -> bool:
        """Take a good frame off the fast path and return whether it is accepted."""
        # The same five bytes as `KIND` cuts out of a version 2 frame.
        key = bytes((frame.system, frame.component)) + frame.msgid.to_bytes(3, "little")
        slot = source.slots.get(key) or source.unknown.get(key)
        if slot is None:
            slot = self._new_slot(key, frame, source, now)
            if slot is None:
                return False
        stream = slot.stream
        if frame.version == 1 and not stream.believes_version_1(now):
            source.version1_refused += 1
            self.dropped.count("MAVLink 1 after 2 (downgrade)", slot.owner.id if slot.owner is not None else None)
            self._owner.report_oddity(source, "downgrade")
            return False
        if slot.gate is not None and not slot.gate(frame.raw):
            return False
        if frame.version == 1:
            stream.version1_s = now
        if frame.seq == stream.expected_seq:
            stream.expected_seq = (frame.seq + 1) & 255
        else:
            stream.resync(frame.seq)
        stream.last_heard_s = slot.t_s = now
        slot.raw = frame.raw
        slot.count += 1
        if slot.layout is None:
            self.dropped["unknown message id"] += 1
        if slot.route == STATE:
            slot.route = KEEP
            self._dirty.append(slot)
        elif slot.route == CALL and slot.call(slot, now) is False:
            return False
        return source.vehicle_count > 0 or slot.owner is not None or self._has_stranger_room(source, now)

    def _has_stranger_room(self, source: Source, now: float) -> bool:
        """Return whether one more frame without a vehicle is recorded and passed on: a flood would fill the disk."""
        if now >= source.stranger_window_end_s:
            source.stranger_frames, source.stranger_window_end_s = 0, now + 1.0
        if now >= self._stranger_window_end_s:
            self._stranger_frames, self._stranger_window_end_s = 0, now + 1.0
        source.stranger_frames += 1
        self._stranger_frames += 1
        if (
            source.stranger_frames <= STRANGER_FRAMES_PER_S
            and self._stranger_frames <= STRANGER_FRAMES_PER_NETWORK_PER_S
        ):
            return True
        self.dropped["from no known vehicle, more than is recorded"] += 1
        return False

    def _demote(self) -> None:
        """Take sources without vehicles off the fast path."""
        for source in self.sources.values():
            if not source.vehicle_count and source.address in self._slots_at[source.link]:
                del self._slots_at[source.link][source.address]

    def _new_slot(self, key: bytes, frame: Frame, source: Source, now: float) -> Slot | None:
        if self._slots >= MAX_SLOTS and not self._make_room(now):
            self.dropped["message table full"] += 1
            self._owner.report_oddity(source, "table full")
            return None
        stream = source.streams.get((frame.system, frame.component))
        if stream is None:
            stream = source.streams[(frame.system, frame.component)] = Stream(source)
        slot = Slot(stream, frame.system, frame.component, frame.msgid)
        self._owner.place(slot, source)
        source.keep(key, slot)
        self._slots += 1
        return slot

    def _bad_crc(self, source: Source, msgid: int) -> None:
        source.bad_crc += 1
        if not dialect.is_known(msgid):
            return
        times = source.bad_crc_by_msgid.get(msgid, 0) + 1
        # Forged frames of many ids must not grow the table.
        if times > 1 or len(source.bad_crc_by_msgid) < MAX_COUNTED_IDS:
            source.bad_crc_by_msgid[msgid] = times
        if times % DIALECT_HINT_AFTER == 0:
            self._owner.report_oddity(source, f"dialect differs: {dialect.label(msgid)}")

    def _restart(self, source: Source) -> None:
        source.junk_bytes += len(source.held)
        source.held, source.in_sync = b"", True
        self._holding.discard(source)
        # A client that reconnects starts its sequence numbers anew.
        for stream in source.streams.values():
            stream.started = False
            # Nothing is known of the new connection yet: version 1 is no downgrade there.
            stream.version1_s, stream.version2_s = stream.last_heard_s, float("-inf")

    def _make_room(self, now: float) -> bool:
        """Return whether there is room for a slot, after dropping those that need not be kept."""
        if now < self._full_until_s:
            return False
        self._count_slots()
        if self._slots < MAX_SLOTS:
            return True
        for source in self.sources.values():
            source.keep_only(self._owner.must_keep)
        self._count_slots()
        # The table would be full again at once, and each search costs more than a frame.
        if self._slots >= MAX_SLOTS // 2:
            self._full_until_s = now + FULL_RECHECK_S
        return self._slots < MAX_SLOTS

    def _count_slots(self) -> None:
        self._slots = sum(len(source.slots) + len(source.unknown) for source in self.sources.values())

    def _forget_a_source(self) -> None:
        """Make room for an address: the first source without a vehicle is forgotten.

        Cheap, because addresses can be forged.
        """
        # In order of age: a dict keeps the order in which addresses were first heard.
        for _ in range(len(self.sources)):
            key = next(iter(self.sources))
            source = self.sources.pop(key)
            if source.vehicle_count:
                # Moved to the end, so that the next search need not pass it.
                self.sources[key] = source
                continue
            self._holding.discard(source)
            self._slots_at[source.link].pop(source.address, None)
            for name, count in _counted(source):
                self.past[f"{source.link} {name}"] += count
            self._slots -= len(source.slots) + len(source.unknown)
            return


def _counted(source: Source) -> tuple[tuple[str, int], ...]:
    frames = source.frames
    for kinds in (source.slots, source.unknown):
        frames += sum([slot.count for slot in kinds.values()])
    return (
        ("frames", frames),
        ("junk bytes", source.junk_bytes),
        ("bad CRC", source.bad_crc),
        ("text bytes", source.text_bytes),
    )
