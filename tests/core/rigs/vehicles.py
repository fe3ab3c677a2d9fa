"""Vehicles for unit tests, as the fleet would have made them."""

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
        records = (vehicle, vehicle.identity, vehicle.telemetry, vehicle.integrity)
        setattr(next(record for record in records if hasattr(record, name)), name, value)
