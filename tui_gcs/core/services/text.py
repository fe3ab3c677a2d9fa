"""STATUSTEXT: puts chunked texts together (MAVLink common.xml, message 253).

A text with `id` 0 is whole. Otherwise chunks carry the same `id` and count from 0; the last one contains a NUL,
that is, it is shorter than 50 characters. What stays incomplete for a second is told with " ... " for the gaps,
as QGroundControl does.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

CHUNK_CHARS = 50
WAIT_S = 1.0
MOST_CHUNKS = 10
MOST_OPEN = 32
BURST, TEXTS_PER_S = 60.0, 5.0
"""An autopilot says some 30 lines when it boots, and a few a minute later."""
URGENT = 2
"""MAV_SEVERITY_CRITICAL and worse."""


@dataclass
class _Open:
    severity: int
    since_s: float
    chunks: dict[int, str] = field(default_factory=dict)
    last: int | None = None

    def text(self) -> str:
        end = self.last if self.last is not None else max(self.chunks)
        return "".join(self.chunks.get(i, " ... ") for i in range(end + 1))


class TextPace:
    """How many texts of each vehicle are told: a burst and so many a second (security.md B.6-83).

    What is urgent has a count of its own, so that chatter never hides it.
    """

    def __init__(self) -> None:
        """Nobody said anything."""
        self._left: dict[tuple[int, bool], tuple[float, float]] = {}

    def has_room(self, system: int, severity: int, now: float) -> bool:
        """Whether one more may be told."""
        return self._count(system, severity, now) >= 1.0

    def told(self, system: int, severity: int, now: float) -> None:
        """One more was told."""
        self._left[(system, severity <= URGENT)] = (self._count(system, severity, now) - 1.0, now)

    def _count(self, system: int, severity: int, now: float) -> float:
        left, at_s = self._left.get((system, severity <= URGENT), (BURST, now))
        return min(BURST, left + TEXTS_PER_S * (now - at_s))


class TextAssembler:
    """Chunks in, whole texts out; bounded whatever arrives."""

    def __init__(self) -> None:
        """Nothing open."""
        self._open: dict[tuple[int, int], _Open] = {}

    def add(self, system: int, fields: dict[str, Any], now: float) -> str | None:
        """The whole text if this chunk completes one (or stands alone)."""
        text: str = fields["text"]
        chunk_id, index = fields.get("id", 0), fields.get("chunk_seq", 0)
        if chunk_id == 0:
            return text
        if index >= MOST_CHUNKS:
            return None
        key = (system, chunk_id)
        if key not in self._open and len(self._open) >= MOST_OPEN:
            return text
        part = self._open.setdefault(key, _Open(fields["severity"], now))
        part.chunks[index] = text
        if len(text) < CHUNK_CHARS:
            part.last = index
        if part.last is not None and all(i in part.chunks for i in range(part.last + 1)):
            del self._open[key]
            return part.text()
        return None

    def expired(self, now: float) -> Iterator[tuple[int, int, str]]:
        """(system, severity, text) of texts whose missing chunks did not come in time; they are forgotten."""
        for key in [k for k, part in self._open.items() if now - part.since_s > WAIT_S]:
            part = self._open.pop(key)
            yield key[0], part.severity, part.text()
