"""Builds all parts of a station from the ground up."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from tui_gcs.core.alarms.alarm_table import AlarmTable
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.firmware.registry import FirmwareRegistry
from tui_gcs.core.fleet.detections import DetectionDecoder
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.integrity.altitude_monitor import AltitudeMonitor
from tui_gcs.core.fleet.integrity.position_jump_monitor import PositionJumpMonitor
from tui_gcs.core.fleet.integrity.reboot_store import RebootStore
from tui_gcs.core.fleet.tracks import TargetTracker
from tui_gcs.core.fleet.wind import WindEstimator
from tui_gcs.core.flight.battery_return import BatteryReturnController
from tui_gcs.core.flight.course_monitor import CourseMonitor
from tui_gcs.core.flight.emergency_monitor import EmergencyMonitor
from tui_gcs.core.flight.executive import Executive
from tui_gcs.core.flight.fleet_monitor import FleetMonitor
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.flight.follow import FollowController
from tui_gcs.core.flight.manual_control import ManualController
from tui_gcs.core.flight.mission_separation import MissionSeparation
from tui_gcs.core.flight.point_table import PointTable
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.forward.forwarder import Forwarder
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.links import Link
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.rates.rate_controller import RateController
from tui_gcs.core.services.all_services import Services
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.payload.operator_id import OperatorIdService
from tui_gcs.core.services.timesync import TimeResponder
from tui_gcs.core.signing.trust import SigningRegistry
from tui_gcs.core.station.active_scenario import ActiveScenario
from tui_gcs.core.station.parts import (
    COMPONENT_ID,
    SYSTEM_ID,
    AirPicture,
    Communications,
    FlightParts,
    Records,
    StationConditions,
    StationConfig,
)
from tui_gcs.core.station.reception import Reception
from tui_gcs.core.uplink.commands import CommandService
from tui_gcs.core.uplink.jobs import JobQueue
from tui_gcs.core.uplink.uplink import Uplink


@dataclass(frozen=True)
class StationParts:
    """All parts of one station, for consumers that need several groups."""

    config: StationConfig
    conditions: StationConditions
    records: Records
    picture: AirPicture
    alarms: AlarmTable
    comms: Communications
    flight: FlightParts
    active: ActiveScenario
    services: Services
    operator_id: OperatorIdService


def build_parts(config: StationConfig, records: Records, links: list[Link]) -> StationParts:
    """Build and connect all parts of a station; nothing is sent.

    The order of the calls is the order of the floors.
    """
    # Parts register at the fleet and the event log while they are built, and are called in that order: it belongs to
    # the behaviour that rehearsals repeat byte for byte.
    uplinks: list[Uplink] = []  # signing needs our heartbeat, which the uplink makes, which needs signing
    picture = _picture(config, records, links, lambda: uplinks[0].our_heartbeat())
    alarms = AlarmTable(records.clock, records.events)
    records.events.listen(lambda event: alarms.on_event(event, picture.fleet.vehicles))
    flights = FlightTable()
    flights.assign(config.scenario, [])
    first = config.scenario.rounds[0]
    # One guard for set-points, forwarded commands and the monitor: they must agree on the present round.
    guard = Guard(config.scenario.limits, first.area, first.no_fly, config.scenario.classes)
    comms = _comms(config, records, picture, guard, links)
    uplinks.append(comms.uplink)
    flight = _flight(
        config,
        FlightServices(picture.fleet, flights, guard, comms.firmware, comms.commands, records.events, records.clock),
    )
    active = ActiveScenario(config, records, picture, comms, flight)
    specs = {link.name: link.spec for link in links}
    context = ServiceContext(
        picture.fleet,
        comms.uplink,
        comms.commands,
        comms.jobs,
        records.clock,
        records.events,
        SYSTEM_ID[config.kind],
        specs,
        config.folder,
    )
    services = Services(context, config.elevation)
    # Set afterwards: the failsafe service is above flight control, and steering asks it what a vehicle does when
    # unheard.
    flight.steering.lost_link_behaviour = services.failsafes.lost_link_behaviour
    is_simulated = config.kind is RunKind.SIM
    flight.steering.own_limits = partial(services.failsafes.own_limits, simulated=is_simulated)
    comms.forwarder.parameter_problem = services.params.foreign_problem
    operator_id = OperatorIdService(context, active.operator, lambda: (flight.vehicle for flight in flights))
    conditions = StationConditions()
    return StationParts(config, conditions, records, picture, alarms, comms, flight, active, services, operator_id)


def _networks(links: list[Link]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(link.spec.network for link in links)) or ("",)


def _picture(
    config: StationConfig, records: Records, links: list[Link], our_heartbeat: Callable[[], bytes]
) -> AirPicture:
    clock, events = records.clock, records.events
    networks = _networks(links)
    trust = SigningRegistry(clock, events, networks, config.keys, config.stamps, heartbeat=our_heartbeat)
    fleet = VehicleRegistry(clock, events, LocalFrame(config.scenario.origin), SYSTEM_ID[config.kind], networks, trust)
    tracks = TargetTracker(fleet, events)
    detections = DetectionDecoder(fleet, clock, tracks.take)
    return AirPicture(
        fleet,
        trust,
        tracks,
        detections,
        WindEstimator(fleet, clock),
        RebootStore(fleet),
        PositionJumpMonitor(),
        AltitudeMonitor(),
    )


def _comms(
    config: StationConfig, records: Records, picture: AirPicture, guard: Guard, links: list[Link]
) -> Communications:
    clock, events, fleet = records.clock, records.events, picture.fleet
    own = SYSTEM_ID[config.kind]
    by_name = {link.name: link for link in links}
    commands = CommandService(clock, events)
    uplink = Uplink(
        by_name,
        fleet,
        guard,
        Encoder(own, COMPONENT_ID),
        records.recorder,
        records.journal,
        clock,
        events,
        config.kind,
        config.token,
        picture.trust,
    )
    numbers = {network: number for number, network in enumerate(_networks(links))}
    forwarder = Forwarder(list(config.forward), fleet, uplink, guard, numbers, own, COMPONENT_ID, clock, events)
    reception = Reception(by_name, fleet, records.recorder, forwarder, picture.trust, clock, events)
    command_encoder = CommandEncoder(uplink, fleet.frame)
    firmware = FirmwareRegistry(command_encoder, fleet, commands, clock, events)
    rates = RateController(fleet, commands, command_encoder, {link.name: link.spec for link in links}, clock, events)
    time_responder = TimeResponder(fleet, uplink, clock, own)
    jobs = JobQueue(fleet.vehicles, clock, events)
    return Communications(
        by_name, commands, uplink, forwarder, reception, command_encoder, firmware, rates, time_responder, jobs
    )


def _flight(config: StationConfig, flight_services: FlightServices) -> FlightParts:
    steering = Steering(flight_services)
    manual_control = ManualController(flight_services, steering)
    executive = Executive(flight_services, steering, config.scenario.limits.speed_m_s)
    return FlightParts(
        flight_services,
        flight_services.guard,
        flight_services.flights,
        steering,
        executive,
        manual_control,
        FollowController(flight_services, manual_control),
        FleetMonitor(flight_services.guard, flight_services.flights),
        EmergencyMonitor(flight_services.flights, executive.losses.declare_emergency),
        CourseMonitor(flight_services),
        MissionSeparation(flight_services, steering, executive.may_stop_by_itself, executive.hold_for_separation),
        BatteryReturnController(flight_services, config.scenario, executive),
        PointTable(flight_services, config.scenario, executive),
    )
