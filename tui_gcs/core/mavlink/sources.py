"""Sources of frames: the addresses, the senders behind them, and the newest frame of each kind."""

from collections.abc import Callable
from typing import Any

from tui_gcs.core.mavlink import checksum, dialect
from tui_gcs.core.mavlink.frames import SIGNED

Address = tuple[str, int] | tuple[str, int, int, int] | str
"""Where bytes came from and where an answer goes. Opaque: an IPv6 address has four parts, a device is a str."""

KEEP, STATE, CALL = 0, 1, 2
"""What is done with a frame beyond keeping it: nothing; its owner reads the newest one at the next `settle`; a call at
once."""
VERSION_1_AFTER_S = 3.0
"""After this long without a version 2 frame version 1 is believed again: else one forged frame would end a version 1
vehicle."""
MAX_LATE_FRAMES = 16
"""A sequence number at most this far behind the newest is a late frame, not a new count."""
MAX_SWAPPED_FRAMES = 4
"""A late frame at most this far behind is no sign of a second sender: PX4 swaps neighbours."""


class Stream:
    """One sender (source, system, component): when it was last heard, and how many of its frames were lost."""

    __slots__ = (
        "count_restarts",
        "duplicates",
        "expected_seq",
        "frames",
        "last_heard_s",
        "lost",
        "source",
        "started",
        "version1_s",
        "version2_s",
    )

    def __init__(self, source: "Source") -> None:
        self.source = source
        self.expected_seq = -1
        """The sequence number of the next frame if none is lost."""
        self.frames = 0
        """Frames of slots that were forgotten; those of the others are counted there."""
        self.lost = 0
        self.duplicates = 0
        self.count_restarts = 0
        """How often the sequence began elsewhere: a reboot, or two senders that alternate. Swapped neighbours do not
        count."""
        self.last_heard_s = float("-inf")
        self.version1_s = self.version2_s = float("-inf")
        """When it last sent that MAVLink version, as far as `believes_version_1` looked."""
        self.started = False

    def believes_version_1(self, now: float) -> bool:
        """Return whether a version 1 frame is no downgrade."""
        # The fast path, which takes version 2 only, sets `last_heard_s` and nothing else.
        if self.last_heard_s > self.version1_s:
            self.version2_s = self.last_heard_s
        return now - self.version2_s >= VERSION_1_AFTER_S

    def resync(self, seq: int) -> None:
        """Take a sequence number other than `expected_seq`: frames were lost, one is late, or a new count began."""
        ahead = (seq - self.expected_seq) & 255
        if not self.started:
            self.started, self.expected_seq = True, (seq + 1) & 255
        elif ahead < 128:
            self.lost += ahead
            self.expected_seq = (seq + 1) & 255
        elif ahead >= 256 - MAX_LATE_FRAMES:
            self.count_restarts += ahead < 256 - MAX_SWAPPED_FRAMES
            if self.lost:
                self.lost -= 1
            else:
                self.duplicates += 1
        else:
            # A reboot, or noise: how many frames were lost cannot be known.
            self.count_restarts += 1
            self.expected_seq = (seq + 1) & 255


class Slot:
    """The newest frame of one message of one component, over one source, and what is done with such frames."""

    __slots__ = (
        "call",
        "component",
        "count",
        "gate",
        "layout",
        "msgid",
        "owner",
        "raw",
        "residue",
        "route",
        "stream",
        "system",
        "t_s",
    )

    def __init__(self, stream: Stream, system: int, component: int, msgid: int) -> None:
        self.stream = stream
        self.system, self.component, self.msgid = system, component, msgid
        self.layout = dialect.layout(msgid)
        """Layout of the message; None if the dialect does not know it."""
        self.residue = checksum.residue(self.layout.extra) if self.layout is not None else 0
        self.raw = b""
        """The whole newest frame; b"" before the first."""
        self.t_s = float("-inf")
        """When it arrived, station time."""
        self.count = 0
        self.route = KEEP
        self.call: Callable[[Slot, float], object] = _nothing
        """With CALL: called for every frame; False means neither record nor pass it on. With STATE: called at `settle`.
        """
        self.gate: Callable[[bytes], bool] | None = None
        """Called first with every frame: whether it is believed (signatures, duplicates)."""
        self.owner: Any = None
        """The vehicle that the frames belong to; None if none."""

    @property
    def signed(self) -> bool:
        """Whether the newest frame carries a signature, checked or not."""
        return self.raw[:1] == b"\xfd" and bool(self.raw[2] & SIGNED)

    def values(self) -> tuple[Any, ...]:
        """Return the newest frame's values in wire order; only for known messages."""
        assert self.layout is not None  # noqa: S101 - the caller asked for a known message
        return dialect.payload_values(self.layout, self.raw)

    def fields(self) -> dict[str, Any]:
        """Return the newest frame's fields by name, text cleaned; {} for an unknown message."""
        return dialect.fields_of(self.layout, self.values()) if self.layout is not None else {}


def _nothing(slot: Slot, now: float) -> bool:
    return True


class Source:
    """One address on one link, with a parser of its own, so that its junk harms no other source."""

    __slots__ = (
        "address",
        "bad_crc",
        "bad_crc_by_msgid",
        "frames",
        "gone",
        "held",
        "in_sync",
        "junk_bytes",
        "keys_by_system",
        "last_heard_s",
        "link",
        "network",
        "slots",
        "stranger_frames",
        "stranger_window_end_s",
        "streams",
        "text_bytes",
        "unknown",
        "vehicle_count",
        "version1_refused",
    )

    def __init__(self, network: str, link: str, address: Address) -> None:
        self.network, self.link, self.address = network, link, address
        self.slots: dict[bytes, Slot] = {}
        """Slots of known messages, by bytes 5…9 of a version 2 frame: system, component, message id."""
        self.unknown: dict[bytes, Slot] = {}
        """Slots of messages that the dialect does not know. Their CRC cannot be checked."""
        self.keys_by_system: dict[int, list[bytes]] = {}
        """Keys of both, by system: a flood fills the tables, and systems are forgotten in the midst of it."""
        self.streams: dict[tuple[int, int], Stream] = {}
        self.frames = 0
        """Frames of slots that were forgotten; those of the others are counted there."""
        self.junk_bytes = 0
        self.bad_crc = 0
        self.bad_crc_by_msgid: dict[int, int] = {}
        """Complete frames with a wrong CRC, by message id (a few ids at most)."""
        self.text_bytes = 0
        """Plain text, as ArduPilot's boot banner: no error."""
        self.version1_refused = 0
        self.last_heard_s = float("-inf")
        """When bytes last came; of byte streams only."""
        self.held = b""
        """The beginning of an unfinished frame of a byte stream."""
        self.in_sync = True
        self.gone = False
        """Its connection was closed, or began and has brought nothing yet."""
        self.vehicle_count = 0
        """How many vehicles are accepted from here. Such a source is never forgotten, and other sources get less work.
        """
        self.stranger_frames, self.stranger_window_end_s = 0, float("-inf")
        """Frames of no vehicle within the present second, and when that ends."""

    def keep(self, key: bytes, slot: Slot) -> None:
        """Put a new slot in."""
        (self.slots if slot.layout is not None else self.unknown)[key] = slot
        self.keys_by_system.setdefault(slot.system, []).append(key)

    def forget(self, system: int | None = None) -> None:
        """Have it looked up anew what is done with the frames of `system`; None for all systems."""
        for one in list(self.keys_by_system) if system is None else [system]:
            for key in self.keys_by_system.pop(one, ()):
                self._count_in(self.slots.pop(key) if key in self.slots else self.unknown.pop(key))

    def keep_only(self, wanted: Callable[[Slot], bool]) -> None:
        """Take the other slots out, and all senders without a slot that belonged to a vehicle."""
        slots = (*self.slots.values(), *self.unknown.values())
        owned = {slot.stream for slot in slots if slot.owner is not None}
        self.streams = {sender: stream for sender, stream in self.streams.items() if stream in owned}
        self.keys_by_system.clear()
        for table in (self.slots, self.unknown):
            # The fast path holds the dict itself.
            before = table.copy()
            table.clear()
            for key, slot in before.items():
                if wanted(slot):
                    self.keep(key, slot)
                else:
                    self._count_in(slot)

    def _count_in(self, slot: Slot) -> None:
        """Keep what a slot that is forgotten has counted."""
        self.frames += slot.count
        slot.stream.frames += slot.count
        slot.count = 0
