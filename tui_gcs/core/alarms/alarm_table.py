"""The alarm table: what is wrong now becomes alarms that are new, acknowledged, over or shelved (ISA-18.2).

A *member* is one cause at one subject: a vehicle, or a link or team by name. It is raised when it has held for its
cause's delay, and over when it has not held for the other delay; being acknowledged is independent of that. Members
of one cause are shown as one `Alarm`. A member that follows from another one of the same vehicle is frozen and not
shown. A member that comes back again and again is kept for longer.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.alarms.causes import BY_ID, EVENT_CAUSES, MAX_SHELVED_MIN, RANK, Cause
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.failsafe_texts import is_fence_breach
from tui_gcs.core.protocol.alarms import AlarmLevel, AlarmState, vehicles_words
from tui_gcs.core.protocol.common import Acknowledge, Alarm, EventClass, JournalEvent, Reply, Shelve, Unshelve
from tui_gcs.core.records.event_log import ALERT, CRITICAL, INFO, NOTICE, WARNING, EventLog

Subject = int | str
"""The id of a vehicle, or the name of a link or team."""
SEVERITY = {AlarmLevel.WARNING: CRITICAL, AlarmLevel.CAUTION: WARNING, AlarmLevel.ADVISORY: NOTICE}
CHATTER_S = 60.0
"""A member that comes back within this time after it was over flutters: it is kept twice as long each time."""
MAX_OFF_S = 60.0
EVENT_HOLDS_S = 30.0
"""An event counts as holding for this long."""
RECALL_HOLDS_S = 15.0
"""After a restart, members count as holding for this long, until the vehicles are heard or LOST."""
_STATES: tuple[AlarmState, ...] = ("new", "over", "acknowledged", "shelved")


@dataclass(frozen=True)
class AlarmFinding:
    """Something that is wrong now with one subject."""

    cause: str
    subject: Subject
    text: str = ""
    action: str = ""
    """Advice for this finding; "": the advice of its cause."""


@dataclass
class _Member:
    cause: Cause
    subject: Subject
    text: str = ""
    action: str = ""
    found_s: float | None = None
    """The time since when it has held without a break; None while it does not hold."""
    seen_s: float = 0.0
    """The time when it last held."""
    raised: int = 0
    """The number of its newest raising; 0: not raised yet."""
    since_s: float = 0.0
    acknowledged: bool = False
    over_s: float | None = None
    """The time when it was found to be over; None while it holds."""
    by: str = ""
    shelved_until_s: float = 0.0
    hidden: bool = False
    flutters: int = 0

    @property
    def holds(self) -> bool:
        return self.raised > 0 and self.over_s is None

    def state(self, now: float) -> AlarmState | None:
        """The state in which it is shown; None if it is not shown."""
        if not self.raised or self.hidden or (self.over_s is not None and self.acknowledged):
            return None
        if self.shelved_until_s > now:
            return "shelved" if self.holds else None
        if self.over_s is not None:
            return "over"
        return "acknowledged" if self.acknowledged else "new"


class AlarmTable:
    """Keeps all members: `look` takes what is wrong now, `alarms` returns what to show."""

    def __init__(self, clock: Clock, events: EventLog) -> None:
        self.changes = 0
        """Grows with every change that consoles should show at once."""
        self._clock = clock
        self._events = events
        self._members: dict[tuple[str, Subject], _Member] = {}
        self._raised = 0
        self._from_events: dict[tuple[str, Subject], tuple[float, str]] = {}
        self._memory: dict[str, Any] | None = None

    def is_up(self, cause: str, subject: Subject) -> bool:
        """Whether a member held at the last look; limits with a dead-band depend on it."""
        member = self._members.get((cause, subject))
        return member is not None and member.holds

    def on_event(self, event: JournalEvent, vehicles: Mapping[int, Vehicle]) -> None:
        """Take an event that may need an act; on the ground, vehicles' events are left to the checks before a start."""
        kind, _, name = event.source.partition(" ")
        if event.severity > CRITICAL or event.cls in (EventClass.ALARM, EventClass.CONSOLE) or kind == "planner":
            return
        subject = int(name) if kind == "vehicle" and name.isdigit() else event.source
        vehicle = vehicles.get(subject) if isinstance(subject, int) else None
        # What a vehicle reports on the ground matters to the operator who wants to start it, and stands in the checks.
        on_ground = vehicle is None or not vehicle.telemetry.armed
        if on_ground and isinstance(subject, int) and event.cls in (EventClass.VEHICLE, EventClass.SENSOR):
            return
        cause = "alert" if event.severity <= ALERT else "report"
        # A PX4 whose fence only warns (GF_ACTION 1) reports a breach by this text alone.
        if isinstance(subject, int) and event.cls is EventClass.VEHICLE and is_fence_breach(event.text):
            cause = "fence"
        self._from_events[(cause, subject)] = (event.t_s, event.text)

    def look(self, findings: Iterable[AlarmFinding]) -> None:
        """Take all that is wrong now: a member without a finding does not hold any more."""
        now = self._clock.now()
        self._end_shelvings(now)
        self._from_events = {
            key: reported for key, reported in self._from_events.items() if now - reported[0] < EVENT_HOLDS_S
        }
        found = {key: AlarmFinding(*key, text) for key, (_, text) in self._from_events.items()}
        found |= {(f.cause, f.subject): f for f in findings}
        # Consequences of what is found now are hidden at once, however long their own delays are.
        hidden = {(effect, subject) for cause, subject in found for effect in BY_ID[cause].hides}
        begun, ended = [], []
        for key, finding in found.items():
            member = self._members.get(key)
            if member is None:
                if key in hidden:
                    continue
                member = self._members[key] = _Member(BY_ID[finding.cause], finding.subject)
            if self._is_true(member, finding, key in hidden, now):
                begun.append(member)
        for key, member in list(self._members.items()):
            if key not in found and self._is_over(member, key in hidden, now):
                ended.append(member)
            if self._is_gone(member, now):
                del self._members[key]
        self._report("", begun)
        self._report("over: ", ended)

    def _is_true(self, member: _Member, finding: AlarmFinding, hidden: bool, now: float) -> bool:
        """Whether this finding raises the member."""
        if member.found_s is None:
            member.found_s = now
        member.seen_s, member.hidden, member.action = now, hidden, finding.action
        if member.holds:
            # The same event again is the same alarm; another text is news, and new to the operator.
            if finding.cause in EVENT_CAUSES and _without_count(finding.text) != _without_count(member.text):
                self._renew(member, now)
            member.text = finding.text
            return False
        if hidden or not (now - member.found_s >= member.cause.on_s - 1e-9 or self._is_reported(member, now)):
            return False
        if member.over_s is not None and now - member.over_s < CHATTER_S:
            # A value at its limit would ring again and again; each return doubles the time before it is over.
            member.flutters += 1
        member.text, member.over_s = finding.text, None
        self._renew(member, now)
        return True

    def _is_reported(self, member: _Member, now: float) -> bool:
        """Whether an event about its consequence came just now, so that its own delay need not pass."""
        reported = [
            self._from_events.get((effect, member.subject)) for effect in member.cause.hides if effect in EVENT_CAUSES
        ]
        return any(each is not None and now - each[0] <= member.cause.on_s for each in reported)

    def _renew(self, member: _Member, now: float) -> None:
        self._raised += 1
        member.raised, member.since_s = self._raised, now
        member.acknowledged = member.cause.level is AlarmLevel.ADVISORY
        self.changes += 1

    def _is_over(self, member: _Member, hidden: bool, now: float) -> bool:
        """Whether the member is over because it was not found."""
        if hidden:
            # Frozen: while the worse cause holds it cannot be seen whether this one does.
            member.hidden, member.seen_s = True, now
            return False
        member.hidden, member.found_s = False, None
        # Doubled with each return, so that what flutters stays one alarm.
        off_s = min(MAX_OFF_S, member.cause.off_s * 2**member.flutters)
        if not member.holds or now - member.seen_s < off_s - 1e-9:
            return False
        member.over_s = now
        self.changes += 1
        return True

    def _is_gone(self, member: _Member, now: float) -> bool:
        """Whether the member can be forgotten."""
        if not member.raised:
            return now - member.seen_s > member.cause.off_s
        return member.over_s is not None and member.acknowledged and now - member.over_s > CHATTER_S

    def memory(self) -> dict[str, Any]:
        """Raised members and their acknowledgements for the station's next start; a new object after every change."""
        if self._memory is None or self._memory["changes"] != self.changes:
            members = [
                {
                    "cause": member.cause.id,
                    "subject": member.subject,
                    "text": member.text,
                    "raised": member.raised,
                    "since_s": member.since_s,
                    "acknowledged": member.acknowledged,
                    "by": member.by,
                    "is_over": member.over_s is not None,
                    "shelved_until_s": member.shelved_until_s,
                }
                for member in self._members.values()
                if member.raised
            ]
            self._memory = {"changes": self.changes, "raised": self._raised, "members": members}
        return self._memory

    def recall(self, held: Mapping[str, Any]) -> None:
        """Take back what `memory` returned, so that a restart makes no alarm new."""
        now = self._clock.now()
        self._raised = held.get("raised", 0)
        for item in held.get("members", ()):
            cause = BY_ID.get(item["cause"])
            if cause is None:
                continue
            # The monotonic clock of the machine may have begun anew, which would shelve it for days.
            longest_s = now + 60.0 * MAX_SHELVED_MIN[cause.level]
            self._members[item["cause"], item["subject"]] = _Member(
                cause,
                item["subject"],
                text=item["text"],
                # In the future on purpose: vehicles are heard again only some seconds after a restart.
                seen_s=now + RECALL_HOLDS_S,
                raised=item["raised"],
                since_s=min(item["since_s"], now),
                acknowledged=item["acknowledged"],
                over_s=now if item["is_over"] else None,
                by=item["by"],
                shelved_until_s=min(item["shelved_until_s"], longest_s),
            )

    def acknowledge(self, principal: str, request: Acknowledge) -> Reply:
        """Acknowledge in the name of `principal`; members raised after the numbers in the request stay new."""
        # A console acknowledges what it shows: a raising that came after its last status stays new.
        named = [m for m in self._named(request.raised) if not m.acknowledged]
        for member in named:
            member.acknowledged, member.by = True, principal
        return self._answered("acknowledged: ", principal, named, "nothing new of that")

    def shelve(self, principal: str, request: Shelve) -> Reply:
        """Hide for a while the members that hold now; a vehicle that joins later is shown."""
        now = self._clock.now()
        named = [m for m in self._named(request.raised) if m.holds]
        for member in named:
            most_min = MAX_SHELVED_MIN[member.cause.level]
            # Checked for all members before any of them is shelved.
            if not 0 < request.minutes <= most_min:
                text = f"{member.cause.title}: may be shelved for {most_min:g} min at most"
                return Reply(ok=False, text=text)
        for member in named:
            member.acknowledged, member.by = True, principal
            member.shelved_until_s = now + 60.0 * request.minutes
        return self._answered(f"shelved for {request.minutes:g} min: ", principal, named, "nothing of that is there")

    def unshelve(self, principal: str, request: Unshelve) -> Reply:
        """Show shelved members again, as new ones."""
        now = self._clock.now()
        named = [m for m in self._members.values() if m.cause.id in request.causes and m.shelved_until_s > now]
        for member in named:
            self._end_shelving(member)
        return self._answered("unshelved: ", principal, named, "nothing of that is shelved")

    def _end_shelvings(self, now: float) -> None:
        """Make members new again when their time on the shelf has passed."""
        ended = [m for m in self._members.values() if 0.0 < m.shelved_until_s <= now]
        for member in ended:
            self._end_shelving(member)
        self._report("shelved no longer: ", [m for m in ended if m.holds])

    def _end_shelving(self, member: _Member) -> None:
        member.shelved_until_s = 0.0
        if member.holds:
            member.acknowledged = member.cause.level is AlarmLevel.ADVISORY
        self.changes += 1

    def _named(self, raised: dict[str, int]) -> list[_Member]:
        """The members that a console had on its screen."""
        now = self._clock.now()
        return [
            member
            for member in self._members.values()
            if member.state(now) is not None and member.raised <= raised.get(member.cause.id, 0)
        ]

    def _answered(self, what: str, principal: str, members: list[_Member], nothing: str) -> Reply:
        if not members:
            return Reply(ok=False, text=nothing)
        self.changes += 1
        return Reply(ok=True, text="; ".join(self._report(what, members, principal)))

    def alarms(self) -> tuple[Alarm, ...]:
        """One alarm for each cause, a second one for its shelved members; the worst first."""
        now = self._clock.now()
        groups: dict[tuple[str, bool], list[_Member]] = {}
        for member in self._members.values():
            state = member.state(now)
            if state is not None:
                groups.setdefault((member.cause.id, state == "shelved"), []).append(member)
        return tuple(sorted((_alarm(members, now) for members in groups.values()), key=_order))

    def _report(self, what: str, members: list[_Member], source: str = "alarm") -> list[str]:
        """Report one event for each cause of these members; returns the texts."""
        groups: dict[str, list[_Member]] = {}
        for member in members:
            groups.setdefault(member.cause.id, []).append(member)
        texts = []
        for group in groups.values():
            text = what + _words(group)
            texts.append(text)
            if what or group[0].cause.id not in EVENT_CAUSES:  # those are events already
                severity = SEVERITY[group[0].cause.level] if not what else INFO
                self._events.report(EventClass.ALARM, source, text, severity)
        return texts


def _without_count(text: str) -> str:
    """The text without the count of repeats that `EventLog.report` puts at its end."""
    return text.partition(" … (")[0]


def _alarm(members: list[_Member], now: float) -> Alarm:
    """The alarm for members of one cause, shelved or not; members that are over count only if none holds."""
    states = {member.state(now) for member in members}
    state = next(state for state in _STATES if state in states)
    if states & {"new", "acknowledged"}:
        state = "new" if "new" in states else "acknowledged"
        shown = [member for member in members if member.holds]
    else:
        shown = members
    cause, newest = members[0].cause, max(shown, key=lambda member: member.raised)
    return Alarm(
        cause=cause.id,
        level=cause.level,
        tag=cause.tag,
        title=cause.title,
        action=_action(cause, shown),
        state=state,
        raised=max(member.raised for member in members),
        since_s=min(member.since_s for member in shown),
        vehicles=_vehicles(shown),
        fresh=_vehicles(member for member in shown if not member.acknowledged),
        names=tuple(sorted(member.subject for member in shown if isinstance(member.subject, str))),
        text=_details(shown, newest),
        by=newest.by,
        shelved_until_s=max(member.shelved_until_s for member in shown),
    )


def _action(cause: Cause, members: list[_Member]) -> str:
    """The advice; where members differ, that of the cause with the vehicles for which it is meant."""
    others = [member for member in members if not member.action]
    if not others:
        return max(members, key=lambda member: member.raised).action
    return cause.action if len(others) == len(members) else f"{vehicles_words(_vehicles(others))}: {cause.action}"


def _vehicles(members: Iterable[_Member]) -> tuple[int, ...]:
    return tuple(sorted(member.subject for member in members if isinstance(member.subject, int)))


def _details(members: list[_Member], newest: _Member) -> str:
    """The newest details; with their vehicle, where other members have different ones."""
    if newest.text and any(member.text != newest.text for member in members):
        subject = newest.subject
        return f"{vehicles_words([subject]) if isinstance(subject, int) else subject}: {newest.text}"
    return newest.text


def _words(members: list[_Member]) -> str:
    """The text for the journal, the same as `Alarm.words`."""
    vehicles = _vehicles(members)
    names = sorted(member.subject for member in members if isinstance(member.subject, str))
    subject = ", ".join([*([vehicles_words(vehicles)] if vehicles else []), *names])
    newest = max(members, key=lambda member: member.raised)
    return "  ".join(part for part in (f"{members[0].cause.title}: {subject}", _details(members, newest)) if part)


def _order(alarm: Alarm) -> tuple[int, int, int, int]:
    """The order of the list: the worst that holds, of one level the new; then what is over, advisories, shelved ones.

    A warning that holds is never pushed off a line by a smaller new one or by one that is over: it must not
    be forgotten because it was acknowledged an hour ago.
    """
    holds = alarm.state in ("new", "acknowledged")
    place = 3 if alarm.state == "shelved" else 1 if not holds else 0 if alarm.level > AlarmLevel.ADVISORY else 2
    return (place, -alarm.level, _STATES.index(alarm.state), RANK[alarm.cause])
