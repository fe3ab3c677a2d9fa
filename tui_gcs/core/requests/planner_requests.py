"""Requests about planners: parameters in flight, and a look at what an edited scenario would give."""

import math

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.flight.planner_tasks import Crew, crewed, crews, within_own_limits
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import PREVIEW_TASK
from tui_gcs.core.protocol.common import PlannerTask, PreviewResult, PreviewTask, Reply, encode
from tui_gcs.core.protocol.planner_log import GetPlannerLog
from tui_gcs.core.protocol.services import ServiceReply
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Round, Scenario, Team

PREVIEW_LIMIT_S = 90.0
"""A worker that has not answered a preview after this long never will."""


class PlannerRequests:
    """Changes parameters of planners, keeps the newest preview, and reads the planner log."""

    def __init__(self, context: RequestContext) -> None:
        self._context, self._parts = context, context.parts
        self._number = 0
        self._asked_s = 0.0
        self.previews: dict[str, PreviewResult] = {}
        """The newest results, by team."""
        self._asked: dict[str, str] = {}
        """By team, the team whose worker makes its preview."""

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        # Looking at what an edited scenario would give changes nothing that flies, so it takes no control.
        return {
            m.GetPlanners: RequestHandler(Access.LOOK, lambda *_: self._planners()),
            GetPlannerLog: RequestHandler(Access.LOOK, lambda _, r: self._log_piece(r)),
            m.GetPreviews: RequestHandler(Access.LOOK, lambda *_: self.look()),
            m.Preview: RequestHandler(Access.ASSIST, lambda _, r: self.preview(r)),
            m.CancelPreview: RequestHandler(Access.ASSIST, lambda *_: self.cancel()),
            m.SetParameters: RequestHandler(Access.COMMAND, lambda _, r: self.set_parameters(r)),
        }

    def _planners(self) -> Reply:
        known = self._parts.config.planners
        return Reply(ok=True, planners=tuple(known[name] for name in sorted(known)))

    def _log_piece(self, request: GetPlannerLog) -> ServiceReply:
        log = self._parts.config.planner_log
        if log is None:
            return ServiceReply(ok=False, text="this station keeps no planner log")
        return ServiceReply(ok=True, planner_log=log.after(request.at) if request.newer else log.before(request.at))

    def set_parameters(self, request: m.SetParameters) -> Reply:
        """Change parameters that fit what the planner declares; only this team gets a new task."""
        parts = self._parts
        controller = parts.active.team_controllers.get(request.team)
        if controller is None:
            return Reply(ok=False, text=f"no team {request.team}")
        info = parts.config.planners.get(controller.team.planner)
        if info is None:
            return Reply(
                ok=False,
                text=f"the parameters of planner {controller.team.planner} are not known yet; try again in a moment",
            )
        if problems := info.problems(request.parameters):
            return Reply(ok=False, text="; ".join(problems))
        before = {param.name: param.default for param in info.params} | controller.team.parameters
        # Unchanged parameters must not restart the planner.
        changed = {name: value for name, value in request.parameters.items() if value != before[name]}
        if not changed:
            return Reply(ok=True, text=f"team {request.team}: nothing changes")
        parameters = controller.team.parameters | changed
        try:
            document = ScenarioDocument(parts.active.toml)
            document.set_team(request.team, parameters=parameters)
        except ScenarioError as error:
            return Reply(ok=False, text=str(error))
        parts.active.set_team(msgspec.structs.replace(controller.team, parameters=parameters), document.text)
        words = ", ".join(f"{name} {before[name]} -> {value}" for name, value in sorted(changed.items()))
        return Reply(ok=True, text=f"team {request.team}, planner {info.name}: {words}")

    def preview(self, request: m.Preview) -> Reply:
        """Begin a preview, which ends the one before; planners work on it aside, and nothing that flies changes."""
        parts = self._parts
        if request.base_revision != parts.active.revision:
            return Reply(ok=False, text="the scenario has changed since you began to edit: look at it again")
        try:
            scenario = parse(request.toml, where="edited scenario")
        except ScenarioError as error:
            return Reply(ok=False, text=str(error))
        if not 0 <= request.round_index < len(scenario.rounds) or not 0.0 <= request.idleness_s < math.inf:
            return Reply(ok=False, text="no such round, or no such idleness")
        round_ = scenario.rounds[request.round_index]
        # One preview at a time: planners work on it beside their flight.
        self.cancel()
        self._number += 1
        self._asked_s = parts.records.clock.now()
        frame, controllers = self._context.publisher.frame(), parts.active.team_controllers
        crew_of = crews(scenario, frame.ids)
        starts_m = {vehicle: place.place_m for crew in crew_of.values() for vehicle, place in crew.items()}
        for team in scenario.teams:
            if request.team not in ("", team.name):
                continue
            task = msgspec.structs.replace(
                self._task(scenario, round_, team, crew_of[team.name]), revision=self._number, t_s=frame.t_s
            )
            # A team that is new in the edit has no worker yet; any other team's worker knows all planners.
            own = controllers.get(team.name)
            worker = team.name if own is not None else next(iter(controllers))
            self._asked[team.name] = worker
            self.previews[team.name] = PreviewResult(team.name, self._number, "running")
            snapshot = own.kept if own is not None else b""
            ask = PreviewTask(self._number, task, frame, request.idleness_s, starts_m, snapshot)
            parts.records.bus.publish(PREVIEW_TASK.format(team=worker), encode(ask))
        return Reply(ok=True, text="preview begun", previews=dict(self.previews))

    def _task(self, scenario: Scenario, round_: Round, team: Team, crew: Crew) -> PlannerTask:
        """The task with the vehicles and layers of the edit; a team with a count keeps its present vehicles."""
        task = crewed(scenario, round_, team, crew)
        controller = self._parts.active.team_controllers.get(team.name)
        if controller is None:  # new, or renamed: another team's worker knows all planners, too
            return task
        now = controller.task_for(scenario, round_, team, self._number)
        if team.vehicles or not now.members:
            own = {vehicle: self._parts.flight.steering.own_limits(vehicle) for vehicle in task.members}
            return msgspec.structs.replace(within_own_limits(task, own), off_course_m=now.off_course_m)
        return now

    def cancel(self) -> Reply:
        """End the preview that is under way."""
        running = {self._asked[team] for team, result in self.previews.items() if result.state == "running"}
        for worker in sorted(running):
            self._parts.records.bus.publish(
                PREVIEW_TASK.format(team=worker), encode(PreviewTask(self._number, None, None))
            )
        self.previews, self._asked = {}, {}
        return Reply(ok=True, text="preview cancelled" if running else "no preview is under way")

    def take(self, worker: str, result: PreviewResult) -> None:
        """Take the result of the worker that was asked for it; results of older previews are dropped."""
        team = result.team
        if result.number == self._number and self._asked.get(team) == worker:
            self.previews[team] = msgspec.structs.replace(result, text=clean(result.text, 300))

    def look(self) -> Reply:
        """The newest preview as far as it is."""
        if self._parts.records.clock.now() - self._asked_s > PREVIEW_LIMIT_S:
            text = f"no answer within {PREVIEW_LIMIT_S:.0f} s"
            for team, result in self.previews.items():
                if result.state == "running":
                    self.previews[team] = msgspec.structs.replace(result, state="failed", text=text)
        return Reply(ok=True, previews=dict(self.previews))
