"""Records what is plotted, as it comes; and of all published values one row a second, for plots that begin later."""

import math
from collections.abc import Hashable, Iterable

import numpy as np

from tui_gcs.core.protocol.common import FleetFrame, StationStatus
from tui_gcs.core.protocol.inspection import MAX_VALUES, GetValues, ValueKey
from tui_gcs.core.records.time_series import TimeSeries
from tui_gcs.feed.plots.plotted_values import (
    TELEMETRY,
    PlotValue,
    ValueKind,
    field_value,
    metric_values,
    telemetry_table,
)
from tui_gcs.feed.plots.value_history import ValueHistory
from tui_gcs.feed.requests import ConsoleRequests

GAP_S = 5.0
"""Nothing was recorded for so long: the line is interrupted there."""
ASKED = (ValueKind.FIELD, ValueKind.PARAMETER)
"""Kinds that are not published."""


class ValueRecorder:
    """Fills a `TimeSeries` for each value that is followed."""

    def __init__(self, requests: ConsoleRequests) -> None:
        """Ask the station by `requests` for what it does not publish."""
        self.now_s = math.nan
        """Station time of what was recorded last."""
        self.wall_ahead_s = math.nan
        """What is added to station time for seconds since 1970."""
        self._requests = requests
        self._series: dict[PlotValue, TimeSeries] = {}
        self._telemetry = ValueHistory()
        self._metrics = ValueHistory()
        self._telemetry_keys: tuple[tuple[int, ...], tuple[Hashable, ...]] = ((), ())
        self._places = {each.name: at for at, each in enumerate(TELEMETRY)}

    def follow(self, values: Iterable[PlotValue]) -> None:
        """Record these values and no others; what is known of them already is the beginning of a new series."""
        before, self._series = self._series, {}
        for value in values:
            self._series[value] = before.get(value) or self._begun(value)

    def _begun(self, value: PlotValue) -> TimeSeries:
        series = TimeSeries()
        if value.kind is ValueKind.TELEMETRY:
            series.extend(*self._telemetry.points((value.subject, value.name)))
        elif value.kind is ValueKind.METRIC:
            series.extend(*self._metrics.points(value))
        return series

    def series(self, value: PlotValue) -> TimeSeries:
        """Return the points of a value; none if it is not followed."""
        return self._series.get(value) or TimeSeries()

    def take_frame(self, frame: FleetFrame) -> None:
        """Record telemetry."""
        self.now_s, self.wall_ahead_s = frame.t_s, frame.wall_s - frame.t_s
        followed = [value for value in self._series if value.kind is ValueKind.TELEMETRY]
        is_due = self._telemetry.is_due(frame.t_s)
        if not frame.ids or not (followed or is_due):
            return
        table = telemetry_table(frame)
        rows: dict[int | str, int] = {vehicle: row for row, vehicle in enumerate(frame.ids)}
        for value in followed:
            row, column = rows.get(value.subject), self._places.get(value.name)
            number = math.nan if row is None or column is None else float(table[row, column])
            _add(self._series[value], frame.t_s, number)
        if is_due:
            self._telemetry.add(frame.t_s, self._keys_of(frame.ids), table.ravel())

    def _keys_of(self, vehicles: tuple[int, ...]) -> tuple[Hashable, ...]:
        if self._telemetry_keys[0] != vehicles:
            keys = tuple((vehicle, each.name) for vehicle in vehicles for each in TELEMETRY)
            self._telemetry_keys = (vehicles, keys)
        return self._telemetry_keys[1]

    def take_status(self, status: StationStatus) -> None:
        """Record metrics."""
        followed = [value for value in self._series if value.kind is ValueKind.METRIC]
        is_due = self._metrics.is_due(status.t_s)
        if not followed and not is_due:
            return
        found = metric_values(status)
        for value in followed:
            _add(self._series[value], status.t_s, found.get(value, math.nan))
        if is_due:
            self._metrics.add(status.t_s, tuple(found), np.array(list(found.values())))

    async def ask(self) -> None:
        """Ask once for the newest fields and parameters that are followed."""
        asked = [value for value in self._series if value.kind in ASKED and isinstance(value.subject, int)][:MAX_VALUES]
        if not asked:
            return
        keys = tuple(
            ValueKey(int(value.subject), value.name, is_parameter=value.kind is ValueKind.PARAMETER) for value in asked
        )
        reply = await self._requests.send(GetValues(keys))
        for value, row in zip(asked, reply.values, strict=False):
            if value in self._series and math.isfinite(row.t_s):
                number = field_value(value.name, row.value) if value.kind is ValueKind.FIELD else row.value
                _add(self._series[value], row.t_s, number)


def _add(series: TimeSeries, t_s: float, value: float) -> None:
    if t_s - series.last_s > GAP_S and len(series):
        series.add(series.last_s + GAP_S / 2, math.nan)
    series.add(t_s, value)
