"""Reads and changes the airframe of a vehicle on the ground. A change takes effect at the next boot."""

from collections.abc import Callable

from tui_gcs.core.firmware.airframes import AirframeParameters, airframe
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.parameters.param_change import ParamChange, if_armed
from tui_gcs.core.services.parameters.param_exchange import ParamReading
from tui_gcs.core.services.parameters.param_service import ParamService
from tui_gcs.core.services.parameters.param_values import Number


class AirframeService:
    """Reads and changes the airframes of vehicles."""

    def __init__(self, context: ServiceContext, params: ParamService) -> None:
        self._context = context
        self._params = params

    def parameters(self, vehicle_id: int) -> AirframeParameters | None:
        """The airframes that the vehicle can be given; None if they are not known."""
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        return airframe(vehicle) if vehicle is not None else None

    def read(self, vehicle_id: int, on_done: Callable[[ParamReading], None] | None = None) -> ParamReading | str:
        """Read the present airframe; returns why not, if it cannot be tried."""
        parameters = self.parameters(vehicle_id)
        if parameters is None:
            return "its airframe is not known"
        return self._params.read(vehicle_id, [field.param for field in parameters.fields], on_done)

    def choose(
        self, vehicle_id: int, values: dict[str, int], on_done: Callable[[ParamChange], None] | None = None
    ) -> ParamChange | str:
        """Change the airframe (parameter name -> number); returns why not, if it cannot be tried."""
        parameters, vehicle = self.parameters(vehicle_id), self._context.fleet.vehicles.get(vehicle_id)
        if parameters is None or vehicle is None:
            return "its airframe is not known"
        fields = {field.param: field for field in parameters.fields}
        if not values or not set(values) <= set(fields):
            return f"to be chosen: {', '.join(fields)}"
        bad = [name for name, value in values.items() if not fields[name].least <= value <= fields[name].most]
        if bad:
            return f"{bad[0]} is {fields[bad[0]].least} to {fields[bad[0]].most}"
        if why := if_armed(vehicle):
            return why
        wanted: dict[str, Number] = {name: values[name] for name in fields if name in values}
        wanted.update(parameters.then)

        def done(change: ParamChange) -> None:
            text = (
                f"airframe NOT changed: {change.error}" if change.error else f"airframe changed: {parameters.warning}"
            )
            severity = WARNING if change.error else NOTICE
            self._context.events.report(EventClass.SENSOR, f"vehicle {vehicle_id}", text, severity)
            if on_done is not None:
                on_done(change)

        return ParamChange(vehicle_id, wanted, on_done=done, forbidden=if_armed).run(self._params)
