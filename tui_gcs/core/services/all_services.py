"""All MAVLink services of a station: created, connected and ticked in one place."""

from collections import Counter

from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.files.ftp import FtpService
from tui_gcs.core.services.files.logs import LogService
from tui_gcs.core.services.parameters.param_service import ParamService
from tui_gcs.core.services.payload.payload import PayloadService
from tui_gcs.core.services.payload.remote_id import RemoteIdService
from tui_gcs.core.services.payload.traffic import TrafficService
from tui_gcs.core.services.plans.mission_service import MissionService
from tui_gcs.core.services.setup.airframe import AirframeService
from tui_gcs.core.services.setup.calibration import CalibrationService
from tui_gcs.core.services.setup.motor_test import MotorTestService
from tui_gcs.core.services.setup.rc_calibration import RcCalibrationService
from tui_gcs.core.services.setup.tuning import TuningService
from tui_gcs.core.services.terrain import TerrainService
from tui_gcs.core.services.timesync import LinkTimingService
from tui_gcs.core.services.vehicle.component_metadata import MetadataService
from tui_gcs.core.services.vehicle.failsafe_service import FailsafeService
from tui_gcs.core.services.vehicle.health_service import HealthService
from tui_gcs.core.services.vehicle.mode_service import ModeService
from tui_gcs.core.services.vehicle.operator_control import ControlService
from tui_gcs.core.services.vehicle.shell_service import ShellService
from tui_gcs.core.services.vehicle.vehicle_events import VehicleEvents


class Services:
    """One instance of each service."""

    def __init__(self, context: ServiceContext, elevation: Elevation | None = None) -> None:
        """Create all services; they receive messages from now on. `elevation` answers vehicles that ask for heights."""
        self.context = context
        self.control = ControlService(context)
        self.ftp = FtpService(context)
        self.logs = LogService(context)
        self.metadata = MetadataService(context, self.ftp)
        self.params = ParamService(context, self.ftp, self.metadata)
        self.missions = MissionService(context)
        self.modes = ModeService(context)
        self.vehicle_events = VehicleEvents(context, self.metadata)
        self.remote_id = RemoteIdService(context)
        self.failsafes = FailsafeService(context, self.params)
        self.health = HealthService(context.fleet, self.vehicle_events, self.remote_id, context.clock)
        self.link_timing = LinkTimingService(context)
        context.commands.ack_matcher.round_trips = self.link_timing.round_trips
        self.payload = PayloadService(context)
        self.shell = ShellService(context)
        self.terrain = TerrainService(context, elevation)
        self.traffic = TrafficService(context)
        self.calibrations = CalibrationService(context)
        self.rc_calibrations = RcCalibrationService(context, self.params)
        self.airframes = AirframeService(context, self.params)
        self.tuning = TuningService(context, self.params)
        self.motor_tests = MotorTestService(context)

    def tick(self) -> None:
        """Do what is due in the services. Jobs are ticked by the job queue."""
        self.missions.tick()
        self.params.tick()
        self.vehicle_events.tick()
        self.link_timing.tick()
        self.shell.tick()
        self.terrain.tick()

    def ignored(self) -> Counter[str]:
        """Messages of vehicles that no service could use, counted by reason."""
        counters = (getattr(service, "ignored", None) for service in vars(self).values())
        return sum((counter for counter in counters if isinstance(counter, Counter)), Counter())
