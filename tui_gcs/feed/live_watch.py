"""The stations that fly while a recording is shown: their worst news in one line, and HOLD ALL.

A replay has a bus of its own on which no vehicle is. A `LiveWatch` listens to the stations of this computer beside it.
It asks them nothing and has one order: a hold of all vehicles. An emergency stop works whatever else the operator does
(ISO 13850, 4.1.1.2): whoever presses HOLD ALL expects that what flies stops. Every other key stays in the replay.
"""

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import msgspec

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.bus import Bus, BusError, Closable
from tui_gcs.core.protocol.common import (
    FleetFrame,
    Freshness,
    Hold,
    RunKind,
    RunPhase,
    StationStatus,
    decode,
)
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.feed.notices import ALARM_SEVERITIES, Notice, Severity
from tui_gcs.feed.stop_requests import TRIES_OVER_RESTART, StopRequests

_Sample = TypeVar("_Sample", StationStatus, FleetFrame, ServiceReply)

LOOK_S = 0.5
"""A console looks as often as a station publishes its status."""
SILENT_S = 3.0
"""A station that publishes no status this long is reported as silent; it publishes two a second."""
MAX_CELLS = 300


@dataclass(frozen=True)
class LiveNews:
    """What the operator of a replay must know of the stations that fly."""

    line: Notice
    """Of all stations, the worst first; an empty text where none was heard."""
    subjects: frozenset[str] = frozenset()
    """What is to be noticed, without changing numbers."""
    rings: bool = False
    """Something of it is new since the last look."""


@dataclass
class _HeardStation:
    """The latest of one station; `heard_s` is when its newest status came, in seconds of the console's clock."""

    kind: RunKind
    bus: Bus
    stops: StopRequests
    samples: dict[str, bytes] = field(default_factory=dict)
    subscriptions: list[Closable] = field(default_factory=list)
    status: StationStatus | None = None
    frame: FleetFrame | None = None
    heard_s: float = 0.0

    def read(self, now_s: float) -> None:
        """Decode what came since the last call. A sample that cannot be decoded leaves what was known."""
        # Bus threads only replace whole samples: taking each by its key needs no lock.
        if (data := self.samples.pop(keys.STATUS, None)) is not None:
            self.heard_s = now_s
            self.status = _decoded(data, StationStatus) or self.status
        if (data := self.samples.pop(keys.FLEET, None)) is not None:
            self.frame = _decoded(data, FleetFrame) or self.frame


class LiveWatch:
    """Listens to the stations on some buses. Everything but the bus callbacks runs on the event loop."""

    def __init__(self, buses: Mapping[RunKind, Bus], principal: str, clock: Clock) -> None:
        """Listen on the bus of each kind of station; a hold is asked as `principal`."""
        key = keys.REQUEST.format(principal=principal)
        self._stations = [_HeardStation(kind, bus, StopRequests(bus, key)) for kind, bus in buses.items()]
        self._clock = clock
        self._seen: frozenset[str] = frozenset()

    def open(self) -> None:
        """Begin to listen."""
        for station in self._stations:
            for key in (keys.STATUS, keys.FLEET):
                station.subscriptions.append(station.bus.subscribe(key, station.samples.__setitem__))

    def close(self) -> None:
        """End listening, and the repetition of a hold. The buses stay open."""
        for station in self._stations:
            station.stops.close()
            while station.subscriptions:
                station.subscriptions.pop().close()

    @property
    def kinds(self) -> tuple[RunKind, ...]:
        """The stations that were heard and not ended; HOLD ALL is for those."""
        now_s = self._clock.now()
        for station in self._stations:
            station.read(now_s)
        return tuple(one.kind for one in self._stations if one.status is not None and not one.status.ending)

    @property
    def words(self) -> str:
        """The names of `kinds`; "" where no station was heard."""
        return " and ".join(self.kinds)

    def news(self) -> LiveNews:
        """Return what is to be said of all stations now."""
        now_s, kinds = self._clock.now(), self.kinds
        found = [_news(one, now_s) for one in self._stations if one.kind in kinds]
        subjects: frozenset[str] = frozenset().union(*(news.subjects for news in found))
        rings, self._seen = bool(subjects - self._seen), subjects
        if not found:
            return LiveNews(Notice(""))
        found.sort(key=lambda news: -news.line.level)
        words = "  | ".join(news.line.text for news in found)
        return LiveNews(Notice(clean(words, MAX_CELLS), found[0].line.level), subjects, rings)

    async def hold_all(self) -> Notice:
        """Have every station that was heard hold all its vehicles; return what they answered."""
        kinds = self.kinds
        # All are sent before the first answer is awaited.
        asked = [(one.kind, one.stops.begin(Hold(), TRIES_OVER_RESTART)) for one in self._stations if one.kind in kinds]
        answers = await asyncio.gather(*(answer for _, answer in asked), return_exceptions=True)
        results = [_answer(kind, answer) for (kind, _), answer in zip(asked, answers, strict=True)]
        text = "  | ".join(result.text for result in results)
        return Notice(clean(text, MAX_CELLS), max((result.level for result in results), default=Severity.NORMAL))


def _news(station: _HeardStation, now_s: float) -> LiveNews:
    kind, status = station.kind, station.status
    silent_s = now_s - station.heard_s
    if status is None or silent_s > SILENT_S:
        text = f"{kind} station silent for {silent_s:.0f} s"
        return LiveNews(Notice(text, Severity.WARNING), frozenset({f"{kind} silent"}))
    words, level, subjects = [str(kind)], Severity.NORMAL, set()
    alarms = [alarm for alarm in status.alarms if alarm.state != "shelved"]
    if alarms:
        words.append(alarms[0].words())
        level = ALARM_SEVERITIES[alarms[0].level]
        subjects |= {f"{kind} alarm {alarm.cause} {alarm.raised}" for alarm in alarms if alarm.state == "new"}
    named = {vehicle for alarm in alarms if alarm.cause == "lost" for vehicle in alarm.vehicles}
    lost = [vehicle for vehicle in _lost(station.frame) if vehicle not in named]
    if lost:
        words.append(f"LOST {id_ranges(lost)}")
        level = max(level, Severity.CAUTION)
        subjects |= {f"{kind} lost {vehicle}" for vehicle in lost}
    if status.armed:
        words.append(f"{status.armed} ARMED")
        level = max(level, Severity.CAUTION)
        subjects.add(f"{kind} armed")
    words += ["HOLD"] if status.run is RunPhase.HOLD else []
    words.append(f"{status.heard}/{status.vehicles} heard")
    return LiveNews(Notice("  ".join(words), level), frozenset(subjects))


def _lost(frame: FleetFrame | None) -> tuple[int, ...]:
    if frame is None:
        return ()
    pairs: Iterable[tuple[int, Freshness]] = zip(frame.ids, frame.freshness, strict=True)
    return tuple(vehicle for vehicle, freshness in pairs if freshness is Freshness.LOST)


def _answer(kind: RunKind, answer: bytes | BaseException) -> Notice:
    """Say what became of a hold."""
    if isinstance(answer, BusError):
        return Notice(f"HOLD ALL {kind}: NO ANSWER ({answer}): press it again, watch the vehicles", Severity.WARNING)
    if isinstance(answer, BaseException):
        raise answer
    reply = _decoded(answer, ServiceReply)
    if reply is None:
        return Notice(f"HOLD ALL {kind}: its answer cannot be read: another version of tui-gcs?", Severity.WARNING)
    refused = [f"{result.vehicle}: {result.text}" for result in reply.results if not result.ok]
    if refused or not reply.ok:
        why = f" for {'; '.join(refused)}" if refused else f": {reply.text}"
        return Notice(f"HOLD ALL {kind} NOT DONE{why}", Severity.WARNING)
    return Notice(f"HOLD ALL {kind}: sent to {len(reply.results)}", Severity.CAUTION)


def _decoded(data: bytes, what: type[_Sample]) -> _Sample | None:
    try:
        return decode(data, what)
    except msgspec.MsgspecError:
        return None
