"""Received messages: the newest frame and value of every kind, for inspector and plots.

Nothing here collects: an answer is read from the intake, which holds the newest frame of every kind anyway. So a
recording that is replayed answers like a station.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.identity.path import PathState
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.command_rules import KEYS
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.field_meanings import number_in, split_element
from tui_gcs.core.mavlink.frames import MAGIC_V2
from tui_gcs.core.mavlink.message_definitions import FieldDefinition
from tui_gcs.core.mavlink.signing import for_log
from tui_gcs.core.mavlink.sources import Slot, Source
from tui_gcs.core.protocol import inspection as p
from tui_gcs.core.protocol.services import ServiceReply

MAX_BAD_CRC_NAMES = 4
UNKNOWN_VALUE = p.ValueRow(math.nan, math.nan)
KEY_REMARK = "it holds a key: neither fields nor bytes are shown"


class ReceivedMessages:
    """Answers what inspector and plots ask of the messages of a fleet."""

    def __init__(self, fleet: VehicleRegistry, clock: Clock, parameter: Callable[[Vehicle, str], float | None]) -> None:
        """`parameter` returns the known value of a vehicle's parameter, None for one that is not known."""
        self._fleet, self._clock, self._parameter = fleet, clock, parameter

    def messages(self, request: p.GetMessages) -> ServiceReply:
        """Return the kinds of messages that were received, and one of them whole if its details are asked for."""
        now = self._clock.now()
        vehicles = frozenset(request.vehicles)
        sources = self._sources()
        rows: list[p.MessageRow] = []
        left_out = 0
        for source in sources:
            address = address_text(source)
            for slot in _slots(source):
                number = self._number(source, slot)
                if vehicles and number not in vehicles:
                    continue
                if len(rows) < p.MAX_ROWS:
                    rows.append(_row(source, address, slot, number, now))
                else:
                    left_out += 1
        held = self._held(request.detail, sources) if request.detail is not None else None
        return ServiceReply(
            ok=True,
            inspection=p.Inspection(
                t_s=now,
                rows=tuple(rows),
                sources=tuple(_source_row(source) for source in sources[: p.MAX_SOURCES]),
                left_out=left_out,
                detail=_detail(request.detail, held) if request.detail is not None and held is not None else None,
            ),
        )

    def values(self, request: p.GetValues) -> ServiceReply:
        """Return the newest values of fields and parameters, in the order in which they are asked for."""
        if len(request.keys) > p.MAX_VALUES:
            return ServiceReply(ok=False, text=f"{len(request.keys)} values at once: ask for at most {p.MAX_VALUES}")
        # Several fields of one message are read from it once.
        decoded: dict[tuple[int, str], tuple[float, dict[str, Any]]] = {}
        return ServiceReply(ok=True, values=tuple(self._value(key, decoded) for key in request.keys))

    def _value(self, key: p.ValueKey, decoded: dict[tuple[int, str], tuple[float, dict[str, Any]]]) -> p.ValueRow:
        vehicle = self._fleet.vehicles.get(key.vehicle)
        if vehicle is None:
            return UNKNOWN_VALUE
        if key.is_parameter:
            value = self._parameter(vehicle, key.name)
            return p.ValueRow(self._clock.now(), value) if value is not None else UNKNOWN_VALUE
        message, _, field = key.name.partition(".")
        if (vehicle.id, message) not in decoded:
            slot = newest_slot(vehicle, message)
            decoded[vehicle.id, message] = (slot.t_s, slot.fields()) if slot is not None else (math.nan, {})
        t_s, fields = decoded[vehicle.id, message]
        name, index = split_element(field)
        number = number_in(fields.get(name), index)
        return p.ValueRow(t_s, float(number)) if number is not None else UNKNOWN_VALUE

    def _sources(self) -> list[Source]:
        """All senders' addresses, those with vehicles first: a forger can send from many."""
        found = [source for intake in self._fleet.intakes.values() for source in intake.sources.values()]
        return sorted(found, key=lambda source: not source.vehicle_count)

    def _number(self, source: Source, slot: Slot) -> int:
        owner: Vehicle | None = slot.owner or self._fleet.find(source.network, slot.system)
        return owner.id if owner is not None else 0

    def _held(self, key: p.MessageKey, sources: list[Source]) -> Slot | None:
        for source in sources:
            if (source.network, source.link, address_text(source)) == (key.network, key.link, key.address):
                for slot in _slots(source):
                    if (slot.system, slot.component, slot.msgid) == (key.system, key.component, key.msgid):
                        return slot
        return None


def newest_slot(vehicle: Vehicle, message: str) -> Slot | None:
    """Return the newest frame of a message over the vehicle's used paths; its autopilot's come before others."""
    layout = dialect.layout_named(message)
    if layout is None or layout.msgid in KEYS:
        return None
    found = [
        slot
        for path in vehicle.used_paths()
        for slot in _slots(path.source)
        if slot.msgid == layout.msgid and slot.owner is vehicle
    ]
    return max(found, key=lambda slot: (slot.component == vehicle.component, slot.t_s), default=None)


def address_text(source: Source) -> str:
    """Return where a source's bytes come from, in words."""
    address = source.address
    return clean(f"{address[0]}:{address[1]}" if isinstance(address, tuple) else address)


def _slots(source: Source) -> Iterator[Slot]:
    """The kinds of frames that came from a source, in order."""
    for kinds in (source.slots, source.unknown):
        yield from (slot for slot in kinds.values() if slot.raw)


def _row(source: Source, address: str, slot: Slot, vehicle: int, now: float) -> p.MessageRow:
    path = slot.owner.path_of(source) if slot.owner is not None else None
    return p.MessageRow(
        key=p.MessageKey(source.network, source.link, address, slot.system, slot.component, slot.msgid),
        name=dialect.label(slot.msgid),
        vehicle=vehicle,
        count=slot.count,
        age_s=now - slot.t_s,
        size=len(slot.raw),
        signed=slot.signed,
        version=2 if slot.raw[0] == MAGIC_V2 else 1,
        autopilot=slot.owner is not None and slot.component == slot.owner.component,
        used=path is not None and path.state is PathState.USED,
    )


def _detail(key: p.MessageKey, slot: Slot) -> p.MessageDetail:
    if slot.msgid in KEYS:
        return p.MessageDetail(key, (), b"", KEY_REMARK)
    # A signature of a real key lets others guess at the key: it does not leave the station (docs/threats.md A.1).
    raw = for_log(slot.raw)
    if slot.layout is None:
        return p.MessageDetail(key, (), raw, "the dialect does not know it: give its XML with --dialect")
    values = slot.fields()
    fields = tuple(p.FieldRow(f.name, _type_text(f), values[f.name]) for f in slot.layout.fields)
    return p.MessageDetail(key, fields, raw)


def _type_text(field: FieldDefinition) -> str:
    return f"{field.type}[{field.length}]" if field.length else field.type


def _source_row(source: Source) -> p.SourceRow:
    worst = sorted(source.bad_crc_by_msgid.items(), key=lambda item: -item[1])[:MAX_BAD_CRC_NAMES]
    return p.SourceRow(
        network=source.network,
        link=source.link,
        address=address_text(source),
        vehicles=source.vehicle_count,
        frames=source.frames + sum(slot.count for slot in _slots(source)),
        junk_bytes=source.junk_bytes,
        text_bytes=source.text_bytes,
        bad_crc=source.bad_crc,
        bad_crc_names=tuple(f"{dialect.label(msgid)} {count}" for msgid, count in worst),
        version1_refused=source.version1_refused,
    )
