"""The scenario that a station flies: its text and revision, the present round, and each team's link to its planner."""

import math
from collections.abc import Collection

import msgspec

from tui_gcs.core.flight.team_controller import TeamController
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.common import RunPhase, ScenarioChanged, encode
from tui_gcs.core.scenario.model import OperatorId, Round, Scenario, Team
from tui_gcs.core.station.parts import AirPicture, Communications, FlightParts, Records, StationConfig


class ActiveScenario:
    """Holds the scenario that is flown and passes every change of it on to the parts that depend on it.

    It checks nothing: whether a change is allowed now is decided by the request handler that calls it.
    """

    def __init__(
        self, config: StationConfig, records: Records, picture: AirPicture, comms: Communications, flight: FlightParts
    ) -> None:
        self.scenario, self.toml, self.path = config.scenario, config.toml, config.scenario_path
        self.revision = 1
        """Revision of the scenario; it grows with every applied edit."""
        self.task_revision = 1
        """Revision of the planners' tasks; it grows with every applied edit and every round."""
        self.round_index = 0
        self.team_controllers: dict[str, TeamController] = {}
        """By name of the team."""
        self._config = config
        self._records = records
        self._picture = picture
        self._comms = comms
        self._flight = flight
        self._assigned_for: tuple[int, ...] = ()
        """Ids of the confirmed vehicles when teams were last put together."""

    @property
    def round(self) -> Round:
        """The round that is flown now, or will be flown next."""
        return self.scenario.rounds[self.round_index]

    def operator(self) -> OperatorId | None:
        """The operator's identity and place that Remote ID broadcasts; None where nothing is to be broadcast."""
        configured, at = self.scenario.remote_id, self._config.operator_at
        if at is None:
            return configured
        return msgspec.structs.replace(configured or at, lat_deg=at.lat_deg, lon_deg=at.lon_deg, alt_m=at.alt_m)

    def changed(self) -> ScenarioChanged:
        """The present scenario as it is published on the bus."""
        return ScenarioChanged(revision=self.revision, path=self.path, toml=self.toml, scenario=self.scenario)

    def begin(self) -> None:
        """Give every planner its first task."""
        self._make_team_controllers()
        self.new_tasks()

    def set_round(self, index: int) -> None:
        """Make round `index` the present one; the caller has checked that every vehicle is inside its area."""
        self.round_index = index
        self._flight.guard.set_round(self.scenario.limits, self.round.area, self.round.no_fly, self.scenario.classes)
        self.new_tasks()

    def set_scenario(self, scenario: Scenario, toml: str) -> None:
        """Fly another scenario from now on; the caller has checked that the change is allowed now."""
        self.scenario, self.toml = scenario, toml
        self._flight.points.scenario = scenario
        self.revision += 1
        self.round_index = min(self.round_index, len(scenario.rounds) - 1)
        fleet, flights = self._picture.fleet, self._flight.flights
        frame = LocalFrame(scenario.origin)
        # Tracks are kept in metres about the origin, so they mean other places now.
        if frame.origin != fleet.frame.origin:
            self._picture.tracks.clear()
        fleet.reframe(frame)
        self._comms.command_encoder.frame = frame
        self._flight.executive.return_control.speed_m_s = scenario.limits.speed_m_s
        self._flight.battery_return.set_scenario(scenario)
        # In flight a vehicle keeps its layer and home, whatever team it goes to; on the ground places are given out
        # anew.
        if flights.any_in_the_air():
            flights.reassign(scenario)
        else:
            flights.assign(scenario, sorted(fleet.vehicles))
        self._flight.guard.set_round(scenario.limits, self.round.area, self.round.no_fly, scenario.classes)
        self._make_team_controllers()
        self.new_tasks(
            {name for name, controller in self.team_controllers.items() if controller.is_changed(scenario, self.round)}
        )
        self._records.bus.publish(keys.SCENARIO, encode(self.changed()))

    def set_team(self, team: Team, toml: str) -> None:
        """Give one team's planner other parameters; the tasks of the other teams stay as they are."""
        teams = tuple(team if t.name == team.name else t for t in self.scenario.teams)
        self.scenario, self.toml = msgspec.structs.replace(self.scenario, teams=teams), toml
        self.revision += 1
        self.team_controllers[team.name].team = team
        self.new_tasks({team.name})
        self._records.bus.publish(keys.SCENARIO, encode(self.changed()))

    def renew_quarantined(self) -> None:
        """Give planners that were quarantined their task anew, because the operator wants them to try again."""
        if quarantined := {
            name for name, controller in self.team_controllers.items() if controller.planner.quarantined
        }:
            self.new_tasks(quarantined)

    def new_tasks(self, teams: Collection[str] | None = None) -> None:
        """Publish the tasks of these teams (None: of all) under a new revision."""
        self.task_revision += 1
        for name, controller in self.team_controllers.items():
            if teams is not None and name not in teams:
                continue
            task = controller.set_round(self.scenario, self.round, self.task_revision)
            self._records.bus.publish(keys.TASK.format(team=name), encode(task))

    def assign_when_idle(self) -> None:
        """Put vehicles that were heard into teams until the first start; after that every vehicle keeps its place.

        A team with a count takes the lowest ids that were heard. Tasks are published again when what they hold of the
        vehicles has changed; after a restart too, before the fleet resumes.
        """
        heard = tuple(sorted(v.id for v in self._picture.fleet.vehicles.values() if v.identity.confirmed))
        executive = self._flight.executive
        run = executive.run
        # A fleet that starts, flies or returns is never put together anew: a vehicle would change its layer in the air.
        if heard == self._assigned_for or run not in (RunPhase.IDLE, RunPhase.HOLD):
            return
        self._assigned_for = heard
        if run is RunPhase.IDLE and math.isnan(executive.started_s):
            self._flight.flights.assign(self.scenario, list(heard))
        named = {
            name: controller
            for name, controller in self.team_controllers.items()
            if run is RunPhase.IDLE or not controller.planner.quarantined
        }
        if changed := {name for name, controller in named.items() if controller.is_changed(self.scenario, self.round)}:
            self.new_tasks(changed)

    def _make_team_controllers(self) -> None:
        self.team_controllers = {
            team.name: self.team_controllers.get(team.name)
            or TeamController(
                self._flight.services,
                self._flight.steering,
                self._records.journal,
                judge_steps=self._config.judge_steps,
                team=team,
            )
            for team in self.scenario.teams
        }
        for team in self.scenario.teams:
            self.team_controllers[team.name].team = team
