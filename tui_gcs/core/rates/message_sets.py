"""Message sets: which messages are requested and how often, from rich to poor, what they cost, which one fits a link.

The sets follow docs/threats.md C.3, with one difference: every set holds every message that the picture of a vehicle is
made of (position, landed state, health, battery, GPS), only at other rates, so that nothing the station acts on freezes
at an old value when a set gets poorer. For that, `lean` has no ATTITUDE, on which nothing acts.
"""

from collections.abc import Mapping
from typing import NamedTuple

from tui_gcs.core.mavlink.frames import SIGNATURE_BYTES

Rates = Mapping[int, float]
"""Hz by message id."""

HEARTBEAT_HZ = 1.0
"""Every autopilot sends it unasked. It is never changed: it shows that a vehicle is there."""
# `bytes_per_s` is what a link carries, both ways together; of a serial line only 70 % count as carried at all,
# because a radio's air rate is half duplex (57.6 kbit/s: 4032 B/s, of which telemetry gets 2822). The rest is for
# what no plan knows: our commands and set-points, their answers, texts, parameters and missions.
TELEMETRY_SHARE = 0.7
"""Share of `LinkSpec.bytes_per_s` for telemetry (docs/threats.md C.3)."""

FRAME_BYTES = 12
"""MAVLink 2 header and CRC (mavlink.io, serialization)."""
PAYLOAD_BYTES = {
    0: 9,
    1: 43,
    24: 52,
    30: 28,
    33: 28,
    42: 18,
    65: 42,
    74: 20,
    147: 54,
    168: 12,
    193: 26,
    230: 42,
    231: 40,
    242: 60,
    245: 2,
}
"""Payloads with all extensions: a frame may be shorter (trailing zeros are not sent), never longer."""

UNASKED = frozenset(
    # PX4, 50 Hz each (docs/autopilots.md): position and attitude targets, servos, attitude quaternion, attitude,
    # local position
    {85, 83, 36, 31, 30, 32}
    # PX4's other habits: altitude, VFR_HUD, pressure, estimator, distance, vibration, ping, node and time estimates,
    # the copies of Remote ID meant for a transmitter
    | {141, 74, 29, 230, 132, 241, 4, 8, 380, 12901, 12904, 105, 331}
    # ArduPilot's streams, when parameters or another station turned them on (docs/autopilots.md "Groups")
    | {26, 27, 116, 129, 137, 143, 35, 65, 62, 163, 164, 178, 193, 152, 125, 2, 168}
)
"""What autopilots send by themselves and a link with a budget cannot afford, unless its set contains it."""


class RateSet(NamedTuple):
    """One set, most important message first."""

    name: str
    hz: Rates


def _slower(name: str, rates: Rates, factor: float) -> RateSet:
    """`rates` divided by `factor`, but not below once in 20 s."""
    # ArduPilot keeps intervals as 16 bits of milliseconds.
    return RateSet(name, {message: max(0.05, hz / factor) for message, hz in rates.items()})


# 33 GLOBAL_POSITION_INT, 245 EXTENDED_SYS_STATE, 1 SYS_STATUS, 24 GPS_RAW_INT, 147 BATTERY_STATUS,
# 30 ATTITUDE, 74 VFR_HUD, 193 EKF_STATUS_REPORT, 230 ESTIMATOR_STATUS, 42 MISSION_CURRENT, 242 HOME_POSITION,
# 65 RC_CHANNELS, 168 WIND, 231 WIND_COV
_FULL = {
    33: 10.0,
    245: 2.0,
    1: 1.0,
    24: 1.0,
    147: 0.5,
    30: 4.0,
    74: 2.0,
    193: 1.0,
    230: 0.4,
    42: 0.5,
    242: 0.1,
    65: 0.4,
    168: 0.1,
    231: 0.1,
}
# Each set is for a link with less room; the numbers are Hz by message id.
_NORMAL = _FULL | {33: 4.0, 245: 1.0, 193: 0.2, 230: 0.2, 65: 0.2}
_MINIMAL = {33: 2.0, 245: 1.0, 1: 0.5, 24: 0.2, 147: 0.1}
_LEAN = {33: 1.0, 245: 0.5, 1: 0.2, 24: 0.2, 147: 0.1}

LADDER = (
    RateSet("full", _FULL),
    RateSet("normal", _NORMAL),
    RateSet("minimal", _MINIMAL),
    RateSet("lean", _LEAN),
    _slower("half lean", _LEAN, 2),
    _slower("quarter lean", _LEAN, 4),
    _slower("eighth lean", _LEAN, 8),
)
"""From rich to poor. Below `lean` a position is older than 1.5 s: only where nothing else fits."""
FULL, LEAN, HALF_LEAN = 0, 3, 4
"""Places on the ladder."""


def bytes_per_s(rates: Rates, vehicles: int, signed: int) -> float:
    """What `vehicles` send with these rates and their heartbeats, `signed` of them with signatures; an upper bound."""
    frames_per_s = HEARTBEAT_HZ + sum(rates.values())
    plain = HEARTBEAT_HZ * (FRAME_BYTES + PAYLOAD_BYTES[0])
    plain += sum(hz * (FRAME_BYTES + PAYLOAD_BYTES[message]) for message, hz in rates.items())
    return vehicles * plain + signed * frames_per_s * SIGNATURE_BYTES


def telemetry_budget(link_bytes_per_s: int | None) -> float | None:
    """Bytes per second for the telemetry of all vehicles on a link of this capacity; None is no limit."""
    return None if link_bytes_per_s is None else TELEMETRY_SHARE * link_bytes_per_s


def best_fit(budget: float | None, vehicles: int, signed: int) -> int:
    """Place on the ladder of the richest set within `budget` (see `telemetry_budget`); the poorest if none fits."""
    if budget is None:
        return FULL
    for place, (_, rates) in enumerate(LADDER):
        if bytes_per_s(rates, vehicles, signed) <= budget:
            return place
    return len(LADDER) - 1
