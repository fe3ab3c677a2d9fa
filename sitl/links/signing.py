"""MAVLink signing as autopilots do it, which is as the C library does: https://mavlink.io/en/guide/message_signing.html.

ArduPilot (GCS_Signing.cpp; behaviour measured on 4.7) takes a key over any link while disarmed. At once it signs all
that it sends, and accepts only what is signed. Its time counts frames, follows the times that it hears, is stored every
30 s, and is loaded with a minute added. PX4 (mavlink_sign_control.cpp) without a key signs with 32 zeros and accepts
all frames. It takes keys over USB only; after a power cycle its time is that of the moment when it got the key.
"""

import hashlib
from dataclasses import dataclass, field

from fastcrc import crc16

from sitl.links.wire import HEADER_V2_BYTES, LAYOUTS, MAGIC_V2, SIGNED

KEY_BYTES = 32
ZERO_KEY = bytes(KEY_BYTES)
# Time stamps count 10 µs since 1 January 2015 (docs/threats.md A.1).
TICKS_PER_S = 100_000
EPOCH_S = 1_420_070_400
"""Time 0 of signatures, in Unix seconds."""
# PX4 remembers 16 streams [source]; a seventeenth is refused.
MAX_STREAMS = 16
# A stream that is seen for the first time may be one minute behind.
NEW_STREAM_TICKS = 60 * TICKS_PER_S
LOADED_TICKS = 60 * TICKS_PER_S
# ArduPilot stores its time stamp every 30 s, and starts a minute ahead of what it stored.
SAVE_US = 30_000_000
MAY_BE_UNSIGNED = (109, 166)
"""Messages that are accepted unsigned: RADIO_STATUS and RADIO."""
TELEMETRY_CHANNEL, PX4_INSTANCE = 1, 255
"""Link ids, as recorded. ArduPilot's channel 0 is USB, which still accepts unsigned frames."""


@dataclass(frozen=True)
class SigningSpec:
    """The signing key that a simulated vehicle has when it is switched on."""

    key: bytes = field(default=b"", repr=False)
    """32 bytes; empty without signing."""
    timestamp: int = 0
    """Time that is stored with the key, in 10 µs units since 2015 (`time_of`)."""
    px4: bool = False
    """Sign as PX4 does, also if the autopilot is ArduPilot."""

    def __post_init__(self) -> None:
        if len(self.key) not in (0, KEY_BYTES):
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(self.key)}")


def time_of(unix_s: float) -> int:
    """Return the signature time of a Unix time."""
    return int((unix_s - EPOCH_S) * TICKS_PER_S)


class Signer:
    """Signs and checks the frames of one vehicle on its one link."""

    def __init__(self, spec: SigningSpec, *, px4: bool) -> None:
        self.px4 = px4
        self.key = spec.key
        self.timestamp = 0
        self._stored = spec.timestamp
        self._saved_us = 0
        self._streams: dict[bytes, int] = {}

    def power_on(self, now_us: int) -> None:
        """Load the stored time and forget the streams."""
        self._streams = {}
        self._saved_us = now_us
        self._load()

    def take(self, key: bytes, timestamp: int) -> None:
        """Take a new key; 32 zeros and time 0 switch signing off."""
        self.key = b"" if key == ZERO_KEY and timestamp == 0 else key
        self._stored = timestamp
        self._load()

    def sign(self, frame: bytes, now_us: int) -> bytes:
        """Return the frame to be sent instead of `frame`: signed, if there is a key."""
        key = self.key or (ZERO_KEY if self.px4 else b"")
        if not key:
            return frame
        # Frames of one moment need times of their own: a receiver takes an equal one for a replay.
        self.timestamp += 1
        if not self.px4 and now_us - self._saved_us >= SAVE_US:
            self._saved_us, self._stored = now_us, self.timestamp
        return signed(frame, key, PX4_INSTANCE if self.px4 else TELEMETRY_CHANNEL, self.timestamp)

    def accepts(self, raw: bytes) -> bool:
        """Return whether a received frame is obeyed, and take note of its time."""
        if not self.key:
            return True
        # Radios cannot sign: their status is accepted without.
        if raw[0] != MAGIC_V2 or not raw[2] & SIGNED:
            return raw[0] == MAGIC_V2 and int.from_bytes(raw[7:10], "little") in MAY_BE_UNSIGNED
        if hashlib.sha256(self.key + raw[:-6]).digest()[:6] != raw[-6:]:
            return False
        stream, timestamp = raw[5:7] + raw[-13:-12], int.from_bytes(raw[-12:-6], "little")
        if stream not in self._streams:
            if len(self._streams) >= MAX_STREAMS or timestamp + NEW_STREAM_TICKS < self.timestamp:
                return False
        # A time that does not grow is a repetition of a recorded frame.
        elif timestamp <= self._streams[stream]:
            return False
        self._streams[stream] = timestamp
        # The vehicle has no real clock: it follows the newest time that it hears.
        self.timestamp = max(self.timestamp, timestamp)
        return True

    def _load(self) -> None:
        self.timestamp = self._stored + (LOADED_TICKS if self.key and not self.px4 else 0)


def signed(frame: bytes, key: bytes, link_id: int, timestamp: int) -> bytes:
    """Return an unsigned MAVLink 2 frame with a signature."""
    layout = LAYOUTS[int.from_bytes(frame[7:HEADER_V2_BYTES], "little")]
    body = frame[1:2] + bytes([SIGNED]) + frame[3:-2]
    crc: int = crc16.mcrf4xx(body + layout.crc_extra)
    tail = crc.to_bytes(2, "little") + bytes([link_id]) + timestamp.to_bytes(6, "little")
    whole = frame[:1] + body + tail
    return whole + hashlib.sha256(key + whole).digest()[:6]
