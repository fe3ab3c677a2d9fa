"""Runs actions on vehicles: sent, repeated by retry class, acknowledged, confirmed by telemetry.

The three retry classes (docs/threats.md C.4):

* start: at most 3 copies within 2 s, then expired; never repeated later.
* stop: every 400 ms for 10 s until telemetry confirms, then an alarm and every 2 s until confirmed or superseded;
  it cancels what is queued for that vehicle.
* set: 5 tries, 0.6 s apart, or as long as an answer takes if that is longer; idempotent; dropped when superseded.

Success is what telemetry shows; an ACK only ends the copies (`ack_matching` finds the action that it answers). After a
refusal the vehicle's own status texts are collected for 0.5 s.
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
OTHER_MESSAGE = {LONG_ONLY: False, INT_ONLY: True}
"""Results that ask for the other message, and whether that is COMMAND_INT."""
REASON_WAIT_S = 0.5
"""Autopilots queue STATUSTEXT: reasons come up to this long after a refusing ACK (docs/autopilots.md)."""
START_WITHIN_S = 2.0
"""No copy of a start leaves later than this after it was asked for."""
PROGRESS_LIMIT_S = 60.0
"""An action that is in progress for longer ends as not confirmed (docs/threats.md B.6-43)."""
LATE_ACK_S = 60.0
"""How long an action that was given up is remembered, so that its late ACK is reported as late."""
AMBIGUOUS_S = 15.0
"""This long after an unanswered action an ACK may belong to either of two equal commands (docs/threats.md B.6-45)."""
MIN_ACKS_IN_DOUBT = 2
"""ACKs that such an action needs: the late ACK of the one before it alone proves nothing."""
MAX_ENDED = 1000
MAX_UNANSWERED = 100
LOOK_FROM_COPY = 2
"""From this copy on the telemetry that confirms it is requested: a heartbeat that comes once a second may be lost as
well."""
MAX_ACKS = 2
"""ACKs of one action by an honest vehicle (PX4 sends two): its telemetry is requested at once after each."""
LOOK_GAP_S = 0.5
"""Once it is accepted its telemetry is requested at once, then this often: the next heartbeat is up to 1 s away."""
REQUEST_MESSAGE = 512
"""MAV_CMD_REQUEST_MESSAGE."""
QUESTION_MEMORY_S = 5.0
"""How long the ACK of a question may take."""

CONFIRMED_WORDS = {"land": "begun"}
"""Words for a confirmed action where "confirmed" would read as if it were over."""


@dataclass
class _EndedAction:
    """What is remembered of an action that is over."""

    name: str
    ended_s: float
    unanswered: bool


class CommandService:
    """Runs all pending actions; at most one per vehicle and name."""

    def __init__(self, clock: Clock, events: EventLog) -> None:
        self._clock = clock
        self._events = events
        self._pending: dict[int, dict[str, VehicleAction]] = {}
        """By vehicle and name, in order of submission."""
        self._ended: OrderedDict[tuple[int, int], _EndedAction] = OrderedDict()
        """By vehicle and command: the newest action that is over."""
        self._questions_s: dict[tuple[int, int], float] = {}
        self.unanswered_count = 0
        """Actions that expired without any answer, since the start."""
        self.unanswered: list[str] = []
        """The newest of them, in words."""
        self.ignored: Counter[str] = Counter()
        """ACKs that belonged to no action, by reason."""
        self.ack_matcher = AckMatcher()

    def submit(self, action: VehicleAction) -> None:
        """Begin `action` at once; a stop cancels everything else that is queued for that vehicle."""
        if action.retry is RetryClass.STOP:
            self.cancel(action.vehicle)
        else:
            self._end(self._pending.get(action.vehicle, {}).get(action.name), Outcome.SUPERSEDED, "")
        now = self._clock.now()
        action.asked_s = action.next_s = now
        if action.command is not None and not action.housekeeping:
            past = self._ended.get((action.vehicle, action.command))
            action.doubtful = past is not None and past.unanswered and now - past.ended_s < AMBIGUOUS_S
        # Dicts keep their order: actions of a vehicle run in order of submission.
        self._pending.setdefault(action.vehicle, {})[action.name] = action
        if action.retry is RetryClass.STOP:
            # It waits for nothing, because what it could wait for was cancelled.
            self._send_copy(action, now)
            action.next_s = now + action.retry.gap_s
        else:
            self._run(action, None)

    def cancel(
        self, vehicle: int, name: str | None = None, *, keep_stops: bool = False, housekeeping: bool = False
    ) -> None:
        """Drop the pending actions of `vehicle`: all, or the one called `name`.

        `housekeeping`: drop requests for information, too.
        """
        for action in list(self._pending.get(vehicle, {}).values()):
            kept = keep_stops and action.retry is RetryClass.STOP
            if not kept and (action.name == name if name else housekeeping or not action.housekeeping):
                self._end(action, Outcome.SUPERSEDED, "")

    def stopping(self, vehicle: int) -> bool:
        """Whether a hold, landing or disarming of `vehicle` is not confirmed yet."""
        return self.stop_under_way(vehicle) is not None

    def stop_under_way(self, vehicle: int) -> VehicleAction | None:
        """The stop of `vehicle` that is not confirmed yet; of several, the newest."""
        pending = self._pending.get(vehicle)
        if not pending:  # nearly always, and it is asked of every vehicle at every tick
            return None
        return next((action for action in reversed(pending.values()) if action.retry is RetryClass.STOP), None)

    def pending(self, vehicle: int, name: str) -> bool:
        """Whether such an action is under way."""
        return name in self._pending.get(vehicle, {})

    @property
    def waiting(self) -> bool:
        """Whether an answer to an order is expected: the station then reads its links without delay."""
        return any(action.sent and not action.housekeeping for action in self._all())

    def tick(self, vehicles: dict[int, Vehicle]) -> None:
        """Send what is due, and end what is confirmed, refused or out of time."""
        for action in list(self._all()):
            self._run(action, vehicles.get(action.vehicle))

    def _all(self) -> Iterator[VehicleAction]:
        return (action for actions in self._pending.values() for action in actions.values())

    def question(self, vehicle: int, command: int) -> None:
        """Note a question for which no action waits: its ACK is not counted as unexpected."""
        self._questions_s[(vehicle, command)] = self._clock.now()

    def on_ack(self, vehicle: Vehicle, command: int, result: int) -> None:
        """Handle a COMMAND_ACK of `vehicle`."""
        action, now = self._waiting_for(vehicle.id, command), self._clock.now()
        is_older = self.ack_matcher.is_older(vehicle.id, command, action, now, last=result != IN_PROGRESS)
        if action is None or (is_older and not action.in_progress):
            self._unmatched_ack(vehicle.id, command, result)
            return
        action.acks += 1
        if action.acks > action.sent * (2 if action.double_ack else 1):
            self.ignored["repeated ack"] += 1
        # The first ACK may belong to the equal command that was given up.
        if action.doubtful and action.acks < MIN_ACKS_IN_DOUBT:
            return
        if self._change_message(action, result):
            action.next_s = now
        elif result in (ACCEPTED, IN_PROGRESS):
            # PX4 acknowledges DO_SET_MODE twice, and the first ACK is always ACCEPTED: it must not take back a
            # refusal.
            if not (action.double_ack and action.refused_s is not None):
                action.acked_s, action.result, action.refused_s = now, result, None
                if action.acks <= MAX_ACKS:
                    action.look_s = now
                action.in_progress = result == IN_PROGRESS
        elif action.refused_s is None and (action.acked_s is None or action.double_ack or action.in_progress):
            action.refused_s, action.result, action.in_progress = now, result, False

    def _change_message(self, action: VehicleAction, result: int) -> bool:
        """Whether the vehicle wants the same command by the other message; the next copy then goes by that one."""
        if (
            action.order is None
            or action.was_carried_otherwise
            or OTHER_MESSAGE.get(result) is not (not action.order.as_int)
        ):
            return False
        action.order, action.was_carried_otherwise = action.order.by_other_message(), True
        return True

    def _unmatched_ack(self, vehicle: int, command: int, result: int) -> None:
        now = self._clock.now()
        key = (vehicle, command)
        past = self._ended.get(key)
        if now - self._questions_s.get(key, -QUESTION_MEMORY_S) < QUESTION_MEMORY_S:
            return
        if past is None or now - past.ended_s > LATE_ACK_S:
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

    def _run(self, action: VehicleAction, vehicle: Vehicle | None) -> None:
        now = self._clock.now()
        if action.refusal:
            self._end(action, Outcome.REFUSED, action.refusal)
        elif vehicle is not None and self._is_confirmed(action, vehicle):
            self._end(action, Outcome.CONFIRMED, "")
        else:
            self._look_if_accepted(action, now)
            self._go_on(action, vehicle, now)

    def _look_if_accepted(self, action: VehicleAction, now: float) -> None:
        if action.acked_s is not None and now >= action.look_s and action.look is not None:
            action.look_s = now + LOOK_GAP_S
            self._look(action)

    def _go_on(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        """Repeat the action, wait, or give it up: it was neither refused by this station nor confirmed."""
        if action.retry is RetryClass.STOP or action.doubtful:
            self._show_refused_stop(action, vehicle, now)
            self._send_or_expire(action, vehicle, now)
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
            self._send_or_expire(action, vehicle, now)

    def _is_confirmed(self, action: VehicleAction, vehicle: Vehicle) -> bool:
        """Whether telemetry shows it done."""
        # A stop is not confirmed by telemetry that is older than the order.
        if not action.sent or (action.retry is RetryClass.STOP and vehicle.telemetry.heartbeat_s <= action.first_s):
            return False
        return action.confirmed(vehicle)

    def _waits_its_turn(self, action: VehicleAction, now: float) -> bool:
        """Whether an equal command of the same vehicle is under way; a start waits no longer than it may be sent."""
        if action.command is None or action.sent:
            return False
        if _is_start_too_late(action, now):
            return False
        # An ACK names only the command: so one of a kind is under way per vehicle, in order of submission.
        for other in self._pending[action.vehicle].values():
            if other is action:
                return False
            if other.command == action.command:
                return True
        return False

    def _send_or_expire(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        """Send the next copy if it is due, or end the action if there is none left."""
        if now < action.next_s - 1e-9 or self._waits_its_turn(action, now):
            return
        last = action.retry.copies
        if _is_start_too_late(action, now):
            # A start that was held up is not sent late: the operator does not expect it any more.
            last = action.sent
        if action.sent < last:
            self._send_copy(action, now)
            if action.look is not None and action.sent > LOOK_FROM_COPY:
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
                # Only the newest are shown.
                del self.unanswered[:-MAX_UNANSWERED]
            self._end(action, Outcome.EXPIRED, "" if action.sent else "not sent in time")

    def _gap_s(self, action: VehicleAction) -> float:
        """Time between copies: on a slow link a setting is not repeated before its answer can have come."""
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
        if not action.sent:
            action.first_s = now
        action.send(action.sent)
        action.sent += 1
        self.ack_matcher.sent(action, now)

    def _look(self, action: VehicleAction) -> None:
        if action.look is not None:
            self.question(action.vehicle, REQUEST_MESSAGE)
            action.look()

    def _show_refused_stop(self, action: VehicleAction, vehicle: Vehicle | None, now: float) -> None:
        """Report once what a vehicle answers to a stop; the stop goes on whatever that is."""
        if action.retry is not RetryClass.STOP or action.refused_s is None or action.refusal_shown:
            return
        if now - action.refused_s >= REASON_WAIT_S:
            action.refusal_shown = True
            text = f"{action.name}: refused ({self._why(action, vehicle)}), still trying"
            self._events.report(EventClass.MISSION, f"vehicle {action.vehicle}", text, WARNING)

    def _why(self, action: VehicleAction, vehicle: Vehicle | None) -> str:
        word = _word(action.result or ACCEPTED)
        # Texts may come a moment before the ACK that they explain.
        since = min(t for t in (action.refused_s, action.acked_s, self._clock.now()) if t is not None) - 1.0
        reasons = vehicle.reasons_since(since) if vehicle is not None else []
        return ": ".join(part for part in (word, "; ".join(reasons)) if part)

    def unconfirmed_stops(self) -> list[tuple[int, str]]:
        """(vehicle, name) of the stops that no telemetry confirmed in time; they are still sent."""
        pending = [action for actions in self._pending.values() for action in actions.values()]
        return [(action.vehicle, action.name) for action in pending if action.alarmed]

    def _end(self, action: VehicleAction | None, outcome: Outcome, why: str) -> None:
        actions = self._pending.get(action.vehicle) if action is not None else None
        if action is None or actions is None or actions.get(action.name) is not action:
            return
        del actions[action.name]
        if not actions:
            del self._pending[action.vehicle]
        self._remember(action, outcome)
        if outcome is not Outcome.SUPERSEDED and not action.housekeeping:
            self._report(action, outcome, why)
        if action.on_done is not None:
            action.on_done(action, outcome, why)

    def _report(self, action: VehicleAction, outcome: Outcome, why: str) -> None:
        word = CONFIRMED_WORDS.get(action.name, outcome.value) if outcome is Outcome.CONFIRMED else outcome.value
        text = f"{action.name}: {word}" + (f" ({why})" if why else "")
        severity = INFO if outcome is Outcome.CONFIRMED else WARNING
        if outcome is Outcome.NOT_CONFIRMED and action.retry is RetryClass.START:
            # A start that was not confirmed may still happen, or have happened (docs/threats.md B.6-41).
            severity = ALERT  # it may happen yet, or have happened (B.6-41)
        if action.retry is not RetryClass.SET or severity != INFO:
            self._events.report(EventClass.MISSION, f"vehicle {action.vehicle}", text, severity)

    def _remember(self, action: VehicleAction, outcome: Outcome) -> None:
        if action.command is None or not action.sent:
            return
        unanswered = action.acks == 0 and outcome in (Outcome.EXPIRED, Outcome.NOT_CONFIRMED)
        self._ended[(action.vehicle, action.command)] = _EndedAction(action.name, self._clock.now(), unanswered)
        self._ended.move_to_end((action.vehicle, action.command))
        while len(self._ended) > MAX_ENDED:
            self._ended.popitem(last=False)


def _is_start_too_late(action: VehicleAction, now: float) -> bool:
    """Whether it is a start of which no copy may leave any more."""
    return action.retry is RetryClass.START and now - action.asked_s > START_WITHIN_S - 1e-9


def _word(result: int) -> str:
    """The operator's words for a MAV_RESULT; "" for ACCEPTED."""
    return RESULT_WORDS.get(result, f"unknown result {result}")
