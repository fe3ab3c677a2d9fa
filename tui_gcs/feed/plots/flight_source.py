"""Points of recorded flights for the plots screen; several logs of one flight are joined by time."""

import asyncio
import math
from collections.abc import Sequence

import numpy as np

from tui_gcs.core.records.flight_series import FlightSeries, Points, SeriesKey, SeriesName
from tui_gcs.core.records.onboard_logs import EARLIEST_WALL_S, OnboardLogError
from tui_gcs.core.records.time_series import Floats
from tui_gcs.core.records.tlog_reader import TlogError
from tui_gcs.feed.plots.plot_source import clock_words
from tui_gcs.feed.plots.plotted_values import WELL_KNOWN, PlotValue, ValueKind, ValueName

NOTHING = (np.empty(0), np.empty(0))


class FlightPlotSource:
    """What logs hold; a log is read again when values of it are plotted first."""

    is_live = False
    kind_words = "recorded"

    def __init__(self, flights: Sequence[FlightSeries]) -> None:
        """Take points from logs that were looked through."""
        self._flights = flights
        self._names: list[tuple[FlightSeries, SeriesName]] = [
            (flight, name) for flight in flights for name in flight.names()
        ]
        self._points: dict[SeriesKey, Points] = {}
        self._followed: list[PlotValue] = []
        self.error = ""
        """Why a log could not be read again."""

    @property
    def begin_s(self) -> float:
        """The time of the first record of all logs; NaN if they hold none."""
        return min((flight.begin_s for flight in self._flights if math.isfinite(flight.begin_s)), default=math.nan)

    @property
    def now_s(self) -> float:
        """The time of the last record of all logs."""
        return max((flight.end_s for flight in self._flights if math.isfinite(flight.end_s)), default=math.nan)

    @property
    def vehicles(self) -> tuple[int, ...]:
        """All vehicles in the logs."""
        return tuple(sorted({vehicle for _, name in self._names for vehicle in name.vehicles}))

    @property
    def is_reading(self) -> bool:
        """Whether points of followed values are still missing."""
        return any(_key(value) not in self._points for value in self._followed)

    def names(self) -> list[ValueName]:
        """Return all values of all logs; those that are well known by other words come first."""
        found = [
            ValueName(
                ValueKind.PARAMETER if name.is_parameter else ValueKind.FIELD,
                name.name,
                name.unit,
                WELL_KNOWN.get(name.name, ""),
                holders=name.vehicles,
            )
            for _, name in self._names
        ]
        order = {name: at for at, name in enumerate(WELL_KNOWN)}
        return sorted(found, key=lambda each: order.get(each.name, len(order)))

    async def more_names(self) -> list[ValueName]:
        """See `PlotSource`: everything is known at once."""
        return []

    def follow(self, values: list[PlotValue]) -> None:
        """See `PlotSource`; points of other values are forgotten."""
        self._followed = values
        kept = {_key(value) for value in values}
        self._points = {key: points for key, points in self._points.items() if key in kept}

    async def ask(self) -> None:
        """Read what is followed and was not read yet, beside the screen."""
        await asyncio.to_thread(self.read)

    def read(self) -> None:
        """Read what is followed and was not read yet; a failure is in `error`."""
        missing = [key for key in map(_key, self._followed) if key not in self._points]
        if not missing:
            return
        found: dict[SeriesKey, list[Points]] = {key: [] for key in missing}
        for flight in self._flights:
            try:
                for key, points in flight.read(missing).items():
                    found[key].append(points)
            except (TlogError, OnboardLogError) as error:
                self.error = str(error)
        self._points |= {key: joined(parts) for key, parts in found.items()}

    def points(self, value: PlotValue, from_s: float = -math.inf, to_s: float = math.inf) -> tuple[Floats, Floats]:
        """See `PlotSource`."""
        times_s, values = self._points.get(_key(value), NOTHING)
        first = max(0, int(np.searchsorted(times_s, from_s)) - 1)
        last = int(np.searchsorted(times_s, to_s, side="right"))
        return times_s[first:last], values[first:last]

    def time_words(self, t_s: float) -> str:
        """Return the time of day in UTC, or the time since boot where the logs have no other."""
        if math.isfinite(self.begin_s) and self.begin_s >= EARLIEST_WALL_S:
            return clock_words(t_s)
        whole = int(t_s) if math.isfinite(t_s) else 0
        return f"T+{whole // 60:02d}:{whole % 60:02d}"


def joined(parts: Sequence[Points]) -> Points:
    """Return the points of one value in several logs in order of time, with a gap where one log ends."""
    if len(parts) < 2:
        return parts[0] if parts else NOTHING
    ends = [(np.nextafter(times_s[-1:], np.inf), np.full(len(times_s[-1:]), np.nan)) for times_s, _ in parts]
    times_s = np.concatenate([times_s for times_s, _ in (*parts, *ends)])
    values = np.concatenate([values for _, values in (*parts, *ends)])
    order = np.argsort(times_s, kind="stable")
    return times_s[order], values[order]


def _key(value: PlotValue) -> SeriesKey:
    return SeriesKey(value.subject if isinstance(value.subject, int) else 0, value.name)
