"""MAVLink's events interface: EVENTs in sequence, what was lost is asked for again, and told in words.

A vehicle numbers its EVENTs (16 bits, wrapping) and says the newest number every 3 s (CURRENT_EVENT_SEQUENCE), so
that a gap is noticed; it keeps some 20 for who asks (REQUEST_EVENT). PX4 says why it refuses to arm only so: the
reasons are a report of several EVENTs, sent when they change, which is kept here (`report`).
"""

import math
from collections import Counter, OrderedDict
from dataclasses import dataclass, field

from tui_gcs.core.base.text import SafeText
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ERROR, NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.vehicle.component_metadata import EVENTS, MetadataJob, MetadataService
from tui_gcs.core.services.vehicle.event_metadata import DecodedEvent, EventMetadata, EventMetadataError, parse
from tui_gcs.core.uplink.jobs import JobState

RESET = 1
"""MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET: it counts from anew."""
PROTOCOL = 8
"""Log level of EVENTs that are for programs, not for people; 9 is "disabled"."""
KEPT = 64
"""EVENTs of one vehicle, to put its reports together."""
MAX_MISSING = 20
"""Asked for again: a vehicle keeps no more (PX4)."""
TRIES, ASK_GAP_S = 20, 0.5
"""A question is of the stop class (docs/threats.md C.4)."""
MAX_ASKED_PER_S = 4
"""REQUEST_EVENTs to one vehicle, whatever it says."""
ARMING, HEALTH = "arming_check", "health"
SUMMARY, APPENDS_REASONS = "summary", "append_health_and_arming_messages"
"""`type` in the metadata."""
ARM_DISARM = 400
FETCH_GAP_S = 120.0
"""How soon a vehicle is asked for its metadata again that did not give it."""
FETCH_S = 8.0
"""So long an EVENT waits to be told in words; then it is told by number."""
MAX_FIRMWARES = 4
"""Firmwares in one fleet."""
REFUSED_S = 5.0
"""So long after a refusal its reasons are still news."""
_HALF, _ALL = 1 << 15, 1 << 16

Firmware = tuple[int, str, bool]


@dataclass(frozen=True)
class ArmingCheck:
    """One thing a vehicle's own arming checks found."""

    text: SafeText
    severity: int
    """MAV_SEVERITY."""
    modes: int
    """Bits of the groups of modes it matters for."""


@dataclass(frozen=True)
class ArmingReport:
    """What a vehicle's arming checks found when it last told."""

    checks: tuple[ArmingCheck, ...]
    can_arm: int
    """Bits of the groups of modes in which it can arm."""
    can_run: int
    """Bits of the groups of modes it can change to."""
    t_s: float


@dataclass
class _EventRecord:
    """The EVENTs of one vehicle."""

    newest: int | None = None
    kept: dict[int, tuple[Fields, DecodedEvent | None]] = field(default_factory=dict)
    """By sequence number, in order of arrival."""
    missing: dict[int, int] = field(default_factory=dict)
    """How often each was asked for."""
    old: set[int] = field(default_factory=set)
    """From before we listened: no loss if they are gone."""
    ask_s: float = 0.0
    asked_s: list[float] = field(default_factory=list)
    untold: dict[int, float] = field(default_factory=dict)
    """When those came that are told as soon as the metadata is there."""
    report: ArmingReport | None = None
    report_seq: int = -1
    refused_s: float = -math.inf
    """When it refused to arm and we did not know why."""


class VehicleEvents:
    """Hears EVENTs of all vehicles."""

    def __init__(self, context: ServiceContext, metadata: MetadataService) -> None:
        """Nothing is fetched before an EVENT matters; until then, and where there is none, EVENTs are numbers."""
        self._context = context
        self._files = metadata
        self._books: dict[int, _EventRecord] = {}
        self._metadata: dict[int, EventMetadata] = {}
        self._by_firmware: OrderedDict[Firmware, EventMetadata] = OrderedDict()
        self._fetching_s: dict[Firmware, float] = {}
        """When one of a firmware began to fetch it for all."""
        self._fetched_s: dict[int, float] = {}
        """When a vehicle's was asked for last."""
        self.ignored: Counter[str] = Counter()
        self.lost = 0
        """EVENTs that never came."""
        fleet = context.fleet
        fleet.on_message("EVENT", self._event)
        fleet.on_message("CURRENT_EVENT_SEQUENCE", self._current)
        fleet.on_message("RESPONSE_EVENT_ERROR", self._gone)
        fleet.on_message("COMMAND_ACK", self._ack)
        fleet.on_gone(self.forget)
        fleet.on_component(self.forget)
        fleet.paths.on_reboot.append(self._rebooted)
        fleet.paths.on_replace.append(self.forget)

    def learn(self, vehicle: Vehicle, metadata: EventMetadata) -> None:
        """What this vehicle's EVENTs mean; its arming checks are read anew."""
        self._metadata[vehicle.id] = metadata
        book = self._books.get(vehicle.id)
        if book is not None:
            for sequence, (fields, _) in book.kept.items():
                book.kept[sequence] = (fields, self._decoded(vehicle, fields))
            self._tell_untold(vehicle, book, -math.inf)
            self._look_for_report(vehicle, book)

    def knows(self, vehicle: Vehicle) -> bool:
        """Whether there is metadata for its EVENTs."""
        return vehicle.id in self._metadata

    def report(self, vehicle: Vehicle) -> ArmingReport | None:
        """What its arming checks found; None if it did not tell, or cannot be understood."""
        book = self._books.get(vehicle.id)
        return book.report if book is not None else None

    def can_arm(self, vehicle: Vehicle, custom_mode: int | None = None) -> bool | None:
        """Whether its own checks would let it arm in a mode, by default the present one; None if not known."""
        report, bit = self.report(vehicle), self._bit(vehicle, custom_mode)
        return None if report is None or not bit else bool(report.can_arm & bit)

    def reasons(self, vehicle: Vehicle, custom_mode: int | None = None) -> list[SafeText]:
        """What speaks against arming in a mode, worst first; empty if nothing does, or if it is not known."""
        report, bit = self.report(vehicle), self._bit(vehicle, custom_mode)
        if report is None or report.can_arm & bit:
            return []
        checks = [check for check in report.checks if check.modes & bit or not bit]
        return [check.text for check in sorted(checks, key=lambda check: check.severity)]

    def catch_up(self, vehicle: Vehicle) -> None:
        """Ask for the EVENTs before the first we heard: the arming checks are told when they change only."""
        book = self._books.get(vehicle.id)
        if book is None or book.newest is None or book.report is not None:
            return
        newest = book.newest
        first = min(book.kept, key=lambda sequence: _ahead(sequence, newest), default=newest + 1)
        for back in range(1, MAX_MISSING + 1):
            book.missing.setdefault((first - back) % _ALL, 0)
            book.old.add((first - back) % _ALL)
        self._ask(vehicle, book)

    def forget(self, vehicle: Vehicle) -> None:
        """It is another vehicle now, or gone."""
        self._books.pop(vehicle.id, None)
        self._metadata.pop(vehicle.id, None)
        self._fetched_s.pop(vehicle.id, None)

    def tick(self) -> None:
        """Ask again for what is missing."""
        now = self._context.clock.now()
        for number, book in self._books.items():
            if not book.missing and not book.untold:
                continue
            vehicle = self._context.fleet.vehicles.get(number)
            if vehicle is None:
                book.missing.clear()
                book.untold.clear()
                continue
            if book.missing and now >= book.ask_s:
                self._ask(vehicle, book)
            self._tell_untold(vehicle, book, FETCH_S)

    def _event(self, vehicle: Vehicle, fields: Fields) -> None:
        if fields["destination_system"] not in (0, self._context.own_system):
            self.ignored["event for another station"] += 1
            return
        book = self._books.setdefault(vehicle.id, _EventRecord())
        sequence = fields["sequence"]
        if sequence in book.kept:
            self.ignored["event heard twice"] += 1
            return
        expected = sequence in book.missing
        if not expected and book.newest is not None and _ahead(sequence, book.newest) <= 0:
            self.ignored["old event"] += 1
            return
        book.missing.pop(sequence, None)
        decoded = self._decoded(vehicle, fields)
        book.kept[sequence] = (fields, decoded)
        while len(book.kept) > KEPT:
            del book.kept[next(iter(book.kept))]
        self._advance(vehicle, book, sequence, came=True)
        waits = decoded is None and fields["log_levels"] & 0x0F <= ERROR and len(book.untold) < MAX_MISSING
        if waits and self._is_fetching(vehicle):
            book.untold[sequence] = self._context.clock.now()
        else:
            self._tell(vehicle, fields, decoded)
        if decoded is None or decoded.group in (ARMING, HEALTH):
            self._look_for_report(vehicle, book)

    def _current(self, vehicle: Vehicle, fields: Fields) -> None:
        book = self._books.setdefault(vehicle.id, _EventRecord())
        sequence = fields["sequence"]
        if fields["flags"] & RESET and book.newest is not None and _ahead(sequence, book.newest) < 0:
            self._books[vehicle.id] = _EventRecord(newest=-1)  # counts from 0: what it said since is all missing
            self._advance(vehicle, self._books[vehicle.id], sequence, came=False)
        else:
            self._advance(vehicle, book, sequence, came=False)

    def _advance(self, vehicle: Vehicle, book: _EventRecord, sequence: int, *, came: bool) -> None:
        """The newest number is `sequence`, if it is newer than what we knew; what was skipped is missing."""
        if book.newest is None:
            book.newest = sequence
            return
        ahead = _ahead(sequence, book.newest)
        if ahead <= 0:
            return
        gap = ahead - came
        self._lose(vehicle, max(0, gap - MAX_MISSING))
        book.missing |= {(sequence - came - back) % _ALL: 0 for back in range(min(gap, MAX_MISSING))}
        book.newest = sequence
        while len(book.missing) > MAX_MISSING:
            self._give_up(vehicle, book, next(iter(book.missing)))
        if gap > 0:
            self._ask(vehicle, book)

    def _gone(self, vehicle: Vehicle, fields: Fields) -> None:
        """It has no longer what we asked for."""
        book = self._books.get(vehicle.id)
        if book is None or not self._context.is_for_us(fields):
            return
        oldest = fields["sequence_oldest_available"]
        for sequence in [s for s in book.missing if s == fields["sequence"] or _ahead(s, oldest) < 0]:
            self._give_up(vehicle, book, sequence)

    def _rebooted(self, vehicle: Vehicle) -> None:
        """It counts anew, and may have other firmware."""
        self.forget(vehicle)

    def _ack(self, vehicle: Vehicle, fields: Fields) -> None:
        """It refused to arm: its checks' findings are the reasons."""
        if fields["command"] == ARM_DISARM and fields["result"] in (1, 2, 4) and self._context.is_for_us(fields):
            book = self._books.get(vehicle.id)
            if book is not None and book.report is None:  # it has EVENTs: ArduPilot says its reasons in texts
                book.refused_s = self._context.clock.now()
                self._want_metadata(vehicle, refused=True)
                self.catch_up(vehicle)
            self._give_reasons(vehicle)

    def _ask(self, vehicle: Vehicle, book: _EventRecord) -> None:
        """Ask for all that is missing, a run of numbers at a time; give up what was asked for often enough."""
        now = self._context.clock.now()
        for sequence in [s for s, tries in book.missing.items() if tries >= TRIES]:
            self._give_up(vehicle, book, sequence)
        book.ask_s = now + ASK_GAP_S
        book.asked_s = [t for t in book.asked_s if now - t < 1.0]
        if not self._context.uplink.is_ours(vehicle):
            book.missing.clear()
        for first, last in _runs(book.missing):
            if len(book.asked_s) >= MAX_ASKED_PER_S:
                return
            book.asked_s.append(now)
            for sequence in book.missing:
                if 0 <= (sequence - first) % _ALL <= (last - first) % _ALL:
                    book.missing[sequence] += 1
            self._context.uplink.ask(vehicle.id, "REQUEST_EVENT", first_sequence=first, last_sequence=last)

    def _give_up(self, vehicle: Vehicle, book: _EventRecord, sequence: int) -> None:
        del book.missing[sequence]
        self._lose(vehicle, 0 if sequence in book.old else 1)

    def _lose(self, vehicle: Vehicle, count: int) -> None:
        if count:
            self.lost += count
            text = "some of its events were lost on the way"
            self._context.events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE, every_s=60)

    def _decoded(self, vehicle: Vehicle, fields: Fields) -> DecodedEvent | None:
        metadata = self._metadata.get(vehicle.id)
        return metadata.decode(fields["id"], bytes(fields["arguments"])) if metadata is not None else None

    def _tell(self, vehicle: Vehicle, fields: Fields, decoded: DecodedEvent | None) -> None:
        """What is for people, and no arming check: those are a report, not news."""
        severity = fields["log_levels"] & 0x0F
        texts = self._context.fleet.texts
        if decoded is None and severity <= WARNING:
            self._want_metadata(vehicle)
        if severity >= PROTOCOL or (decoded is not None and decoded.group in (ARMING, HEALTH)):
            return
        if decoded is not None:
            texts.take_event(vehicle, severity, decoded.text)
            if decoded.type == APPENDS_REASONS:
                self._give_reasons(vehicle)
        elif severity <= ERROR and self.knows(vehicle):
            texts.take_event(vehicle, severity, f"event {fields['id']:#010x} (not in its metadata)")
        elif severity <= ERROR:
            texts.take_event(vehicle, severity, f"event {fields['id']:#010x} (no metadata)")
        else:
            self.ignored["event without metadata"] += 1

    def _want_metadata(self, vehicle: Vehicle, *, refused: bool = False) -> None:
        """Fetch it, if it is time. 17 kB are little, but not on a slow link: there only who was refused wants it."""
        if self._context.is_slow(vehicle.link) and not refused:
            return
        now = self._context.clock.now()
        fetched_s = self._fetched_s.get(vehicle.id, -math.inf)
        if self.knows(vehicle) or now - fetched_s < FETCH_GAP_S or not self._context.uplink.is_ours(vehicle):
            return
        firmware = _firmware(vehicle)
        known = self._by_firmware.get(firmware) if firmware is not None else None
        if known is not None:
            self.learn(vehicle, known)
            return
        self._fetched_s[vehicle.id] = now
        if firmware is None or now - self._fetching_s.get(firmware, -math.inf) > FETCH_GAP_S:
            if firmware is not None:
                self._fetching_s[firmware] = now
            self._files.fetch(vehicle.id, EVENTS, lambda job: self._take(vehicle, job, firmware))

    def _is_fetching(self, vehicle: Vehicle) -> bool:
        """Whether its metadata may come soon; else it is asked for."""
        if self.knows(vehicle):
            return False
        self._want_metadata(vehicle)
        return self._context.clock.now() - self._fetched_s.get(vehicle.id, -math.inf) < FETCH_S

    def _tell_untold(self, vehicle: Vehicle, book: _EventRecord, older_s: float) -> None:
        """Tell what waited for its metadata for so long."""
        now = self._context.clock.now()
        for sequence in [sequence for sequence, came_s in book.untold.items() if now - came_s >= older_s]:
            del book.untold[sequence]
            if sequence in book.kept:
                self._tell(vehicle, *book.kept[sequence])

    def _take(self, vehicle: Vehicle, job: MetadataJob, firmware: Firmware | None) -> None:
        """Its metadata came, or did not: the desk tells why. It serves all who wait for that of this firmware."""
        if firmware is not None:
            self._fetching_s.pop(firmware, None)
        if job.state is not JobState.DONE or self._context.fleet.vehicles.get(vehicle.id) is not vehicle:
            return
        try:
            metadata = parse(job.data)
        except EventMetadataError as error:
            self._context.events.report(EventClass.VEHICLE, f"vehicle {vehicle.id}", str(error), NOTICE)
            return
        self.learn(vehicle, metadata)
        if firmware is not None:
            self._by_firmware[firmware] = metadata
            while len(self._by_firmware) > MAX_FIRMWARES:
                self._by_firmware.popitem(last=False)
            for other in self._context.fleet.vehicles.values():
                if other.id in self._fetched_s and not self.knows(other) and _firmware(other) == firmware:
                    self.learn(other, metadata)

    def _give_reasons(self, vehicle: Vehicle) -> None:
        for text in reversed(self.reasons(vehicle)):
            self._context.fleet.texts.keep_reason(vehicle, text)

    def _bit(self, vehicle: Vehicle, custom_mode: int | None) -> int:
        metadata = self._metadata.get(vehicle.id)
        mode = vehicle.telemetry.custom_mode if custom_mode is None else custom_mode
        return metadata.mode_groups.get(mode, 0) if metadata is not None else 0

    def _look_for_report(self, vehicle: Vehicle, book: _EventRecord) -> None:
        """Put the newest whole report together: from the arming summary, chunk 0, to the health summary."""
        ends = [s for s, (_, d) in book.kept.items() if d is not None and d.group == HEALTH and d.type == SUMMARY]
        for end in sorted(ends, key=lambda s: _ahead(s, book.newest or 0), reverse=True):
            if end == book.report_seq:
                return
            report = self._report_until(book, end)
            if report is not None:
                book.report, book.report_seq = report, end
                if self._context.clock.now() - book.refused_s < REFUSED_S:
                    book.refused_s = -math.inf
                    self._explain(vehicle)
                return

    def _explain(self, vehicle: Vehicle) -> None:
        """The reasons of a refusal came late: after its action was ended."""
        self._give_reasons(vehicle)
        for text in self.reasons(vehicle):
            self._context.fleet.texts.take_event(vehicle, WARNING, f"cannot arm: {text}")

    def _report_until(self, book: _EventRecord, end: int) -> ArmingReport | None:
        checks: list[ArmingCheck] = []
        can_arm = can_run = -1
        for back in range(KEPT):
            fields, decoded = book.kept.get((end - back) % _ALL, (None, None))
            if fields is None or decoded is None:
                return None
            if decoded.group == ARMING and decoded.type == SUMMARY and len(decoded.values) >= 5:
                chunk, _, _, arm, run = (int(value) for value in decoded.values[:5])
                can_arm, can_run = can_arm & arm, can_run & run
                if chunk == 0:
                    return ArmingReport(tuple(reversed(checks)), can_arm, can_run, self._context.clock.now())
            elif decoded.group in (ARMING, HEALTH) and decoded.type != SUMMARY and decoded.values:
                checks.append(ArmingCheck(decoded.text, fields["log_levels"] & 0x0F, int(decoded.values[0])))
        return None


def _firmware(vehicle: Vehicle) -> Firmware | None:
    """What vehicles have in common that need one file only; None if it did not tell.

    One whose frames are signed does not learn words from one that anybody may play.
    """
    token = vehicle.identity.firmware_token
    return (
        (vehicle.autopilot, token, vehicle.identity.keyed) if vehicle.identity.identified and token.strip("0") else None
    )


def _ahead(sequence: int, of: int) -> int:
    """How far a number is ahead of another, -32768…32767."""
    return (sequence - of + _HALF) % _ALL - _HALF


def _runs(numbers: dict[int, int]) -> list[tuple[int, int]]:
    """First and last of each run of numbers without a gap, oldest first; they lie within one half of the circle."""
    if not numbers:
        return []
    anchor = next(iter(numbers))
    ordered = sorted(numbers, key=lambda sequence: _ahead(sequence, anchor))
    runs = [(ordered[0], ordered[0])]
    for sequence in ordered[1:]:
        if sequence == (runs[-1][1] + 1) % _ALL:
            runs[-1] = (runs[-1][0], sequence)
        else:
            runs.append((sequence, sequence))
    return runs
