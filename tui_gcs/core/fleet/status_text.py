"""Status texts: STATUSTEXT, whole or in chunks (MAVLink common.xml, message 253), and the texts of EVENTs.

A text with `id` 0 is whole, except for PX4's first one after a boot. Otherwise chunks carry the same `id` and count
from 0; the last one contains a NUL, that is, it is shorter than 50 characters. A text that stays incomplete for a
second is reported with " ... " for the gaps, as in QGroundControl.
"""

import re
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.failsafe_texts import is_of_failsafe
from tui_gcs.core.mavlink.frames import MAGIC_V2
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING, EventLog

# STATUSTEXT.text has 50 characters; longer texts come in chunks with one id (docs/autopilots.md C9).
CHUNK_CHARS = 50
# QGroundControl waits as long for missing chunks, then shows what it has.
CHUNK_TIMEOUT_S = 1.0
# 500 characters are far more than any autopilot writes; chunk_seq itself would allow 12,800.
MAX_CHUNKS = 10
MAX_OPEN_TEXTS = 4
"""Incomplete texts of one vehicle: vehicles send the chunks of a text one after the other."""
MAX_BURST_TEXTS, TEXTS_PER_S = 60.0, 5.0
"""An autopilot sends about 30 lines when it boots, and a few a minute later."""
MAX_FRAMES_PER_S = 200
"""Frames read per vehicle and second, urgent and other ones each: 30 lines in five chunks are fewer. More is a flood
(4,000 fit into one datagram), and reading a frame costs ten times what counting it does."""
URGENT = 2
"""MAV_SEVERITY_CRITICAL and worse."""
TAB = "\u2409"
"""The tab character as `clean` shows it. PX4 ends texts that it also sends as an EVENT in one."""
REPEAT_WINDOW_S, REPEATS_KEPT, MIN_SHARED_WORDS = 1.0, 20, 0.5
"""A text and an EVENT with the same news come within this time and share this part of the words of the shorter one.

Measured with PX4: 0-100 ms apart, either first, and worded differently: "IGN MISSION_ITEM: Invalid item" is "Ignoring
mission item, invalid item".
"""
MIN_EXTRA_WORDS = 2
"""A repeat with this many more words is reported as well: "Failsafe activated", then its EVENT "Failsafe activated:
Autopilot disengaged, switching to Descend" (a real PX4 that lost its GPS)."""
MAX_REASONS = 20
_WORD = re.compile(r"[^\W_]+")


@dataclass
class _Open:
    """A text with chunks missing."""

    severity: int
    since_s: float
    chunks: dict[int, str] = field(default_factory=dict)
    last: int | None = None

    def text(self) -> str:
        """Return the text so far, with " ... " for the gaps."""
        end = self.last if self.last is not None else max(self.chunks)
        return "".join(self.chunks.get(i, " ... ") for i in range(end + 1))


class TextRateLimiter:
    """Token bucket per vehicle: a burst of texts and then a few a second (docs/threats.md B.6-83).

    Urgent texts have a bucket of their own, so that other texts never hide them.
    """

    def __init__(self) -> None:
        self._buckets: dict[tuple[int, bool], tuple[float, float]] = {}

    def has_room(self, system: int, severity: int, now: float) -> bool:
        """Return whether one more text may be reported."""
        return self._tokens(system, severity, now) >= 1.0

    def count(self, system: int, severity: int, now: float) -> None:
        """Take one text out of the budget."""
        self._buckets[(system, severity <= URGENT)] = (self._tokens(system, severity, now) - 1.0, now)

    def _tokens(self, system: int, severity: int, now: float) -> float:
        left, at_s = self._buckets.get((system, severity <= URGENT), (MAX_BURST_TEXTS, now))
        return min(MAX_BURST_TEXTS, left + TEXTS_PER_S * (now - at_s))


class TextFrameLimiter:
    """Limits how many STATUSTEXT frames are read at all, per vehicle."""

    def __init__(self) -> None:
        self._seen: dict[tuple[int, bool], tuple[float, int]] = {}

    def has_room(self, vehicle: int, severity: int, now: float) -> bool:
        """Return whether one more frame is read, and count it if so."""
        key = (vehicle, severity <= URGENT)
        since_s, count = self._seen.get(key, (now, 0))
        if now - since_s >= 1.0:
            since_s, count = now, 0
        if count >= MAX_FRAMES_PER_S:
            return False
        self._seen[key] = (since_s, count + 1)
        return True


class TextAssembler:
    """Assembles chunks to whole texts. What it keeps is bounded, whatever arrives."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int], _Open] = {}

    def add(self, system: int, fields: dict[str, Any], now: float) -> str | None:
        """Take one STATUSTEXT and return the whole text if it is complete now; None if not."""
        text: str = fields["text"]
        chunk_id, index = fields.get("id", 0), fields.get("chunk_seq", 0)
        # A text with id 0 is no chunk, except for the first one of PX4.
        if chunk_id == 0 and self._is_whole(system, text, index):
            return text
        # A chunk number beyond any real text: it would only fill memory.
        if index >= MAX_CHUNKS:
            return None
        key = (system, chunk_id)
        if key in self._open and index in self._open[key].chunks and self._open[key].chunks[index] != text:
            # The id is used again, for another text.
            del self._open[key]
        if key not in self._open and sum(1 for sender, _ in self._open if sender == system) >= MAX_OPEN_TEXTS:
            return text
        part = self._open.setdefault(key, _Open(fields["severity"], now))
        part.chunks[index] = text
        if len(text) < CHUNK_CHARS:
            part.last = index
        if part.last is not None and all(i in part.chunks for i in range(part.last + 1)):
            del self._open[key]
            return part.text()
        return None

    def _is_whole(self, system: int, text: str, index: int) -> bool:
        """Return whether a text with id 0 is whole.

        PX4's first text after a boot has that id, and chunks if it is long (measured).
        """
        held = self._open.get((system, 0))
        return index == 0 and (len(text) < CHUNK_CHARS or (held is not None and held.chunks.get(0, text) != text))

    def expired(self, now: float) -> Iterator[tuple[int, int, str]]:
        """Yield (vehicle, severity, text) of texts that stayed incomplete for too long, and forget them."""
        for key in [k for k, part in self._open.items() if now - part.since_s > CHUNK_TIMEOUT_S]:
            part = self._open.pop(key)
            yield key[0], part.severity, part.text()


class EventTextMatcher:
    """Finds news that come twice, as a text and as an EVENT: the second is dropped unless it holds clearly more."""

    def __init__(self) -> None:
        self._recent: dict[int, deque[tuple[float, bool, frozenset[str]]]] = {}

    def is_repeat(self, vehicle: int, text: str, *, event: bool, now: float) -> bool:
        """Return whether `text` repeats what just came the other way; else remember it as the first."""
        recent = self._recent.setdefault(vehicle, deque(maxlen=REPEATS_KEPT))
        words = frozenset(_WORD.findall(text.casefold()))
        for entry in recent:
            when, was_event, others = entry
            if was_event != event and now - when <= REPEAT_WINDOW_S:
                fewer = min(len(words), len(others))
                if fewer and len(words & others) >= MIN_SHARED_WORDS * fewer:
                    recent.remove(entry)
                    return not (others < words and len(words - others) >= MIN_EXTRA_WORDS)
        recent.append((now, event, words))
        return False


MAX_REPEAT_S = 60.0
"""A text that is repeated for ever is reported at least this often: ArduPilot repeats some texts every 5 s."""


class StatusTextReporter:
    """Reports vehicles' texts as events, each once and at a bounded rate; keeps those that may explain a refusal."""

    def __init__(self, clock: Clock, events: EventLog, dropped: RejectionCounter) -> None:
        """Texts that are not reported are counted in `dropped`."""
        self._clock = clock
        self._events = events
        self._dropped = dropped
        self._assembler = TextAssembler()
        self._frames = TextFrameLimiter()
        self._pace = TextRateLimiter()
        self._matcher = EventTextMatcher()
        self.hidden = 0
        """How many texts and EVENTs were dropped because they repeated each other."""

    def has_room(self, vehicle: Vehicle, raw: bytes) -> bool:
        """Return whether this STATUSTEXT frame is to be read; if not, it is counted."""
        severity = raw[10] if raw[0] == MAGIC_V2 else raw[6]
        if self._frames.has_room(vehicle.id, severity, self._clock.now()):
            return True
        self._dropped.count("status texts too fast", vehicle.id)
        return False

    def take_status_text(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        """Take the fields of a STATUSTEXT."""
        whole = self._assembler.add(vehicle.id, fields, self._clock.now())
        if whole is not None:
            self._report_text(vehicle, fields["severity"], whole)

    def take_event(self, vehicle: Vehicle, severity: int, text: str) -> None:
        """Take an EVENT that was decoded to `text`."""
        if self._matcher.is_repeat(vehicle.id, text, event=True, now=self._clock.now()):
            self.hidden += 1
        else:
            self._report(vehicle, severity, text)

    def keep_reason(self, vehicle: Vehicle, text: str) -> None:
        """Keep a text that may explain a refusal; see `Vehicle.reasons_since`."""
        vehicle.recent_reasons = [*vehicle.recent_reasons[1 - MAX_REASONS :], (self._clock.now(), text)]

    def tick(self, vehicles: Mapping[int, Vehicle]) -> None:
        """Report the texts that stayed incomplete for too long."""
        for number, severity, text in self._assembler.expired(self._clock.now()):
            if number in vehicles:
                self._report_text(vehicles[number], severity, text)

    def _report_text(self, vehicle: Vehicle, severity: int, text: str) -> None:
        if text.endswith(TAB) and self._matcher.is_repeat(vehicle.id, text, event=False, now=self._clock.now()):
            self.hidden += 1
        else:
            self._report(vehicle, severity, text.rstrip(f"{TAB} "))

    def _report(self, vehicle: Vehicle, severity: int, text: str) -> None:
        severity = severity if 0 <= severity <= 7 else NOTICE
        # ArduPilot reports a fence breach with severity NOTICE only.
        if severity <= WARNING or is_of_failsafe(text):
            self.keep_reason(vehicle, text)
        now = self._clock.now()
        if not self._pace.has_room(vehicle.id, severity, now):
            self._dropped.count("status texts too fast", vehicle.id)
            return
        cls = EventClass.SENSOR if text.startswith(("PreArm", "Arm:", "EKF", "GPS")) else EventClass.VEHICLE
        if self._events.report(cls, f"vehicle {vehicle.id}", text, severity, every_s=5, seldom_s=MAX_REPEAT_S):
            self._pace.count(vehicle.id, severity, now)
