"""Parameters that checks read and change. What is changed is noted before, and given back after, in any case."""

import math
from collections.abc import Mapping, Sequence

from tests.conformance.field import Failed, Field, NotApplicable
from tui_gcs.core.services.parameters.param_values import Number

READ_S, SET_S = 20.0, 20.0
ALL_OF_THEM = 300
"""Known parameters: then all were fetched, and what is not among them is not there."""


def have(field: Field, vehicle: int, names: Sequence[str]) -> dict[str, float]:
    """Values of those of these parameters that the vehicle has. Some autopilots say nothing to a name they lack."""
    table = field.station.services.params.table(vehicle).params
    if len(table) >= ALL_OF_THEM:
        names = [name for name in names if name in table]
    reading = field.station.services.params.read(vehicle, names)
    field.until(lambda: reading.over, READ_S + 1.0 * len(names), f"parameters {', '.join(names)}")
    return {name: float(param.value) for name, param in reading.values.items()}


def read(field: Field, vehicle: int, name: str) -> float:
    """One parameter that it must have.

    Raises:
        Failed: It does not tell it.
    """
    reading = field.station.services.params.read(vehicle, [name])
    field.until(lambda: reading.over, READ_S, f"parameter {name}")
    if name not in reading.values:
        raise Failed(f"{name}: {reading.missing.get(name)}")
    return float(reading.values[name].value)


def put(field: Field, vehicle: int, name: str, value: Number) -> None:
    """Set one, beyond its documented range, too: some failsafes are provoked only so.

    Raises:
        Failed: It does not take it.
    """
    setting = field.station.services.params.set(vehicle, name, value, beyond_range=True)
    field.until(lambda: setting.over, SET_S, f"setting {name}")
    if setting.error:
        raise Failed(f"{name} = {value:g}: {setting.error}")


def borrow(field: Field, vehicle: int, values: Mapping[str, float]) -> None:
    """Set parameters for the rest of this check.

    Raises:
        NotApplicable: It does not have them all.
    """
    held = have(field, vehicle, list(values))
    missing = [name for name in values if name not in held]
    if missing:
        raise NotApplicable(f"it has no {', '.join(missing)}")
    for name, value in values.items():
        field.borrowed.setdefault((vehicle, name), held[name])
        if not math.isclose(held[name], value, rel_tol=1e-6):
            put(field, vehicle, name, value)


def give_back(field: Field, vehicle: int) -> list[str]:
    """Put back what was borrowed, newest first; what could not be put back is said, and tried again next time."""
    left = []
    for system, name in reversed([key for key in field.borrowed if key[0] == vehicle]):
        value = field.borrowed[(system, name)]
        try:
            put(field, vehicle, name, value)
        except Failed as failed:
            left.append(f"NOT PUT BACK: {name} was {value:g} ({failed})")
        else:
            del field.borrowed[(system, name)]
    return left
