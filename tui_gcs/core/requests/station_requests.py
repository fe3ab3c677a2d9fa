"""Requests about the station as a whole: what it publishes, starts and stops of the fleet, rounds, the scenario."""

from tui_gcs.core.base.text import clean
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.preflight.readiness import layer_problem
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass, Freshness, Phase, Reply, ReplyCode, RunPhase, VehicleResult
from tui_gcs.core.protocol.flight import Land
from tui_gcs.core.protocol.preflight import AcknowledgeCheck, ReadChecks, SignOff, TickItem
from tui_gcs.core.records.event_log import DEBUG, WARNING
from tui_gcs.core.records.journal_reader import events_before
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.requests.stop_sequence import StopSequence
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Round, Scenario
from tui_gcs.core.scenario.place_allocation import same_places

MAX_NOTE_CHARS = 300
"""Longer notes of a console are cut."""


class StationRequests:
    """Answers requests that concern no single vehicle's services."""

    def __init__(self, context: RequestContext) -> None:
        self._context, self._parts = context, context.parts

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        alarms, checklist = self._parts.alarms, self._context.checklist
        executive, look, assist, command = self._parts.flight.executive, Access.LOOK, Access.ASSIST, Access.COMMAND
        stop = StopSequence().handler
        return {
            m.Hello: RequestHandler(look, lambda _, r: self._hello(r)),
            m.GetScenario: RequestHandler(look, lambda *_: Reply(ok=True, scenario=self._parts.active.changed())),
            m.GetEvents: RequestHandler(
                look, lambda _, r: Reply(ok=True, events=self._parts.records.events.since(r.after))
            ),
            m.GetJournal: RequestHandler(look, lambda _, r: self._journal(r)),
            m.GetTask: RequestHandler(look, lambda _, r: self._task(r)),
            m.GetPlan: RequestHandler(look, lambda *_: self._annotations()),
            m.Acknowledge: RequestHandler(assist, alarms.acknowledge),
            m.Shelve: RequestHandler(assist, alarms.shelve),
            m.Unshelve: RequestHandler(assist, alarms.unshelve),
            m.Note: RequestHandler(assist, self._note),
            AcknowledgeCheck: RequestHandler(assist, checklist.acknowledge),
            SignOff: RequestHandler(assist, checklist.sign),
            TickItem: RequestHandler(assist, checklist.tick),
            ReadChecks: RequestHandler(assist, lambda _, r: checklist.read(anew=r.anew)),
            # Stops are answered per vehicle: one that cannot be held keeps no other from being held.
            m.Start: RequestHandler(command, self._start),
            m.Hold: RequestHandler(command, stop("hold", executive.hold)),
            m.Resume: RequestHandler(command, lambda _, r: self._resume(r)),
            m.Return: RequestHandler(command, stop("return", executive.go_home)),
            Land: RequestHandler(command, stop("land", executive.land)),
            m.SwitchRound: RequestHandler(command, lambda _, r: self._switch_round(r.index)),
            m.ApplyScenario: RequestHandler(command, lambda _, r: self._apply(r)),
            m.Shutdown: RequestHandler(command, lambda _, r: self._shutdown(r)),
        }

    def _hello(self, request: m.Hello) -> Reply:
        if request.protocol != m.PROTOCOL:
            text = f"station speaks protocol {m.PROTOCOL}, you {request.protocol}"
            return Reply(ok=False, text=text, code=ReplyCode.OTHER_PROTOCOL)
        return Reply(ok=True, text=f"protocol {m.PROTOCOL}", status=self._context.publisher.status())

    def _journal(self, request: m.GetJournal) -> Reply:
        events, at = events_before(self._parts.records.journal.path, request.before)
        return Reply(ok=True, events=events, journal_at=at)

    def _task(self, request: m.GetTask) -> Reply:
        team = self._parts.active.team_controllers.get(request.team)
        if team is None:
            return Reply(ok=False, text=f"no team {request.team}")
        if team.planner.quarantined:
            return Reply(ok=True, text="its planner is left alone until the operator changes something")
        return Reply(ok=True, task=team.task, snapshot=team.kept)

    def _annotations(self) -> Reply:
        teams = self._parts.active.team_controllers
        return Reply(ok=True, annotations={name: team.annotations for name, team in teams.items()})

    def _note(self, principal: str, request: m.Note) -> Reply:
        severity = min(max(request.severity, WARNING), DEBUG)
        self._parts.records.events.report(EventClass.CONSOLE, principal, clean(request.text, MAX_NOTE_CHARS), severity)
        return Reply(ok=True)

    def _resume(self, request: m.Resume) -> Reply:
        self._parts.active.renew_quarantined()
        return self._parts.flight.executive.resume(request.vehicles)

    def _start(self, principal: str, request: m.Start) -> Reply:
        parts = self._parts
        if parts.flight.executive.run is RunPhase.RETURNING:
            return Reply(ok=False, text="the fleet is returning: wait until all have landed")
        if not request.vehicles or len(set(request.vehicles)) != len(request.vehicles):
            return Reply(ok=False, text="name each vehicle once")
        results = self._context.readiness.of_start(request.vehicles)
        bad = [r.vehicle for r in results if not r.ok]
        if bad:
            text = f"not started: {vehicles_words(bad)} not ready"
            return Reply(ok=False, text=text, results=results)
        if refused := self._context.checklist.refusal(request):
            return refused
        self._context.checklist.begun(principal, request)
        parts.flight.executive.start(request.vehicles)
        ids = ", ".join(map(str, request.vehicles))
        return Reply(
            ok=True, text=f"{parts.active.round.name} started: {len(results)} vehicles ({ids})", results=results
        )

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
        """Vehicles of teams that are outside the round's area, or in the air outside its altitude band."""
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
            # A vehicle in the air must be able to land where it took off.
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
        # Two consoles may edit at once: the second one would silently undo the first.
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
        # The edited scenario may have fewer rounds.
        index = min(parts.active.round_index, len(scenario.rounds) - 1)
        outside = self._outside(scenario, scenario.rounds[index])
        if outside:
            return Reply(ok=False, text="not applied: vehicles outside the new operating area", results=outside)
        before = {flight.vehicle: flight.team for flight in parts.flight.flights}
        changed = planner_changes(parts.active.scenario, scenario)
        parts.active.set_scenario(scenario, request.toml)
        moved = [
            f"vehicle {f.vehicle} to {f.team}"
            for f in parts.flight.flights
            if before.get(f.vehicle) not in (None, f.team)
        ]
        text = "; ".join(["scenario applied", *changed, *moved])
        return Reply(ok=True, text=text, scenario=parts.active.changed())

    def _why_not_in_flight(self, scenario: Scenario) -> str:
        """Why an edit cannot be applied in flight; "" if it can."""
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
            # `tui-gcs return` and `land` wait until telemetry shows the vehicles down.
            text = f"not while armed: {vehicles_words(flying)} (tui-gcs return or tui-gcs land lands them)"
            return Reply(ok=False, text=text)
        # The operator must name exactly the lost ones: another vehicle may have got lost meanwhile.
        if set(lost) != set(request.lost):
            ids = " ".join(map(str, lost))
            text = f"armed when last heard, and LOST: {ids}; if you know what became of them: tui-gcs stop --lost {ids}"
            return Reply(ok=False, text=text if lost else "nothing armed is lost: stop without --lost")
        self._parts.conditions.ending = True
        return Reply(ok=True, text="station ends")


def planner_changes(before: Scenario, after: Scenario) -> list[str]:
    """Lines for the journal: teams that get another planner, and parameters that change."""
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
