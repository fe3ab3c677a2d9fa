"""What the parts of a simulated autopilot are built on."""

from dataclasses import dataclass

from sitl.common.files import FileTree
from sitl.common.flight_state import FlightState
from sitl.common.logs import Logs
from sitl.common.missions import Plans
from sitl.common.outbox import Outbox, VehicleClock
from sitl.common.parameters import ParameterTable
from sitl.common.streams import Streams
from sitl.common.tasks import Tasks
from sitl.common.vehicle_spec import VehicleSpec
from sitl.physics.point_masses import Body


@dataclass
class Identity:
    """How a board identifies itself in AUTOPILOT_VERSION."""

    token: bytes
    """The run's token (8 bytes), reported as flight_custom_version."""
    uid: str
    """32 hex digits."""


@dataclass(frozen=True)
class Platform:
    """The parts that every autopilot has, one subject each.

    `streams` and `state` are new after every power-on; all others outlive it.
    """

    spec: VehicleSpec
    identity: Identity
    body: Body
    clock: VehicleClock
    outbox: Outbox
    tasks: Tasks
    params: ParameterTable
    plans: Plans
    logs: Logs
    files: FileTree
    """Files that the vehicle serves by MAVFTP; the server fills it with its first request."""
    streams: Streams
    state: FlightState
