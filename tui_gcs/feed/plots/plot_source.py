"""Where the points of plots come from: the station, live. A recorded flight is another source of the same kind."""

import asyncio
import math
import time
from typing import Protocol

import numpy as np

from tui_gcs.core.protocol.inspection import GetMessages
from tui_gcs.core.protocol.services import GetParams
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.plots.plotted_values import (
    Floats,
    PlotValue,
    ValueName,
    field_names,
    metric_names,
    parameter_names,
    telemetry_names,
)
from tui_gcs.feed.plots.value_recorder import ValueRecorder


class PlotSource(Protocol):
    """Values over time, and what there is."""

    is_live: bool
    """Whether points are still coming."""

    @property
    def kind_words(self) -> str:
        """Return what the points are: live, of a replay, recorded."""
        ...

    @property
    def now_s(self) -> float:
        """The time of the newest point; NaN while there is none."""
        ...

    @property
    def begin_s(self) -> float:
        """The time of the first record; NaN where each value begins at a time of its own."""
        ...

    @property
    def vehicles(self) -> tuple[int, ...]:
        """The vehicles that a chosen value is meant for."""
        ...

    def names(self) -> list[ValueName]:
        """Return what can be plotted and is known at once."""
        ...

    async def more_names(self) -> list[ValueName]:
        """Return what else can be plotted; it may take a second."""
        ...

    def follow(self, values: list[PlotValue]) -> None:
        """Record these values, and no others."""
        ...

    async def ask(self) -> None:
        """Ask for new points where they do not come by themselves."""
        ...

    def points(self, value: PlotValue, from_s: float = -math.inf, to_s: float = math.inf) -> tuple[Floats, Floats]:
        """Return (times, values) within a span, and one point before it."""
        ...

    def time_words(self, t_s: float) -> str:
        """Return a time for people."""
        ...


class LivePlotSource:
    """What the station of a console knows, as it comes."""

    is_live = True
    begin_s = math.nan

    def __init__(self, feed: Feed, recorder: ValueRecorder) -> None:
        """Take points from `recorder`, which is filled while the console runs."""
        self._feed = feed
        self._recorder = recorder

    @property
    def kind_words(self) -> str:
        """See `PlotSource`; the player of a recording publishes as a station does."""
        replay = self._feed.status.replay if self._feed.status is not None else None
        if replay is None:
            return "live"
        return "replay, paused" if replay.paused else "replay"

    @property
    def now_s(self) -> float:
        """See `PlotSource`."""
        return self._recorder.now_s

    @property
    def vehicles(self) -> tuple[int, ...]:
        """The selected vehicles; all while none is selected."""
        return self._feed.shown_vehicles()

    def names(self) -> list[ValueName]:
        """See `PlotSource`."""
        return [*telemetry_names(), *metric_names(self._feed.status)]

    async def more_names(self) -> list[ValueName]:
        """Ask for the messages and parameters of the first vehicle that is meant."""
        vehicles = self.vehicles[:1]
        if not vehicles:
            return []
        messages = (await self._feed.requests.send(GetMessages(vehicles))).inspection
        params = await self._feed.requests.send(GetParams(vehicles[0]))
        rows = messages.rows if messages is not None else ()
        # The first time this imports pymavlink's dialect, which would hold up a key.
        fields = await asyncio.to_thread(field_names, sorted({row.name for row in rows if row.vehicle}))
        return [*fields, *parameter_names(sorted(params.params, key=lambda row: row.name))]

    def follow(self, values: list[PlotValue]) -> None:
        """See `PlotSource`."""
        self._recorder.follow(values)

    async def ask(self) -> None:
        """See `PlotSource`."""
        await self._recorder.ask()

    def points(self, value: PlotValue, from_s: float = -math.inf, to_s: float = math.inf) -> tuple[Floats, Floats]:
        """See `PlotSource`."""
        return self._recorder.series(value).points(from_s, to_s)

    def time_words(self, t_s: float) -> str:
        """Return the time of day in UTC."""
        return clock_words(t_s + self._recorder.wall_ahead_s)


def clock_words(wall_s: float) -> str:
    """Return seconds since 1970 as the time of day in UTC; `--` where they are not known."""
    if not math.isfinite(wall_s) or not 0.0 <= wall_s < 4e9:
        return "--"
    return time.strftime("%H:%M:%S", time.gmtime(wall_s))


def first_s(source: PlotSource, values: list[PlotValue]) -> float:
    """Return the time of the oldest point of these values; the newest time where there is none."""
    firsts = [times_s[0] for times_s, _ in (source.points(value) for value in values) if len(times_s)]
    return float(np.min(firsts)) if firsts else source.now_s
