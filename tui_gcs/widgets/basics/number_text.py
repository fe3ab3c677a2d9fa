"""Numbers and states in words as an operator reads them; `--` when not known."""

import math
from collections.abc import Iterable

from rich.cells import cell_len

from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.common import Phase, VehicleRow
from tui_gcs.feed.visible_changes import outside_tenths

ids = id_ranges
"""Ids with ranges: `1-4 7`."""

UNKNOWN = "--"

MOVES_M_S = 0.5
"""A slower vehicle counts as standing."""
THERE_M = 3.0
"""A vehicle this near to its goal has arrived."""
GPS_FIX = {0: "none", 1: "no", 2: "2D", 3: "3D", 4: "DG", 5: "Flt", 6: "RTK", 7: "Sta", 8: "PPP"}
"""MAVLink GPS_FIX_TYPE in three letters at most."""

AUTOPILOTS = {"ArduPilot": "Ardu", "ArduCopter": "Ardu", "PX4": "PX4"}


def number(value: float, digits: int = 0, unit: str = "") -> str:
    """`value` with its unit, or `--`. Minus zero is zero."""
    if not math.isfinite(value):
        return UNKNOWN
    # Adding 0.0 makes 0.0 of -0.0, which would be shown as `-0`.
    return f"{round(value, digits) + 0.0:.{digits}f}{unit}"


def outside(value_m: float, unit: str) -> str:
    """The largest distance outside, rounded up: 0 only if no vehicle was outside; tenths below 10 m."""
    tenths = outside_tenths(value_m) or 0
    return number(value_m if not tenths else tenths / 10.0, 1 if 0 < tenths < 100 else 0, unit)


def fitted(value: float, width: int) -> str:
    """The value with one decimal if that fits into `width` cells, else without."""
    text = number(value, 1)
    return text if len(text) <= width else number(value, 0)


def clock(seconds: float) -> str:
    """`T+mm:ss`; hours where there are any."""
    if not math.isfinite(seconds):
        return "T+--:--"
    whole = max(0, int(seconds))
    hours, minutes = divmod(whole // 60, 60)
    return f"T+{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"T+{minutes:02d}:{whole % 60:02d}"


def age_words(seconds: float) -> str:
    """An age for a narrow column: `57` seconds, from two minutes on `12m`, from two hours on `3h`.

    It is empty below a second and where it is not known, and `never` where nothing was heard.
    """
    if math.isnan(seconds) or seconds < 1.0:
        return ""
    if math.isinf(seconds):
        return "never"
    if seconds < 120.0:
        return f"{seconds:.0f}"
    return f"{seconds // 60:.0f}m" if seconds < 7200.0 else f"{seconds // 3600:.0f}h"


def slot_words(slot: str, label: str = "slot ") -> str:
    """The place that a vehicle keeps: one of its planner, behind `label`, or beside the one that it follows."""
    # `>12`: a vehicle that is flown by hand beside vehicle 12.
    return f"follows {slot[1:]}" if slot.startswith(">") else f"{label}{slot or UNKNOWN}"


def phase_words(row: VehicleRow) -> str:
    """The phase of a vehicle; in a mode that takes no set-points (a mission, a failsafe) it flies `by itself`."""
    return "by itself" if row.phase is Phase.TAKEN_OUT else row.phase.value


def mode_or_hand(row: VehicleRow) -> str:
    """The mode, or `by hand`: such a vehicle is in the same mode in which planners fly it."""
    return row.phase.value if row.phase is Phase.BY_HAND else row.mode


def hand_words(row: VehicleRow) -> str:
    """What a vehicle flown by hand does, in at most 12 cells; empty for other vehicles."""
    if row.phase is not Phase.BY_HAND:
        return ""
    if row.slot.startswith(">"):
        return slot_words(row.slot)
    if not math.isfinite(row.goal_m[0]):  # nudged, or has taken off
        return "nudged" if speed_m_s(row.velocity_m_s) >= MOVES_M_S else "stays there"
    if row.goal_radius_m:
        return "orbits"
    to_go_m = math.dist(row.goal_m, row.position_m)
    return f"{to_go_m:.0f} m to go" if to_go_m > THERE_M else "stays there"


def gps(fix: int, satellites: int) -> str:
    """Fix and satellites in at most five cells: `3D12`, `RTK14`."""
    return f"{GPS_FIX.get(fix, '?')}{satellites if satellites >= 0 else ''}"


def autopilot_short(name: str) -> str:
    """The autopilot's name in at most four cells."""
    return AUTOPILOTS.get(name, name)[:4]


def speed_m_s(velocity_m_s: tuple[float, float, float]) -> float:
    """Ground speed of a velocity (east, north, up)."""
    return math.hypot(velocity_m_s[0], velocity_m_s[1])


def heading(value_deg: float, degree: str) -> str:
    """A heading in three digits, 000 to 359."""
    return f"{round(value_deg) % 360:03d}{degree}" if math.isfinite(value_deg) else UNKNOWN


def packed(words: Iterable[str], width: int) -> list[str]:
    """Lines with as many words as fit, none of them cut."""
    rows: list[str] = []
    for one in words:
        if rows and cell_len(rows[-1]) + 2 + cell_len(one) <= width:
            rows[-1] += f"  {one}"
        else:
            rows.append(one)
    return rows
