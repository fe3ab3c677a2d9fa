"""Flies a whole mission without a person: start, each round, hold, return, land, result.

It talks to the station over the bus as a console does, so it flies a rehearsal and a live fleet alike.
"""

import math
from enum import StrEnum

from tui_gcs.core.geometry.zones import bounds
from tui_gcs.core.judging.referee import Referee
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import Alarm, vehicles_words
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import (
    FleetFrame,
    Freshness,
    Phase,
    Reply,
    RunPhase,
    StationStatus,
    decode,
    encode,
)
from tui_gcs.core.protocol.preflight import Check, CheckState, names_of
from tui_gcs.core.scenario.model import Round, Scenario

READY_LIMIT_S = 90.0
"""Vehicles that are not heard, ready and started after this long end the flight before it begins."""
TRY_AGAIN_S = 2.0
UNREAD_LIMIT_S = 20.0
"""Checks that are not read yet are waited for this long, before they are overridden too."""
TAKE_OFF_LIMIT_S = 150.0
HOLD_S = 3.0
RESUME_GAP_S = 10.0
"""Seconds before the first, and between, attempts to resume vehicles that the station holds."""
NOBODY_S = 20.0
"""For this long no vehicle may be flying: a restarted station steers no vehicle before it is asked to."""
RETURN_AGAIN_S = 5.0
"""Vehicles that do not come down are asked to return again after this long."""
MANOEUVRES_LIMIT_S = 300.0
"""Longest time for the end of a flight beside the way home: holding, climbing, waiting for others, coming down."""
COMING_DOWN = (Phase.RETURNING, Phase.LANDING)


def return_limit_s(scenario: Scenario) -> float:
    """Return how long vehicles may take from the order to return until all have landed.

    After that the flight has failed; vehicles that are heard are waited for all the same.
    """
    # Fifteen vehicles over a zone of 1.9 km were on their way home for 210 s at 9 m/s, before they came down.
    corners = [bounds(round_.area.shape) for round_ in scenario.rounds]
    across_m = max(math.hypot(east - west, north - south) for west, south, east, north in corners)
    return MANOEUVRES_LIMIT_S + across_m / scenario.limits.speed_m_s


class Step(StrEnum):
    """The stage of the flight."""

    WAIT = "waiting for vehicles"
    TAKE_OFF = "take-off"
    ROUND = "round"
    HOLD = "hold"
    RETURN = "return"
    DONE = "done"


class Script:
    """Flies one mission; `tick` is called after every change of time."""

    def __init__(
        self,
        scenario: Scenario,
        bus: Bus,
        *,
        principal: str,
        whole_duration: bool,
        operator: str = "",
        overrides: tuple[str, ...] = (),
        insists: bool = False,
    ) -> None:
        """`whole_duration`: each round lasts its `duration_s`; else until everything is measured.

        `operator` signs the checks before the start and overrides those named in `overrides`; `insists` overrides all
        that can be overridden.
        """
        self._operator, self._overrides, self._insists = operator, overrides, insists
        self.overridden: tuple[Check, ...] = ()
        """The checks that refused the start and were overridden because of `insists`."""
        self.step = Step.WAIT
        self.problem = ""
        """Why the flight ended early; empty if it did not."""
        self.referee = Referee(scenario)
        self.round_index = 0
        self._scenario = scenario
        self._bus = bus
        self._key = keys.REQUEST.format(principal=principal)
        self._principal = principal
        self._whole_duration = whole_duration
        self._frame: FleetFrame | None = None
        self._status: StationStatus | None = None
        self._since_s = math.nan
        self._try_s = -math.inf
        self._refusal, self._unread_s = "", math.nan
        self._unanswered: tuple[int, ...] = ()
        """The vehicles of a start without an answer: whether it was carried out is not known."""
        self._flown_s = -math.inf
        self._held_s = math.nan
        bus.subscribe(keys.FLEET, lambda _, data: self.on_frame(decode(data, FleetFrame)))
        bus.subscribe(keys.STATUS, lambda _, data: self.on_status(decode(data, StationStatus)))
        bus.subscribe(keys.EVENT, lambda _, data: self.referee.on_event(decode(data, m.JournalEvent)))

    @property
    def done(self) -> bool:
        """Whether the flight is over."""
        return self.step is Step.DONE

    @property
    def held_by(self) -> str:
        """The other principal that holds the fleet, or "": nothing goes on before it resumes."""
        status = self._status
        if status is None or status.run is not RunPhase.HOLD or status.in_control in ("", self._principal):
            return ""
        return status.in_control

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """What the station alarms now."""
        return self._status.alarms if self._status is not None else ()

    @property
    def progress(self) -> float:
        """The share of the flight that is done, 0 to 1: each round, the way up and the way home are a step."""
        steps = len(self._scenario.rounds) + 2
        done: dict[Step, float] = {Step.WAIT: 0, Step.TAKE_OFF: 0, Step.DONE: steps}
        if self.step is Step.ROUND:
            flown_s = 0.0 if self._frame is None else self._frame.t_s - self._since_s
            done[Step.ROUND] = 1 + self.round_index + min(0.99, flown_s / self._round.duration_s)
        return min(1.0, done.get(self.step, steps - 1) / steps)

    @property
    def _round(self) -> Round:
        return self._scenario.rounds[self.round_index]

    @property
    def headline(self) -> str:
        """The stage of the flight in words, for a progress bar."""
        if self._status is None:
            return "waiting for the station"
        what = self._round.name if self.step is Step.ROUND else str(self.step)
        if self.step is Step.WAIT and self._refusal:
            return f"{what}: {self._refusal}"
        # An operator at a console has taken over: the script must not order anything against that.
        if self.held_by:
            what = f"HELD by {self.held_by}"
        elif self.step is Step.RETURN and self._frame is not None:
            heard, silent = self._not_landed(self._frame)
            what += f": waiting for {vehicles_words(heard)}" if heard else ""
            what += f", NOT HEARD: {vehicles_words(silent)}" if silent else ""
        return f"{what}  T+{self._status.mission_time_s:.0f} s  armed {self._status.armed}"

    def on_frame(self, frame: FleetFrame) -> None:
        """Take a fleet frame, for the script and its referee."""
        self._frame = frame
        self.referee.on_frame(frame)

    def on_status(self, status: StationStatus) -> None:
        """Take a station status, for the script and its referee."""
        self._status = status
        self.referee.on_status(status)

    def abort(self, why: str) -> None:
        """End the rounds: return and land now."""
        if self.step in (Step.TAKE_OFF, Step.ROUND, Step.HOLD):
            self.problem = self.problem or why
            self._begin_return()
        elif self.step is Step.WAIT and self._unanswered:
            self.problem = self.problem or why
            self.referee.started = self._unanswered
            self._begin_return()
        elif self.step is Step.WAIT:
            self._end(why)

    def tick(self) -> None:
        """Do what is due at this stage."""
        if self._frame is None or self._status is None or self.done:
            return
        now = self._frame.t_s
        if math.isnan(self._since_s):
            self._since_s = now
        if self.held_by:
            # The first frames after the hold do not show yet what the operator ordered instead, e.g. a landing.
            self._try_s = now
            return
        {
            Step.WAIT: self._wait,
            Step.TAKE_OFF: self._take_off,
            Step.ROUND: self._fly_round,
            Step.HOLD: self._hold,
            Step.RETURN: self._return,
        }[self.step](now, self._frame, self._status)

    def _enter(self, step: Step) -> None:
        self.step, self._since_s, self._try_s = step, math.nan, -math.inf

    def _end(self, problem: str) -> None:
        self.problem = self.problem or problem
        self._enter(Step.DONE)

    def _ask(self, request: m.AnyRequest) -> Reply:
        try:
            return decode(self._bus.ask(self._key, encode(request)), Reply)
        except BusError as error:
            return Reply(ok=False, text=str(error))

    def _start(self, vehicles: tuple[int, ...]) -> Reply:
        request = m.Start(vehicles=vehicles, overrides=self._overrides, operator=self._operator)
        try:
            return decode(self._bus.ask(self._key, encode(request)), Reply)
        except BusError as error:
            # The station may have died, or been busy, after it had carried the order out.
            self._unanswered = vehicles
            return Reply(ok=False, text=str(error))

    def _started(self, vehicles: tuple[int, ...]) -> None:
        self.referee.started = vehicles
        self._enter(Step.TAKE_OFF)

    def _wait(self, now: float, frame: FleetFrame, status: StationStatus) -> None:
        if self._unanswered and status.run is not RunPhase.IDLE:
            self._started(self._unanswered)
            return
        members = {v for team in status.teams for v in team.members}
        rows = [row for row in frame.rows() if row.id in members]
        ready = [r.id for r in rows if r.freshness is Freshness.OK and r.gps_fix >= 3]
        missing = sorted(members - set(ready))
        expected = self._scenario.vehicle_count
        # Asking costs the station the whole list of checks, so not in every tick.
        if len(ready) == expected and now - self._try_s >= TRY_AGAIN_S:
            self._try_s = now
            reply = self._start(tuple(sorted(ready)))
            if reply.ok:
                self._started(tuple(sorted(ready)))
                return
            self._refused(now, reply)
        if not self.done and now - self._since_s > READY_LIMIT_S:
            names = ", ".join(map(str, missing)) or "all heard"
            text = f"{len(ready)} of {expected} vehicles (missing: {names}) {self._refusal}"
            self.abort(f"not ready after {READY_LIMIT_S:.0f} s: {text}".strip())

    def _refused(self, now: float, reply: Reply) -> None:
        """Wait for what may heal or is being read; override the rest if `insists` is set, else give up."""
        self._refusal = refusal_words(reply)
        unread = any(check.state is CheckState.UNKNOWN for check in reply.refused_by)
        if unread and math.isnan(self._unread_s):
            self._unread_s = now
        # Refusals without a check (not heard, no fix yet) may heal by waiting.
        if not reply.refused_by or (unread and not (self._insists and now - self._unread_s >= UNREAD_LIMIT_S)):
            return
        if not self._insists:
            names = " ".join(f"--override {name}" for name in names_of(reply.refused_by))
            self._end(f"{self._refusal}; put it right, or: {names}")  # none of that heals by waiting
            return
        self.overridden += reply.refused_by
        self._overrides = tuple(dict.fromkeys((*self._overrides, *names_of(reply.refused_by))))
        self._try_s = -math.inf

    def _take_off(self, now: float, frame: FleetFrame, status: StationStatus) -> None:
        if status.run is RunPhase.RUNNING:
            self._begin_round(now)
        # The first status after the start may still show the phase before it.
        elif status.run in (RunPhase.IDLE, RunPhase.HOLD) and now - self._since_s > 2.0:
            self.abort(f"take-off ended in {status.run}")
        elif now - self._since_s > TAKE_OFF_LIMIT_S:
            self.abort(f"take-off not finished after {TAKE_OFF_LIMIT_S:.0f} s")

    def _begin_round(self, now: float) -> None:
        self._enter(Step.ROUND)
        # The station's own table: what is flown is judged by what it declared, here and in every other command.
        known = {info.name: info for info in self._ask(m.GetPlanners()).planners}
        self.referee.planners = {**self.referee.planners, **known}
        self._since_s = self._flown_s = now
        self.referee.begin_round(self._round, now)

    def _fly_round(self, now: float, frame: FleetFrame, status: StationStatus) -> None:
        if Phase.FLYING in frame.phase or Phase.HOLDING in frame.phase:
            self._flown_s = now
        # A restarted station shows no vehicle flying at first.
        elif now - self._flown_s > NOBODY_S:
            self.abort("no vehicle is flying any more")
            return
        self._resume_held(now, frame, status)
        flown = now - self._since_s
        measured = all(measure.done for measure in self.referee.present())
        over = flown >= self._round.duration_s if self._whole_duration else measured
        if not over:
            return
        if self.round_index + 1 == len(self._scenario.rounds):
            self._enter(Step.HOLD)
            self._ask(m.Hold())
            return
        reply = self._ask(m.SwitchRound(index=self.round_index + 1))
        if not reply.ok:
            self.abort(refusal_words(reply))
            return
        self.round_index += 1
        self._begin_round(now)

    def _resume_held(self, now: float, frame: FleetFrame, status: StationStatus) -> None:
        """Resume vehicles that only the station holds, because their planner was late or dead, when it is back."""
        if not any(team and phase is Phase.HOLDING for team, phase in zip(frame.team, frame.phase, strict=True)):
            self._held_s = math.nan
            return
        if math.isnan(self._held_s):
            self._held_s = now
        # A hold that an operator gave is the operator's to end.
        nobodys = status.in_control in ("", self._principal)
        workers = all(team.worker in ("ready", "running") for team in status.teams)
        flying_on = status.run is RunPhase.RUNNING  # not after a restart: then a person must say so
        waited = now - max(self._held_s, self._try_s) >= RESUME_GAP_S  # by then the status tells who held them
        if nobodys and workers and flying_on and waited:
            self._try_s = now
            self._ask(m.Resume())

    def _hold(self, now: float, frame: FleetFrame, status: StationStatus) -> None:
        if now - self._since_s >= HOLD_S:
            self._begin_return()

    def _begin_return(self) -> None:
        self._enter(Step.RETURN)
        self._ask(m.Return())
        if self._frame is not None:
            self._try_s = self._frame.t_s

    def _return(self, now: float, frame: FleetFrame, status: StationStatus) -> None:
        heard, silent = self._not_landed(frame)
        if not heard and not silent and (self.referee.lost or status.run is RunPhase.IDLE):
            self._end("")
            return
        limit_s = return_limit_s(self._scenario)
        if now - self._since_s > limit_s:
            self.problem = self.problem or f"not all landed after {limit_s:.0f} s"
            if not heard:
                self._end("")
                return
        phases = {row.id: row.phase for row in frame.rows()}
        if any(phases[vehicle] not in COMING_DOWN for vehicle in heard) and now - self._try_s >= RETURN_AGAIN_S:
            self._try_s = now
            self._ask(m.Return())

    def _not_landed(self, frame: FleetFrame) -> tuple[list[int], list[int]]:
        """The vehicles of this flight that are armed: those that are heard, and those that are LOST."""
        ours = set(self.referee.started) - set(self.referee.lost)  # those lost on purpose are not waited for
        armed = [row for row in frame.rows() if row.armed and row.id in ours]
        silent = [row.id for row in armed if row.freshness is Freshness.LOST]
        return [row.id for row in armed if row.id not in silent], silent

    @property
    def armed(self) -> tuple[int, ...]:
        """The vehicles of this flight that were armed when last heard."""
        if self._frame is None:
            return ()
        heard, silent = self._not_landed(self._frame)
        return tuple(sorted(heard + silent))


def refusal_words(reply: Reply) -> str:
    """The refusal with its reasons: each reason once, with all vehicles that it holds for."""
    vehicles: dict[str, list[int]] = {}
    for result in reply.results:
        if not result.ok:
            vehicles.setdefault(result.text, []).append(result.vehicle)
    reasons = "; ".join(f"{vehicles_words(ids)}: {text}" for text, ids in vehicles.items())
    return f"{reply.text} ({reasons})" if reasons else reply.text
