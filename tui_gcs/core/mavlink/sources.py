"""What is remembered of where frames come from: sources, the senders behind them, and the newest frame of each kind."""

from collections.abc import Callable
from typing import Any

from tui_gcs.core.mavlink import checksum, dialect
from tui_gcs.core.mavlink.frames import SIGNED

Address = tuple[str, int] | tuple[str, int, int, int] | str
"""Where bytes came from, and where an answer to that sender goes. Opaque: an IPv6 sender has four parts."""

KEEP, STATE, CALL = 0, 1, 2
"""What is done with a frame beyond keeping it: nothing; its owner reads the newest at the next `settle`; a call now."""
VERSION_1_AFTER_S = 3.0
"""Without a version 2 frame version 1 is believed again: else one forged frame would end a version 1 vehicle."""
MAX_LATE_FRAMES = 16
"""A sequence number at most so far behind the newest is a late frame, not a new count. PX4 swaps neighbours."""
MAX_SWAPPED_FRAMES = 4


class Stream:
    """One sender: (source, system, component). When it was last heard, and what of it was lost."""

    __slots__ = (
        "count_restarts",
        "duplicates",
        "expected_seq",
        "frames",
        "heard_s",
        "lost",
        "source",
        "started",
        "version1_s",
        "version2_s",
    )

    def __init__(self, source: "Source") -> None:
        """Nothing heard yet."""
        self.source = source
        self.expected_seq = -1
        """The sequence number that comes next if nothing is lost."""
        self.frames = 0
        """Of slots that were forgotten; the others are counted there."""
        self.lost = 0
        self.duplicates = 0
        self.count_restarts = 0
        """How often the count began elsewhere: a reboot, or two senders that take turns. No swapped neighbours."""
        self.heard_s = float("-inf")
        self.version1_s = self.version2_s = float("-inf")
        """When it last spoke that MAVLink version, as far as `believes_version_1` looked."""
        self.started = False

    def believes_version_1(self, now: float) -> bool:
        """Whether a version 1 frame is no downgrade. Every frame sets `heard_s`: the fast path need not tell."""
        if self.heard_s > self.version1_s:
            self.version2_s = self.heard_s
        return now - self.version2_s >= VERSION_1_AFTER_S

    def resync(self, seq: int) -> None:
        """The sequence number is not the one that was due: frames lost, a late frame, or a new count."""
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
            self.count_restarts += 1
            self.expected_seq = (seq + 1) & 255  # a reboot, or noise: how many were lost cannot be known


class Slot:
    """The newest frame of one message of one component, as one source sends it."""

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
        """Nothing received yet."""
        self.stream = stream
        self.system, self.component, self.msgid = system, component, msgid
        self.layout = dialect.layout(msgid)
        """None: a message that the dialect does not know."""
        self.residue = checksum.residue(self.layout.extra) if self.layout is not None else 0
        self.raw = b""
        """The whole frame as it came."""
        self.t_s = float("-inf")
        """When it came, station time."""
        self.count = 0
        self.route = KEEP
        self.call: Callable[[Slot, float], object] = _nothing
        """With CALL: called for every frame; False: neither record nor pass it on. With STATE: called at `settle`."""
        self.gate: Callable[[bytes], bool] | None = None
        """Decides before anything else whether a frame is believed (signatures, duplicates)."""
        self.owner: Any = None
        """Whose it is: the fleet's vehicle, or None."""

    @property
    def signed(self) -> bool:
        """Whether the newest frame carries a signature (which nobody may have checked)."""
        return self.raw[:1] == b"\xfd" and bool(self.raw[2] & SIGNED)

    def values(self) -> tuple[Any, ...]:
        """The newest frame's values in wire order; only for known messages."""
        assert self.layout is not None  # noqa: S101 - the caller asked for a known message
        return dialect.payload_values(self.layout, self.raw)

    def fields(self) -> dict[str, Any]:
        """The newest frame's fields by name, text cleaned; empty for an unknown message."""
        return dialect.fields_of(self.layout, self.values()) if self.layout is not None else {}


def _nothing(slot: Slot, now: float) -> bool:
    return True


class Source:
    """Where frames come from: one address on one link. A parser of its own, so junk harms nobody else."""

    __slots__ = (
        "address",
        "bad_crc",
        "bad_crc_by_msgid",
        "frames",
        "gone",
        "heard_s",
        "held",
        "in_sync",
        "junk_bytes",
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
        """Nothing heard yet."""
        self.network, self.link, self.address = network, link, address
        self.slots: dict[bytes, Slot] = {}
        """Of known messages, by bytes 5…9 of a version 2 frame: system, component, message id."""
        self.unknown: dict[bytes, Slot] = {}
        """Of messages that the dialect does not know, whose CRC cannot be checked."""
        self.streams: dict[tuple[int, int], Stream] = {}
        self.frames = 0
        """Of slots that were forgotten; the others are counted there."""
        self.junk_bytes = 0
        self.bad_crc = 0
        self.bad_crc_by_msgid: dict[int, int] = {}
        """Complete frames with a wrong CRC, by message id (a few at most)."""
        self.text_bytes = 0
        """ArduPilot's boot banner: plain text, no error."""
        self.version1_refused = 0
        self.heard_s = float("-inf")
        """When anything last came; of byte streams only."""
        self.held = b""
        """Of a byte stream: the beginning of a frame whose rest has not come."""
        self.in_sync = True
        self.gone = False
        """Its connection was closed, or began and has brought nothing yet."""
        self.vehicle_count = 0
        """How many vehicles are accepted from here: such a source is never forgotten, and others get less work."""
        self.stranger_frames, self.stranger_window_end_s = 0, float("-inf")
        """Frames of no vehicle within the present second, and when that ends."""

    def forget(self, system: int | None = None) -> None:
        """What to do with the frames of `system` (None: of all) is to be looked up anew."""
        for key in [key for key in (*self.slots, *self.unknown) if system is None or key[0] == system]:
            self.drop(key)

    def drop(self, key: bytes) -> Slot:
        """Take one slot out; what it counted is kept."""
        slot = self.slots.pop(key) if key in self.slots else self.unknown.pop(key)
        self.frames += slot.count
        slot.stream.frames += slot.count
        slot.count = 0
        return slot
