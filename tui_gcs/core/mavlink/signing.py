"""MAVLink 2 signatures: making them, checking them, and the clocks and memories that keep replays out.

Rules: https://mavlink.io/en/guide/message_signing.html. Behind the CRC of a signed frame stand a link id, a 48-bit time
in units of 10 µs since 2015 and the first 6 bytes of SHA-256(key + everything before). Nothing here does I/O or reads a
clock. Frames given to `SignatureVerifier`, `signature_matches`, `signed_by` and `strip_signature` are whole frames
with a right length and CRC (`mavlink/frames.py`).
"""

import hashlib
from dataclasses import dataclass
from enum import Enum, StrEnum
from hmac import compare_digest
from typing import Any

from fastcrc.crc16 import mcrf4xx

from tui_gcs.core.mavlink import dialect

KEY_BYTES = 32
ZERO_KEY = bytes(KEY_BYTES)
"""PX4 signs with it while it has no key: it proves nothing."""
TICKS_PER_S = 100_000
EPOCH_S = 1_420_070_400
"""2015-01-01 00:00 UTC in Unix seconds: time 0 of signatures."""
MAX_TIMESTAMP = 2**48 - 1
MAX_NEW_STREAM_AGE_S = 60.0
"""A stream that was never heard may be this far behind our clock; a known stream only has to grow."""
MAX_AHEAD_S = 300.0
"""A stream that leaps farther ahead of our clock is not believed (docs/threats.md B.6-32)."""
RESTART_MARGIN_S = 60.0
"""After a restart our time is at least this far beyond the last one stored (ArduPilot does the same)."""
MAX_PULL_AHEAD_S = 60.0
"""Received times pull our time at most this far beyond the wall clock (docs/threats.md B.6-33)."""
STORE_EVERY_S = 1.0
"""Streams are to be stored this often."""
RESTORE_MARGIN_S = 1.5
"""What may have been accepted since streams were last stored: one storing interval and a late one."""
MAX_STREAMS = 64
"""Streams per key holder: 4 components on 16 links; autopilots keep 16 in all."""
MAY_BE_UNSIGNED = frozenset({109})
"""RADIO_STATUS: SiK radios insert it and cannot sign. No other message is believed unsigned once there is a key."""
# Message id. It carries the key itself, so it is never logged and never forwarded.
SETUP_SIGNING = 256

# Only MAVLink 2 can be signed; bit 0 of the incompatibility flags marks it.
_MAGIC = 0xFD
_SIGNED = 0x01
_HEADER_BYTES, _CRC_BYTES, _SIGNATURE_BYTES = 10, 2, 13
_FINGERPRINT_PREFIX = b"tui-gcs signing key fingerprint\0"
_KEY_IN_SETUP_SIGNING = slice(10, 10 + KEY_BYTES)  # of the payload, behind initial_timestamp and the target


class SigningError(ValueError):
    """A frame or key cannot be used for signing: one line, without secrets."""


@dataclass(frozen=True, repr=False, slots=True)
class SigningKey:
    """A signing key with the name that the operator knows it by. Its repr shows the fingerprint, never the key."""

    name: str
    secret: bytes

    def __post_init__(self) -> None:
        if len(self.secret) != KEY_BYTES:
            raise SigningError(f"key {self.name}: must be {KEY_BYTES} bytes, not {len(self.secret)}")

    @property
    def fingerprint(self) -> str:
        """8 hex digits, for comparing keys by eye."""
        return hashlib.sha256(_FINGERPRINT_PREFIX + self.secret).hexdigest()[:8]

    def __repr__(self) -> str:
        return f"Key({self.name!r}, {self.fingerprint})"


def ticks(unix_s: float) -> int:
    """Return the signature time at `unix_s`: 10 µs since 2015.

    0 if no clock can mean that: before 2015, after 2104, NaN.
    """
    if not EPOCH_S < unix_s < EPOCH_S + MAX_TIMESTAMP / TICKS_PER_S:
        return 0
    return int((unix_s - EPOCH_S) * TICKS_PER_S)


def timestamp(raw: bytes) -> int:
    """Return the time in the signature of a signed frame, 10 µs ticks."""
    return int.from_bytes(raw[-12:-6], "little")


def sign(raw: bytes, secret: bytes, link_id: int, timestamp: int) -> bytes:
    """Return the unsigned MAVLink 2 frame `raw` with a signature and a new CRC, because that covers the signed flag.

    Raises:
        SigningError: `raw` is MAVLink 1, signed already, torn, or of a message that the dialect does not know.
    """
    if raw[0] != _MAGIC or raw[2] & _SIGNED:
        raise SigningError("only unsigned MAVLink 2 frames can be signed")
    framed = _framed(raw, raw[2] | _SIGNED)
    if framed is None or len(raw) != len(framed):
        raise SigningError("this frame is torn or of an unknown message: it cannot be signed")
    signed = framed + bytes((link_id,)) + timestamp.to_bytes(6, "little")
    return signed + hashlib.sha256(secret + signed).digest()[:6]


def signature_matches(raw: bytes, secret: bytes) -> bool:
    """Return whether the frame ends in a signature by `secret`, whatever its age."""
    return compare_digest(hashlib.sha256(secret + raw[:-6]).digest()[:6], raw[-6:])


class SignedBy(StrEnum):
    """What a signed frame proves of a sender that has no key with us."""

    ZERO_KEY = "not verified"
    """Signed with the zero key, as PX4 does while signing is off: as good as unsigned."""
    UNKNOWN_KEY = "unknown key"


def signed_by(raw: bytes) -> SignedBy:
    """Classify a signed frame of a sender without a key."""
    return SignedBy.ZERO_KEY if signature_matches(raw, ZERO_KEY) else SignedBy.UNKNOWN_KEY


def strip_signature(raw: bytes) -> bytes:
    """Return the frame as it would be unsigned: flag cleared, new CRC, 13 bytes off.

    Unsigned frames, and those of messages that the dialect does not know (their CRC cannot be made), stay as they are.
    """
    if raw[0] != _MAGIC or not raw[2] & _SIGNED:
        return raw
    return _framed(raw, raw[2] & ~_SIGNED) or raw


def for_log(raw: bytes) -> bytes:
    """Return the frame as logs and other stations may see it: unsigned, and SETUP_SIGNING with its key masked."""
    raw = strip_signature(raw)
    if raw[0] != _MAGIC or int.from_bytes(raw[7:10], "little") != SETUP_SIGNING:
        return raw
    payload = bytearray(raw[_HEADER_BYTES : _HEADER_BYTES + raw[1]].ljust(_KEY_IN_SETUP_SIGNING.stop, b"\0"))
    payload[_KEY_IN_SETUP_SIGNING] = b"\xff" * KEY_BYTES
    masked = bytes((_MAGIC, len(payload))) + raw[2:_HEADER_BYTES] + payload
    # Never the key, not even if the dialect has lost the message.
    return _framed(masked, masked[2]) or b""


def _framed(raw: bytes, flags: int) -> bytes | None:
    """Return header and payload of `raw` with other incompatibility flags and CRC; None if the message is unknown."""
    extra = dialect.crc_extra(raw[7] | raw[8] << 8 | raw[9] << 16)
    if extra is None:
        return None
    body = raw[1:2] + bytes((flags,)) + raw[3 : _HEADER_BYTES + raw[1]]
    crc: int = mcrf4xx(body + extra)
    return b"\xfd" + body + crc.to_bytes(2, "little")


class SigningClock:
    """The time we sign with: it grows with every frame, follows the wall clock and never goes back.

    One per key holder, so that a vehicle whose clock is ahead pulls only the time we use with that vehicle.
    """

    def __init__(self, wall_s: float, now_s: float, stored: int = 0) -> None:
        """Start at `wall_s` (Unix) and `now_s` (monotonic) seconds; `stored` is what `last` was before a restart."""
        self._offset_s = float("-inf")
        self.last = max(self._wall_ticks(wall_s, now_s), stored + int(RESTART_MARGIN_S * TICKS_PER_S) if stored else 0)
        """The newest time used or received, to be stored."""

    def next(self, wall_s: float, now_s: float) -> int:
        """Return the timestamp for one more frame."""
        self.last = max(self.last + 1, self._wall_ticks(wall_s, now_s))
        return self.last

    def follow(self, timestamp: int, wall_s: float, now_s: float) -> None:
        """Follow the time of a GOOD frame: ours must not stay behind, but goes no farther than a minute ahead."""
        limit = self._wall_ticks(wall_s, now_s) + int(MAX_PULL_AHEAD_S * TICKS_PER_S)
        self.last = max(self.last, min(timestamp, limit))

    def _wall_ticks(self, wall_s: float, now_s: float) -> int:
        """Return the wall clock as it would be had it never been set back; 0 while it is not set at all."""
        if ticks(wall_s):
            self._offset_s = max(self._offset_s, wall_s - now_s)
        return ticks(now_s + self._offset_s)


class SignatureResult(Enum):
    """Result of a check. All but BAD_SIGNATURE come from the key holder, or from a recording of it."""

    GOOD = "good"
    BAD_SIGNATURE = "bad signature"
    OLD = "old"
    """The frame is replayed, or not newer than what its stream has brought."""
    TOO_OLD_NEW_STREAM = "too old for a new stream"
    AHEAD = "ahead of our clock"


# Looking up a member of an Enum would cost as much as the rest of a check.
_GOOD, _BAD_SIGNATURE, _OLD = SignatureResult.GOOD, SignatureResult.BAD_SIGNATURE, SignatureResult.OLD
_AHEAD_TICKS = int(MAX_AHEAD_S * TICKS_PER_S)
_NEW_STREAM_TICKS = int(MAX_NEW_STREAM_AGE_S * TICKS_PER_S)


class SignatureVerifier:
    """Checks the frames of one key holder (a vehicle) and keeps how far each of its streams has come.

    The hash is checked first: frames that did not come from the key holder change nothing (docs/threats.md A.2). A
    stream is a (system, component, link id) and exists from its first good frame on. When there are too many, the one
    with the oldest time goes, and no new stream may be older than it was: what was forgotten cannot be replayed.
    """

    def __init__(self, secret: bytes, max_streams: int = MAX_STREAMS) -> None:
        """Check frames signed with `secret`, which is not kept in a readable form."""
        self._keyed = hashlib.sha256(secret)
        self._max_streams = max_streams
        self._streams: dict[int, int] = {}
        """Newest time accepted, by stream number."""
        self._floor = 0
        """Newest time of the streams that were forgotten."""
        self._ahead: list[tuple[int, int, int]] = []
        """(stream, first and last time) of what was refused as AHEAD: when that time comes, these frames are
        recordings."""

    def check(self, raw: bytes, now_wall_s: float) -> SignatureResult:
        """Check a signed frame at `now_wall_s` (Unix seconds by our clock). Only GOOD ones may be used."""
        # The hash state with the key is copied, which is faster than hashing the key again for every frame.
        keyed = self._keyed.copy()
        keyed.update(raw[:-6])
        # compare_digest takes the same time for every forgery.
        if not compare_digest(keyed.digest()[:6], raw[-6:]):
            return _BAD_SIGNATURE
        tail = int.from_bytes(raw[-13:-6], "little")
        time, stream = tail >> 8, raw[5] << 16 | raw[6] << 8 | tail & 0xFF
        newest = self._streams.get(stream)
        if newest is None or time - newest > _AHEAD_TICKS or self._ahead:
            result = self._check_rare(stream, time, newest, ticks(now_wall_s))
            if result is not _GOOD:
                return result
        elif time <= newest:
            return _OLD
        self._streams[stream] = time
        return _GOOD

    def streams(self) -> dict[str, Any]:
        """Return what `restore` needs after a restart: text keys and whole numbers, no secret."""
        return {
            "newest": {_name(stream): time for stream, time in self._streams.items()},
            "ahead": [[_name(stream), first, last] for stream, first, last in self._ahead],
            "floor": self._floor,
        }

    def restore(self, streams: dict[str, Any]) -> None:
        """Continue from what `streams` returned before a restart.

        Every stream then begins a little later than stored, because later frames may have been accepted and not stored:
        RESTORE_MARGIN_S, and "late_s" if the store put that into the dict.

        Raises:
            SigningError: not such a dict.
        """
        try:
            margin = int((RESTORE_MARGIN_S + float(streams.get("late_s", 0.0))) * TICKS_PER_S)
            newest = {_number(name): int(time) + margin for name, time in streams["newest"].items()}
            ahead = [(_number(name), int(first), int(last)) for name, first, last in streams["ahead"]]
            floor = int(streams["floor"])
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            raise SigningError("stored signing streams are damaged") from None
        self._streams, self._ahead, self._floor = newest, ahead, floor

    def _check_rare(self, stream: int, time: int, newest: int | None, now: int) -> SignatureResult:
        """Check a frame that does not simply follow the one before. `now` is 0 while our clock is not set."""
        if newest is not None and time <= newest:
            return _OLD
        # A known stream that does not leap is right even if our clock was set back.
        leaps = newest is None or time - newest > _AHEAD_TICKS
        if now and leaps and time > now + _AHEAD_TICKS:
            self._quarantine(stream, time)
            return SignatureResult.AHEAD
        if any(each == stream and first <= time <= last for each, first, last in self._ahead):
            return _OLD
        if newest is None:
            # A recording of a stream that we never heard: docs/threats.md A.1.
            if time + _NEW_STREAM_TICKS < now:
                return SignatureResult.TOO_OLD_NEW_STREAM
            if time <= self._floor:
                return _OLD
            if len(self._streams) >= self._max_streams:
                self._forget_one()
        self._ahead = [refused for refused in self._ahead if refused[0] != stream or refused[2] > time]
        return _GOOD

    def _quarantine(self, stream: int, time: int) -> None:
        """Remember the refused time with its neighbours: a clock may go wrong more than once, and differently."""
        for number, (each, first, last) in enumerate(self._ahead):
            if each == stream and first - _AHEAD_TICKS <= time <= last + _AHEAD_TICKS:
                self._ahead[number] = (stream, min(first, time), max(last, time))
                return
        self._ahead.append((stream, time, time))
        if len(self._ahead) > self._max_streams:
            # The refusal with the latest time is dropped: its time comes last.
            self._ahead.remove(max(self._ahead, key=lambda refused: refused[2]))

    def _forget_one(self) -> None:
        oldest = min(self._streams, key=self._streams.__getitem__)
        self._floor = max(self._floor, self._streams.pop(oldest))


def _name(stream: int) -> str:
    """Return a stream as text: system, component and link id with slashes between."""
    return f"{stream >> 16}/{stream >> 8 & 0xFF}/{stream & 0xFF}"


def _number(name: str) -> int:
    system, component, link_id = (int(part) for part in name.split("/"))
    if not all(0 <= part <= 255 for part in (system, component, link_id)):
        raise ValueError(name)
    return system << 16 | component << 8 | link_id
