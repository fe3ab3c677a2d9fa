"""The flown points of recorded flights: position, speed, mode and battery of each vehicle over time.

A telemetry log (.tlog) of this or another station holds all vehicles; logs that vehicles wrote themselves are in
`onboard_logs`. Every reader yields `FlightPoint`s in the order of the log, with absolute times, so that flights from
several sources can be joined by time.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_INVALID
from tui_gcs.core.mavlink.frames import decode
from tui_gcs.core.mavlink.mode_names import mode_name
from tui_gcs.core.records.tlog_reader import read_tlog

HEARTBEAT, SYS_STATUS, GLOBAL_POSITION_INT, BATTERY_STATUS = 0, 1, 33, 147
ARMED = 0x80
"""MAV_MODE_FLAG_SAFETY_ARMED."""
UNKNOWN_HEADING = 65535
UNKNOWN_CHARGE = -1


class FlightPoint(NamedTuple):
    """One vehicle at one time. Numbers that the log does not give are NaN, words are empty."""

    wall_s: float
    """Seconds since 1970."""
    vehicle: int
    """The MAVLink system id."""
    lat_deg: float
    lon_deg: float
    amsl_m: float
    """Height above mean sea level."""
    above_home_m: float
    north_m_s: float
    east_m_s: float
    up_m_s: float
    heading_deg: float
    mode: str
    armed: bool | None
    battery_pct: float


@dataclass
class LeftOut:
    """What a reader did not yield."""

    without_place: int = 0
    """Positions of 0, 0: autopilots report them before their first fix."""
    damaged_bytes: int = 0


@dataclass
class ReportedState:
    """What was reported last of a vehicle, beside its position."""

    mode: str = ""
    armed: bool | None = None
    battery_pct: float = math.nan


@dataclass
class TlogPoints:
    """Reads the points of a telemetry log. Raises `TlogError` while iterating."""

    path: Path
    left_out: LeftOut = field(default_factory=LeftOut)

    def __iter__(self) -> Iterator[FlightPoint]:
        """Yield a point for each GLOBAL_POSITION_INT of an autopilot."""
        states: dict[int, ReportedState] = {}
        reader = read_tlog(self.path)
        for wall_s, frame in reader:
            if frame.component != 1 or frame.msgid not in (HEARTBEAT, SYS_STATUS, GLOBAL_POSITION_INT, BATTERY_STATUS):
                continue
            message = decode(frame)
            if message is None:
                continue
            state = states.setdefault(frame.system, ReportedState())
            if frame.msgid != GLOBAL_POSITION_INT:
                _update(state, frame.msgid, message.fields)
            elif message.fields["lat"] or message.fields["lon"]:
                yield _point(wall_s, frame.system, message.fields, state)
            else:
                self.left_out.without_place += 1
        self.left_out.damaged_bytes = reader.skipped_bytes


def _update(state: ReportedState, message: int, fields: dict[str, int]) -> None:
    if message == HEARTBEAT:
        if fields["autopilot"] != AUTOPILOT_INVALID:
            state.mode = mode_name(fields["autopilot"], fields["type"], fields["custom_mode"])
            state.armed = bool(fields["base_mode"] & ARMED)
    # The first battery is the one that flies.
    elif fields["battery_remaining"] != UNKNOWN_CHARGE and not fields.get("id", 0):
        state.battery_pct = float(fields["battery_remaining"])


def _point(wall_s: float, vehicle: int, fields: dict[str, int], state: ReportedState) -> FlightPoint:
    heading = fields["hdg"]
    return FlightPoint(
        wall_s,
        vehicle,
        fields["lat"] / 1e7,
        fields["lon"] / 1e7,
        fields["alt"] / 1e3,
        fields["relative_alt"] / 1e3,
        fields["vx"] / 100,
        fields["vy"] / 100,
        -fields["vz"] / 100,
        math.nan if heading == UNKNOWN_HEADING else heading / 100,
        state.mode,
        state.armed,
        state.battery_pct,
    )
