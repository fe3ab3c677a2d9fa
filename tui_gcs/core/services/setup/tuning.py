"""Gains: read by group on demand, set one at a time by a bounded step, with every former value kept.

A gain may be set in flight: that is what tuning is. So a step is at most a factor of two, unless forced, and the former
value is one key away (`undo`).
"""

import math
from collections.abc import Callable

from tui_gcs.core.firmware.gains import GainGroup, gain_groups
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.parameters.param_change import ParamChange
from tui_gcs.core.services.parameters.param_exchange import ParamReading, ParamSetting
from tui_gcs.core.services.parameters.param_service import ParamService
from tui_gcs.core.services.parameters.param_values import Number

MAX_STEP = 2.0
"""The largest factor of one step, up or down."""
FORCE = ": force it if you mean it"
"""The end of a refusal that `force` overrides."""
MAX_KEPT = 50
"""How many former values of one gain are kept."""

SetDone = Callable[[ParamSetting], None]


class TuningService:
    """Reads and sets the gains of all vehicles, and keeps their former values."""

    def __init__(self, context: ServiceContext, params: ParamService) -> None:
        self._context = context
        self._params = params
        self._before: dict[int, dict[str, list[Number]]] = {}
        """Former values by vehicle and name, oldest first."""
        self._readings: list[tuple[ParamReading, GainGroup]] = []
        context.fleet.on_message("PARAM_VALUE", self._on_value)
        context.forget_with(self._forget, reboot=False)

    def groups(self, vehicle_id: int) -> tuple[GainGroup, ...]:
        """The groups of gains of a vehicle."""
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        return gain_groups(vehicle) if vehicle is not None else ()

    def read(
        self, vehicle_id: int, group: str, on_done: Callable[[ParamReading], None] | None = None
    ) -> ParamReading | str:
        """Read the values of a group; what the vehicle does not have is in `missing`."""
        wanted = next((g for g in self.groups(vehicle_id) if g.name == group), None)
        if wanted is None:
            return f"no such group of gains: {group}"
        reading = self._params.read(vehicle_id, wanted.names, on_done)
        self._readings = [(r, g) for r, g in self._readings if not r.over]
        self._readings.append((reading, wanted))
        return reading

    def former(self, vehicle_id: int) -> dict[str, tuple[Number, ...]]:
        """The former values of changed gains by name, oldest first."""
        return {name: tuple(values) for name, values in self._before.get(vehicle_id, {}).items() if values}

    def set(
        self,
        vehicle_id: int,
        name: str,
        value: Number,
        on_done: SetDone | None = None,
        *,
        force: bool = False,
        beyond_range: bool = False,
    ) -> str:
        """Set one gain; returns "" or why that is not even tried.

        `force` allows a greater step, `beyond_range` a value outside of the range in the vehicle's description. Its
        present value must have been read: the step is measured by it, and `undo` goes back to it.
        """
        known = self._params.table(vehicle_id).params.get(name)
        if not any(name in group.names for group in self.groups(vehicle_id)):
            return "not one of its gains"
        if known is None:
            return "read it first"
        why = "" if force else _too_far(known.value, value)
        if why:
            return why
        before = known.value

        def took(setting: ParamSetting) -> None:
            if not setting.error:
                kept = self._before.setdefault(vehicle_id, {}).setdefault(name, [])
                kept.append(before)
                del kept[1:-MAX_KEPT]
            if on_done is not None:
                on_done(setting)

        self._params.set(vehicle_id, name, value, took, beyond_range=beyond_range)
        return ""

    def undo(self, vehicle_id: int, name: str, on_done: SetDone | None = None) -> str:
        """Undo the last change of one gain; returns "" or why not."""
        kept = self._before.get(vehicle_id, {}).get(name)
        if not kept:
            return "it was not changed"

        def took(setting: ParamSetting) -> None:
            if not setting.error and kept:
                kept.pop()
            if on_done is not None:
                on_done(setting)

        # It flew with that value: no range is fetched before an oscillating vehicle gets it back.
        self._params.set(vehicle_id, name, kept[-1], took, beyond_range=True)
        return ""

    def undo_all(self, vehicle_id: int, on_done: Callable[[ParamChange], None] | None = None) -> ParamChange | str:
        """Set every gain back to its value before the first change."""
        former = self._before.get(vehicle_id, {})
        first = {name: values[0] for name, values in former.items() if values}
        if not first:
            return "nothing was changed"

        def took(change: ParamChange) -> None:
            for name in first:
                if not change.error or name in change.changed:
                    former.pop(name, None)
            if on_done is not None:
                on_done(change)

        return ParamChange(vehicle_id, first, on_done=took, restores=True).run(self._params)

    def _on_value(self, vehicle: Vehicle, fields: Fields) -> None:
        """Stop waiting for the other names of a gain that has arrived."""
        # Gains have different names in different versions, and autopilots do not answer to a name they do not have.
        for reading, group in self._readings:
            if reading.vehicle == vehicle.id and any(fields["param_id"] in names for names in group.either):
                others = (names for names in group.either if fields["param_id"] not in names)
                for name in (name for names in others for name in names):
                    reading.miss(name, "this version names it otherwise")

    def _forget(self, vehicle: Vehicle) -> None:
        self._before.pop(vehicle.id, None)


def _too_far(before: Number, after: Number) -> str:
    """Return why that step is too great, or ""."""
    if not math.isfinite(after):
        return "must be a number"
    if after == before:
        return ""
    # A factor makes no sense across zero: switching a gain off, or turning it round, must be forced.
    if before == 0 or after == 0 or (before < 0) != (after < 0):
        return f"from {before:g} to {after:g} is no step by a factor{FORCE}"
    factor = after / before
    if max(factor, 1 / factor) > MAX_STEP * (1 + 1e-6):
        return f"{factor:.3g} times what it is: more than a factor of {MAX_STEP:g}{FORCE}"
    return ""
