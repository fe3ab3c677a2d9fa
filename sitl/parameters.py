"""A small parameter table with ArduPilot's manners: values floats, ints truncated and clamped, no range check."""

import math
from collections.abc import Iterator
from typing import NamedTuple

INT8, INT16, INT32, REAL32 = 2, 4, 6, 9
_LIMITS = {INT8: (-128, 127), INT16: (-32768, 32767), INT32: (-(2**31), 2**31 - 1)}

# Names and units of ArduCopter 4.7; the values are its defaults except the battery's.
_DEFAULTS: tuple[tuple[str, float, int], ...] = (
    ("ANGLE_MAX", 3000, INT16),  # centidegrees
    ("ARMING_CHECK", 1, INT32),
    ("BATT_CAPACITY", 9333, INT32),  # mAh: 20 min at 28 A
    ("BATT_FS_CRT_ACT", 0, INT8),
    ("BATT_FS_LOW_ACT", 0, INT8),
    ("BATT_LOW_MAH", 0, REAL32),
    ("DISARM_DELAY", 10, INT8),  # s
    ("FENCE_ENABLE", 0, INT8),
    ("FRAME_CLASS", 1, INT8),
    ("FS_GCS_ENABLE", 0, INT8),
    ("FS_GCS_TIMEOUT", 5, REAL32),  # s
    ("FS_THR_ENABLE", 1, INT8),
    ("GUID_TIMEOUT", 3, REAL32),  # s
    ("LAND_SPEED", 50, INT16),  # cm/s
    ("MAV_GCS_SYSID", 255, INT16),
    ("MAV_OPTIONS", 0, INT16),
    ("MAV_SYSID", 1, INT16),
    ("PILOT_TKOFF_ALT", 0, REAL32),
    ("RTL_ALT", 1500, INT32),  # cm
    ("RTL_ALT_FINAL", 0, INT16),
    ("RTL_LOIT_TIME", 5000, INT32),  # ms
    ("STAT_RUNTIME", 0, INT32),
    ("TERRAIN_ENABLE", 1, INT8),
    ("WPNAV_ACCEL", 250, REAL32),  # cm/s/s
    ("WPNAV_SPEED", 1000, REAL32),  # cm/s
    ("WPNAV_SPEED_DN", 150, REAL32),
    ("WPNAV_SPEED_UP", 250, REAL32),
    ("WP_YAW_BEHAVIOR", 2, INT8),
)


class Entry(NamedTuple):
    """A parameter as PARAM_VALUE shows it."""

    name: str
    value: float
    kind: int
    position: int


class ParameterTable:
    """Parameters by name."""

    def __init__(self, system_id: int) -> None:
        self._values = {name: float(value) for name, value, _ in _DEFAULTS}
        self._kinds = {name: kind for name, _, kind in _DEFAULTS}
        self._index = {name: i for i, (name, _, _) in enumerate(_DEFAULTS)}
        self._values["MAV_SYSID"] = float(system_id)

    def __len__(self) -> int:
        return len(self._values)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[Entry]:
        return (self._entry(name) for name in self._values)

    def _entry(self, name: str) -> Entry:
        return Entry(name, self._values[name], self._kinds[name], self._index[name])

    def by_name(self, name: str) -> Entry | None:
        """None if there is no such parameter: the real one does not answer then."""
        return self._entry(name) if name in self._values else None

    def by_index(self, index: int) -> Entry | None:
        """None if there is no such index."""
        return self._entry(_DEFAULTS[index][0]) if 0 <= index < len(_DEFAULTS) else None

    def set(self, name: str, value: float) -> Entry | None:
        """Store and return what was stored; None (no answer) for unknown names, NaN and infinity."""
        if name not in self._values or not math.isfinite(value):
            return None
        limits = _LIMITS.get(self._kinds[name])
        if limits is not None:
            value = float(int(max(limits[0], min(limits[1], value))))
        self._values[name] = value
        return self._entry(name)
