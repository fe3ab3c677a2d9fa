"""Failsafes on demand: the parameters that say what a vehicle does by itself are read, and told in words.

Read by name, a dozen small questions; nothing is downloaded. What somebody changes later is heard as PARAM_VALUE, and
counts instead of what was read.
"""

from collections.abc import Callable, Sequence

from tui_gcs.core.firmware.failsafes import UNHEARD, FailsafeLine, Values, explain, wanted
from tui_gcs.core.firmware.lost_link_behaviour import lost_link_behaviour
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.services.parameters.param_service import ParamService

_NO_WORDS = ("NOTHING", "not known")
OnRead = Callable[[dict[str, float]], None]
Read = Callable[[int, Sequence[str], OnRead], None]
"""(vehicle id, names, on_done): on_done gets the values of those names that the vehicle told."""

__all__ = ["FailsafeLine", "FailsafeService", "listener", "reader"]


Heard = Callable[[int, str], float | None]
"""(vehicle id, name): the newest value that it told of a parameter, None if it told none."""


def listener(params: ParamService) -> Heard:
    """What the parameter service knows as that."""

    def heard(vehicle: int, name: str) -> float | None:
        param = params.table(vehicle).params.get(name)
        return float(param.value) if param is not None else None

    return heard


def reader(params: ParamService) -> Read:
    """The parameter service as that."""

    def read(vehicle: int, names: Sequence[str], on_done: OnRead) -> None:
        params.read(
            vehicle,
            names,
            lambda reading: on_done({name: float(param.value) for name, param in reading.values.items()}),
        )

    return read


class FailsafeService:
    """Knows what was read of each vehicle."""

    def __init__(
        self, fleet: VehicleRegistry, read: Read, own_system: int, heard: Heard = lambda vehicle, name: None
    ) -> None:
        """`read` and `heard` are the parameter service's; `own_system` is who ArduPilot has to listen for."""
        self._heard = heard
        self._fleet = fleet
        self._read = read
        self._own_system = own_system
        self._values: dict[int, dict[str, float]] = {}
        fleet.on_gone(self.forget)
        fleet.paths.on_reboot.append(self.forget)
        fleet.paths.on_replace.append(self.forget)

    def ask(self, vehicle_id: int, on_done: Callable[[], None] | None = None) -> None:
        """Read its failsafe parameters (again); `on_done` is called when `report` has them, however many came."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        names = wanted(vehicle) if vehicle is not None else ()

        def took(values: dict[str, float]) -> None:
            if self._fleet.vehicles.get(vehicle_id) is vehicle:
                self._values[vehicle_id] = {name: value for name, value in values.items() if name in names}
            if on_done is not None:
                on_done()

        if names:
            self._read(vehicle_id, names, took)
        else:
            took({})

    def known(self, vehicle: Vehicle) -> bool:
        """Whether they were read since it booted."""
        return vehicle.id in self._values

    def report(self, vehicle: Vehicle) -> tuple[FailsafeLine, ...]:
        """What it does when something is lost; all of it is a warning until it was read."""
        return explain(vehicle, self._told(vehicle), self._own_system)

    def unheard(self, vehicle: Vehicle) -> str:
        """What it does some time after it last heard a station; "" if nothing, or not read yet."""
        lines = self.report(vehicle) if self.known(vehicle) else ()
        does = next((line.does for line in lines if line.when in UNHEARD), "")
        return "" if does.startswith(_NO_WORDS) else does

    def lost_link_behaviour(self, vehicle: Vehicle, home_m: Vec3) -> LostLinkBehaviour | None:
        """The same in numbers, of what it does when it hears nothing."""
        return lost_link_behaviour(vehicle, self._told(vehicle), home_m)

    def _told(self, vehicle: Vehicle) -> Values:
        read = self._values.get(vehicle.id, {})
        told = {name: self._heard(vehicle.id, name) for name in wanted(vehicle)}
        return read | {name: value for name, value in told.items() if value is not None}

    def warnings(self, vehicle: Vehicle) -> tuple[FailsafeLine, ...]:
        """What an operator has to accept before a start."""
        return tuple(line for line in self.report(vehicle) if line.warning)

    def forget(self, vehicle: Vehicle) -> None:
        """It rebooted or is another one: its parameters may be others."""
        self._values.pop(vehicle.id, None)
