"""PX4's modes, as numbers in HEARTBEAT.custom_mode: main << 16 | sub << 24 (docs/autopilots.md "Modes of PX4")."""

from typing import NamedTuple


def custom_mode(main: int, sub: int = 0) -> int:
    """Return the number of a mode in HEARTBEAT and CURRENT_MODE."""
    return main << 16 | sub << 24


# custom_mode is main mode << 16 | sub mode << 24 (docs/autopilots.md "Modes of PX4").
AUTO_MAIN = 4
MANUAL, ALTCTL, POSCTL, ACRO = custom_mode(1), custom_mode(2), custom_mode(3), custom_mode(5)
ORBIT, SLOW, STABILIZED = custom_mode(3, 1), custom_mode(3, 2), custom_mode(7)
OFFBOARD, TERMINATION, ALTITUDE_CRUISE = custom_mode(6), custom_mode(10), custom_mode(11)
TAKEOFF, HOLD, MISSION, RTL, LAND = (custom_mode(AUTO_MAIN, sub) for sub in (2, 3, 4, 5, 6))
FOLLOW, PRECLAND, VTOL_TAKEOFF = (custom_mode(AUTO_MAIN, sub) for sub in (8, 9, 10))
EXTERNAL = tuple(custom_mode(AUTO_MAIN, sub) for sub in range(11, 19))

MAIN_MODES = frozenset({1, 2, 3, 4, 5, 6, 7, 10, 11})
STICKS = frozenset({MANUAL, ALTCTL, POSCTL, SLOW, ACRO, STABILIZED, ALTITUDE_CRUISE})
"""Modes that a pilot flies: they need MANUAL_CONTROL."""
PASSING = frozenset({TAKEOFF, RTL, LAND, PRECLAND, VTOL_TAKEOFF})
"""Modes that end by themselves; after the flight the mode before them is in force again."""


class ModeInfo(NamedTuple):
    """How a mode appears in events."""

    bit: int
    """Its bit in the masks of arming_check events (navigation_mode_group)."""
    number: int
    """Number of the mode as navigation_mode in events."""
    name: str


MODES: dict[int, ModeInfo] = {
    MANUAL: ModeInfo(0x1, 0, "Manual"),
    ALTCTL: ModeInfo(0x2, 1, "Altitude"),
    POSCTL: ModeInfo(0x4, 2, "Position"),
    MISSION: ModeInfo(0x8, 3, "Mission"),
    HOLD: ModeInfo(0x10, 4, "Hold"),
    RTL: ModeInfo(0x20, 5, "Return"),
    SLOW: ModeInfo(0x40, 9, "Position Slow"),
    ACRO: ModeInfo(0x400, 6, "Acro"),
    OFFBOARD: ModeInfo(0x4000, 7, "Offboard"),
    STABILIZED: ModeInfo(0x8000, 8, "Stabilized"),
    TAKEOFF: ModeInfo(0x20000, 10, "Takeoff"),
    LAND: ModeInfo(0x40000, 11, "Land"),
    FOLLOW: ModeInfo(0x80000, 12, "Follow Target"),
    PRECLAND: ModeInfo(0x100000, 13, "Precision Landing"),
    ORBIT: ModeInfo(0x200000, 14, "Orbit"),
    VTOL_TAKEOFF: ModeInfo(0x400000, 15, "VTOL Takeoff"),
    ALTITUDE_CRUISE: ModeInfo(0x2, 24, "Altitude Cruise"),
}


def base_mode(mode: int, *, armed: bool) -> int:
    """Return HEARTBEAT.base_mode as recorded."""
    if mode in STICKS:
        base = 0x51
    elif mode in (OFFBOARD, ORBIT):
        base = 0x11
    else:
        base = 0x1D
    return base | (0x80 if armed else 0)


def mode_of(main: int, sub: int) -> int | None:
    """Return the mode that DO_SET_MODE's parameters name; None for main modes that do not exist."""
    if main not in MAIN_MODES:
        return None
    if main == AUTO_MAIN:
        return custom_mode(main, sub) if sub in range(2, 19) and sub != 7 else HOLD if sub == 1 else None
    return custom_mode(main, sub if main == 3 and sub in (1, 2) else 0)


class AvailableMode(NamedTuple):
    """One entry of AVAILABLE_MODES as recorded."""

    standard: int
    custom: int
    properties: int
    name: str


AVAILABLE: tuple[AvailableMode, ...] = (
    AvailableMode(0, MANUAL, 1, "Manual"),
    AvailableMode(4, ALTCTL, 0, ""),
    AvailableMode(1, POSCTL, 0, ""),
    AvailableMode(6, MISSION, 1, ""),
    AvailableMode(0, HOLD, 1, "Hold"),
    AvailableMode(5, RTL, 1, ""),
    AvailableMode(0, SLOW, 1, "Position Slow"),
    AvailableMode(0, ALTITUDE_CRUISE, 1, "Altitude Cruise"),
    AvailableMode(0, ACRO, 1, "Acro"),
    AvailableMode(0, TERMINATION, 3, "Termination"),
    AvailableMode(0, OFFBOARD, 1, "Offboard"),
    AvailableMode(0, STABILIZED, 1, "Stabilized"),
    AvailableMode(8, TAKEOFF, 1, ""),
    AvailableMode(7, LAND, 1, ""),
    AvailableMode(0, FOLLOW, 1, "Follow Target"),
    AvailableMode(0, PRECLAND, 1, "Precision Landing"),
    AvailableMode(2, ORBIT, 1, ""),
    AvailableMode(0, VTOL_TAKEOFF, 1, "VTOL Takeoff"),
    *(AvailableMode(0, mode, 2, "(Mode not available)") for mode in EXTERNAL),
)
"""The modes in the order of their AVAILABLE_MODES index."""
