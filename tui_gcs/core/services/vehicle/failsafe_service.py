"""Reads the parameters of vehicles that decide what each does by itself, on demand, and describes it.

Two dozen parameters at most are read by name; nothing else is downloaded. A PARAM_VALUE that is received later counts
instead of what was read.
"""

from collections.abc import Callable

from tui_gcs.core.firmware.failsafes import UNHEARD, FailsafeLine, Values, explain, wanted
from tui_gcs.core.firmware.lost_link_behaviour import lost_link_behaviour
from tui_gcs.core.firmware.own_limits import AskedMotion, OwnLimits, limit_names, limit_problems, own_limits
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.parameters.param_exchange import ParamReading
from tui_gcs.core.services.parameters.param_service import ParamService

_NO_EFFECT = ("NOTHING", "not known")
__all__ = ["FailsafeLine", "FailsafeService"]


class FailsafeService:
    """Keeps the failsafe parameters that were read of each vehicle."""

    def __init__(self, context: ServiceContext, params: ParamService) -> None:
        """Read through `params`. ArduPilot's failsafe watches one station: the one with this station's system id."""
        self._params = params
        self._fleet = context.fleet
        self._own_system = context.own_system
        self._values: dict[int, dict[str, float]] = {}
        context.forget_with(self.forget)

    def ask(self, vehicle_id: int, on_done: Callable[[], None] | None = None) -> None:
        """Read its failsafe parameters again; `on_done` is called when `report` has them, however many arrived."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        names = _names(vehicle) if vehicle is not None else ()

        def on_read(reading: ParamReading) -> None:
            # It may have been replaced while it was asked.
            if self._fleet.vehicles.get(vehicle_id) is vehicle:
                self._values[vehicle_id] = {n: float(p.value) for n, p in reading.values.items() if n in names}
            if on_done is not None:
                on_done()

        if names:
            self._params.read(vehicle_id, names, on_read)
        else:
            on_read(ParamReading(vehicle_id))

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

    def own_limits(self, vehicle_id: int, *, simulated: bool) -> OwnLimits:
        """What the vehicle flies at most by its own parameters, or as shipped while they were not read.

        For a vehicle that was never heard nothing is known.
        """
        vehicle = self._fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return OwnLimits()
        return own_limits(vehicle.autopilot, self._newest_values(vehicle), simulated=simulated)

    def limit_problems(self, vehicle: Vehicle, asked: AskedMotion) -> list[str]:
        """Why the vehicle's own limits keep it from flying that, by the parameters that were read of it."""
        return limit_problems(vehicle.autopilot, self._newest_values(vehicle), asked)

    def _newest_values(self, vehicle: Vehicle) -> Values:
        read = self._values.get(vehicle.id, {})
        known = self._params.table(vehicle.id).params
        return read | {name: float(known[name].value) for name in _names(vehicle) if name in known}

    def warnings(self, vehicle: Vehicle) -> tuple[FailsafeLine, ...]:
        """The lines that an operator has to accept before a start."""
        return tuple(line for line in self.report(vehicle) if line.warning)

    def forget(self, vehicle: Vehicle) -> None:
        """Forget a vehicle that rebooted or was replaced: its parameters may be different."""
        self._values.pop(vehicle.id, None)


def _names(vehicle: Vehicle) -> tuple[str, ...]:
    return (*wanted(vehicle), *limit_names(vehicle.autopilot))
