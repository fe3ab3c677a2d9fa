"""The list of checks before a start: its lines, acknowledgements and signature, and the starts that it refuses.

Checks that keep a single vehicle on the ground (`readiness.py`) are the same for simulated and real vehicles and cannot
be overridden. The others are asked of LIVE vehicles only: an operator can override each for one start, by the name of
the check and with a name of their own.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.request_checks import Ruling
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.preflight import fleet_checks as fleet
from tui_gcs.core.preflight.readiness import Readiness
from tui_gcs.core.preflight.ticked_items import Tick, TickedItems
from tui_gcs.core.preflight.vehicle_checks import (
    CheckFinding,
    failsafes,
    link_quality,
    own_limits,
    plans_on_board,
    standing,
)
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.common import EventClass, Reply
from tui_gcs.core.protocol.preflight import (
    CHECKLIST,
    FAILSAFES,
    MAX_NAME_CHARS,
    OVERRIDABLE,
    STOPS,
    TITLES,
    AcknowledgeCheck,
    Check,
    CheckState,
    SignOff,
    TickItem,
    count_words,
    names_of,
    open_by_hand,
    refusing,
)
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.records.rehearsal_store import RehearsalStore, plan_digest
from tui_gcs.core.station.assembly import StationParts

LOOK_S = 1.0
"""For this long the list of the status is kept before it is made again."""
PER_VEHICLE_S = 0.02
"""In a large fleet the list is kept for this long per vehicle: making it takes 0.3 ms for each."""
MAX_LINES = 8
"""Lines of one check and state; beyond that, vehicles with different reasons share one line."""
ASK_AGAIN_S = 10.0
"""A vehicle that did not answer is asked again after this many seconds."""
_SIM = "simulated vehicles"
_STATES = list(CheckState)
_NAMES = list(TITLES)


@dataclass(frozen=True)
class _Accepted:
    """A failsafe that an operator accepted as it is."""

    text: str
    operator: str
    uid: str
    """The vehicle's hardware id; "" if it was not known."""


VehicleFindings = list[tuple[int, CheckFinding]]
"""Pairs of a vehicle's id and a finding about it."""


class PreflightChecklist:
    """Makes the list of checks, and keeps what operators acknowledged and signed."""

    def __init__(self, parts: StationParts, readiness: Readiness) -> None:
        self._parts = parts
        self._readiness = readiness
        self._rehearsals = RehearsalStore(parts.config.rehearsals)
        self._accepted: dict[tuple[str, int], _Accepted] = {}
        """By name of the check and id of the vehicle."""
        self._ticked = TickedItems()
        self._signed: tuple[str, int] | None = None
        """The operator who signed, and the revision of the scenario that was signed."""
        self._asked_s: dict[int, float] = {}
        self._digest: tuple[int, str] = (-1, "")
        self._newest: tuple[float, tuple[Check, ...]] = (-math.inf, ())
        parts.picture.fleet.on_gone(self._forget)
        parts.picture.fleet.paths.on_replace.append(self._forget)
        parts.comms.forwarder.on_passed.append(self._passed)

    def checks(self) -> tuple[Check, ...]:
        """All vehicles of teams on the ground, the worst first; empty if there are none."""
        now = self._parts.records.clock.now()
        vehicles = fleet.on_ground(self._parts)
        if now - self._newest[0] >= max(LOOK_S, len(vehicles) * PER_VEHICLE_S) - 1e-9:
            self._newest = now, self.look(vehicles) if vehicles else ()
        return self._newest[1]

    def look(self, vehicles: tuple[int, ...], operator: str = "") -> tuple[Check, ...]:
        """The list for these vehicles now; `operator` signs it with the start itself."""
        findings = [(vehicle, finding) for vehicle in vehicles for finding in self._findings(vehicle)]
        found = [*self._of_fleet(), *_grouped([*findings, *self._of_places(vehicles, findings)])]
        found.append(self._sign_off(operator))
        listed = {CHECKLIST, *(check.name for check in found)}  # not every scenario has a checklist
        found += [self._good(name, len(vehicles)) for name in TITLES if name not in listed]
        return tuple(sorted(found, key=lambda check: (_STATES.index(check.state), _NAMES.index(check.name))))

    def _good(self, name: str, count: int) -> Check:
        """The line of a check without findings."""
        if name in OVERRIDABLE and not fleet.is_live(self._parts):
            return Check(name, CheckState.NOT_NEEDED, _SIM)
        if name == "mission":
            return Check(name, CheckState.NOT_NEEDED, "none was put on board by this station")
        return Check(name, CheckState.OK, f"{count} vehicles" if name in ("heard", "ids", "gps", "battery") else "")

    def _of_fleet(self) -> Iterator[Check]:
        parts = self._parts
        yield from fleet.complete(parts)
        yield from fleet.links(parts)
        yield fleet.recording(parts)
        yield from self._ticked.checks(parts.active.scenario.checklist, live=fleet.is_live(parts))
        if fleet.is_live(parts):
            yield fleet.rehearsal(parts, self._rehearsals.newest(self._plan()))

    def _of_places(self, vehicles: tuple[int, ...], findings: VehicleFindings) -> Iterator[tuple[int, CheckFinding]]:
        """Findings about vehicles that may start alone, but not together with the others."""
        kept = {vehicle for vehicle, finding in findings if finding.hard}
        alone = tuple(vehicle for vehicle in vehicles if vehicle not in kept)
        for result in self._readiness.beside(alone):
            if not result.ok:
                yield result.vehicle, CheckFinding("place", CheckState.FAIL, result.text, "carry it away", hard=True)

    def _findings(self, vehicle_id: int) -> Iterator[CheckFinding]:
        yield from standing(self._readiness, vehicle_id)
        vehicle = self._parts.picture.fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return
        yield from link_quality(vehicle)
        if fleet.is_live(self._parts):
            yield from (self._judged(vehicle, finding) for finding in failsafes(self._parts, vehicle))
            yield from plans_on_board(self._parts, vehicle)
            yield from own_limits(self._parts, vehicle)

    def _judged(self, vehicle: Vehicle, finding: CheckFinding) -> CheckFinding:
        """The finding as it stands with the operators' acknowledgements: one holds for the same text and vehicle."""
        accepted = self._accepted.get((finding.name, vehicle.id))
        if finding.state is not CheckState.FAIL or accepted is None or accepted.text != finding.text:
            return finding
        # Another vehicle may use this id by now.
        if accepted.uid and vehicle.identity.uid and accepted.uid != vehicle.identity.uid:
            return finding
        return CheckFinding(finding.name, CheckState.ACKNOWLEDGED, finding.text, f"acknowledged by {accepted.operator}")

    def _sign_off(self, operator: str) -> Check:
        if not fleet.is_live(self._parts):
            return Check("sign-off", CheckState.NOT_NEEDED, _SIM)
        if operator:
            return Check("sign-off", CheckState.OK, f"by {operator}, with the start")
        if self._signed is None:
            return Check("sign-off", CheckState.FAIL, "not signed", "sign this list, or the start, with your name")
        name, revision = self._signed
        if revision != self._parts.active.revision:
            text = f"{name} has signed, but the scenario was changed since"
            return Check("sign-off", CheckState.FAIL, text, "look at the list, and sign again")
        return Check("sign-off", CheckState.OK, f"by {name}")

    def _plan(self) -> str:
        """The digest of the scenario and planners that would be flown."""
        parts = self._parts
        # Hashed once per revision: the list is made again every second.
        if self._digest[0] != parts.active.revision:
            self._digest = parts.active.revision, plan_digest(parts.active.scenario, parts.config.planners)
        return self._digest[1]

    def refusal(self, request: m.Start) -> Reply | None:
        """The reply that refuses this start; None if the list allows it."""
        if wrong := [name for name in request.overrides if name not in OVERRIDABLE]:
            known = ", ".join(OVERRIDABLE)
            return Reply(ok=False, text=f"{_name(wrong[0])} cannot be overridden; what can: {known}")
        operator = _name(request.operator)
        if request.overrides and not operator:
            return Reply(ok=False, text="not started: an override needs the operator's name")
        stopping = [
            check
            for check in refusing(self.look(request.vehicles, operator), request.vehicles)
            if check.name not in request.overrides
        ]
        if not stopping:
            return None
        # What is not known refuses a start, so it is read at once; the next try finds it.
        if any(check.state is CheckState.UNKNOWN for check in stopping):
            self.read(anew=False)
        text = "; ".join(check.words() for check in stopping)
        return Reply(ok=False, text=f"not started: {text}", refused_by=tuple(stopping))

    def begun(self, principal: str, request: m.Start) -> None:
        """Journal a start that was accepted, with its signature and overrides, which hold for this start only."""
        self._newest = -math.inf, ()
        if not fleet.is_live(self._parts):
            self._ticked.clear()
            return
        operator = _name(request.operator) or (self._signed[0] if self._signed else "")
        checks = self.look(request.vehicles, operator)
        overridden = refusing(checks, request.vehicles)
        for check in overridden:
            self._report(principal, f"OVERRIDDEN by {operator} for this start: {check.words()}", WARNING)
        names = f"; overridden: {', '.join(names_of(overridden))}" if overridden else ""
        self._report(principal, f"start signed by {operator}: {count_words(checks)}{names}", NOTICE)
        # A signature holds for one start, and so do ticks.
        self._signed = None
        self._ticked.clear()

    def lifted(self, principal: str, vehicle: int) -> None:
        """Journal what speaks against arming a vehicle manually; that is no start, so nothing is refused."""
        if fleet.is_live(self._parts):
            for check in open_by_hand(self.look((vehicle,)), (vehicle,)):
                self._report(
                    principal, f"vehicle {vehicle} is armed by hand although {check.name}: {check.text}", WARNING
                )

    def _passed(self, vehicle: Vehicle, ruling: Ruling, station: str) -> None:
        """Journal the same when another station arms the vehicle through the forwarder."""
        if ruling.arms:
            self.lifted(station, vehicle.id)

    def acknowledge(self, principal: str, request: AcknowledgeCheck) -> Reply:
        """Accept a failsafe as it is, for all vehicles of which the same is true now."""
        operator = _name(request.operator)
        if request.name not in FAILSAFES:
            return Reply(ok=False, text=f"{_name(request.name)}: only {', '.join(FAILSAFES)} can be acknowledged")
        if not operator:
            return Reply(ok=False, text="an acknowledgement needs the operator's name")
        lines = [c for c in self.look(fleet.on_ground(self._parts)) if c.name == request.name]
        line = next((c for c in lines if c.text == request.text and c.state is CheckState.FAIL), None)
        if line is None:
            return Reply(ok=False, text=f"{request.name}: this is not found any more: look again")
        if request.vehicles and (others := set(line.vehicles) - set(request.vehicles)):
            return Reply(ok=False, text=f"{request.name}: found of {id_ranges(sorted(others))}, too: look again")
        for vehicle in line.vehicles:
            uid = self._parts.picture.fleet.vehicles[vehicle].identity.uid
            self._accepted[request.name, vehicle] = _Accepted(line.text, operator, uid)
        self._newest = -math.inf, ()
        text = f"acknowledged by {operator}: {line.words()}"
        self._report(principal, text, NOTICE)
        return Reply(ok=True, text=text)

    def tick(self, principal: str, request: TickItem) -> Reply:
        """Tick an item of the scenario's checklist, or take that back; both are journalled with operator and time."""
        operator = _name(request.operator)
        if not operator:
            return Reply(ok=False, text="a tick needs the operator's name")
        if request.text not in self._parts.active.scenario.checklist:
            return Reply(ok=False, text=f"{clean(request.text, 80)}: the scenario has no such item now: look again")
        tick = Tick(operator, self._parts.records.clock.wall()) if request.ticked else None
        text = f"checklist: {request.text}: {'ticked' if request.ticked else 'NOT ticked any more, taken back'}"
        if self._ticked.tick(request.text, tick):
            self._report(principal, f"{text} by {operator}", NOTICE)
        self._newest = -math.inf, ()
        return Reply(ok=True, text=f"{text} by {operator}")

    def sign(self, principal: str, request: SignOff) -> Reply:
        """Sign the list, unless something on it refuses a start."""
        operator, parts = _name(request.operator), self._parts
        if not operator:
            return Reply(ok=False, text="a signature needs the operator's name")
        if request.revision != parts.active.revision:
            return Reply(ok=False, text="not signed: the scenario has changed, look again")
        checks = self.look(fleet.on_ground(parts), operator)
        stopping = [check for check in checks if check.state in STOPS and not check.hard]
        if stopping:
            return Reply(
                ok=False, text=f"not signed: open are {', '.join(names_of(stopping))}", refused_by=tuple(stopping)
            )
        self._signed, self._newest = (operator, parts.active.revision), (-math.inf, ())
        text = f"list of checks signed by {operator}: {count_words(checks)}"
        self._report(principal, text, NOTICE)
        return Reply(ok=True, text=text)

    def read(self, *, anew: bool) -> Reply:
        """Read what is not known of the vehicles on the ground (`anew`: what is known, too); LIVE only."""
        parts, now = self._parts, self._parts.records.clock.now()
        if not fleet.is_live(parts):
            return Reply(ok=True, text=f"nothing to read: {_SIM}")
        asked = []
        for number in fleet.on_ground(parts):
            vehicle = parts.picture.fleet.vehicles.get(number)
            if (
                vehicle is None
                or vehicle.telemetry.armed
                or vehicle.path.high_latency
                or parts.comms.firmware.of(vehicle).why_not(vehicle)
            ):
                continue
            if now - self._asked_s.get(number, -math.inf) < ASK_AGAIN_S or not self._ask(vehicle, anew=anew):
                continue
            self._asked_s[number] = now
            asked.append(number)
        self._newest = -math.inf, ()
        return Reply(ok=True, text=f"reading from {len(asked)} vehicles" if asked else "nothing to read now")

    def _ask(self, vehicle: Vehicle, *, anew: bool) -> bool:
        """Ask the vehicle for what is not known; returns whether anything was asked."""
        services = self._parts.services
        plans = services.missions.registry
        fence = plans.state(vehicle.id).held[PlanKind.FENCE]
        unread = anew or not services.failsafes.known(vehicle)
        unseen = {kind for kind in PlanKind if plans.to_read(vehicle.id, kind)}
        if anew or not (fence.known or fence.partial or fence.stale):
            unseen.add(PlanKind.FENCE)
        if unread:
            services.failsafes.ask(vehicle.id)
        if not services.context.jobs.jobs(vehicle.id):
            for kind in sorted(unseen):
                services.missions.download(vehicle.id, kind)
        return unread or bool(unseen)

    def _forget(self, vehicle: Vehicle) -> None:
        """Forget acknowledgements of a vehicle whose id another vehicle may take over."""
        self._accepted = {key: value for key, value in self._accepted.items() if key[1] != vehicle.id}
        self._asked_s.pop(vehicle.id, None)

    def memory(self) -> list[list[str | int]]:
        """Acknowledgements for the station's next start; a signature is not kept, so that the list is read again."""
        return [[name, vehicle, a.text, a.operator, a.uid] for (name, vehicle), a in self._accepted.items()]

    def recall(self, held: list[list[Any]]) -> None:
        """Take back what `memory` returned; an acknowledgement counts only while the same is true of its vehicle."""
        self._accepted = {(name, vehicle): _Accepted(*said) for name, vehicle, *said in held}

    def _report(self, principal: str, text: str, severity: int) -> None:
        self._parts.records.events.report(EventClass.OPERATOR, principal, text, severity)


def _name(text: str) -> str:
    """An operator's name without control characters, cut to its maximum length."""
    return clean(text.strip(), MAX_NAME_CHARS)


def _grouped(findings: Iterable[tuple[int, CheckFinding]]) -> Iterator[Check]:
    """Group findings: vehicles of which the same is true share one line, and so do too many different ones."""
    groups: dict[CheckFinding, list[int]] = {}
    for vehicle, finding in findings:
        groups.setdefault(finding, []).append(vehicle)
    lines: dict[tuple[str, CheckState], list[Check]] = {}
    for finding, vehicles in groups.items():
        line = Check(finding.name, finding.state, finding.text, finding.todo, tuple(sorted(vehicles)), finding.hard)
        lines.setdefault((line.name, line.state), []).append(line)
    for same in lines.values():
        if len(same) <= MAX_LINES or same[0].name in FAILSAFES:  # these are acknowledged one by one
            yield from same
        else:
            yield from same[: MAX_LINES - 1]
            rest = same[MAX_LINES - 1 :]
            everyone = tuple(sorted(v for line in rest for v in line.vehicles))
            text = f"{rest[0].text}; and {len(rest) - 1} other reasons"
            yield Check(rest[0].name, rest[0].state, text, rest[0].todo, everyone, any(line.hard for line in rest))
