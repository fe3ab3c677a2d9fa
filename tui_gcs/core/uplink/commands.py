"""Actions on one vehicle: sent, repeated by class, acknowledged, confirmed by telemetry.

The three retry classes of docs/architecture.md (docs/threats.md C.4):

* start: at most 3 copies within 2 s, then expired; never repeated later.
* stop: every 400 ms for 10 s until telemetry confirms, then an alarm and every 2 s until confirmed or superseded;
  it cancels what is queued for that vehicle.
* set: 5 tries, 0.6 s apart, or what an answer takes if that is longer; idempotent; dropped when superseded.

Success is what telemetry shows; an ACK only ends the copies (whose it is: `ack_book.py`). A refusal collects the
vehicle's own words for 0.5 s.
"""

from collections import Counter, OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT, INFO, NOTICE, WARNING, EventLog
from tui_gcs.core.uplink.ack_matching import AckMatcher
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS, CANCELLED = range(7)
LONG_ONLY, INT_ONLY, UNSUPPORTED_FRAME, NOT_IN_CONTROL = range(7, 11)
"""MAV_RESULT."""
RESULT_WORDS = {
    ACCEPTED: "",
    TEMPORARILY_REJECTED: "temporarily rejected",
    DENIED: "denied",
    UNSUPPORTED: "unsupported",
    FAILED: "failed",
    IN_PROGRESS: "still in progress",
    CANCELLED: "cancelled",
    LONG_ONLY: "taken as COMMAND_LONG only",
    INT_ONLY: "taken as COMMAND_INT only",
    UNSUPPORTED_FRAME: "frame of reference not supported",
    NOT_IN_CONTROL: "another station has control",
}
OTHER_WAY = {LONG_ONLY: False, INT_ONLY: True}
"""Results that ask for the other message: whether that is COMMAND_INT."""
REASON_WAIT_S = 0.5
"""STATUSTEXT is queued by the autopilot: reasons come up to this long after a refusing ACK (docs/autopilots.md)."""
START_WITHIN_S = 2.0
"""No copy of a start leaves later than this after it was asked for."""
PROGRESS_LIMIT_S = 60.0
"""What is in progress for longer is told as that (B.6-43)."""
LATE_S = 60.0
"""How long it is remembered what was given up, so that its late ACK is told as late."""
DOUBT_S = 15.0
"""So long after giving up without an answer an ACK may belong to either of two equal commands (B.6-45)."""
SURE_ACKS = 2
"""Of an order in such doubt: the given-up one's late ACK alone proves nothing."""
MAX_REMEMBERED = 1000
MAX_UNANSWERED = 100
LOOK_FROM = 2
"""From this copy on, the telemetry that confirms it is asked for: a heartbeat a second may be lost, too."""
MAX_ACKS = 2
"""Of one order, by an honest vehicle (PX4's double one): it is looked at once after each."""
LOOK_GAP_S = 0.5
"""Once it is accepted, that telemetry is asked for at once, then this often: the next heartbeat is up to 1 s away."""
REQUEST_MESSAGE = 512
"""MAV_CMD_REQUEST_MESSAGE."""
QUESTION_S = 5.0
"""So long the ACK of a question may take."""

SHOWN = {"land": "begun"}
"""What telemetry showed, where "confirmed" would read as if it were over."""


@dataclass
class _Past:
    """An action that is over."""

    name: str
    ended_s: float
    unanswered: bool


class CommandService:
    """Runs all pending actions; at most one per vehicle and name."""

    def __init__(self, clock: Clock, events: EventLog) -> None:
        """Nothing pending."""
        self._clock = clock
        self._events = events
        self._pending: dict[int, dict[str, VehicleAction]] = {}
        """By vehicle and name, in order of submission."""
        self._past: OrderedDict[tuple[int, int], _Past] = OrderedDict()
        """By vehicle and command: what came last and is over."""
        self._questions_s: dict[tuple[int, int], float] = {}
        self.unanswered_count = 0
        """Actions that expired without any answer, since start."""
        self.unanswered: list[str] = []
        """The newest of them, in words."""
        self.ignored: Counter[str] = Counter()
        """ACKs that belonged to nothing, by reason."""
        self.ack_matcher = AckMatcher()

    # ---------------------------------------------------------------- asking

    def submit(self, action: VehicleAction) -> None:
        """Begin `action` at the next tick; a stop cancels everything else queued for that vehicle."""
        if action.retry is RetryClass.STOP:
            self.cancel(action.vehicle)
        else:
            self._end(self._pending.get(action.vehicle, {}).get(action.name), Outcome.SUPERSEDED, "")
        now = self._clock.now()
        action.asked_s = action.next_s = now
        if action.command is not None and not action.housekeeping:
            past = self._past.get((action.vehicle, action.command))
            action.doubtful = past is not None and past.unanswered and now - past.ended_s < DOUBT_S
        self._pending.setdefault(action.vehicle, {})[action.name] = action
        self._run(action, None)

    def cancel(
        self, vehicle: int, name: str | None = None, *, keep_stops: bool = False, housekeeping: bool = False
    ) -> None:
        """Drop the actions pending for `vehicle` (all, or the one called `name`); `housekeeping`: those, too."""
        for action in list(self._pending.get(vehicle, {}).values()):
            kept = keep_stops and action.retry is RetryClass.STOP
            if not kept and (action.name == name if name else housekeeping or not action.housekeeping):
                self._end(action, Outcome.SUPERSEDED, "")

    def stopping(self, vehicle: int) -> bool:
        """Whether a hold, landing or disarming of `vehicle` is not confirmed yet."""
        return any(action.retry is RetryClass.STOP for action in self._pending.get(vehicle, {}).values())

    def pending(self, vehicle: int, name: str) -> bool:
        """Whether such an action is under way."""
        return name in self._pending.get(vehicle, {})

    @property
    def waiting(self) -> bool:
        """Whether an answer to something flown is expected: then we listen without delay."""
        return any(action.sent and not action.housekeeping for action in self._all())

    def tick(self, vehicles: dict[int, Vehicle]) -> None:
        """Send what is due, end what is confirmed, refused or out of time."""
        for action in list(self._all()):
            self._run(action, vehicles.get(action.vehicle))

    def _all(self) -> Iterator[VehicleAction]:
        return (action for actions in self._pending.values() for action in actions.values())

    # ---------------------------------------------------------------- ACKs

    def question(self, vehicle: int, command: int) -> None:
        """Something was asked by `command` that no action waits for: its ACK is nobody's, and not worth counting."""
        self._questions_s[(vehicle, command)] = self._clock.now()

    def on_ack(self, vehicle: Vehicle, command: int, result: int) -> None:
        """A COMMAND_ACK arrived."""
        action, now = self._waiting_for(vehicle.id, command), self._clock.now()
        is_older = self.ack_matcher.is_older(vehicle.id, command, action, now, last=result != IN_PROGRESS)
        if action is None or (is_older and not action.in_progress):
            self._ack_for_nobody(vehicle.id, command, result)
            return
        action.acks += 1
        if action.acks > action.sent * (2 if action.double_ack else 1):
            self.ignored["repeated ack"] += 1
        if action.doubtful and action.acks < SURE_ACKS:
            return
        if self._turns(action, result):
            action.next_s = now
        elif result in (ACCEPTED, IN_PROGRESS):
            if not (action.double_ack and action.refused_s is not None):
                action.acked_s, action.result, action.refused_s = now, result, None
                if action.acks <= MAX_ACKS:
                    action.look_s = now
                action.in_progress = result == IN_PROGRESS
        elif action.refused_s is None and (action.acked_s is None or action.double_ack or action.in_progress):
            action.refused_s, action.result, action.in_progress = now, result, False

    def _turns(self, action: VehicleAction, result: int) -> bool:
        """Whether the vehicle wants the same order by the other message; then the next copy is that."""
        if action.order is None or action.turned or OTHER_WAY.get(result) is not (not action.order.as_int):
            return False
        action.order, action.turned = action.order.by_other_message(), True
        return True

    def _ack_for_nobody(self, vehicle: int, command: int, result: int) -> None:
        now = self._clock.now()
        key = (vehicle, command)
        past = self._past.get(key)
        if now - self._questions_s.get(key, -QUESTION_S) < QUESTION_S:
            return
        if past is None or now - past.ended_s > LATE_S:
            self.ignored["ack for nothing asked"] += 1
        elif not past.unanswered:
            self.ignored["repeated ack"] += 1
        else:
            self.ignored["late ack"] += 1
            word = _word(result) or "accepted"
            text = f"{past.name}: {word}, {now - past.ended_s:.1f} s after it was given up: not counted"
            self._events.report(EventClass.MISSION, f"vehicle {vehicle}", text, NOTICE, every_s=5)

    def _waiting_for(self, vehicle: int, command: int) -> VehicleAction | None:
        for action in self._pending.get(vehicle, {}).values():
            if action.command == command and action.sent:
                return action
        return None

    # ---------------------------------------------------------------- time

    def _run(self, action: VehicleAction, vehicle: Vehicle | None) -> None:
        now = self._clock.now()
        if action.refusal:
            self._end(action, Outcome.REFUSED, action.refusal)
        elif vehicle is not None and self._is_shown(action, vehicle):
            self._end(action, Outcome.CONFIRMED, "")
        else:
            self._look_if_accepted(action, now)
            self._go_on(action, vehicle, now)

    def _look_if_accepted(self, action: VehicleAction, now: float) -> None:
        if action.acked_s is not None and now >= action.look_s and action.look is not None:
            action.look_s = now + LOOK_GAP_S
            self._look(action)

    def _go_on(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        """Neither refused by us nor shown: say it again, wait, or give it up."""
        if action.retry is RetryClass.STOP or action.doubtful:
            self._tell_refused_stop(action, vehicle, now)
            self._send_if_due(action, vehicle, now)
        elif action.refused_s is not None:
            if now - action.refused_s >= REASON_WAIT_S:
                self._end(action, Outcome.REFUSED, self._why(action, vehicle))
        elif action.in_progress:
            if now - action.asked_s > PROGRESS_LIMIT_S:
                self._end(action, Outcome.NOT_CONFIRMED, self._why(action, vehicle))
        elif action.acked_s is not None and action.ack_ends:
            if now - action.acked_s > action.confirm_s:
                self._end(action, Outcome.NOT_CONFIRMED, self._why(action, vehicle))
        else:
            self._send_if_due(action, vehicle, now)

    def _is_shown(self, action: VehicleAction, vehicle: Vehicle) -> bool:
        """Whether telemetry shows it done. A stop is not confirmed by a picture that is older than the order."""
        if not action.sent or (action.retry is RetryClass.STOP and vehicle.telemetry.heartbeat_s <= action.first_s):
            return False
        return action.confirmed(vehicle)

    def _send_if_due(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        if now >= action.next_s - 1e-9 and not self._waits_its_turn(action, now):
            self._send_or_expire(action, vehicle, now)

    def _waits_its_turn(self, action: VehicleAction, now: float) -> bool:
        """An ACK names only the command: so one of a kind is under way per vehicle, in order of submission.

        A start waits no longer than it may be sent.
        """
        if action.command is None or action.sent:
            return False
        if _is_too_late(action, now):
            return False
        for other in self._pending[action.vehicle].values():
            if other is action:
                return False
            if other.command == action.command:
                return True
        return False

    def _send_or_expire(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        if not action.sent:
            action.first_s = now
        last = action.retry.copies
        if _is_too_late(action, now):
            last = action.sent  # nobody expects it any more, whatever held us up
        if action.sent < last:
            self._send_copy(action, now)
            if action.look is not None and action.sent > LOOK_FROM:
                self._look(action)
            patient = (
                action.command is None or action.retry is RetryClass.START
            )  # no more copies, but telemetry may tell
            wait_s = action.confirm_s if action.sent == last and patient else self._gap_s(action)
            action.next_s = now + (action.retry.gap_s if action.retry is RetryClass.STOP else wait_s)
        elif action.retry is RetryClass.STOP:
            self._keep_stopping(action, now)
        elif action.refused_s is not None:
            self._end(action, Outcome.REFUSED, self._why(action, vehicle))
        elif (action.command is None and action.sent) or action.acked_s is not None:
            self._end(action, Outcome.NOT_CONFIRMED, "")
        else:
            if not action.housekeeping:  # those are asked again for as long as it takes
                self.unanswered_count += 1
                self.unanswered.append(f"vehicle {action.vehicle}: {action.name}")
                del self.unanswered[:-MAX_UNANSWERED]
            self._end(action, Outcome.EXPIRED, "" if action.sent else "not sent in time")

    def _gap_s(self, action: VehicleAction) -> float:
        """Where the way is long, what is only set is not repeated before its answer can have come."""
        if action.retry is not RetryClass.SET or action.command is None:
            return action.retry.gap_s
        return max(action.retry.gap_s, self.ack_matcher.patience_s(action.vehicle))

    def _keep_stopping(self, action: VehicleAction, now: float) -> None:
        if not action.alarmed:
            action.alarmed = True
            text = f"{action.name} not confirmed after 10 s: still trying"
            self._events.report(EventClass.CONNECTION, f"vehicle {action.vehicle}", text, ALERT)
        self._send_copy(action, now)
        self._look(action)
        action.next_s = now + action.retry.slow_gap_s

    def _send_copy(self, action: VehicleAction, now: float) -> None:
        action.send(action.sent)
        action.sent += 1
        self.ack_matcher.sent(action, now)

    def _look(self, action: VehicleAction) -> None:
        if action.look is not None:
            self.question(action.vehicle, REQUEST_MESSAGE)
            action.look()

    def _tell_refused_stop(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        """A stop goes on whatever the vehicle answers, but what it answers is told, once."""
        if action.retry is not RetryClass.STOP or action.refused_s is None or action.told_refusal:
            return
        if now - action.refused_s >= REASON_WAIT_S:
            action.told_refusal = True
            text = f"{action.name}: refused ({self._why(action, vehicle)}), still trying"
            self._events.report(EventClass.MISSION, f"vehicle {action.vehicle}", text, WARNING)

    def _why(self, action: VehicleAction, vehicle: Vehicle | None) -> str:
        word = _word(action.result or ACCEPTED)
        since = min(t for t in (action.refused_s, action.acked_s, self._clock.now()) if t is not None) - 1.0
        reasons = vehicle.reasons_since(since) if vehicle is not None else []
        return ": ".join(part for part in (word, "; ".join(reasons)) if part)

    def unconfirmed_stops(self) -> list[tuple[int, str]]:
        """(vehicle, name) of the stops that no telemetry confirmed in time; they are still sent."""
        pending = [action for actions in self._pending.values() for action in actions.values()]
        return [(action.vehicle, action.name) for action in pending if action.alarmed]

    # ---------------------------------------------------------------- the end

    def _end(self, action: VehicleAction | None, outcome: Outcome, why: str) -> None:
        actions = self._pending.get(action.vehicle) if action is not None else None
        if action is None or actions is None or actions.get(action.name) is not action:
            return
        del actions[action.name]
        if not actions:
            del self._pending[action.vehicle]
        self._remember(action, outcome)
        if outcome is not Outcome.SUPERSEDED and not action.housekeeping:
            self._tell(action, outcome, why)
        if action.on_done is not None:
            action.on_done(action, outcome, why)

    def _tell(self, action: VehicleAction, outcome: Outcome, why: str) -> None:
        word = SHOWN.get(action.name, outcome.value) if outcome is Outcome.CONFIRMED else outcome.value
        text = f"{action.name}: {word}" + (f" ({why})" if why else "")
        severity = INFO if outcome is Outcome.CONFIRMED else WARNING
        if outcome is Outcome.NOT_CONFIRMED and action.retry is RetryClass.START:
            severity = ALERT  # it may happen yet, or have happened (B.6-41)
        if action.retry is not RetryClass.SET or severity != INFO:
            self._events.report(EventClass.MISSION, f"vehicle {action.vehicle}", text, severity)

    def _remember(self, action: VehicleAction, outcome: Outcome) -> None:
        if action.command is None or not action.sent:
            return
        unanswered = action.acks == 0 and outcome in (Outcome.EXPIRED, Outcome.NOT_CONFIRMED)
        self._past[(action.vehicle, action.command)] = _Past(action.name, self._clock.now(), unanswered)
        self._past.move_to_end((action.vehicle, action.command))
        while len(self._past) > MAX_REMEMBERED:
            self._past.popitem(last=False)


def _is_too_late(action: VehicleAction, now: float) -> bool:
    """A start of which no copy may leave any more."""
    return action.retry is RetryClass.START and now - action.asked_s > START_WITHIN_S - 1e-9


def _word(result: int) -> str:
    """What a MAV_RESULT says; "" for ACCEPTED."""
    return RESULT_WORDS.get(result, f"unknown result {result}")
