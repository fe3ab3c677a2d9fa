"""Reads the failsafe parameters of vehicles on demand, and describes what each vehicle does by itself.

About a dozen parameters are read by name; nothing else is downloaded. A PARAM_VALUE that is received later counts
instead of what was read.
"""

from collections.abc import Callable, Sequence

from tui_gcs.core.firmware.failsafes import UNHEARD, FailsafeLine, Values, explain, wanted
from tui_gcs.core.firmware.lost_link_behaviour import lost_link_behaviour
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.services.parameters.param_service import ParamService

_NO_EFFECT = ("NOTHING", "not known")
OnRead = Callable[[dict[str, float]], None]
Read = Callable[[int, Sequence[str], OnRead], None]
"""Called with (vehicle id, names, on_done): on_done gets the values of those names that the vehicle reported."""

__all__ = ["FailsafeLine", "FailsafeService", "newest_value_of", "parameter_reader"]


NewestValue = Callable[[int, str], float | None]
"""Called with (vehicle id, name): returns the newest value that the vehicle reported, or None."""


def newest_value_of(params: ParamService) -> NewestValue:
    """Return a `NewestValue` that looks into the parameter service's tables."""

    def newest(vehicle: int, name: str) -> float | None:
        param = params.table(vehicle).params.get(name)
        return float(param.value) if param is not None else None

    return newest


def parameter_reader(params: ParamService) -> Read:
    """Return a `Read` that reads through the parameter service."""

    def read(vehicle: int, names: Sequence[str], on_done: OnRead) -> None:
        params.read(
            vehicle,
            names,
            lambda reading: on_done({name: float(param.value) for name, param in reading.values.items()}),
        )

    return read


class FailsafeService:
    """Keeps the failsafe parameters that were read of each vehicle."""

    def __init__(
        self, fleet: VehicleRegistry, read: Read, own_system: int, newest: NewestValue = lambda vehicle, name: None
    ) -> None:
        """Use `read` and `newest` of the parameter service. ArduPilot's failsafe watches the station `own_system`."""
        self._newest = newest
        self._fleet = fleet
        self._read = read
        self._own_system = own_system
        self._values: dict[int, dict[str, float]] = {}
        fleet.on_gone(self.forget)
        fleet.paths.on_reboot.append(self.forget)
        fleet.paths.on_replace.append(self.forget)

    def ask(self, vehicle_id: int, on_done: Callable[[], None] | None = None) -> None:
        """Read its failsafe parameters again; `on_done` is called when `report` has them, however many arrived."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        names = wanted(vehicle) if vehicle is not None else ()

        def on_read(values: dict[str, float]) -> None:
            # It may have been replaced while it was asked.
            if self._fleet.vehicles.get(vehicle_id) is vehicle:
                self._values[vehicle_id] = {name: value for name, value in values.items() if name in names}
            if on_done is not None:
                on_done()

        if names:
            self._read(vehicle_id, names, on_read)
        else:
            on_read({})

    def known(self, vehicle: Vehicle) -> bool:
        """Whether they were read since the vehicle booted."""
        return vehicle.id in self._values

    def report(self, vehicle: Vehicle) -> tuple[FailsafeLine, ...]:
        """What the vehicle does when something is lost. Every line is a warning until the parameters were read."""
        return explain(vehicle, self._newest_values(vehicle), self._own_system)

    def lost_link_text(self, vehicle: Vehicle) -> str:
        """What the vehicle does some time after it last received a station; "" if nothing, or not read yet."""
        lines = self.report(vehicle) if self.known(vehicle) else ()
        does = next((line.does for line in lines if line.when in UNHEARD), "")
        return "" if does.startswith(_NO_EFFECT) else does

    def lost_link_behaviour(self, vehicle: Vehicle, home_m: Vec3) -> LostLinkBehaviour | None:
        """The same as a motion model's input: what the vehicle does when it receives no station."""
        return lost_link_behaviour(vehicle, self._newest_values(vehicle), home_m)

    def _newest_values(self, vehicle: Vehicle) -> Values:
        read = self._values.get(vehicle.id, {})
        reported = {name: self._newest(vehicle.id, name) for name in wanted(vehicle)}
        return read | {name: value for name, value in reported.items() if value is not None}

    def warnings(self, vehicle: Vehicle) -> tuple[FailsafeLine, ...]:
        """The lines that an operator has to accept before a start."""
        return tuple(line for line in self.report(vehicle) if line.warning)

    def forget(self, vehicle: Vehicle) -> None:
        """Forget a vehicle that rebooted or was replaced: its parameters may be different."""
        self._values.pop(vehicle.id, None)
