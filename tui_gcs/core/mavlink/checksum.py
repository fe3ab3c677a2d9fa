"""Checksum: MAVLink's CRC checked over a frame as it lies there, without cutting or copying it.

The CRC (CRC-16/MCRF4XX) runs over the frame without its first byte, then over one byte that only the message's
definition has. Each byte b turns the register s into T(s ^ b); T is linear and invertible. So, if s is what the frame's
content leaves behind and e that extra byte, the frame must end in c = T(s ^ e). Running on over c itself gives T(T(s ^
c)), and with s taken from the first equation that is T(c) ^ T(T(c)) ^ T(T(e)), for this c and no other. The last term
depends on the message only, the others on the frame's last two bytes. The first byte is run over, too, from the value
that it turns into the one that the CRC is defined to begin with.
"""

from functools import cache

from fastcrc.crc16 import mcrf4xx

BEFORE_MAGIC = 0x3085
"""The register value that MAGIC_V2 turns into 0xFFFF."""


def _next(register: int) -> int:
    """Return T(register)."""
    return int(mcrf4xx(b"\0", register))


@cache
def residue(extra: bytes) -> int:
    """Return what the definition's byte adds to the register behind a good frame; 0 without one.

    The result is cached, so that equal values are one object: every frame is compared with it, and thousands of equal
    ints would not stay in the CPU's cache.
    """
    return _next(_next(extra[0])) if extra else 0


LOW = [_next(byte) ^ _next(_next(byte)) for byte in range(256)]
HIGH = [_next(byte << 8) ^ _next(_next(byte << 8)) for byte in range(256)]
"""What the CRC's own two bytes behind the frame add to the register: LOW by the first byte, HIGH by the second."""
