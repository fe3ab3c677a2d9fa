"""Requests of inspector and plots: what is received, the newest frame or value of messages, and a rate for them.

Nothing here collects: an answer is read from the intake, which holds the newest frame of every kind anyway.
"""

import math
from collections.abc import Iterator
from typing import Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.firmware.base import may_be_flying
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
from tui_gcs.core.rates.operator_rates import ESSENTIAL, OperatorRate, doubts, why_never
from tui_gcs.core.requests.handler import Access, NotConfirmedError, RequestHandler, VehicleAct
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.station.assembly import StationParts

MAX_BAD_CRC_NAMES = 4
UNKNOWN_VALUE = p.ValueRow(math.nan, math.nan)
KEY_REMARK = "it holds a key: neither fields nor bytes are shown"


class InspectionRequests:
    """Answers what the inspector asks."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._fleet = parts.picture.fleet
        self._rates = parts.comms.rates
        self.acts: dict[type, VehicleAct] = {p.SetMessageRate: VehicleAct(self._set_rate, _rate_words)}

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that only look."""
        return {
            p.GetMessages: RequestHandler(Access.LOOK, lambda _, request: self._messages(request)),
            p.GetValues: RequestHandler(Access.LOOK, lambda _, request: self._values(request)),
        }

    def _messages(self, request: p.GetMessages) -> ServiceReply:
        now = self._parts.records.clock.now()
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

    def _values(self, request: p.GetValues) -> ServiceReply:
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
            param = self._parts.services.params.table(vehicle.id).params.get(key.name)
            return p.ValueRow(self._parts.records.clock.now(), float(param.value)) if param else UNKNOWN_VALUE
        message, _, field = key.name.partition(".")
        if (vehicle.id, message) not in decoded:
            slot = newest_slot(vehicle, message)
            decoded[vehicle.id, message] = (slot.t_s, slot.fields()) if slot is not None else (math.nan, {})
        t_s, fields = decoded[vehicle.id, message]
        name, index = split_element(field)
        value = number_in(fields.get(name), index)
        return p.ValueRow(t_s, float(value)) if value is not None else UNKNOWN_VALUE

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

    def _set_rate(self, vehicle: Vehicle, request: p.SetMessageRate, task: Task) -> str:
        message, hz, rates = request.msgid, request.rate_hz, self._rates
        link = rates.link_of(vehicle)
        if why := why_never(message) or ("nothing is asked over a satellite link" if link.silent else ""):
            return why
        if hz is None:
            was_set = rates.release_rate(vehicle, message)
            task.end(text="" if was_set else "no other rate was asked for")
            return ""
        if not 0.0 <= hz <= p.MAX_RATE_HZ:
            return f"a rate is from 0 to {p.MAX_RATE_HZ:g} Hz"
        if message in ESSENTIAL and hz < link.set.hz.get(message, 0.0) and may_be_flying(vehicle):
            return "it is in the air, and the station flies it by this message: only a higher rate is taken"
        if not request.sure and (why := doubts(link, vehicle, message, hz, rates.operator_rates)):
            raise NotConfirmedError(why)

        def stop() -> str:
            rates.release_rate(vehicle, message)
            task.end(cancelled=True)
            return ""

        task.stop = stop
        rates.set_rate(vehicle, message, OperatorRate(hz, task.end))
        return ""


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


def _rate_words(request: p.SetMessageRate) -> str:
    name = dialect.label(request.msgid)
    return f"{name} as the station asks" if request.rate_hz is None else f"{name} at {request.rate_hz:g} Hz"
