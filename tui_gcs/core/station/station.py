"""The station: wires links, fleet, services, guard, teams and recorder together; the one place that knows them all.

It has no loop of its own and never waits: `tick` does everything that is due. A process calls it 20 times a second;
a lock-step run calls it as time is moved on.
"""

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from tui_gcs.core.alarms.alarm_table import AlarmTable
from tui_gcs.core.base.clock import Clock, WallClockMonitor, wall_clock_warning
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.firmware.registry import FirmwareRegistry
from tui_gcs.core.fleet.detections import DetectionDecoder
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.integrity.altitude_monitor import AltitudeMonitor
from tui_gcs.core.fleet.integrity.navigation_integrity import NavigationIntegrityMonitor
from tui_gcs.core.fleet.integrity.position_jump_monitor import PositionJumpMonitor
from tui_gcs.core.fleet.integrity.reboot_store import RebootStore
from tui_gcs.core.fleet.tracks import TargetTracker
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.fleet.wind import WindEstimator
from tui_gcs.core.flight.executive import Executive
from tui_gcs.core.flight.fleet_monitor import FleetMonitor
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import FlightTable, HoldStep
from tui_gcs.core.flight.follow import FollowController
from tui_gcs.core.flight.manual_control import ManualController
from tui_gcs.core.flight.stall_detection import StallDetector
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.flight.team_controller import TeamController
from tui_gcs.core.forward.forwarder import Endpoint, Forwarder
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.links import Link
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.preflight.checklist import PreflightChecklist
from tui_gcs.core.preflight.readiness import Readiness
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import (
    Event,
    EventClass,
    FleetFrame,
    Phase,
    PlannerInfo,
    RunKind,
    RunPhase,
    ScenarioChanged,
    StationStatus,
    encode,
)
from tui_gcs.core.rates.rate_controller import RateController
from tui_gcs.core.records.event_log import ALERT, WARNING, EventLog
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.request_desk import RequestRouter
from tui_gcs.core.scenario.model import OperatorId, Round, Scenario, Team
from tui_gcs.core.services.all_services import Services
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.payload.operator_id import OperatorIdService
from tui_gcs.core.services.timesync import TimeResponder
from tui_gcs.core.signing.keystore import KeyStore
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.signing.trust import SigningRegistry
from tui_gcs.core.station.alarm_finder import AlarmFinder
from tui_gcs.core.station.bus_handlers import BusHandlers
from tui_gcs.core.station.fleet_frame import fleet_frame
from tui_gcs.core.station.reception import Reception
from tui_gcs.core.station.status import station_status
from tui_gcs.core.uplink.commands import CommandService
from tui_gcs.core.uplink.jobs import JobQueue
from tui_gcs.core.uplink.uplink import Uplink

JUMPED, DOUBTED = "its position jumped", "it doubted its own position"
"""Why who holds does not go on with the others."""
FRAME_GAP_S = 0.1
STATUS_GAP_S = 0.5
ALARM_GAP_S = 0.2
HEARTBEAT_GAP_S = 1.0
SYSTEM_ID = {RunKind.SIM: 254, RunKind.LIVE: 255}
"""SIM and LIVE stations never speak with the same id (architecture.md)."""
WHO_ARE_YOU = (148, 33)
"""AUTOPILOT_VERSION and GLOBAL_POSITION_INT: hardware id and boot clock tell whether it is the vehicle we know."""
COMPONENT_ID = 190
"""MAV_COMP_ID_MISSIONPLANNER, by convention any ground station."""


@dataclass
class StationConfig:
    """What a station is started with."""

    kind: RunKind
    scenario: Scenario
    toml: str
    scenario_path: str
    token: str = ""
    judge_steps: bool = True
    forward: tuple[Endpoint, ...] = ()
    """Other stations that hear our vehicles, and may command them where their endpoint says so."""
    keys: KeyStore | None = None
    """Signing keys of the vehicles; None: nothing is signed and no signature is checked."""
    stamps: TimestampStore | None = None
    planners: dict[str, PlannerInfo] = field(default_factory=dict)
    """What planners declare, by name, as far as it is known."""
    folder: Path | None = None
    """Where what is downloaded from vehicles goes, and caches of it; None: nothing is written."""
    rehearsals: Path | None = None
    """The file that tells which plans were rehearsed; None: none was."""
    operator_at: OperatorId | None = None
    """Where the operator stands (nothing else of it), by the command line: it goes before the scenario's."""


class Station:
    """One station of one kind. Everything happens on the caller's thread."""

    def __init__(
        self, config: StationConfig, clock: Clock, bus: Bus, links: list[Link], recorder: TlogWriter, journal: Journal
    ) -> None:
        """Wire the parts; nothing is sent before the first `tick`."""
        self.config = config
        self.clock = clock
        self.bus = bus
        self.links = {link.name: link for link in links}
        self.recorder = recorder
        self.journal = journal
        self.scenario, self.toml, self.path = config.scenario, config.toml, config.scenario_path
        self.revision = 1
        """Of the scenario: changes with every applied edit."""
        self.task_revision = 1
        """Of the planners' tasks: changes with every round, too."""
        self.round_index = 0
        self.ending = False
        self.events = EventLog(clock)
        self.events.listen(self._publish_event)
        frame = LocalFrame(self.scenario.origin)
        own = SYSTEM_ID[config.kind]
        networks = tuple(dict.fromkeys(link.spec.network for link in links)) or ("",)
        self.trust = SigningRegistry(
            clock, self.events, networks, config.keys, config.stamps, heartbeat=lambda: self.uplink.our_heartbeat()
        )
        self.fleet = VehicleRegistry(clock, self.events, frame, own, networks, self.trust)
        self.alarms = AlarmTable(clock, self.events)
        self.events.listen(lambda event: self.alarms.on_event(event, self.fleet.vehicles))
        self.flights = FlightTable()
        self.flights.assign(self.scenario, [])
        self.guard = Guard(self.scenario.limits, self.round.area, self.round.no_fly)
        self.commands = CommandService(clock, self.events)
        encoder = Encoder(own, COMPONENT_ID)
        self.uplink = Uplink(
            self.links,
            self.fleet,
            self.guard,
            encoder,
            recorder,
            journal,
            clock,
            self.events,
            config.kind,
            config.token,
            self.trust,
        )
        self.forwarder = Forwarder(
            list(config.forward),
            self.fleet,
            self.uplink,
            self.guard,
            {network: number for number, network in enumerate(networks)},
            own,
            COMPONENT_ID,
            clock,
            self.events,
        )
        self.reception = Reception(self.links, self.fleet, recorder, self.forwarder, self.trust, clock, self.events)
        self.command_encoder = CommandEncoder(self.uplink, frame)
        self.firmware = FirmwareRegistry(self.command_encoder, self.fleet, self.commands, clock, self.events)
        self._flight_services = FlightServices(
            self.fleet, self.flights, self.guard, self.firmware, self.commands, self.events, clock
        )
        self.steering = Steering(self._flight_services)
        self.executive = Executive(self._flight_services, self.steering, self.scenario.limits.speed_m_s)
        self.manual_control = ManualController(self._flight_services, self.steering)
        self.follow_control = FollowController(self._flight_services, self.manual_control)
        specs = {link.name: link.spec for link in links}
        self.rates = RateController(self.fleet, self.commands, self.command_encoder, specs, clock, self.events)
        self.answers = TimeResponder(self.fleet, self.uplink, clock, own)
        self.jobs = JobQueue(self.fleet.vehicles, clock, self.events)
        context = ServiceContext(
            self.fleet, self.uplink, self.commands, self.jobs, clock, self.events, own, specs, config.folder
        )
        self.services = Services(context)
        self.operator_id = OperatorIdService(
            context, self.operator, lambda: (flight.vehicle for flight in self.flights)
        )
        self.steering.lost_link_behaviour = self.services.failsafes.lost_link_behaviour
        self.monitor = FleetMonitor(self.guard, self.flights)
        self.tracks = TargetTracker(self.fleet, self.events)
        self.detections = DetectionDecoder(self.fleet, clock, self.tracks.take)
        self.wind = WindEstimator(self.fleet, clock)
        self.team_controllers: dict[str, TeamController] = {}
        self.readiness = Readiness(self)
        self.preflight = PreflightChecklist(self)
        self.orphaned = False
        """Whether the process that would start it again is gone."""
        self.memory_lost = self.memory_error = ""
        """Why what the station before this one knew is lost; why what this one knows cannot be kept. "" otherwise."""
        self.requests = RequestRouter(self)
        self.reboots = RebootStore(self.fleet)
        self._alarm_finder = AlarmFinder(self, self.alarms)
        self.events.listen(self._alarm_finder.on_event)
        self._next_alarms_s = -math.inf
        self.stall_detector = StallDetector()
        self.jumps = PositionJumpMonitor()
        self.heights = AltitudeMonitor()
        self.executive.return_control.lift_m = self.lift_m
        self._self_doubts = NavigationIntegrityMonitor()
        self._wall_watch = WallClockMonitor(clock)
        self.dropped: Counter[str] = Counter()
        self._assigned_for: tuple[int, ...] = ()
        self._frame_seq = self._status_seq = 0
        self._next_frame_s = self._next_status_s = self._next_heartbeat_s = -math.inf
        self._last_state: object = None
        BusHandlers(self, own).listen()
        self._make_team_controllers()
        self.new_tasks()

    @property
    def round(self) -> Round:
        """The present round."""
        return self.scenario.rounds[self.round_index]

    def operator(self) -> OperatorId | None:
        """What Remote ID is to tell of the operator, if anything."""
        told, at = self.scenario.remote_id, self.config.operator_at
        if at is None:
            return told
        return msgspec.structs.replace(told or at, lat_deg=at.lat_deg, lon_deg=at.lon_deg, alt_m=at.alt_m)

    @property
    def waiting(self) -> bool:
        """Whether an answer is expected: then what arrives is taken at once."""
        return self.commands.waiting or self.jobs.busy

    # ---------------------------------------------------------------- time

    def receive(self, may_go_on: Callable[[], bool] = lambda: True) -> int:
        """Take what has arrived and answer what must be answered at once; how many datagrams came.

        `may_go_on` is asked between links, see `Reception.receive`.
        """
        return self.reception.receive(may_go_on)

    def tick(self) -> None:
        """Take what has arrived, and do everything that is due now."""
        self.receive()
        for _ in self.steps():
            pass

    def steps(self) -> Iterator[None]:
        """Everything that is due now, in parts: between them who is waiting for an answer may be served.

        Nothing is received: the caller has done so just before.
        """
        self.fleet.tick()
        self.trust.tick(list(self.fleet.vehicles.values()))
        self._assign_when_idle()
        for vehicle, path in self.fleet.paths.due_version_requests(list(self.fleet.vehicles.values())):
            for message in WHO_ARE_YOU:
                self.uplink.ask_path(vehicle, path, message)
        for source, heartbeat in self.trust.due_time_frames():
            self.uplink.tell_time(source, heartbeat)
        yield
        self.rates.tick()
        yield
        self.commands.tick(self.fleet.vehicles)
        self.jobs.tick()
        self.services.tick()
        self.operator_id.tick()
        self.reboots.tick()
        self.executive.tick()
        self.firmware.tick()
        if self.stall_detector.is_over(self.clock.now()):
            self._hold_after_pause()
        if not self.stall_detector.catches_up:
            for desk in self.team_controllers.values():
                silent = desk.tick()
                if silent:
                    self.executive.hold(tuple(silent), stays="", asked=False)
            self.follow_control.tick()
            self.steering.tick()
        self.forwarder.tick()
        self.uplink.tick()
        yield
        self._look_for_alarms()
        yield
        yield from self._publish_due()

    def _hold_after_pause(self) -> None:
        """Whoever flew for its planner, and does so still, holds: nobody led it meanwhile, and it may be anywhere."""
        flying = tuple(flight.vehicle for flight in self.flights.in_phase(Phase.FLYING))
        held = f"{len(flying)} {'vehicle holds' if len(flying) == 1 else 'vehicles hold'}; " if flying else ""
        text = f"stood still for {self.stall_detector.lasted_s:.1f} s: {held}computer overloaded?"
        self.events.report(EventClass.CONNECTION, "station", text, ALERT)
        if flying:
            self.executive.hold(flying, stays="", asked=False)

    def _hold_jumped(self, vehicle: Vehicle, far_m: float) -> None:
        """Led on it would be as far beside what everybody believes: who flew for its planner or by hand holds.

        Who holds is told to do so where it is now: it would fly back to where it seemed to be.
        """
        text = f"its position jumped by {far_m:.0f} m: before or after that it is not where it says"
        if not self.jumps.off_m(vehicle.id):
            text = f"its position jumped back by {far_m:.0f} m"
        self.events.report(EventClass.SENSOR, f"vehicle {vehicle.id}", text, WARNING)
        flight = self.flights.get(vehicle.id)
        if flight is None or flight.phase not in (Phase.FLYING, Phase.BY_HAND, Phase.HOLDING):
            return
        if flight.step is HoldStep.FOUND:
            flight.stays = flight.stays or JUMPED
        else:
            self.executive.hold((vehicle.id,), stays=JUMPED, asked=False)

    def _hold_doubtful(self, now: float) -> None:
        """As long as it still is where it says, nearly: who flies for its planner or by hand holds."""
        for vehicle, why in self._self_doubts.look(self._alarm_finder.in_doubt, now):
            flight = self.flights.get(vehicle)
            if flight is not None and flight.phase in (Phase.FLYING, Phase.BY_HAND):
                text = f"it doubts its own position, and holds: {why}"
                self.events.report(EventClass.SENSOR, f"vehicle {vehicle}", text, WARNING)
                self._self_doubts.answer(vehicle)
                self.executive.hold((vehicle,), stays=DOUBTED, asked=False)

    def lift_m(self, vehicle: int) -> float:
        """How much lower than it says a vehicle may be: it jumped up, or its GPS says so."""
        return max(0.0, self.jumps.off(vehicle)[2], self.heights.off_m(vehicle))

    def close(self) -> None:
        """Write down what the next start has to know."""
        self.trust.close()

    def _look_for_alarms(self) -> None:
        now = self.clock.now()
        if now >= self._next_alarms_s - 1e-9:
            self._next_alarms_s = now + ALARM_GAP_S
            if by_s := self._wall_watch.was_set_by():
                self.events.report(EventClass.CONNECTION, "station", wall_clock_warning(by_s), WARNING)
            for vehicle, far_m in self.jumps.look(self.fleet.vehicles.values()):
                self._hold_jumped(vehicle, far_m)
            self.heights.look(self.fleet.vehicles.values(), now)
            self.alarms.look(self._alarm_finder.findings(ALARM_GAP_S))
            self._hold_doubtful(now)

    def _publish_due(self) -> Iterator[None]:
        now = self.clock.now()
        if now >= self._next_heartbeat_s - 1e-9:
            self._next_heartbeat_s = now + HEARTBEAT_GAP_S
            yield from self.uplink.heartbeat()
        if now >= self._next_frame_s - 1e-9:
            self._next_frame_s = now + min(
                [FRAME_GAP_S, *(1.0 / desk.planner.rate_hz for desk in self.team_controllers.values())]
            )
            yield from self._publish_frame()
            yield
        state = (self.executive.run, self.round_index, self.revision, self.uplink.refused.total(), self.alarms.changes)
        if now >= self._next_status_s - 1e-9 or state != self._last_state:
            self._next_status_s = now + STATUS_GAP_S
            self._last_state = state
            self._status_seq += 1
            self.bus.publish(keys.STATUS, encode(self.status()))
            yield
            self.recorder.flush()

    def status(self) -> StationStatus:
        """As it is now, under the number of the one published last."""
        return station_status(self, self._status_seq)

    def _publish_frame(self) -> Iterator[None]:
        self._frame_seq += 1
        for desk in self.team_controllers.values():
            desk.measure()
        self.monitor.watch(self.fleet.vehicles.values())
        yield
        frame = self.frame()
        yield
        self.bus.publish(keys.FLEET, encode(frame))

    def frame(self) -> FleetFrame:
        """All vehicles as they are now."""
        frame = fleet_frame(
            self._frame_seq,
            self.config.kind,
            self.fleet,
            self.flights,
            self.steering,
            self.clock,
            self.services.payload,
        )
        return msgspec.structs.replace(
            frame, tracks=self.tracks.tracks(self.clock.now()), wind_m_s=self.wind.estimate()
        )

    # ---------------------------------------------------------------- vehicles

    def _assign_when_idle(self) -> None:
        """Teams with a count take the lowest ids heard, until the first start; then everybody keeps his place.

        Planners are told anew what is known only of vehicles that were heard, also after a restart: before it resumes.
        """
        heard = tuple(sorted(v.id for v in self.fleet.vehicles.values() if v.identity.confirmed))
        run = self.executive.run
        if heard == self._assigned_for or run not in (RunPhase.IDLE, RunPhase.HOLD):
            return
        self._assigned_for = heard
        if run is RunPhase.IDLE and math.isnan(self.executive.started_s):
            self.flights.assign(self.scenario, list(heard))
        asked = {
            name: desk
            for name, desk in self.team_controllers.items()
            if run is RunPhase.IDLE or not desk.planner.quarantined
        }
        if changed := {name for name, desk in asked.items() if desk.is_changed(self.scenario, self.round)}:
            self.new_tasks(changed)

    # ---------------------------------------------------------------- rounds and teams

    def set_round(self, index: int) -> None:
        """Make round `index` the present one; the caller has checked that everybody is inside its area."""
        self.round_index = index
        self.guard.set_round(self.scenario.limits, self.round.area, self.round.no_fly)
        self.new_tasks()

    def set_scenario(self, scenario: Scenario, toml: str) -> None:
        """Fly another scenario from now on; the caller has checked that this may be done."""
        self.scenario, self.toml = scenario, toml
        self.revision += 1
        self.round_index = min(self.round_index, len(scenario.rounds) - 1)
        frame = LocalFrame(scenario.origin)
        if frame.origin != self.fleet.frame.origin:
            self.tracks.clear()
        self.fleet.reframe(frame)
        self.command_encoder.frame = frame
        self.executive.return_control.speed_m_s = scenario.limits.speed_m_s
        if self.flights.any_in_the_air():
            self.flights.reassign(scenario)
        else:
            self.flights.assign(scenario, sorted(self.fleet.vehicles))
        self.guard.set_round(scenario.limits, self.round.area, self.round.no_fly)
        self._make_team_controllers()
        self.new_tasks({name for name, desk in self.team_controllers.items() if desk.is_changed(scenario, self.round)})
        self.bus.publish(keys.SCENARIO, encode(self.scenario_changed()))

    def set_team(self, team: Team, toml: str) -> None:
        """Other parameters for one team's planner; the others are not disturbed."""
        teams = tuple(team if t.name == team.name else t for t in self.scenario.teams)
        self.scenario, self.toml = msgspec.structs.replace(self.scenario, teams=teams), toml
        self.revision += 1
        self.team_controllers[team.name].team = team
        self.new_tasks({team.name})
        self.bus.publish(keys.SCENARIO, encode(self.scenario_changed()))

    def renew_quarantined(self) -> None:
        """The operator wants planners that were left alone to try again."""
        if left_alone := {name for name, desk in self.team_controllers.items() if desk.planner.quarantined}:
            self.new_tasks(left_alone)

    def new_tasks(self, teams: Collection[str] | None = None) -> None:
        """Give every planner, or those of some teams, its task anew, under a new revision."""
        self.task_revision += 1
        for name, desk in self.team_controllers.items():
            if teams is not None and name not in teams:
                continue
            task = desk.set_round(self.scenario, self.round, self.task_revision)
            self.bus.publish(keys.TASK.format(team=name), encode(task))

    def scenario_changed(self) -> ScenarioChanged:
        """The present scenario for the bus."""
        return ScenarioChanged(revision=self.revision, path=self.path, toml=self.toml, scenario=self.scenario)

    def _make_team_controllers(self) -> None:
        self.team_controllers = {
            team.name: self.team_controllers.get(team.name)
            or TeamController(
                self._flight_services,
                self.steering,
                self.journal,
                judge_steps=self.config.judge_steps,
                team=team,
            )
            for team in self.scenario.teams
        }
        for team in self.scenario.teams:
            self.team_controllers[team.name].team = team

    def _publish_event(self, event: Event) -> None:
        self.bus.publish(keys.EVENT, encode(event))
        self.journal.write(msgspec.to_builtins(event))
