"""What consoles, workers and scripts may ask of the station, and the checks before it is done.

The principal comes from the bus key, never from the payload.
"""

import re

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.preflight.readiness import layer_problem
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass, Freshness, Phase, Reply, ReplyCode, RunPhase, VehicleResult
from tui_gcs.core.protocol.flight import Land, Nudge
from tui_gcs.core.protocol.preflight import AcknowledgeCheck, ReadChecks, SignOff
from tui_gcs.core.protocol.setup import ConfirmStep
from tui_gcs.core.records.event_log import DEBUG, NOTICE, WARNING
from tui_gcs.core.records.journal_reader import events_before
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.key_provisioning import KeyProvisioning
from tui_gcs.core.requests.planner_requests import PlannerRequests
from tui_gcs.core.requests.service_desk import VehicleTasks
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Round, Scenario
from tui_gcs.core.scenario.place_allocation import same_places

NOTING = (m.Acknowledge, m.Shelve, m.Unshelve, m.Note, AcknowledgeCheck, SignOff, ReadChecks)
"""Done for every console: nothing is commanded, nobody takes control."""
MOST_NOTE_CHARS = 300
NUDGES_TOLD_S = 5.0
OBSERVE = (m.Hello, m.GetScenario, m.GetEvents, m.GetTask, m.GetPlan, m.GetPlanners, m.GetPreviews, m.GetJournal)


class RequestRouter:
    """Answers requests, one at a time."""

    def __init__(self, context: RequestContext) -> None:
        """Serve `station`."""
        self._context, self._parts = context, context.parts
        self._provisioning = KeyProvisioning(context.parts)
        self._services = VehicleTasks(context)
        self.tasks = self._services.tasks
        self.planners = PlannerRequests(context)
        self.in_control = ""
        """The principal whose command came last."""

    def answer(self, principal: str, payload: bytes) -> Reply:
        """Do what is asked, or say why not."""
        try:
            request = s.decode_request(payload)
        except msgspec.MsgspecError as error:
            self._parts.conditions.dropped["request not understood"] += 1
            return Reply(ok=False, text=f"request not understood: {error}", code=ReplyCode.NOT_UNDERSTOOD)
        if isinstance(request, s.Look):
            return self._services.look(request)
        if isinstance(request, OBSERVE):
            return self._observe(request)
        if principal.startswith("planner-"):
            return Reply(ok=False, text="a planner worker may not command")
        if isinstance(request, s.Fetch):
            return self._services.begin(principal, request)
        if isinstance(request, m.Preview):  # changes nothing that flies: nobody takes control by looking
            return self.planners.preview(request)
        if isinstance(request, m.CancelPreview):
            return self.planners.cancel()
        if isinstance(request, NOTING):  # neither does who says that he has seen
            return self._note(principal, request)
        self.in_control = principal
        if isinstance(request, m.ProvisionKey):  # tells what it does by itself: its reply holds a code
            return self._provisioning.ask(principal, request)
        if isinstance(request, s.CancelTask):
            reply: Reply = self._services.cancel(request)
        elif isinstance(request, ConfirmStep):
            reply = self._services.confirm(request)
        elif isinstance(request, s.Change):
            reply = self._services.begin(principal, request)
        else:
            reply = self._command(request)
        self._tell(principal, request, reply)
        return reply

    def _tell(self, principal: str, request: m.Request, reply: Reply) -> None:
        """Journal what was asked; keys held down are told once in a while."""
        every_s = NUDGES_TOLD_S if isinstance(request, Nudge) else 0.0
        refused = "; ".join(f"vehicle {r.vehicle}: {r.text}" for r in reply.results if not r.ok)
        text = (reply.text or "done") + (f" ({refused})" if refused else "")
        if not reply.ok:
            partly = " in part" if any(r.ok for r in reply.results) else ""
            text = f"{act_words(request)} refused{partly}: {text}"
        severity = NOTICE if reply.ok else WARNING
        self._parts.records.events.report(EventClass.OPERATOR, principal, text, severity, every_s=every_s)

    def _observe(self, request: m.AnyRequest) -> Reply:
        parts = self._parts
        if isinstance(request, m.Hello):
            same = request.protocol == m.PROTOCOL
            text = f"protocol {m.PROTOCOL}" if same else f"station speaks protocol {m.PROTOCOL}, you {request.protocol}"
            code = ReplyCode.NONE if same else ReplyCode.OTHER_PROTOCOL
            return Reply(ok=same, text=text, status=self._context.publisher.status() if same else None, code=code)
        if isinstance(request, m.GetScenario):
            return Reply(ok=True, scenario=parts.active.changed())
        if isinstance(request, m.GetEvents):
            return Reply(ok=True, events=parts.records.events.since(request.after))
        if isinstance(request, m.GetJournal):
            events, at = events_before(parts.records.journal.path, request.before)
            return Reply(ok=True, events=events, journal_at=at)
        if isinstance(request, m.GetTask):
            desk = parts.active.team_controllers.get(request.team)
            if desk is None:
                return Reply(ok=False, text=f"no team {request.team}")
            if desk.planner.quarantined:
                return Reply(ok=True, text="its planner is left alone until the operator changes something")
            return Reply(ok=True, task=desk.task, snapshot=desk.kept)
        if isinstance(request, m.GetPreviews):
            return self.planners.look()
        if isinstance(request, m.GetPlanners):
            return Reply(ok=True, planners=tuple(parts.config.planners[k] for k in sorted(parts.config.planners)))
        return Reply(
            ok=True, annotations={name: desk.annotations for name, desk in parts.active.team_controllers.items()}
        )

    def _note(self, principal: str, request: m.AnyRequest) -> Reply:
        alarms = self._parts.alarms
        if isinstance(request, m.Acknowledge):
            return alarms.acknowledge(principal, request)
        if isinstance(request, m.Shelve):
            return alarms.shelve(principal, request)
        if isinstance(request, m.Unshelve):
            return alarms.unshelve(principal, request)
        if isinstance(request, AcknowledgeCheck):
            return self._context.checklist.acknowledge(principal, request)
        if isinstance(request, SignOff):
            return self._context.checklist.sign(principal, request)
        if isinstance(request, ReadChecks):
            return self._context.checklist.read(anew=request.anew)
        if isinstance(request, m.Note):
            severity = min(max(request.severity, WARNING), DEBUG)
            text = clean(request.text, MOST_NOTE_CHARS)
            self._parts.records.events.report(EventClass.CONSOLE, principal, text, severity)
        return Reply(ok=True)

    def _command(self, request: m.AnyRequest | Land) -> Reply:
        executive = self._parts.flight.executive
        if isinstance(request, m.Start):
            return self._start(request)
        if isinstance(request, m.Hold):
            return _done("hold", request, executive.hold(request.vehicles, request.but))
        if isinstance(request, m.Resume):
            self._parts.active.renew_quarantined()
            return executive.resume(request.vehicles)
        if isinstance(request, m.Return):
            return _done("return", request, executive.go_home(request.vehicles, request.but))
        if isinstance(request, Land):
            return _done("land", request, executive.land(request.vehicles, request.but))
        if isinstance(request, m.SwitchRound):
            return self._switch_round(request.index)
        if isinstance(request, m.ApplyScenario):
            return self._apply(request)
        if isinstance(request, m.SetParameters):
            return self.planners.set_parameters(request)
        if isinstance(request, m.Shutdown):
            return self._shutdown(request)
        return Reply(ok=False, text="not a command")

    # ---------------------------------------------------------------- start

    def _start(self, request: m.Start) -> Reply:
        parts = self._parts
        if parts.flight.executive.run is RunPhase.RETURNING:
            return Reply(ok=False, text="the fleet is returning: wait until all have landed")
        if not request.vehicles or len(set(request.vehicles)) != len(request.vehicles):
            return Reply(ok=False, text="name each vehicle once")
        results = self._context.readiness.of_start(request.vehicles)
        bad = [r.vehicle for r in results if not r.ok]
        if bad:
            text = f"not started: vehicle {', '.join(map(str, bad))} not ready"
            return Reply(ok=False, text=text, results=results)
        if refused := self._context.checklist.refusal(request):
            return refused
        self._context.checklist.begun(self.in_control, request)
        parts.flight.executive.start(request.vehicles)
        ids = ", ".join(map(str, request.vehicles))
        return Reply(
            ok=True, text=f"{parts.active.round.name} started: {len(results)} vehicles ({ids})", results=results
        )

    # ---------------------------------------------------------------- rounds and scenario

    def _switch_round(self, index: int) -> Reply:
        parts = self._parts
        rounds = parts.active.scenario.rounds
        if not 0 <= index < len(rounds):
            return Reply(ok=False, text=f"there is no round {index + 1}; there are {len(rounds)}")
        if parts.flight.executive.run in (RunPhase.RETURNING, RunPhase.STARTING):
            return Reply(ok=False, text=f"not while the fleet is {parts.flight.executive.run}")
        outside = self._outside(parts.active.scenario, rounds[index])
        if outside:
            text = f"{rounds[index].name} not started: outside its operating area"
            return Reply(ok=False, text=text, results=outside)
        parts.active.set_round(index)
        return Reply(ok=True, text=f"{rounds[index].name} is the present round")

    def _outside(self, scenario: Scenario, round_: Round) -> tuple[VehicleResult, ...]:
        """Vehicles of teams that are outside the round's area, or in the air outside its band."""
        parts = self._parts
        guard = Guard(scenario.limits, round_.area, round_.no_fly)
        teams = {flight.vehicle: flight.team for flight in parts.flight.flights} | parts.flight.flights.teams_in_flight(
            scenario
        )
        results = []
        for flight in parts.flight.flights:
            vehicle = parts.picture.fleet.vehicles.get(flight.vehicle)
            if vehicle is None or not vehicle.telemetry.has_position():
                continue
            away = guard.outside_m(vehicle.telemetry.position_m)
            home_away = guard.outside_m(flight.home_m) if flight.home_m and flight.phase is not Phase.GROUND else 0.0
            if home_away > 0:
                text = "the place where it must land is outside, or in a no-fly zone"
                results.append(VehicleResult(vehicle=vehicle.id, ok=False, text=text))
            elif away > 0:
                results.append(VehicleResult(vehicle=vehicle.id, ok=False, text=f"{away:.0f} m outside"))
            elif flight.phase is not Phase.GROUND and (
                problem := layer_problem(scenario, round_, flight, teams[flight.vehicle])
            ):
                results.append(VehicleResult(vehicle=vehicle.id, ok=False, text=problem))
        return tuple(results)

    def _apply(self, request: m.ApplyScenario) -> Reply:
        parts = self._parts
        if request.base_revision != parts.active.revision:
            return Reply(ok=False, text="the scenario has changed since you began to edit: look at it and apply again")
        try:
            scenario = parse(request.toml, where="edited scenario")
        except ScenarioError as error:
            return Reply(ok=False, text=str(error))
        if parts.flight.flights.any_in_the_air():
            problem = self._why_not_in_flight(scenario)
            if problem:
                return Reply(ok=False, text=problem)
        index = min(parts.active.round_index, len(scenario.rounds) - 1)
        outside = self._outside(scenario, scenario.rounds[index])
        if outside:
            return Reply(ok=False, text="not applied: vehicles outside the new operating area", results=outside)
        before = {flight.vehicle: flight.team for flight in parts.flight.flights}
        changed = _planners_changed(parts.active.scenario, scenario)
        parts.active.set_scenario(scenario, request.toml)
        moved = [
            f"vehicle {f.vehicle} to {f.team}"
            for f in parts.flight.flights
            if before.get(f.vehicle) not in (None, f.team)
        ]
        text = "; ".join(["scenario applied", *changed, *moved])
        return Reply(ok=True, text=text, scenario=parts.active.changed())

    def _why_not_in_flight(self, scenario: Scenario) -> str:
        """In flight, zones, parameters and teams may change; where who takes off and how high he flies may not."""
        now = self._parts.active.scenario
        if scenario.origin != now.origin:
            return "not applied: the origin cannot change in flight"
        if scenario.limits != now.limits:
            return "not applied: limits cannot change in flight"
        if not same_places(scenario.places, now.places):
            return "not applied: take-off places and layers cannot change in flight"
        why = self._parts.flight.flights.why_not_reassigned(now, scenario)
        return f"not applied: {why}" if why else ""

    def _shutdown(self, request: m.Shutdown) -> Reply:
        now = self._parts.records.clock.now()
        armed = [v for v in self._parts.picture.fleet.in_order() if v.telemetry.armed]
        lost = [v.id for v in armed if v.freshness(now) is Freshness.LOST]
        flying = [v.id for v in armed if v.id not in lost]
        if flying:
            return Reply(ok=False, text=f"not while vehicles are armed: {', '.join(map(str, flying))}")
        if set(lost) != set(request.lost):
            ids = " ".join(map(str, lost))
            text = f"armed when last heard, and LOST: {ids}; if you know what became of them: tui-gcs stop --lost {ids}"
            return Reply(ok=False, text=text if lost else "nothing armed is lost: stop without --lost")
        self._parts.conditions.ending = True
        return Reply(ok=True, text="station ends")


def _done(what: str, asked: m.Hold | m.Return | Land, results: tuple[VehicleResult, ...]) -> Reply:
    """A reply for a stop-class request: ok if everybody concerned got it. Nobody that was named is left out."""
    answered = {result.vehicle for result in results}
    left_out = [v for v in asked.vehicles if v not in answered and v not in asked.but]
    results += tuple(VehicleResult(vehicle=v, ok=False, text="is not known or not in the air") for v in left_out)
    if not results:
        return Reply(ok=False, text="nobody is in the air")
    good = [r.vehicle for r in results if r.ok]
    whole = len(good) == len(results)
    share = "" if whole else f"{len(good)} of {len(results)}" + (": " if good else "")
    who = vehicles_words(good) if good else ""
    return Reply(ok=whole, text=f"{what}: {share}{who}", results=results)


def _planners_changed(before: Scenario, after: Scenario) -> list[str]:
    """In words, for the journal: which team gets another planner, and which parameters are others now."""
    teams = {team.name: team for team in before.teams}
    words = []
    for team in after.teams:
        old = teams.get(team.name)
        if old is None:
            continue
        if old.planner != team.planner:
            words.append(f"team {team.name}: planner {old.planner} -> {team.planner}")
            continue
        for name in sorted(old.parameters.keys() | team.parameters.keys()):
            was, now = (t.parameters.get(name, "its default") for t in (old, team))
            if was != now:
                words.append(f"team {team.name}: {name} {was} -> {now}")
    return words


def act_words(request: m.Request) -> str:
    """What kind of request it is, in words: `limit speed`."""
    return re.sub(r"(?<!^)(?=[A-Z])", " ", type(request).__name__).lower()
