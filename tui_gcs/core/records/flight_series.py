"""Values of recorded flights over time: which there are, and the points of those that are wanted.

A telemetry log (.tlog) of this or another station holds all vehicles; logs that vehicles wrote themselves are in
`onboard_series`. A reader looks through its log once to learn what is in it, and again for the points that are wanted:
a long flight needs no more memory than what is plotted. Times are seconds since 1970 where the log has them.
"""

import math
import struct
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.base.text import clean
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.dialect import MessageLayout
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_INVALID, sends_integers_bytewise
from tui_gcs.core.mavlink.field_meanings import (
    FieldMeaning,
    field_meaning,
    number_in,
    split_element,
    usual_unit,
    usual_value,
)
from tui_gcs.core.mavlink.frames import Frame, decode
from tui_gcs.core.records.time_series import safe_values
from tui_gcs.core.records.tlog_reader import read_tlog

Floats = NDArray[np.float64]
Points = tuple[Floats, Floats]
"""(times, values), oldest first; NaN is a gap."""

MAX_POINTS = 1_000_000
"""Points of one value: 28 hours at 10 Hz. What comes later is left out."""
MAX_NAMES = 20_000
MAX_NAME = 80
GAP_S, GAP_PERIODS = 5.0, 10.0
"""Two points farther apart than both are not joined: seconds, and the value's usual distances."""
MAX_ELEMENTS = 32
HEARTBEAT, PARAM_VALUE = 0, 22
INT32 = 6
"""A value of MAV_PARAM_TYPE: PX4 sends its bits in place of a float (docs/autopilots.md)."""
NAMED = {PARAM_VALUE: ("param_id", "param_value"), 251: ("name", "value"), 252: ("name", "value")}
"""Messages with a name and a number: parameters, NAMED_VALUE_FLOAT, NAMED_VALUE_INT."""


class SeriesKey(NamedTuple):
    """One value of one vehicle."""

    vehicle: int
    name: str


@dataclass(frozen=True)
class SeriesName:
    """A value that a flight has."""

    name: str
    """`ATTITUDE.roll`, `BAT.Volt`, `vehicle_status.nav_state`, or the name of a parameter."""
    unit: str
    vehicles: tuple[int, ...]
    is_parameter: bool = False


class FlightSeries(Protocol):
    """What a log has over time. Reading it may raise `TlogError` or `OnboardLogError`."""

    @property
    def begin_s(self) -> float:
        """The time of the first record; NaN in an empty log."""
        ...

    @property
    def end_s(self) -> float:
        """The time of the last record."""
        ...

    def names(self) -> list[SeriesName]:
        """Return all values, sorted by name."""
        ...

    def read(self, wanted: Collection[SeriesKey]) -> dict[SeriesKey, Points]:
        """Return the points of the wanted values; those that the log does not have are missing."""
        ...


class PointCollector:
    """Collects points that come in the order of a log."""

    def __init__(self) -> None:
        """Begin without points."""
        self._found: dict[SeriesKey, tuple[list[float], list[float]]] = {}

    def add(self, key: SeriesKey, t_s: float, value: float) -> None:
        """Take a point; times that run backwards are left out."""
        times_s, values = self._found.setdefault(key, ([], []))
        if len(times_s) < MAX_POINTS and (not times_s or t_s > times_s[-1]):
            times_s.append(t_s)
            values.append(value)

    def points(self) -> dict[SeriesKey, Points]:
        """Return all points, with a gap where nothing came for long."""
        return {
            key: with_gaps(np.array(times_s), safe_values(np.array(values, dtype=np.float64)))
            for key, (times_s, values) in self._found.items()
        }


def with_gaps(times_s: Floats, values: Floats) -> Points:
    """Return the points with a NaN in each long pause."""
    if len(times_s) < 2:
        return times_s, values
    steps_s = np.diff(times_s)
    pauses = np.flatnonzero(steps_s > max(GAP_S, GAP_PERIODS * float(np.median(steps_s))))
    return (
        np.insert(times_s, pauses + 1, times_s[pauses] + steps_s[pauses] / 2),
        np.insert(values, pauses + 1, np.nan),
    )


class TlogSeries:
    """The values in a telemetry log: every number in every message of every vehicle, and parameters."""

    def __init__(self, path: Path) -> None:
        """Look through the log. Raises TlogError."""
        self._path = path
        self.begin_s = self.end_s = math.nan
        self.damaged_bytes = 0
        self._counts: Counter[tuple[int, int, int]] = Counter()
        self._named: dict[tuple[int, int], set[str]] = {}
        """Names in messages that have some, by system and message id."""
        self._autopilots: dict[int, tuple[int, int]] = {}
        """MAV_AUTOPILOT and component by system."""
        self._scan()
        self._senders = self._choose_senders()

    def _scan(self) -> None:
        reader = read_tlog(self._path)
        first, last = math.inf, -math.inf
        for wall_s, frame in reader:
            first, last = min(first, wall_s), max(last, wall_s)
            self._counts[frame.system, frame.component, frame.msgid] += 1
            if frame.msgid == HEARTBEAT or frame.msgid in NAMED:
                self._look_into(frame)
        self.begin_s, self.end_s, self.damaged_bytes = first, last, reader.skipped_bytes

    def _look_into(self, frame: Frame) -> None:
        message = decode(frame)
        if message is None:
            return
        if frame.msgid == HEARTBEAT:
            if message.fields["autopilot"] != AUTOPILOT_INVALID:
                self._autopilots.setdefault(frame.system, (message.fields["autopilot"], frame.component))
            return
        names = self._named.setdefault((frame.system, frame.msgid), set())
        if len(names) < MAX_NAMES:
            names.add(_name_in(frame.msgid, message.fields))

    def _choose_senders(self) -> dict[tuple[int, int], int]:
        """Return the component that counts, by system and message id: the autopilot, else the most frequent sender."""
        senders: dict[tuple[int, int], int] = {}
        for (system, component, msgid), _ in self._counts.most_common():
            known = self._autopilots.get(system)
            if known is None and self._autopilots:
                continue  # a ground station
            if (system, msgid) not in senders or (known is not None and component == known[1]):
                senders[system, msgid] = component
        return senders

    def names(self) -> list[SeriesName]:
        """See `FlightSeries`."""
        vehicles: dict[int, list[int]] = {}
        for system, msgid in sorted(self._senders):
            vehicles.setdefault(msgid, []).append(system)
        found: list[SeriesName] = []
        for msgid, systems in vehicles.items():
            layout = dialect.layout(msgid)
            if msgid in NAMED:
                found += self._names_in(msgid, systems)
            elif layout is not None:
                found += [SeriesName(name, unit, tuple(systems)) for name, unit in numbers_of(layout)]
        return sorted(found, key=lambda each: (each.is_parameter, each.name))[:MAX_NAMES]

    def _names_in(self, msgid: int, systems: Iterable[int]) -> list[SeriesName]:
        holders: dict[str, list[int]] = {}
        for system in systems:
            for name in self._named.get((system, msgid), ()):
                holders.setdefault(name, []).append(system)
        return [SeriesName(name, "", tuple(held), msgid == PARAM_VALUE) for name, held in holders.items()]

    def read(self, wanted: Collection[SeriesKey]) -> dict[SeriesKey, Points]:
        """See `FlightSeries`. A log of 200,000 frames takes a second."""
        collector = PointCollector()
        fields, named = self._wanted_fields(wanted), {key for key in wanted if "." not in key.name or " " in key.name}
        for wall_s, frame in read_tlog(self._path):
            if self._senders.get((frame.system, frame.msgid)) != frame.component:
                continue
            if frame.msgid in NAMED:
                self._collect_named(collector, wall_s, frame, named)
            elif (places := fields.get((frame.system, frame.msgid))) is not None:
                message = decode(frame)
                for place in places if message is not None else ():
                    collector.add(place.key, wall_s, place.value_in(message.fields if message is not None else {}))
        return collector.points()

    def _wanted_fields(self, wanted: Collection[SeriesKey]) -> dict[tuple[int, int], list["_FieldPlace"]]:
        places: dict[tuple[int, int], list[_FieldPlace]] = {}
        for key in wanted:
            message, _, field = key.name.partition(".")
            layout = dialect.layout_named(message)
            if layout is not None and field:
                places.setdefault((key.vehicle, layout.msgid), []).append(_FieldPlace.of(key, layout, field))
        return places

    def _collect_named(self, collector: PointCollector, wall_s: float, frame: Frame, wanted: set[SeriesKey]) -> None:
        message = decode(frame) if wanted else None
        if message is None:
            return
        key = SeriesKey(frame.system, _name_in(frame.msgid, message.fields))
        if key in wanted:
            value = message.fields[NAMED[frame.msgid][1]]
            bytewise = sends_integers_bytewise(self._autopilots.get(frame.system, (0, 0))[0])
            if frame.msgid == PARAM_VALUE and bytewise and message.fields["param_type"] == INT32:
                value = struct.unpack("<i", struct.pack("<f", value))[0]
            collector.add(key, wall_s, float(value))


def _name_in(msgid: int, fields: dict[str, Any]) -> str:
    """Return the name that a message has in it; those of NAMED_VALUE stand behind its number's kind."""
    name = clean(fields[NAMED[msgid][0]], MAX_NAME)
    return name if msgid == PARAM_VALUE else f"named {name}"


@dataclass(frozen=True)
class _FieldPlace:
    """Where a wanted number stands in its message."""

    key: SeriesKey
    field: str
    index: int | None
    """Of an array; None for a single number."""
    meaning: FieldMeaning
    type: str

    @classmethod
    def of(cls, key: SeriesKey, layout: MessageLayout, field: str) -> "_FieldPlace":
        name, at = split_element(field)
        type_ = next((each.type for each in layout.fields if each.name == name), "")
        return cls(key, name, at, field_meaning(layout.name, name), type_)

    def value_in(self, fields: dict[str, Any]) -> float:
        """Return the number in its usual unit; NaN if it is none, or means "not known"."""
        value = number_in(fields.get(self.field), self.index)
        return usual_value(value, self.meaning, self.type) if value is not None else math.nan


def numbers_of(layout: MessageLayout) -> list[tuple[str, str]]:
    """Return (name, unit) of all numbers of a message: `ATTITUDE.roll`, `BATTERY_STATUS.voltages[0]`."""
    found = []
    for field in layout.fields:
        if not field.is_text:
            unit, _ = usual_unit(field_meaning(layout.name, field.name).unit)
            elements = [f"[{at}]" for at in range(min(field.length, MAX_ELEMENTS))] or [""]
            found += [(f"{layout.name}.{field.name}{element}", unit) for element in elements]
    return found
