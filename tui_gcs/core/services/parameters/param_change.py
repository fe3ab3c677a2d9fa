"""Changes several parameters of one vehicle in order, and keeps their former values.

A change that fails stops there; `changed` and `error` say what was done, and `undo` takes it back. Each value is
checked against the range that the vehicle reports, but for those that it held before.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.parameters.param_exchange import ParamReading, ParamSetting
from tui_gcs.core.services.parameters.param_service import ParamService
from tui_gcs.core.services.parameters.param_values import Number


@dataclass
class ParamChange:
    """Reads all parameters, then sets one after the other; stops at the first that the vehicle does not take."""

    vehicle: int
    wanted: dict[str, Number]
    """The new values, in the order in which they are set."""
    optional: frozenset[str] = frozenset()
    """The names that the vehicle may lack: they are skipped then."""
    on_done: "Callable[[ParamChange], None] | None" = None
    before: dict[str, Number] = field(default_factory=dict)
    """The former values of the parameters that the vehicle has."""
    changed: list[str] = field(default_factory=list)
    """The names that were set and confirmed, in order. A parameter that had its value already is not set."""
    unchecked: str = ""
    """Why the ranges of the values are not known; "" if they were checked."""
    forbidden: Callable[[Vehicle], str] = lambda vehicle: ""
    """Returns why the vehicle must not be changed now, or ""; asked before each value."""
    restores: bool = False
    """The values are those that the vehicle held before: they may be outside of the ranges in its description."""
    error: str = ""
    over: bool = False

    def run(self, params: ParamService) -> "ParamChange":
        """Begin to read and set; `on_done` is called at the end."""
        if self.wanted:
            params.read(self.vehicle, self.wanted, lambda reading: self._on_read(params, reading))
        else:
            self._end("")
        return self

    def undo(self, params: ParamService, on_done: "Callable[[ParamChange], None] | None" = None) -> "ParamChange":
        """Set the changed parameters back, newest first, as a change of its own."""
        back = {name: self.before[name] for name in reversed(self.changed)}
        return ParamChange(self.vehicle, back, on_done=on_done, forbidden=self.forbidden, restores=True).run(params)

    def _on_read(self, params: ParamService, reading: ParamReading) -> None:
        self.before = {name: param.value for name, param in reading.values.items()}
        missing = [name for name in self.wanted if name in reading.missing and name not in self.optional]
        if missing:
            self._end(f"{missing[0]}: {reading.missing[missing[0]]}")
        else:
            self._next(params)

    def _next(self, params: ParamService) -> None:
        # A parameter that is missing (`optional`), or has its value already, is skipped.
        name = next((n for n, v in self.wanted.items() if n not in self.changed and self.before.get(n, v) != v), None)
        if name is None:
            self._end("")
            return

        def on_set(setting: ParamSetting) -> None:
            self.unchecked = self.unchecked or setting.unchecked
            if setting.error:
                self._end(f"{name} was not set: {setting.error}")
            else:
                self.changed.append(name)
                self._next(params)

        params.set(self.vehicle, name, self.wanted[name], on_set, beyond_range=self.restores, forbidden=self.forbidden)

    def _end(self, error: str) -> None:
        self.error, self.over = error, True
        if self.on_done is not None:
            self.on_done(self)


def if_armed(vehicle: Vehicle) -> str:
    """Why an armed vehicle must not be changed, or ""."""
    return "it is armed" if vehicle.telemetry.armed else ""
