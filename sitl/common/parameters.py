"""Parameters of both autopilots: names, types and values of real vehicles, and the changes of each simulated one.

The tables are text files in `sitl/data`, read with the first vehicle of their kind and shared by all.
"""

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

INT8, INT16, INT32, REAL32 = 2, 4, 6, 9
"""MAV_PARAM_TYPE; PX4 has INT32 and REAL32 only."""
UINT32 = 5

HASH_NAME = "_HASH_CHECK"

_LIMITS = {INT8: (-128, 127), INT16: (-32768, 32767), INT32: (-(2**31), 2**31 - 1)}
_ARDUPILOT_KINDS = {"1": INT8, "2": INT16, "3": INT32, "4": REAL32}

# Values that differ from the real vehicle's: 20 min of battery at 28 A, and counters that begin at zero.
_ARDUPILOT_CHANGES = {"BATT_CAPACITY": 9333, "MIS_TOTAL": 0, "STAT_RUNTIME": 0}
_REMOTE_ID_PARAMETERS: dict[str, tuple[int, float]] = {
    "DID_MAVPORT": (INT8, -1),
    "DID_CANDRIVER": (INT8, 0),
    "DID_OPTIONS": (INT16, 0),
    "DID_BARO_ACC": (REAL32, -1.0),
}
"""Types and values of the parameters that DID_ENABLE reveals, as in ArduPilot's source."""


class ParameterEntry(NamedTuple):
    """A parameter as PARAM_VALUE shows it."""

    name: str
    value: float
    kind: int
    position: int


@dataclass(frozen=True)
class ParameterDefaults:
    """The table that all vehicles of a kind share; it is never changed after it was read."""

    values: dict[str, float] = field(default_factory=dict)
    kinds: dict[str, int] = field(default_factory=dict)
    factory: dict[str, float] = field(default_factory=dict)
    """ArduPilot: defaults of the parameters with another value."""
    volatile: set[str] = field(default_factory=set)
    """PX4: parameters that do not count for `_HASH_CHECK`."""
    late: frozenset[str] = frozenset()
    """Parameters that are listed only once they were used (PX4) or `reveals` is on; then all later indices shift."""
    reveals: str = ""
    """ArduPilot: the parameter that enables the late ones."""


def _lines(file: str) -> Iterator[list[str]]:
    for line in (resources.files("sitl") / "data" / file).read_text(encoding="ascii").splitlines():
        if not line.startswith("#"):
            yield line.split(" ")


@cache
def ardupilot_defaults() -> ParameterDefaults:
    """Return ArduCopter's table in the order of its list."""
    table = ParameterDefaults(late=frozenset(_REMOTE_ID_PARAMETERS), reveals="DID_ENABLE")
    for name, kind, value, *default in _lines("arducopter.param"):
        table.kinds[name] = _ARDUPILOT_KINDS[kind]
        number = float if table.kinds[name] == REAL32 else int
        table.values[name] = _ARDUPILOT_CHANGES.get(name, number(value))
        if default or name in _ARDUPILOT_CHANGES:
            table.factory[name] = number((default or [value])[0])
        if name == table.reveals:
            table.values.update({late: value for late, (_, value) in _REMOTE_ID_PARAMETERS.items()})
            table.kinds.update({late: kind for late, (kind, _) in _REMOTE_ID_PARAMETERS.items()})
    return table


@cache
def px4_defaults() -> ParameterDefaults:
    """Return PX4's table in the order of its list."""
    table = ParameterDefaults()
    late = []
    for name, kind, value, *flags in _lines("px4.param"):
        table.kinds[name] = int(kind)
        table.values[name] = float(value) if int(kind) == REAL32 else int(value)
        if "volatile" in flags:
            table.volatile.add(name)
        if "late" in flags:
            late.append(name)
    return ParameterDefaults(table.values, table.kinds, volatile=table.volatile, late=frozenset(late))


class ParameterTable:
    """Parameters of one vehicle by name."""

    def __init__(self, system_id: int, autopilot: str = "ardupilot") -> None:
        self.defaults = px4_defaults() if autopilot == "px4" else ardupilot_defaults()
        self._values = self.defaults.values
        self._changed: dict[str, float] = {"MAV_SYS_ID" if autopilot == "px4" else "MAV_SYSID": system_id}
        self._listed: list[str] | None = None
        self._index: dict[str, int] = {}
        self._used: set[str] = set()
        self.changes = 0
        """How often a value was set."""

    def __len__(self) -> int:
        return len(self._values) - len(self.defaults.late) + len(self._used)

    def __getitem__(self, name: str) -> float:
        return self._changed[name] if name in self._changed else self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[ParameterEntry]:
        return (self._entry(name) for name in self._names())

    def _names(self) -> list[str]:
        """Return the names in the order of the list, which is made when it is first needed."""
        if self._listed is None:
            # The indices of all later parameters shift when the list grows: stations must not rely on them.
            hidden = self.defaults.late - self._used
            self._listed = [name for name in self._values if name not in hidden]
            self._index = {name: position for position, name in enumerate(self._listed)}
        return self._listed

    def _entry(self, name: str) -> ParameterEntry:
        self._names()
        return ParameterEntry(name, self[name], self.defaults.kinds[name], self._index.get(name, len(self) - 1))

    def by_name(self, name: str) -> ParameterEntry | None:
        """Return a parameter; None if it does not exist."""
        return self._entry(name) if name in self._values else None

    def by_index(self, index: int) -> ParameterEntry | None:
        """Return the parameter at an index of the list; None beyond the list."""
        names = self._names()
        return self._entry(names[index]) if 0 <= index < len(names) else None

    def use_all(self) -> None:
        """Mark every parameter as used, which makes the list longer from now on."""
        if len(self._used) < len(self.defaults.late):
            self._used = set(self.defaults.late)
            self._listed = None

    def default(self, name: str) -> float:
        """Return the factory value of a parameter."""
        return self.defaults.factory.get(name, self._values[name])

    def set(self, name: str, value: float) -> ParameterEntry | None:
        """Store a value and return the parameter; None for unknown names, NaN and infinity.

        Integers are truncated and clamped to their type. Nothing else is checked: a real ArduCopter and PX4 do not
        check ranges either.
        """
        if name not in self._values or not math.isfinite(value):
            return None
        limits = _LIMITS.get(self.defaults.kinds[name])
        if limits is None:
            value = struct.unpack("<f", struct.pack("<f", value))[0] if abs(value) < 3.4e38 else value
        else:
            value = int(max(limits[0], min(limits[1], value)))
        self._changed[name] = value
        self.changes += 1
        if name == self.defaults.reveals and value:
            self.use_all()
        return self._entry(name)

    def value_bits(self, name: str) -> int:
        """Return the four bytes that PX4 sends for a parameter."""
        return bits_of(self[name], self.defaults.kinds[name])

    def hash(self) -> int:
        """Return PX4's `_HASH_CHECK`: `crc32` over names and values of the parameters that are listed."""
        crc = 0
        for name in self._names():
            if name not in self.defaults.volatile:
                crc = crc32(name.encode() + self.value_bits(name).to_bytes(4, "little"), crc)
        return crc


def bits_of(value: float, kind: int) -> int:
    """Return the four bytes that PX4 sends for a value."""
    packed: Any = struct.pack("<f", value) if kind == REAL32 else struct.pack("<i", int(value))
    return int.from_bytes(packed, "little")


def crc32(data: bytes, crc: int = 0) -> int:
    """Return the CRC-32 of PX4 and NuttX: the usual polynomial, started with 0, without the final inversion."""
    return zlib.crc32(data, crc ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
