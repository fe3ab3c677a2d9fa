"""The parts of a station: its configuration, and frozen records that group the parts by subject.

A consumer takes the records that it needs, and never the `Station`, so it cannot reach what drives the tick.
"""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from tui_gcs.core.base.clock import Clock
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
from tui_gcs.core.forward.forwarder import Endpoint, Forwarder
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.links import Link
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import PlannerInfo
from tui_gcs.core.rates.rate_controller import RateController
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.link_store import LinkStore
from tui_gcs.core.records.planner_log import PlannerLog
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.scenario.model import OperatorId, Scenario
from tui_gcs.core.services.timesync import TimeResponder
from tui_gcs.core.signing.keystore import KeyStore
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.signing.trust import SigningRegistry
from tui_gcs.core.station.reception import Reception
from tui_gcs.core.uplink.commands import CommandService
from tui_gcs.core.uplink.jobs import JobQueue
from tui_gcs.core.uplink.uplink import Uplink

SYSTEM_ID = {RunKind.SIM: 254, RunKind.LIVE: 255}
"""MAVLink system id of a station by its kind: two ids, so that a vehicle can tell a rehearsal from a flight."""
COMPONENT_ID = 190
"""MAV_COMP_ID_MISSIONPLANNER, by convention any ground station."""


@dataclass
class StationConfig:
    """What a station is started with."""

    kind: RunKind
    scenario: Scenario
    toml: str
    """The text that `scenario` was parsed from."""
    scenario_path: str
    token: str = ""
    """Secret of our own simulator: a SIM station commands only vehicles that know it."""
    judge_steps: bool = True
    """Whether the time that planners take for a step counts; not in lock-step, where wall time means nothing."""
    forward: tuple[Endpoint, ...] = ()
    """Other stations that receive our vehicles' frames, and may command them where their endpoint allows it."""
    keys: KeyStore | None = None
    """Signing keys of the vehicles. None: nothing is signed and no signature is checked."""
    stamps: TimestampStore | None = None
    """Where signing times are kept across restarts."""
    planners: dict[str, PlannerInfo] = field(default_factory=dict)
    """Declarations of planners by name, as far as they are known."""
    planner_log: PlannerLog | None = None
    """What planner workers print. None: none of them are processes of this station."""
    link_store: LinkStore | None = None
    """Keeps changes of links for later starts. None: they end with the station."""
    folder: Path | None = None
    """Where downloads from vehicles and their caches are written. None: nothing is written."""
    rehearsals: Path | None = None
    """The file that lists the plans that were rehearsed. None: none was."""
    elevation: Elevation | None = None
    """The heights of the ground that vehicles are given when they ask. None: they are not answered."""
    operator_at: OperatorId | None = None
    """The operator's place from the command line (its other fields are unused); it overrides the scenario's place."""


@dataclass
class StationConditions:
    """What the process around a station reports to it, and counters that belong to no other part."""

    ending: bool = False
    """An operator has ended the station: the process leaves its loop."""
    orphaned: bool = False
    """The supervisor that would restart the station is gone."""
    memory_lost: str = ""
    """Why the state of the previous run is lost; "" if it is not."""
    memory_error: str = ""
    """Why the state of this run cannot be written; "" if it can."""
    connected: dict[str, float] = field(default_factory=dict)
    """Principals that are present on the bus, and since when."""
    dropped: Counter[str] = field(default_factory=Counter)
    """Bus messages that were received and not used, by reason."""


@dataclass(frozen=True)
class Records:
    """Time, the bus, and everything that is written down."""

    clock: Clock
    bus: Bus
    events: EventLog
    recorder: TlogWriter
    journal: Journal


@dataclass(frozen=True)
class AirPicture:
    """What the station knows of vehicles and their surroundings, and how far each report is trusted."""

    fleet: VehicleRegistry
    trust: SigningRegistry
    tracks: TargetTracker
    detections: DetectionDecoder
    wind: WindEstimator
    reboots: RebootStore
    jump_monitor: PositionJumpMonitor
    altitude_monitor: AltitudeMonitor


@dataclass(frozen=True)
class Communications:
    """Links, and everything that decides what leaves over them and when."""

    links: dict[str, Link]
    commands: CommandService
    uplink: Uplink
    forwarder: Forwarder
    reception: Reception
    command_encoder: CommandEncoder
    firmware: FirmwareRegistry
    rates: RateController
    time_responder: TimeResponder
    jobs: JobQueue


@dataclass(frozen=True)
class FlightParts:
    """What flies vehicles and keeps them apart: guard, phases, starts and stops, courses, manual control."""

    services: FlightServices
    """What every part below was built with."""
    guard: Guard
    flights: FlightTable
    steering: Steering
    executive: Executive
    manual_control: ManualController
    follow_control: FollowController
    monitor: FleetMonitor
    emergencies: EmergencyMonitor
    courses: CourseMonitor
    mission_separation: MissionSeparation
    battery_return: BatteryReturnController
    points: PointTable
