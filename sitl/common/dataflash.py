"""DataFlash, the format of ArduPilot's logs: a format of each message, then messages.

https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html; the columns are those of ArduCopter 4.7 as
far as they are written here.
"""

import random
import struct
from functools import cache

_HEAD = b"\xa3\x95"
_FMT, _FMT_BYTES = 128, 89
_CODES = {"Q": "Q", "I": "I", "i": "i", "h": "h", "H": "H", "B": "B", "M": "B", "f": "f", "c": "h", "L": "i", "e": "i"}
_CODES |= {"n": "4s", "N": "16s", "Z": "64s"}
_COLUMNS = {
    "GPS": (130, "QBBIHBcLLeffff", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw"),
    "POS": (131, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "ATT": (132, "Qfff", "TimeUS,Roll,Pitch,Yaw"),
    "BAT": (133, "QBffB", "TimeUS,Inst,Volt,Curr,RemPct"),
    "MSG": (140, "QZ", "TimeUS,Message"),
    "PARM": (141, "QNf", "TimeUS,Name,Value"),
    "MODE": (142, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ARM": (143, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "ERR": (144, "QBB", "TimeUS,Subsys,ECode"),
    "FILL": (200, "ZZZ", "A,B,C"),
}
"""Type, format and columns of each message. FILL stands for the hundreds of others that a vehicle writes."""
_LAYOUTS = {
    name: (kind, struct.Struct("<" + "".join(_CODES[letter] for letter in form)))
    for name, (kind, form, _) in _COLUMNS.items()
}
FILLER_BYTES = len(_HEAD) + 1 + _LAYOUTS["FILL"][1].size
_FILLER_MESSAGES = 336
GPS_EPOCH_S, GPS_WEEK_S, LEAP_S = 315_964_800, 604_800, 18
"""GPS time begins on 6 January 1980, and is ahead of UTC by the leap seconds since then."""


def message(name: str, *values: float | bytes) -> bytes:
    """Return one message with these values, in the units of its format: L is 1e-7 degrees, c and e hundredths."""
    kind, layout = _LAYOUTS[name]
    return _HEAD + bytes((kind,)) + layout.pack(*values)


def gps_time(unix_us: int) -> tuple[int, int]:
    """Return (milliseconds of the week, week) of GPS time."""
    milliseconds = unix_us // 1000 - (GPS_EPOCH_S - LEAP_S) * 1000
    return milliseconds % (GPS_WEEK_S * 1000), milliseconds // (GPS_WEEK_S * 1000)


def _format(kind: int, length: int, name: str, form: str, columns: str) -> bytes:
    names = struct.pack("<4s16s64s", name.encode(), form.encode(), columns.encode())
    return _HEAD + bytes((_FMT, kind, length)) + names


FORMATS = _format(_FMT, _FMT_BYTES, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") + b"".join(
    _format(kind, len(_HEAD) + 1 + _LAYOUTS[name][1].size, name, form, columns)
    for name, (kind, form, columns) in _COLUMNS.items()
)
"""What a log begins with."""


@cache
def filler(seed: int) -> bytes:
    """Return messages without meaning, the same for the same seed."""
    chance = random.Random(seed)
    size = _LAYOUTS["FILL"][1].size
    return b"".join(message_of_bytes(chance.randbytes(size)) for _ in range(_FILLER_MESSAGES))


def message_of_bytes(payload: bytes) -> bytes:
    """Return a message of filler with this payload."""
    return _HEAD + bytes((_LAYOUTS["FILL"][0],)) + payload
