"""Actions on one vehicle: sent, repeated by class, acknowledged, confirmed by telemetry.

The three retry classes of architecture.md (security.md C.4):

* start: at most 3 copies within 2 s, then expired; never repeated later.
* stop: every 400 ms for 10 s until telemetry confirms, then an alarm and every 2 s until confirmed or superseded;
  it cancels what is queued for that vehicle.
* set: 5 tries, 0.6 s apart; idempotent; dropped when superseded.

Success is what telemetry shows; an ACK only ends the copies. A refusal collects the vehicle's own words for 0.5 s.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from tui_gcs.core.clock import Clock
from tui_gcs.core.events import ALERT, INFO, WARNING, EventLog
from tui_gcs.core.messages import EventClass
from tui_gcs.core.vehicle import Vehicle

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS, CANCELLED = range(7)
"""MAV_RESULT."""
RESULT_WORDS = {1: "temporarily rejected", 2: "denied", 3: "unsupported", 4: "failed", 6: "cancelled"}
REASON_WAIT_S = 0.5
"""STATUSTEXT is queued by the autopilot: reasons come up to this long after a refusing ACK (ardupilot.md)."""


class Retry(Enum):
    """How an action is repeated: (copies, gap s, slow gap s after the copies or 0)."""

    START = (3, 0.9, 0.0)
    STOP = (25, 0.4, 2.0)
    SET = (5, 0.6, 0.0)

    @property
    def copies(self) -> int:
        """How many are sent at most before it is given up (stop: before the alarm)."""
        return int(self.value[0])

    @property
    def gap_s(self) -> float:
        """Time between copies."""
        return float(self.value[1])

    @property
    def slow_gap_s(self) -> float:
        """Time between further copies of a stop that is still not confirmed."""
        return float(self.value[2])


class Outcome(Enum):
    """How an action ended."""

    CONFIRMED = "confirmed"
    REFUSED = "refused"
    EXPIRED = "no answer"
    NOT_CONFIRMED = "accepted, not confirmed"
    SUPERSEDED = "superseded"


@dataclass
class Action:
    """One thing asked of one vehicle."""

    vehicle: int
    name: str
    """For the operator and the journal, e.g. "arm"; a newer action of the same name supersedes this one."""
    retry: Retry
    send: Callable[[int], object]
    """Sends copy number 0, 1, …"""
    confirmed: Callable[[Vehicle], bool]
    """Whether telemetry shows it done."""
    command: int | None = None
    """MAV_CMD whose COMMAND_ACK belongs to this action; None if it has none (set-points, heartbeat-confirmed modes)."""
    confirm_s: float = 5.0
    """After an accepting ACK, or the last copy, wait this long for telemetry."""
    on_done: Callable[["Action", Outcome, str], None] | None = None
    ack_ends: bool = True
    """Whether an accepting ACK ends the copies; not where what is asked for is a message that may be lost itself."""
    housekeeping: bool = False
    """A request for information or rates: no stop needs to cancel it."""
    sent: int = 0
    first_s: float = 0.0
    """When the first copy was sent."""
    next_s: float = 0.0
    acked_s: float | None = None
    refused_s: float | None = None
    result: int | None = None
    alarmed: bool = False


class CommandService:
    """Runs all pending actions; at most one per vehicle and name."""

    def __init__(self, clock: Clock, events: EventLog) -> None:
        """Nothing pending."""
        self._clock = clock
        self._events = events
        self._pending: dict[tuple[int, str], Action] = {}
        self.unanswered: list[str] = []
        """Actions that expired without any answer."""
        self.ignored: Counter[str] = Counter()
        """ACKs that belonged to nothing, by reason."""

    def submit(self, action: Action) -> None:
        """Begin `action` at the next tick; a stop cancels everything else queued for that vehicle."""
        if action.retry is Retry.STOP:
            self.cancel(action.vehicle)
        else:
            self._end(self._pending.get((action.vehicle, action.name)), Outcome.SUPERSEDED, "")
        action.next_s = self._clock.now()
        self._pending[(action.vehicle, action.name)] = action
        self._run(action, None)

    def cancel(
        self, vehicle: int, name: str | None = None, *, keep_stops: bool = False, housekeeping: bool = False
    ) -> None:
        """Drop the actions pending for `vehicle` (all, or the one called `name`); `housekeeping`: those, too."""
        for key, action in list(self._pending.items()):
            kept = keep_stops and action.retry is Retry.STOP
            if key[0] == vehicle and not kept and (key[1] == name if name else housekeeping or not action.housekeeping):
                self._end(action, Outcome.SUPERSEDED, "")

    def stopping(self, vehicle: int) -> bool:
        """Whether a hold, landing or disarming of `vehicle` is not confirmed yet."""
        return any(key[0] == vehicle and action.retry is Retry.STOP for key, action in self._pending.items())

    def pending(self, vehicle: int, name: str) -> bool:
        """Whether such an action is under way."""
        return (vehicle, name) in self._pending

    @property
    def waiting(self) -> bool:
        """Whether an answer to something flown is expected: then we listen without delay."""
        return any(action.sent and not action.housekeeping for action in self._pending.values())

    def tick(self, vehicles: dict[int, Vehicle]) -> None:
        """Send what is due, end what is confirmed, refused or out of time."""
        for action in list(self._pending.values()):
            self._run(action, vehicles.get(action.vehicle))

    def on_ack(self, vehicle: Vehicle, command: int, result: int) -> None:
        """A COMMAND_ACK arrived."""
        action = self._waiting_for(vehicle.id, command)
        if action is None:
            self.ignored["ack for nothing asked"] += 1
            return
        now = self._clock.now()
        if result in (ACCEPTED, IN_PROGRESS):
            action.acked_s, action.result = now, result
            action.refused_s = None
        elif action.acked_s is None and action.refused_s is None:
            action.refused_s, action.result = now, result

    def _waiting_for(self, vehicle: int, command: int) -> Action | None:
        for (vehicle_id, _), action in self._pending.items():
            if vehicle_id == vehicle and action.command == command:
                return action
        return None

    def _run(self, action: Action, vehicle: Vehicle | None) -> None:
        now = self._clock.now()
        if vehicle is not None and self._is_shown(action, vehicle):
            self._end(action, Outcome.CONFIRMED, "")
        elif action.refused_s is not None and action.retry is not Retry.STOP:
            if now - action.refused_s >= REASON_WAIT_S:
                self._end(action, Outcome.REFUSED, self._why(action, vehicle))
        elif action.acked_s is not None and action.ack_ends and action.retry is not Retry.STOP:
            if now - action.acked_s > action.confirm_s:
                self._end(action, Outcome.NOT_CONFIRMED, self._why(action, vehicle))
        elif now >= action.next_s - 1e-9 and not self._waits_its_turn(action):
            self._send_or_expire(action, now)

    def _is_shown(self, action: Action, vehicle: Vehicle) -> bool:
        """Whether telemetry shows it done. A stop is not confirmed by a picture that is older than the order."""
        if not action.sent or (action.retry is Retry.STOP and vehicle.heartbeat_s <= action.first_s):
            return False
        return action.confirmed(vehicle)

    def _waits_its_turn(self, action: Action) -> bool:
        """An ACK names only the command: so one of a kind is under way per vehicle, in order of submission."""
        if action.command is None or action.sent:
            return False
        for (vehicle, _), other in self._pending.items():
            if other is action:
                return False
            if vehicle == action.vehicle and other.command == action.command:
                return True
        return False

    def _send_or_expire(self, action: Action, now: float) -> None:
        if not action.sent:
            action.first_s = now
        if action.sent < action.retry.copies:
            action.send(action.sent)
            action.sent += 1
            last = action.sent == action.retry.copies
            patient = action.command is None or action.retry is Retry.START  # no more copies, but telemetry may tell
            wait_s = action.confirm_s if last and patient else action.retry.gap_s
            action.next_s = now + (action.retry.gap_s if action.retry is Retry.STOP else wait_s)
        elif action.retry is Retry.STOP:
            self._keep_stopping(action, now)
        elif action.command is None or action.acked_s is not None:
            self._end(action, Outcome.NOT_CONFIRMED, "")
        else:
            if not action.housekeeping:  # those are asked again for as long as it takes
                self.unanswered.append(f"vehicle {action.vehicle}: {action.name}")
            self._end(action, Outcome.EXPIRED, "")

    def _keep_stopping(self, action: Action, now: float) -> None:
        if not action.alarmed:
            action.alarmed = True
            text = f"{action.name} not confirmed after 10 s: still trying"
            self._events.say(EventClass.CONNECTION, f"vehicle {action.vehicle}", text, ALERT)
        action.send(action.sent)
        action.sent += 1
        action.next_s = now + action.retry.slow_gap_s

    def _why(self, action: Action, vehicle: Vehicle | None) -> str:
        word = RESULT_WORDS.get(action.result or 0, "" if action.result == ACCEPTED else f"result {action.result}")
        since = min(t for t in (action.refused_s, action.acked_s, self._clock.now()) if t is not None) - 1.0
        reasons = vehicle.reasons_since(since) if vehicle is not None else []
        return ": ".join(part for part in (word, "; ".join(reasons)) if part)

    def _end(self, action: Action | None, outcome: Outcome, why: str) -> None:
        if action is None or self._pending.get((action.vehicle, action.name)) is not action:
            return
        del self._pending[(action.vehicle, action.name)]
        if outcome is not Outcome.SUPERSEDED and not action.housekeeping:
            text = f"{action.name}: {outcome.value}" + (f" ({why})" if why else "")
            severity = INFO if outcome is Outcome.CONFIRMED else WARNING
            if action.retry is not Retry.SET or severity == WARNING:
                self._events.say(EventClass.MISSION, f"vehicle {action.vehicle}", text, severity)
        if action.on_done is not None:
            action.on_done(action, outcome, why)
