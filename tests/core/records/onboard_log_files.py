"""Writes small logs as vehicles write them: DataFlash (.bin) of ArduPilot, ULog (.ulg) of PX4.

The formats: https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html and
https://docs.px4.io/main/en/dev_log/ulog_file_format.html.
"""

import struct
from collections.abc import Iterable

CODES = {
    "Q": "Q",
    "I": "I",
    "i": "i",
    "h": "h",
    "H": "H",
    "B": "B",
    "f": "f",
    "n": "4s",
    "N": "16s",
    "Z": "64s",
    "L": "i",
}
"""The letters of DataFlash formats used here; L is a position in 1e-7 degrees."""
GPS_WEEK_1900_S = 1_465_084_800
"""Unix seconds at which GPS week 1900 began, without leap seconds: 1980-01-06 plus 1900 weeks."""


def dataflash(messages: Iterable[tuple[int, str, str, str, tuple[object, ...]]]) -> bytes:
    """Write a log of (type, name, format, columns, values); each format is written before its first message."""
    out = bytearray(_fmt(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"))
    known: set[int] = set()
    for kind, name, form, columns, values in messages:
        layout = "<" + "".join(CODES[letter] for letter in form)
        if kind not in known:
            known.add(kind)
            out += _fmt(kind, 3 + struct.calcsize(layout), name, form, columns)
        encoded = [value.encode() if isinstance(value, str) else value for value in values]
        out += bytes((0xA3, 0x95, kind)) + struct.pack(layout, *encoded)
    return bytes(out)


def _fmt(kind: int, length: int, name: str, form: str, columns: str) -> bytes:
    return bytes((0xA3, 0x95, 0x80)) + struct.pack(
        "<BB4s16s64s", kind, length, name.encode(), form.encode(), columns.encode()
    )


def ulog(topics: dict[str, tuple[str, list[tuple[object, ...]]]], parameters: dict[str, int] | None = None) -> bytes:
    """Write a log of topics: (fields as "uint64_t timestamp;double lat", rows)."""
    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
    for name, (fields, _) in topics.items():
        out += _ulog_message("F", f"{name}:{fields};".encode())
    for name, value in (parameters or {}).items():
        key = f"int32_t {name}".encode()
        out += _ulog_message("P", bytes((len(key),)) + key + struct.pack("<i", value))
    for number, name in enumerate(topics):
        out += _ulog_message("A", struct.pack("<BH", 0, number) + name.encode())
    for number, (fields, rows) in enumerate(topics.values()):
        letters = {"uint64_t": "Q", "double": "d", "float": "f", "uint8_t": "B", "int32_t": "i"}
        layout = "<" + "".join(letters[field.split()[0]] for field in fields.split(";"))
        for row in rows:
            out += _ulog_message("D", struct.pack("<H", number) + struct.pack(layout, *row))
    return bytes(out)


def _ulog_message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload


GPS = (130, "GPS", "QBBIHLLffff", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Alt,Spd,GCrs,VZ")


def copter_log() -> bytes:
    """A flight of a copter with system id 7: armed, LOITER, 5 m/s to the east, sinking at 1 m/s; two POS."""

    def at(us: int) -> list[tuple[int, str, str, str, tuple[object, ...]]]:
        return [
            (*GPS, (us, 0, 3, us // 1000, 1900, 473977000, 85456000, 488.0, 5.0, 90.0, 1.0)),
            (131, "POS", "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt", (us, 473977000, 85456000 + us, 498.0, 10.0)),
        ]

    return dataflash(
        [
            (140, "MSG", "QZ", "TimeUS,Message", (1000, "ArduCopter V4.6.0")),
            (141, "PARM", "QNf", "TimeUS,Name,Value", (1000, "SYSID_THISMAV", 7.0)),
            (142, "MODE", "QBBB", "TimeUS,Mode,ModeNum,Rsn", (1000, 5, 5, 1)),
            (143, "EV", "QB", "TimeUS,Id", (1000, 10)),
            (144, "BAT", "QBf", "TimeUS,Inst,RemPct", (1000, 0, 81.0)),
            (145, "ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw", (1000, 0.0, 0.0, 92.5)),
            *at(1_000_000),
            *at(1_200_000),
        ]
    )


def px4_log() -> bytes:
    """A flight of a PX4 with system id 3 in HOLD, 12 m above home, 2 m/s to the north; two positions, one without."""
    utc_us = 1_700_000_000_000_000
    return ulog(
        {
            "vehicle_global_position": (
                "uint64_t timestamp;double lat;double lon;float alt",
                [(900_000, 0.0, 0.0, 0.0), (1_000_000, 47.5, 8.5, 500.0), (1_500_000, 47.5001, 8.5, 500.5)],
            ),
            "vehicle_gps_position": (
                "uint64_t timestamp;uint64_t time_utc_usec;uint8_t fix_type",
                [(800_000, 0, 0), (1_000_000, utc_us, 3)],
            ),
            "vehicle_local_position": (
                "uint64_t timestamp;float vx;float vy;float vz;float heading",
                [(500_000, 2.0, 0.0, -0.5, -1.5707963)],
            ),
            "vehicle_status": ("uint64_t timestamp;uint8_t nav_state;uint8_t arming_state", [(1, 4, 2)]),
            "battery_status": ("uint64_t timestamp;float remaining", [(1, 0.5)]),
            "home_position": ("uint64_t timestamp;float alt", [(1, 488.0)]),
        },
        {"MAV_SYS_ID": 3},
    )
