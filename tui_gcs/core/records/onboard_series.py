"""Values over time in logs that vehicles write themselves: DataFlash (.bin) of ArduPilot, ULog (.ulg) of PX4.

They are read as in `onboard_logs`: by pymavlink's DFReader and by pyulog, an extra of this package.
"""

import math
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from tui_gcs.core.base.text import clean
from tui_gcs.core.records.flight_series import (
    MAX_NAME,
    MAX_NAMES,
    MAX_POINTS,
    FlightSeries,
    PointCollector,
    Points,
    SeriesKey,
    SeriesName,
    TlogSeries,
    with_gaps,
)
from tui_gcs.core.records.onboard_logs import (
    DAMAGED,
    OnboardLogError,
    dataflash_errors,
    first_instances,
    open_dataflash,
    open_ulog,
    system_id,
    time_offset_s,
    wordless,
)
from tui_gcs.core.records.time_series import safe_values

PARAMETER = "PARM"
NOT_PLOTTED = {"FMT", "FMTU", "UNIT", "MULT", "MSG", PARAMETER}
TIME_COLUMNS = ("TimeUS", "TimeMS")
TEXT_LETTERS = "nNZa"
"""Letters of DataFlash formats that are no numbers."""
MAX_LOOKED_INTO = 2000
"""So many messages of one kind are searched for the numbers of its instances."""


class DataFlashSeries:
    """The values in a log of ArduPilot: every number of every message, and parameters."""

    def __init__(self, path: Path) -> None:
        """Look through the log. Raises OnboardLogError."""
        self.begin_s = self.end_s = math.nan
        self._log: Any = open_dataflash(path)
        with dataflash_errors():
            self._instances = {form.name: self._instances_of(form) for form in self._log.formats.values()}
            self._find_span()

    def _instances_of(self, form: Any) -> list[int]:
        """Return the instances that a kind of message has; [] where it has none, or was never written."""
        if form.instance_field is None or form.type not in self._log.formats:
            return []
        found = set()
        for at in self._log.offsets[form.type][:MAX_LOOKED_INTO]:
            begin = at + 3 + form.instance_ofs
            found.add(int.from_bytes(self._log.data_map[begin : begin + form.instance_len], "little"))
        return sorted(found)

    def _find_span(self) -> None:
        times_s = []
        self._log.rewind()
        kinds = [form.name for form in self._log.formats.values() if form.name not in NOT_PLOTTED]
        for _ in range(2):
            with wordless():
                message = self._log.recv_match(type=kinds)
            if message is not None:
                times_s.append(float(message._timestamp))
        self.begin_s = min(times_s, default=math.nan)
        # The last messages of all kinds: reading to the end would take a minute for a long log.
        for offsets in self._log.offsets:
            if len(offsets):
                self._log.offset = int(offsets[-1])
                with wordless():
                    message = self._log._parse_next()
                if message is not None and hasattr(message, "_timestamp"):
                    times_s.append(float(message._timestamp))
        self.end_s = max(times_s, default=math.nan)

    @property
    def _vehicle(self) -> int:
        return system_id(self._log.params)

    def names(self) -> list[SeriesName]:
        """See `FlightSeries`."""
        vehicles = (self._vehicle,)
        found = [SeriesName(clean(name, MAX_NAME), "", vehicles, True) for name in self._log.params]
        for form in self._log.formats.values():
            if form.name in NOT_PLOTTED or not len(self._log.offsets[form.type]):
                continue
            instances = self._instances[form.name]
            kinds = [f"{form.name}[{at}]" for at in instances] if len(instances) > 1 else [form.name]
            for column, letter in zip(form.columns, form.format, strict=False):
                if letter not in TEXT_LETTERS and column not in TIME_COLUMNS and column != form.instance_field:
                    unit = clean(form.get_unit(column), 12)
                    found += [SeriesName(clean(f"{kind}.{column}", MAX_NAME), unit, vehicles) for kind in kinds]
        return sorted(found, key=lambda each: (each.is_parameter, each.name))[:MAX_NAMES]

    def read(self, wanted: Collection[SeriesKey]) -> dict[SeriesKey, Points]:
        """See `FlightSeries`."""
        with dataflash_errors():
            return self._read({key.name for key in wanted if key.vehicle == self._vehicle})

    def _read(self, wanted: set[str]) -> dict[SeriesKey, Points]:
        columns: dict[str, set[str]] = {}
        for name in wanted:
            kind, dot, column = name.partition(".")
            columns.setdefault(kind.partition("[")[0] if dot else PARAMETER, set()).add(column if dot else name)
        collector, vehicle = PointCollector(), self._vehicle
        self._log.rewind()
        while True:
            with wordless():
                message = self._log.recv_match(type=sorted(columns)) if columns else None
            if message is None:
                return collector.points()
            kind, t_s = message.get_type(), float(message._timestamp)
            if kind == PARAMETER:
                if (name := clean(message.Name, MAX_NAME)) in columns[kind]:
                    collector.add(SeriesKey(vehicle, name), t_s, _number(message.Value))
                continue
            instance = message.fmt.instance_field
            where = f"{kind}[{getattr(message, instance)}]" if instance and len(self._instances[kind]) > 1 else kind
            for column in columns[kind]:
                if f"{where}.{column}" in wanted:
                    key = SeriesKey(vehicle, f"{where}.{column}")
                    collector.add(key, t_s, _number(getattr(message, column, math.nan)))


class ULogSeries:
    """The values in a log of PX4: every field of every topic, and parameters."""

    def __init__(self, path: Path) -> None:
        """Read the log. Raises OnboardLogError."""
        log = open_ulog(path)
        try:
            self._parameters = log.initial_parameters
            self._changed = log.changed_parameters
            self._topics: dict[str, dict[str, Any]] = {
                clean(data.name if not data.multi_id else f"{data.name}[{data.multi_id}]", MAX_NAME): data.data
                for data in log.data_list
            }
            self._offset_s = time_offset_s(first_instances(log))
            self._vehicle = int(log.initial_parameters.get("MAV_SYS_ID", 1))
            times_us = [data["timestamp"] for data in self._topics.values() if len(data["timestamp"])]
            self.begin_s = min((float(t[0]) for t in times_us), default=math.nan) / 1e6 + self._offset_s
            self.end_s = max((float(t[-1]) for t in times_us), default=math.nan) / 1e6 + self._offset_s
        except DAMAGED as error:
            raise OnboardLogError(f"not a log of PX4, or damaged ({type(error).__name__})") from None

    def names(self) -> list[SeriesName]:
        """See `FlightSeries`."""
        vehicles = (self._vehicle,)
        fields = [f"{topic}.{field}" for topic, data in self._topics.items() for field in data if field != "timestamp"]
        found = [SeriesName(clean(name, MAX_NAME), "", vehicles) for name in sorted(fields)]
        found += [SeriesName(clean(name, MAX_NAME), "", vehicles, True) for name in sorted(self._parameters)]
        return found[:MAX_NAMES]

    def read(self, wanted: Collection[SeriesKey]) -> dict[SeriesKey, Points]:
        """See `FlightSeries`."""
        found = {}
        for key in wanted:
            topic, _, field = key.name.partition(".")
            data = self._topics.get(topic, {})
            if key.vehicle != self._vehicle:
                continue
            if field in data:
                times_s = np.asarray(data["timestamp"], dtype=np.float64)[:MAX_POINTS] / 1e6 + self._offset_s
                values = safe_values(np.asarray(data[field], dtype=np.float64)[:MAX_POINTS])
                forward = np.concatenate([[True], np.diff(times_s) > 0.0]) if len(times_s) else np.empty(0, dtype=bool)
                found[key] = with_gaps(times_s[forward], values[forward])
            elif key.name in self._parameters:
                found[key] = self._parameter(key.name)
        return found

    def _parameter(self, name: str) -> Points:
        """Return the value at the beginning, at each change, and at the end."""
        changes = [
            (t_us / 1e6 + self._offset_s, float(value)) for t_us, changed, value in self._changed if changed == name
        ]
        points = [(self.begin_s, float(self._parameters[name])), *changes]
        points.append((max(self.end_s, points[-1][0]), points[-1][1]))
        return np.array([t_s for t_s, _ in points]), safe_values(np.array([value for _, value in points]))


def open_flight(path: Path) -> FlightSeries:
    """Return the reader of a log by its ending. Raises OnboardLogError, TlogError."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise OnboardLogError(f"no flight: {', '.join(READERS)}")
    return reader(path)


READERS: dict[str, type[TlogSeries] | type[DataFlashSeries] | type[ULogSeries]] = {
    ".tlog": TlogSeries,
    ".bin": DataFlashSeries,
    ".ulg": ULogSeries,
}


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
