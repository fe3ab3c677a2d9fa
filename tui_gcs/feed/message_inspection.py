"""What the vehicles send, message by message, as far as this console asks the station for it."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tui_gcs.core.mavlink.field_meanings import field_meaning, value_words
from tui_gcs.core.protocol.inspection import GetMessages, Inspection, MessageDetail, MessageKey, MessageRow
from tui_gcs.feed.count_rates import CountRates
from tui_gcs.feed.requests import ConsoleRequests

STATION = "station"
BAD_CRC = "frames with a wrong CRC"


@dataclass(frozen=True)
class InspectedMessage:
    """A kind of message, and how often it comes."""

    row: MessageRow
    rate_hz: float
    """NaN until it was counted twice."""

    @property
    def words(self) -> str:
        """What the filter looks into, in lower case: not kept, because most pictures have no filter."""
        key = self.row.key
        who = f"v{self.row.vehicle}" if self.row.vehicle else f"stranger system {key.system}"
        return f"{who} c{key.component} {self.row.name} {key.msgid} {key.link} {key.address}".casefold()


@dataclass(frozen=True)
class InspectedField:
    """One field in words."""

    name: str
    sent: str
    """The value as it was sent, with MAVLink's unit."""
    means: str
    """Its name, or the value in usual units; "" if that says nothing new."""


@dataclass(frozen=True)
class InspectedFrame:
    """The newest frame of one message."""

    key: MessageKey
    fields: tuple[InspectedField, ...]
    raw: bytes
    remark: str


@dataclass(frozen=True)
class DroppedCount:
    """What was received and not used, for one reason."""

    where: str
    """The address that sent it; `STATION` where the station counts all together."""
    reason: str
    count: int
    per_s: float
    names: str = ""
    """The messages that it concerns, where that is known."""


class MessageInspector:
    """Asks the station what is received. While nothing asks here, nothing is done there."""

    def __init__(self, requests: ConsoleRequests, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called after every answer."""
        self.messages: tuple[InspectedMessage, ...] = ()
        """Sorted by vehicle, component and name."""
        self.dropped: tuple[DroppedCount, ...] = ()
        """What grows fastest first."""
        self.frame: InspectedFrame | None = None
        """The newest frame of the message that was chosen at the last look."""
        self.left_out = 0
        self._requests = requests
        self._on_news = on_news
        self._knows_meanings = False
        self._rates: CountRates[MessageKey] = CountRates()
        self._drop_rates: CountRates[tuple[str, str]] = CountRates()

    def pause(self) -> None:
        """Begin to measure rates anew with the next answer."""
        self._rates.clear()
        self._drop_rates.clear()

    async def look(self, vehicles: tuple[int, ...], chosen: MessageKey | None, station_dropped: dict[str, int]) -> None:
        """Ask once. `station_dropped` is `StationStatus.dropped`, the station's own counts."""
        found = (await self._requests.send(GetMessages(vehicles, chosen))).inspection
        if found is None:
            return
        self._rates.add(found.t_s, {row.key: row.count for row in found.rows})
        self.messages = tuple(InspectedMessage(row, self._rates.of(row.key)) for row in sorted(found.rows, key=_order))
        self.dropped = self._count_dropped(found, station_dropped)
        self.frame = await self._inspected(found.detail) if found.detail is not None else None
        self.left_out = found.left_out
        self._on_news()

    async def _inspected(self, detail: MessageDetail) -> InspectedFrame:
        name = next((each.row.name for each in self.messages if each.row.key == detail.key), "")
        if not self._knows_meanings:
            # The first time this imports pymavlink's dialect, which would hold up a key.
            await asyncio.to_thread(field_meaning, name, "")
            self._knows_meanings = True
        fields = []
        for each in detail.fields:
            sent, means = value_words(each.value, field_meaning(name, each.name), each.type)
            fields.append(InspectedField(each.name, sent, means))
        return InspectedFrame(detail.key, tuple(fields), detail.raw, detail.remark)

    def _count_dropped(self, found: Inspection, station_dropped: dict[str, int]) -> tuple[DroppedCount, ...]:
        counts = {(STATION, reason): count for reason, count in station_dropped.items()}
        names: dict[tuple[str, str], str] = {}
        for source in found.sources:
            where = f"{source.link} {source.address}"
            if source.bad_crc_names:
                names[(where, BAD_CRC)] = ", ".join(source.bad_crc_names)
            counts |= {
                (where, "bytes of no frame"): source.junk_bytes,
                (where, "bytes of plain text"): source.text_bytes,
                (where, "MAVLink 1 after MAVLink 2"): source.version1_refused,
                (where, BAD_CRC): source.bad_crc,
            }
        self._drop_rates.add(found.t_s, counts)
        rows = [
            DroppedCount(*key, count, self._drop_rates.of(key), names.get(key, ""))
            for key, count in counts.items()
            if count
        ]
        return tuple(sorted(rows, key=lambda row: (-(row.per_s if row.per_s == row.per_s else 0.0), -row.count)))


def matching(messages: Sequence[InspectedMessage], words: str) -> list[InspectedMessage]:
    """Return the messages that have every word in their vehicle, component, name, number, link or address."""
    wanted = words.casefold().split()
    if not wanted:
        return list(messages)
    searched = ((each, each.words) for each in messages)
    return [each for each, words in searched if all(word in words for word in wanted)]


def _order(row: MessageRow) -> tuple[bool, int, int, int, str, str, str]:
    key = row.key
    return not row.vehicle, row.vehicle, key.system, key.component, row.name, key.link, key.address
