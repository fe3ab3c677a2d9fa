"""Which `Firmware` commands which vehicle."""

from collections.abc import Iterable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.ardupilot import COPTER_TYPES, ArduCopter
from tui_gcs.core.firmware.base import UNKNOWN_OFF_COURSE_M, Firmware
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.firmware.home_requests import HomeRequests
from tui_gcs.core.firmware.px4 import Px4Multicopter
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4, autopilot_name
from tui_gcs.core.motion.target_place import HomeHeight, TargetPlace, home_height
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.uplink.commands import CommandService


def off_course_m(autopilot: int) -> float:
    """`Firmware.off_course_m` of multicopters with this autopilot (MAV_AUTOPILOT)."""
    known: dict[int, float] = {
        AUTOPILOT_ARDUPILOT: ArduCopter.off_course_m,
        AUTOPILOT_PX4: Px4Multicopter.off_course_m,
    }
    return known.get(autopilot, UNKNOWN_OFF_COURSE_M)


class FirmwareRegistry:
    """Holds one firmware of each kind; a vehicle's kind is known from its heartbeat."""

    def __init__(
        self,
        command_encoder: CommandEncoder,
        fleet: VehicleRegistry,
        commands: CommandService,
        clock: Clock,
        events: EventLog,
    ) -> None:
        """Subscribes to the parameters that `fleet` receives."""
        self._fleet = fleet
        self._encoder = command_encoder
        self._ardupilot = ArduCopter(command_encoder, commands)
        self._px4 = Px4Multicopter(command_encoder, commands, clock, events)
        self._unsupported = Firmware()
        self._homes = HomeRequests(command_encoder, commands, clock)
        self._kinds: dict[tuple[int, int], Firmware] = {
            (autopilot, kind): firmware
            for autopilot, firmware in ((AUTOPILOT_ARDUPILOT, self._ardupilot), (AUTOPILOT_PX4, self._px4))
            for kind in COPTER_TYPES
        }
        fleet.on_message("PARAM_VALUE", self._on_parameter)

    def of(self, vehicle: Vehicle) -> Firmware:
        """The firmware that commands `vehicle`."""
        return self._kinds.get((vehicle.autopilot, vehicle.type), self._unsupported)

    def off_course_m(self, vehicles: Iterable[int]) -> float:
        """How far beside a moving course the worst of these vehicles may be; the worst kind's for one never heard."""
        heard = self._fleet.vehicles
        strays = [self.of(heard[v]).off_course_m if v in heard else UNKNOWN_OFF_COURSE_M for v in vehicles]
        return max(strays, default=UNKNOWN_OFF_COURSE_M)

    def home(self, vehicle: Vehicle) -> HomeHeight:
        """The height of the vehicle's home above mean sea level, or why it is not known."""
        return home_height(vehicle)

    def point_m(self, vehicle: Vehicle, place: TargetPlace) -> Vec3:
        """The point, in ENU metres with z above the vehicle's home, to which `go_to` and its like fly `vehicle`.

        Raises:
            PlaceError: its height is above sea level, and the height of the vehicle's home is not known.
        """
        return place.point_m(self._encoder.frame, self.home(vehicle))

    def tick(self) -> None:
        """Let every firmware do what is due for its vehicles."""
        flown: dict[Firmware, list[Vehicle]] = {}
        for vehicle in self._fleet.vehicles.values():
            self._homes.tick(vehicle)
            flown.setdefault(self.of(vehicle), []).append(vehicle)
        for firmware, vehicles in flown.items():
            firmware.tick(vehicles)

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle rebooted, or is another one now, perhaps of another kind."""
        self._homes.forget(vehicle)
        self._px4.forget(vehicle)
        self._ardupilot.release(vehicle)

    def _on_parameter(self, vehicle: Vehicle, fields: dict[str, object]) -> None:
        if self.of(vehicle) is self._px4:
            self._px4.hear_parameter(vehicle, fields)


def name_of(vehicle: Vehicle) -> str:
    """The name of what flies it, e.g. "ArduCopter", "PX4", "ArduPilot" (of another vehicle type)."""
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT and vehicle.type in COPTER_TYPES:
        return ArduCopter.name
    return autopilot_name(vehicle.autopilot)
