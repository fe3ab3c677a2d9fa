"""Vehicles for unit tests, as the fleet would have made them."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tui_gcs.core.fleet.identity.path import Path, PathState
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.sources import Source


def a_vehicle(system: int = 1, link: str = "memory", **telemetry: Any) -> Vehicle:
    """An ArduCopter quadrotor, heard over one path."""
    path = Path(Source("", link, ("sim", system)), PathState.USED, 0.0)
    vehicle = Vehicle(system, system, "", path, 3, 2, paths=[path])
    set_fields(vehicle, **telemetry)
    return vehicle


def set_fields(vehicle: Vehicle, **fields: Any) -> None:
    """Set fields of the vehicle or of whichever of its records has them."""
    for name, value in fields.items():
        setattr(_record_with(vehicle, name), name, value)


@contextmanager
def with_fields(vehicle: Vehicle, **fields: Any) -> Iterator[None]:
    """Set such fields for a while."""
    before = {name: getattr(_record_with(vehicle, name), name) for name in fields}
    set_fields(vehicle, **fields)
    yield
    set_fields(vehicle, **before)


def _record_with(vehicle: Vehicle, name: str) -> object:
    records = (vehicle, vehicle.identity, vehicle.telemetry, vehicle.integrity)
    return next(record for record in records if hasattr(record, name))
