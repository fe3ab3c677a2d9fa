"""Orders to one vehicle as its own firmware words them, for tests that need any order at all."""

from typing import Any

from tui_gcs.core.uplink.actions import VehicleAction


def land(flight: Any, vehicle: int) -> VehicleAction:
    """Land where it is: stop class."""
    one = flight.station.picture.fleet.vehicles[vehicle]
    return flight.station.comms.firmware.of(one).land(one)


def speed(flight: Any, vehicle: int, speed_m_s: float) -> VehicleAction:
    """Limit its speed: set class, confirmed by its ACK."""
    one = flight.station.picture.fleet.vehicles[vehicle]
    return flight.station.comms.firmware.of(one).change_speed(one, speed_m_s)


def prepare(flight: Any, vehicle: int) -> VehicleAction:
    """The mode it is armed in: set class, confirmed by its heartbeat."""
    one = flight.station.picture.fleet.vehicles[vehicle]
    return flight.station.comms.firmware.of(one).prepare(one, None)
