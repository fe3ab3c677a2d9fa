"""ULog, the format of PX4's logs: https://docs.px4.io/main/en/dev_log/ulog_file_format.html.

Topics and fields are named as by PX4 1.17, as far as they are written here.
"""

import random
import struct
from functools import cache

_CODES = {"uint64_t": "Q", "uint8_t": "B", "int32_t": "i", "float": "f", "double": "d"}
_TOPICS = {
    "vehicle_status": "uint64_t timestamp;uint8_t nav_state;uint8_t arming_state;uint8_t failsafe",
    "vehicle_global_position": "uint64_t timestamp;double lat;double lon;float alt",
    "vehicle_local_position": (
        "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;float heading;double ref_lat;"
        "double ref_lon;float ref_alt"
    ),
    "vehicle_attitude": "uint64_t timestamp;float[4] q",
    "vehicle_gps_position": (
        "uint64_t timestamp;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;double altitude_msl_m;"
        "uint8_t fix_type;uint8_t satellites_used"
    ),
    "battery_status": "uint64_t timestamp;float voltage_v;float remaining",
    "home_position": "uint64_t timestamp;double lat;double lon;float alt",
}
_NUMBERS = {name: number for number, name in enumerate(_TOPICS)}
FILLER_BYTES = 250
_FILLER_MESSAGES = 256
_FILLER_KIND = "Z"
"""A message of a kind that readers skip; it stands for the hundreds of topics that a vehicle writes besides."""


def _message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def _layout(fields: str) -> struct.Struct:
    """Return the layout of a topic's record: its number, then its fields; `float[4] q` is four of them."""
    kinds = (field.split()[0].rstrip("]").partition("[") for field in fields.split(";"))
    return struct.Struct("<H" + "".join(count + _CODES[kind] for kind, _, count in kinds))


_LAYOUTS = {name: _layout(fields) for name, fields in _TOPICS.items()}


def head(system_id: int) -> bytes:
    """Return what a log begins with: formats of the topics, the system id, and the topics that will follow."""
    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + _message("B", bytes(40)))
    for name, fields in _TOPICS.items():
        out += _message("F", f"{name}:{fields};".encode())
    for name, text in (("sys_name", b"PX4"), ("ver_sw_release_str", b"simulated")):
        key = f"char[{len(text)}] {name}".encode()
        out += _message("I", bytes((len(key),)) + key + text)
    key = b"int32_t MAV_SYS_ID"
    out += _message("P", bytes((len(key),)) + key + struct.pack("<i", system_id))
    for name, number in _NUMBERS.items():
        out += _message("A", struct.pack("<BH", 0, number) + name.encode())
    return bytes(out)


def data(topic: str, *values: float) -> bytes:
    """Return one record of a topic; `values` are in the order of its fields, the microseconds since boot first."""
    return _message("D", _LAYOUTS[topic].pack(_NUMBERS[topic], *values))


def text(severity: int, boot_us: int, words: str) -> bytes:
    """Return a text with its MAV_SEVERITY."""
    return _message("L", struct.pack("<BQ", ord("0") + severity, boot_us) + words.encode())


@cache
def filler(seed: int) -> bytes:
    """Return messages without meaning, the same for the same seed."""
    chance = random.Random(seed)
    return b"".join(_message(_FILLER_KIND, chance.randbytes(FILLER_BYTES - 3)) for _ in range(_FILLER_MESSAGES))
