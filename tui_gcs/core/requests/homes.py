"""The home that a vehicle reports, as degrees and as the height from which its own heights count."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.station.assembly import StationParts


def home_deg(parts: StationParts, vehicle: Vehicle) -> tuple[float, float, float] | None:
    """Latitude and longitude in degrees, and height above mean sea level in metres; None before it was reported."""
    newest = parts.picture.fleet.newest(vehicle, c.HOME_POSITION)
    if newest is None:
        return None
    fields = newest.fields
    return fields["latitude"] / 1e7, fields["longitude"] / 1e7, fields["altitude"] / 1e3


def home_amsl_m(parts: StationParts, vehicle: Vehicle) -> float:
    """Height above mean sea level of the home that the vehicle reports, else the ground of the scenario's origin."""
    home = home_deg(parts, vehicle)
    return home[2] if home is not None else parts.active.scenario.origin.ground_amsl_m
