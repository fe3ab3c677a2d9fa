"""The stream that everything is measured with: 13 messages, 37.1 a second from every vehicle.

Every vehicle circles about a place of its own, so most fields change with every message, as in flight. Frames that
fall in one 20 ms tick of one vehicle share a datagram: 1.34 frames on average.
"""

import functools
import hashlib
import math
import random
import struct
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as mavlink

TICK_S = 0.02
ORIGIN_DEG = (52.0720, -0.6280)
"""Of the shipped scenario: vehicles 1 to 20 begin near it, the others in rows 100 m apart."""
BOOTED_S = 60.0
"""The stream begins this long after the vehicles were switched on."""
UNIX_S = 1_750_000_000
SIGNATURE_EPOCH_S = 1_420_070_400
"""Signature timestamps count 10 µs since 2015-01-01 (mavlink.io, message_signing)."""
ZERO_KEY = bytes(32)
"""What PX4 signs with when it has no key."""


class Datagram(NamedTuple):
    """What a vehicle sends at once."""

    t_s: float
    """When, after the beginning."""
    vehicle: int
    """Which: 0 is the first."""
    data: bytes
    frames: int


class Flight(NamedTuple):
    """Where a vehicle is and how it moves at one moment."""

    boot_ms: int
    x_m: float
    """North of its start."""
    y_m: float
    """East of its start."""
    alt_rel_m: float
    vx_m_s: float
    vy_m_s: float
    vz_m_s: float
    heading_deg: float
    lat_e7: int
    lon_e7: int
    wobble: float
    """-1 … 1, different from message to message."""


RATES_HZ = {
    "HEARTBEAT": 1.0,
    "ATTITUDE": 10.0,
    "GLOBAL_POSITION_INT": 10.0,
    "LOCAL_POSITION_NED": 4.0,
    "VFR_HUD": 4.0,
    "GPS_RAW_INT": 2.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 1.0,
    "EXTENDED_SYS_STATE": 1.0,
    "EKF_STATUS_REPORT": 1.0,
    "MISSION_CURRENT": 1.0,
    "STATUSTEXT": 0.1,
    "TIMESYNC": 1.0,
}
RATE_HZ = sum(RATES_HZ.values())


@functools.cache
def stream(vehicles: int, seconds: float, times: int = 1) -> tuple[Datagram, ...]:
    """What `vehicles` vehicles (system ids from 1) send in `seconds`, in order; all rates `times` what they are."""
    datagrams = [datagram for vehicle in range(vehicles) for datagram in _vehicle(vehicle, seconds, times)]
    return tuple(sorted(datagrams, key=lambda datagram: datagram.t_s))


@functools.cache
def signed_stream(vehicles: int, seconds: float) -> tuple[Datagram, ...]:
    """The same frames as PX4 sends them: each signed with the zero key on link 0, each in a datagram of its own."""
    began = (UNIX_S - SIGNATURE_EPOCH_S) * 100_000
    return tuple(
        Datagram(sent.t_s, sent.vehicle, sign(raw, ZERO_KEY, 0, began + round(sent.t_s * 1e5) + number), 1)
        for sent in stream(vehicles, seconds)
        for number, raw in enumerate(frames_of(sent.data))
    )


def frames_of(data: bytes) -> Iterator[bytes]:
    """The frames of a datagram of good unsigned version 2 frames."""
    at = 0
    while at < len(data):
        end = at + 12 + data[at + 1]
        yield data[at:end]
        at = end


def sign(raw: bytes, key: bytes, link_id: int, timestamp: int) -> bytes:
    """An unsigned version 2 frame, signed: flag, new CRC, then link, time and the first 6 bytes of the hash."""
    body = raw[:2] + b"\x01" + raw[3:-2]
    crc_extra = bytes([mavlink.mavlink_map[int.from_bytes(raw[7:10], "little")].crc_extra])
    whole = body + struct.pack("<H", mcrf4xx(body[1:] + crc_extra)) + bytes([link_id]) + timestamp.to_bytes(6, "little")
    return whole + hashlib.sha256(key + whole).digest()[:6]


def frame(system: int, seq: int, name: str, fields: dict[str, Any]) -> bytes:
    """One version 2 frame of component 1, trailing zeros cut off (pymavlink's own `pack` takes five times as long)."""
    kind = _kind(name)
    values: list[Any] = []
    for field, length in zip(kind.ordered_fieldnames, kind.lengths, strict=True):
        value = fields[field]
        values.extend(value if length > 1 and not isinstance(value, bytes) else (value,))
    payload = kind.unpacker.pack(*values).rstrip(b"\0") or b"\0"
    head = struct.pack("<BBBBBBHB", len(payload), 0, 0, seq & 255, system, 1, kind.id & 0xFFFF, kind.id >> 16)
    return b"\xfd" + head + payload + struct.pack("<H", mcrf4xx(head + payload + bytes([kind.crc_extra])))


@functools.cache
def _kind(name: str) -> Any:
    return next(kind for kind in mavlink.mavlink_map.values() if kind.msgname == name)


def _vehicle(vehicle: int, seconds: float, times: int) -> Iterator[Datagram]:
    """All datagrams of one vehicle. Its ticks fall between those of others; each of its messages has its own phase."""
    chance = random.Random(vehicle)
    tick_s = TICK_S / times
    due: dict[int, list[str]] = {}
    for name, rate_hz in RATES_HZ.items():
        gap = 1 / (rate_hz * TICK_S)
        phase = chance.uniform(0, gap)
        for number in range(math.ceil((seconds / tick_s - phase) / gap)):
            due.setdefault(int(phase + number * gap), []).append(name)
    seq, offset_s = chance.randrange(256), chance.uniform(0, tick_s)
    for tick in sorted(due):
        t_s = tick * tick_s + offset_s
        flight = _flight(vehicle, t_s, chance)
        data = b""
        for name in due[tick]:
            data += frame(vehicle + 1, seq, name, VALUES[name](flight))
            seq += 1
        yield Datagram(t_s, vehicle, data, len(due[tick]))


def _flight(vehicle: int, t_s: float, chance: random.Random) -> Flight:
    """8 m/s on a circle of 60 m, a little up and down."""
    angle = t_s * 8 / 60 + vehicle
    x_m, y_m = 60 * math.cos(angle), 60 * math.sin(angle)
    north_m, east_m = 20 + 100 * (vehicle // 5) + x_m, 50 + 100 * (vehicle % 5) + y_m
    return Flight(
        boot_ms=round((BOOTED_S + t_s) * 1000) + vehicle,
        x_m=x_m,
        y_m=y_m,
        alt_rel_m=30 + vehicle % 40 + math.sin(angle / 3),
        vx_m_s=-8 * math.sin(angle),
        vy_m_s=8 * math.cos(angle),
        vz_m_s=-8 / 180 * math.cos(angle / 3),
        heading_deg=math.degrees(angle + math.pi / 2) % 360,
        lat_e7=round(1e7 * (ORIGIN_DEG[0] + north_m / 111_320)),
        lon_e7=round(1e7 * (ORIGIN_DEG[1] + east_m / 111_320 / math.cos(math.radians(ORIGIN_DEG[0])))),
        wobble=chance.uniform(-1, 1),
    )


def _heartbeat(_: Flight) -> dict[str, Any]:
    """An armed quadrotor under ArduPilot in GUIDED."""
    return {"type": 2, "autopilot": 3, "base_mode": 217, "custom_mode": 4, "system_status": 4, "mavlink_version": 3}


def _attitude(f: Flight) -> dict[str, Any]:
    yaw = math.radians((f.heading_deg + 180) % 360 - 180)
    rates = {"rollspeed": 0.02 * f.wobble, "pitchspeed": -0.03 * f.wobble, "yawspeed": 8 / 60 + 0.01 * f.wobble}
    return {"time_boot_ms": f.boot_ms, "roll": 0.1 + 0.01 * f.wobble, "pitch": -0.05 * f.wobble, "yaw": yaw} | rates


def _global_position(f: Flight) -> dict[str, Any]:
    return {
        "time_boot_ms": f.boot_ms,
        "lat": f.lat_e7,
        "lon": f.lon_e7,
        "alt": round(1000 * (110 + f.alt_rel_m)),
        "relative_alt": round(1000 * f.alt_rel_m),
        "vx": round(100 * f.vx_m_s),
        "vy": round(100 * f.vy_m_s),
        "vz": round(100 * f.vz_m_s),
        "hdg": round(100 * f.heading_deg) % 36000,
    }


def _local_position(f: Flight) -> dict[str, Any]:
    velocity = {"vx": f.vx_m_s, "vy": f.vy_m_s, "vz": f.vz_m_s}
    return {"time_boot_ms": f.boot_ms, "x": f.x_m, "y": f.y_m, "z": -f.alt_rel_m} | velocity


def _vfr_hud(f: Flight) -> dict[str, Any]:
    return {
        "airspeed": 8 + 0.2 * f.wobble,
        "groundspeed": math.hypot(f.vx_m_s, f.vy_m_s),
        "alt": 110 + f.alt_rel_m,
        "climb": -f.vz_m_s,
        "heading": int(f.heading_deg),
        "throttle": 45 + round(4 * f.wobble),
    }


def _gps(f: Flight) -> dict[str, Any]:
    return {
        "time_usec": 1000 * (UNIX_S * 1000 + f.boot_ms),
        "fix_type": 6,
        "lat": f.lat_e7,
        "lon": f.lon_e7,
        "alt": round(1000 * (110 + f.alt_rel_m)),
        "eph": 70 + round(5 * f.wobble),
        "epv": 110 + round(5 * f.wobble),
        "vel": 800,
        "cog": round(100 * f.heading_deg) % 36000,
        "satellites_visible": 14 + round(f.wobble),
        "alt_ellipsoid": round(1000 * (157 + f.alt_rel_m)),
        "h_acc": 300 + round(50 * f.wobble),
        "v_acc": 400 + round(50 * f.wobble),
        "vel_acc": 200,
        "hdg_acc": 0,
        "yaw": 0,
    }


def _sys_status(f: Flight) -> dict[str, Any]:
    sensors = {"present": 0x5361FC2F, "enabled": 0x5361FC2F, "health": 0x5771FC2F}
    return {
        **{f"onboard_control_sensors_{what}": bits for what, bits in sensors.items()},
        **{f"onboard_control_sensors_{what}_extended": 0 for what in sensors},
        **{f"errors_count{number}": 0 for number in range(1, 5)},
        "load": 380 + round(30 * f.wobble),
        "voltage_battery": 15_800 + round(60 * f.wobble),
        "current_battery": 2_100 + round(200 * f.wobble),
        "drop_rate_comm": 0,
        "errors_comm": 0,
        "battery_remaining": 76,
    }


def _battery(f: Flight) -> dict[str, Any]:
    return {
        "id": 0,
        "battery_function": 0,
        "type": 0,
        "temperature": 32767,
        "voltages": [15_800 + round(60 * f.wobble)] + [65_535] * 9,
        "current_battery": 2_100 + round(200 * f.wobble),
        "current_consumed": f.boot_ms // 180,
        "energy_consumed": f.boot_ms // 3200,
        "battery_remaining": 76,
        "time_remaining": 900,
        "charge_state": 1,
        "voltages_ext": [0] * 4,
        "mode": 0,
        "fault_bitmask": 0,
    }


def _extended_state(_: Flight) -> dict[str, Any]:
    return {"vtol_state": 0, "landed_state": 2}


def _ekf(f: Flight) -> dict[str, Any]:
    names = ("velocity", "pos_horiz", "pos_vert", "compass", "terrain_alt", "airspeed")
    sizes = (0.02, 0.03, 0.05, 0.04, 0.0, 0.0)
    return {f"{n}_variance": s * (1.2 + f.wobble) for n, s in zip(names, sizes, strict=True)} | {"flags": 831}


def _mission_current(_: Flight) -> dict[str, Any]:
    return {"seq": 3, "total": 12, "mission_state": 3, "mission_mode": 1}


def _text(f: Flight) -> dict[str, Any]:
    return {"severity": 6, "text": f"EKF3 IMU0 is using GPS, lane {f.boot_ms % 7}".encode(), "id": 0, "chunk_seq": 0}


def _timesync(f: Flight) -> dict[str, Any]:
    """The vehicle asks the time: a station answers."""
    return {"tc1": 0, "ts1": f.boot_ms * 1_000_000 + 1}


VALUES: dict[str, Callable[[Flight], dict[str, Any]]] = {
    "HEARTBEAT": _heartbeat,
    "ATTITUDE": _attitude,
    "GLOBAL_POSITION_INT": _global_position,
    "LOCAL_POSITION_NED": _local_position,
    "VFR_HUD": _vfr_hud,
    "GPS_RAW_INT": _gps,
    "SYS_STATUS": _sys_status,
    "BATTERY_STATUS": _battery,
    "EXTENDED_SYS_STATE": _extended_state,
    "EKF_STATUS_REPORT": _ekf,
    "MISSION_CURRENT": _mission_current,
    "STATUSTEXT": _text,
    "TIMESYNC": _timesync,
}
