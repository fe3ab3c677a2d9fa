"""MAVLink's events interface: EVENTs in sequence, lost ones requested again, decoded with the vehicle's metadata.

A vehicle numbers its EVENTs (16 bits, wrapping) and sends the newest number every 3 s (CURRENT_EVENT_SEQUENCE), so a
gap is noticed. It keeps about 20 for REQUEST_EVENT. PX4 reports only so why it refuses to arm: the reasons are a report
of several EVENTs, sent when they change, which is kept here (`report`).
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
"""MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET: the vehicle counts anew."""
PROTOCOL = 8
"""The log level of EVENTs that are for programs, not for the operator; 9 is "disabled"."""
MAX_KEPT = 64
"""How many EVENTs of one vehicle are kept, to put its reports together."""
MAX_MISSING = 20
"""How many lost EVENTs are requested again: PX4 keeps no more."""
TRIES, ASK_GAP_S = 20, 0.5
"""How often and at which interval they are requested: reads are of the stop class (docs/threats.md C.4)."""
MAX_ASKED_PER_S = 4
"""The most REQUEST_EVENTs a second to one vehicle, whatever it reports."""
ARMING, HEALTH = "arming_check", "health"
SUMMARY, APPENDS_REASONS = "summary", "append_health_and_arming_messages"
"""Values of `type` in the metadata."""
ARM_DISARM = 400
FETCH_GAP_S = 120.0
"""How soon the metadata is requested again from a vehicle that did not serve it."""
METADATA_WAIT_S = 8.0
"""How long an EVENT waits for its metadata; then it is reported by its number."""
MAX_FIRMWARES = 4
"""How many firmwares' metadata are kept."""
REFUSAL_NEWS_S = 5.0
"""How long after a refusal to arm its reasons are still news."""
_HALF, _ALL = 1 << 15, 1 << 16

Firmware = tuple[int, str, bool]


@dataclass(frozen=True)
class ArmingCheck:
    """One finding of a vehicle's own arming checks."""

    text: SafeText
    severity: int
    """MAV_SEVERITY."""
    modes: int
    """The groups of modes that it concerns, as bits."""


@dataclass(frozen=True)
class ArmingReport:
    """The findings of a vehicle's arming checks in its last report."""

    checks: tuple[ArmingCheck, ...]
    can_arm: int
    """The groups of modes in which it can arm, as bits."""
    t_s: float


@dataclass
class _EventRecord:
    """The EVENTs of one vehicle."""

    newest: int | None = None
    kept: dict[int, tuple[Fields, DecodedEvent | None]] = field(default_factory=dict)
    """The newest EVENTs by sequence number, in order of arrival."""
    missing: dict[int, int] = field(default_factory=dict)
    """The missing sequence numbers, and how often each was requested."""
    old: set[int] = field(default_factory=set)
    """Numbers from before this station listened: it is no loss if they are gone."""
    ask_s: float = 0.0
    asked_s: list[float] = field(default_factory=list)
    unreported: dict[int, float] = field(default_factory=dict)
    """EVENTs that wait for the metadata to be reported, with their time of arrival."""
    report: ArmingReport | None = None
    report_seq: int = -1
    refused_s: float = -math.inf
    """When the vehicle refused to arm and the reason was not known."""


class VehicleEvents:
    """Collects, decodes and reports the EVENTs of all vehicles."""

    def __init__(self, context: ServiceContext, metadata: MetadataService) -> None:
        """Create the service. No metadata is fetched before an EVENT matters; without metadata EVENTs are numbers."""
        self._context = context
        self._files = metadata
        self._records: dict[int, _EventRecord] = {}
        self._metadata: dict[int, EventMetadata] = {}
        self._by_firmware: OrderedDict[Firmware, EventMetadata] = OrderedDict()
        self._fetching_s: dict[Firmware, float] = {}
        """When a vehicle of a firmware began to fetch the metadata for all of that firmware."""
        self._fetched_s: dict[int, float] = {}
        """When a vehicle's metadata was last requested."""
        self.ignored: Counter[str] = Counter()
        self.lost = 0
        """How many EVENTs never arrived."""
        fleet = context.fleet
        fleet.on_message("EVENT", self._event)
        fleet.on_message("CURRENT_EVENT_SEQUENCE", self._current)
        fleet.on_message("RESPONSE_EVENT_ERROR", self._gone)
        fleet.on_message("COMMAND_ACK", self._ack)
        fleet.on_component(self.forget)
        context.forget_with(self.forget)

    def learn(self, vehicle: Vehicle, metadata: EventMetadata) -> None:
        """Take the metadata of a vehicle: its kept EVENTs are decoded, and its arming checks are read anew."""
        self._metadata[vehicle.id] = metadata
        record = self._records.get(vehicle.id)
        if record is not None:
            for sequence, (fields, _) in record.kept.items():
                record.kept[sequence] = (fields, self._decoded(vehicle, fields))
            self._report_waiting(vehicle, record, -math.inf)
            self._look_for_report(vehicle, record)

    def knows(self, vehicle: Vehicle) -> bool:
        """Whether the metadata of its EVENTs is known."""
        return vehicle.id in self._metadata

    def report(self, vehicle: Vehicle) -> ArmingReport | None:
        """The report of its arming checks; None if there was none, or it cannot be decoded."""
        record = self._records.get(vehicle.id)
        return record.report if record is not None else None

    def can_arm(self, vehicle: Vehicle, custom_mode: int | None = None) -> bool | None:
        """Whether its own checks would let it arm in a mode, by default the present one; None if not known."""
        report, bit = self.report(vehicle), self._bit(vehicle, custom_mode)
        return None if report is None or not bit else bool(report.can_arm & bit)

    def reasons(self, vehicle: Vehicle, custom_mode: int | None = None) -> list[SafeText]:
        """What prevents arming in a mode, worst first; empty if nothing does, or if it is not known."""
        report, bit = self.report(vehicle), self._bit(vehicle, custom_mode)
        if report is None or report.can_arm & bit:
            return []
        checks = [check for check in report.checks if check.modes & bit or not bit]
        return [check.text for check in sorted(checks, key=lambda check: check.severity)]

    def catch_up(self, vehicle: Vehicle) -> None:
        """Request the EVENTs before the first that was received: arming checks are reported only when they change."""
        record = self._records.get(vehicle.id)
        if record is None or record.newest is None or record.report is not None:
            return
        newest = record.newest
        first = min(record.kept, key=lambda sequence: _ahead(sequence, newest), default=newest + 1)
        for back in range(1, MAX_MISSING + 1):
            record.missing.setdefault((first - back) % _ALL, 0)
            record.old.add((first - back) % _ALL)
        self._ask(vehicle, record)

    def forget(self, vehicle: Vehicle) -> None:
        """Forget a vehicle that is gone, was replaced, or rebooted: it counts anew, and may have other firmware."""
        self._records.pop(vehicle.id, None)
        self._metadata.pop(vehicle.id, None)
        self._fetched_s.pop(vehicle.id, None)

    def tick(self) -> None:
        """Repeat the requests for what is missing."""
        now = self._context.clock.now()
        for number, record in self._records.items():
            if not record.missing and not record.unreported:
                continue
            vehicle = self._context.fleet.vehicles.get(number)
            if vehicle is None:
                record.missing.clear()
                record.unreported.clear()
                continue
            if record.missing and now >= record.ask_s:
                self._ask(vehicle, record)
            self._report_waiting(vehicle, record, METADATA_WAIT_S)

    def _event(self, vehicle: Vehicle, fields: Fields) -> None:
        if fields["destination_system"] not in (0, self._context.own_system):
            self.ignored["event for another station"] += 1
            return
        record = self._records.setdefault(vehicle.id, _EventRecord())
        sequence = fields["sequence"]
        if sequence in record.kept:
            self.ignored["event heard twice"] += 1
            return
        expected = sequence in record.missing
        if not expected and record.newest is not None and _ahead(sequence, record.newest) <= 0:
            self.ignored["old event"] += 1
            return
        record.missing.pop(sequence, None)
        decoded = self._decoded(vehicle, fields)
        record.kept[sequence] = (fields, decoded)
        while len(record.kept) > MAX_KEPT:
            del record.kept[next(iter(record.kept))]
        self._advance(vehicle, record, sequence, came=True)
        waits = decoded is None and fields["log_levels"] & 0x0F <= ERROR and len(record.unreported) < MAX_MISSING
        if waits and self._is_fetching(vehicle):
            record.unreported[sequence] = self._context.clock.now()
        else:
            self._report(vehicle, fields, decoded)
        if decoded is None or decoded.group in (ARMING, HEALTH):
            self._look_for_report(vehicle, record)

    def _current(self, vehicle: Vehicle, fields: Fields) -> None:
        record = self._records.setdefault(vehicle.id, _EventRecord())
        sequence = fields["sequence"]
        if fields["flags"] & RESET and record.newest is not None and _ahead(sequence, record.newest) < 0:
            # It counts from 0: all since then is missing.
            self._records[vehicle.id] = _EventRecord(newest=-1)
            self._advance(vehicle, self._records[vehicle.id], sequence, came=False)
        else:
            self._advance(vehicle, record, sequence, came=False)

    def _advance(self, vehicle: Vehicle, record: _EventRecord, sequence: int, *, came: bool) -> None:
        """Take the newest sequence number: what was skipped is missing."""
        if record.newest is None:
            record.newest = sequence
            return
        ahead = _ahead(sequence, record.newest)
        if ahead <= 0:
            return
        gap = ahead - came
        # A wild sequence number must not make us request thousands of EVENTs.
        self._lose(vehicle, max(0, gap - MAX_MISSING))
        record.missing |= {(sequence - came - back) % _ALL: 0 for back in range(min(gap, MAX_MISSING))}
        record.newest = sequence
        while len(record.missing) > MAX_MISSING:
            self._give_up(vehicle, record, next(iter(record.missing)))
        if gap > 0:
            self._ask(vehicle, record)

    def _gone(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take RESPONSE_EVENT_ERROR: the vehicle does not have the requested EVENT any more."""
        record = self._records.get(vehicle.id)
        if record is None or not self._context.is_for_us(fields):
            return
        oldest = fields["sequence_oldest_available"]
        for sequence in [s for s in record.missing if s == fields["sequence"] or _ahead(s, oldest) < 0]:
            self._give_up(vehicle, record, sequence)

    def _ack(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take an ACK that refuses to arm: the findings of its checks are the reasons."""
        if fields["command"] == ARM_DISARM and fields["result"] in (1, 2, 4) and self._context.is_for_us(fields):
            record = self._records.get(vehicle.id)
            # It has EVENTs; ArduPilot sends its reasons as texts.
            if record is not None and record.report is None:
                record.refused_s = self._context.clock.now()
                self._want_metadata(vehicle, refused=True)
                self.catch_up(vehicle)
            self._give_reasons(vehicle)

    def _ask(self, vehicle: Vehicle, record: _EventRecord) -> None:
        """Request all that is missing, one run of numbers at a time, and give up what was requested often enough."""
        now = self._context.clock.now()
        for sequence in [s for s, tries in record.missing.items() if tries >= TRIES]:
            self._give_up(vehicle, record, sequence)
        record.ask_s = now + ASK_GAP_S
        record.asked_s = [t for t in record.asked_s if now - t < 1.0]
        if not self._context.uplink.is_ours(vehicle):
            record.missing.clear()
        for first, last in _runs(record.missing):
            if len(record.asked_s) >= MAX_ASKED_PER_S:
                return
            record.asked_s.append(now)
            for sequence in record.missing:
                if 0 <= (sequence - first) % _ALL <= (last - first) % _ALL:
                    record.missing[sequence] += 1
            self._context.uplink.ask(vehicle.id, "REQUEST_EVENT", first_sequence=first, last_sequence=last)

    def _give_up(self, vehicle: Vehicle, record: _EventRecord, sequence: int) -> None:
        del record.missing[sequence]
        self._lose(vehicle, 0 if sequence in record.old else 1)

    def _lose(self, vehicle: Vehicle, count: int) -> None:
        if count:
            self.lost += count
            text = "some of its events were lost on the way"
            self._context.events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE, every_s=60)

    def _decoded(self, vehicle: Vehicle, fields: Fields) -> DecodedEvent | None:
        metadata = self._metadata.get(vehicle.id)
        return metadata.decode(fields["id"], bytes(fields["arguments"])) if metadata is not None else None

    def _report(self, vehicle: Vehicle, fields: Fields, decoded: DecodedEvent | None) -> None:
        """Report an EVENT that is for the operator. Arming checks are not reported: they are a state, not news."""
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
        """Fetch the metadata, if it is time."""
        # 17 kB are too much for a slow link, except when the operator needs to know why it refused to arm.
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
        # One vehicle of each firmware fetches the file for all of them.
        if firmware is None or now - self._fetching_s.get(firmware, -math.inf) > FETCH_GAP_S:
            if firmware is not None:
                self._fetching_s[firmware] = now
            self._files.fetch(vehicle.id, EVENTS, lambda job: self._take(vehicle, job, firmware))

    def _is_fetching(self, vehicle: Vehicle) -> bool:
        """Whether its metadata may arrive soon; requests it if needed."""
        if self.knows(vehicle):
            return False
        self._want_metadata(vehicle)
        return self._context.clock.now() - self._fetched_s.get(vehicle.id, -math.inf) < METADATA_WAIT_S

    def _report_waiting(self, vehicle: Vehicle, record: _EventRecord, older_s: float) -> None:
        """Report the EVENTs that have waited for their metadata for `older_s`."""
        now = self._context.clock.now()
        for sequence in [sequence for sequence, came_s in record.unreported.items() if now - came_s >= older_s]:
            del record.unreported[sequence]
            if sequence in record.kept:
                self._report(vehicle, *record.kept[sequence])

    def _take(self, vehicle: Vehicle, job: MetadataJob, firmware: Firmware | None) -> None:
        """Take fetched metadata for all vehicles of the firmware. The job queue reports a failure."""
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

    def _look_for_report(self, vehicle: Vehicle, record: _EventRecord) -> None:
        """Assemble the newest complete report: from the arming summary, chunk 0, to the health summary."""
        ends = [s for s, (_, d) in record.kept.items() if d is not None and d.group == HEALTH and d.type == SUMMARY]
        for end in sorted(ends, key=lambda s: _ahead(s, record.newest or 0), reverse=True):
            if end == record.report_seq:
                return
            report = self._report_until(record, end)
            if report is not None:
                record.report, record.report_seq = report, end
                if self._context.clock.now() - record.refused_s < REFUSAL_NEWS_S:
                    record.refused_s = -math.inf
                    self._explain(vehicle)
                return

    def _explain(self, vehicle: Vehicle) -> None:
        """Report the reasons of a refusal that arrived after its action had ended."""
        self._give_reasons(vehicle)
        for text in self.reasons(vehicle):
            self._context.fleet.texts.take_event(vehicle, WARNING, f"cannot arm: {text}")

    def _report_until(self, record: _EventRecord, end: int) -> ArmingReport | None:
        checks: list[ArmingCheck] = []
        can_arm = -1
        for back in range(MAX_KEPT):
            fields, decoded = record.kept.get((end - back) % _ALL, (None, None))
            if fields is None or decoded is None:
                return None
            if decoded.group == ARMING and decoded.type == SUMMARY and len(decoded.values) >= 5:
                chunk, can_arm = int(decoded.values[0]), can_arm & int(decoded.values[3])
                if chunk == 0:
                    return ArmingReport(tuple(reversed(checks)), can_arm, self._context.clock.now())
            elif decoded.group in (ARMING, HEALTH) and decoded.type != SUMMARY and decoded.values:
                checks.append(ArmingCheck(decoded.text, fields["log_levels"] & 0x0F, int(decoded.values[0])))
        return None


def _firmware(vehicle: Vehicle) -> Firmware | None:
    """Return what vehicles share that need only one metadata file; None if a vehicle did not report it.

    A vehicle with signed frames does not share with one without, because unsigned frames can be forged.
    """
    token = vehicle.identity.firmware_token
    return (
        (vehicle.autopilot, token, vehicle.identity.keyed) if vehicle.identity.identified and token.strip("0") else None
    )


def _ahead(sequence: int, of: int) -> int:
    """How far a number is ahead of another, -32768…32767."""
    return (sequence - of + _HALF) % _ALL - _HALF


def _runs(numbers: dict[int, int]) -> list[tuple[int, int]]:
    """Return first and last of each run of consecutive numbers, oldest first.

    All lie within half of the number circle.
    """
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
