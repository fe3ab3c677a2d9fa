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
    """Id of the board: 32 hex digits."""


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


class Part:
    """One part of a simulated autopilot, with the parts of the platform as attributes of its own.

    It is made anew at every power-on, because `_streams` and `_state` are.
    """

    def __init__(self, platform: Platform) -> None:
        self._platform, self._spec, self._body, self._state = platform, platform.spec, platform.body, platform.state
        self._clock, self._outbox, self._tasks = platform.clock, platform.outbox, platform.tasks
        self._params, self._plans, self._streams = platform.params, platform.plans, platform.streams
        self._logs, self._files = platform.logs, platform.files
