"""The take-off places of a scenario in degrees, and the autopilots of a fleet, as a simulator needs them."""

from typing import Literal

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.model import Scenario

AUTOPILOTS: dict[str, tuple[Literal["ardupilot", "px4"], ...]] = {
    "ardupilot": ("ardupilot",),
    "px4": ("px4",),
    "mixed": ("ardupilot", "px4"),
}
"""The autopilots of a simulated fleet by the value of `--autopilot`; vehicles take them in turns."""


def simulated_places(scenario: Scenario) -> list[tuple[int, float, float]]:
    """Return (system id, latitude, longitude) of one vehicle for each place that a team needs.

    Places that name no vehicle get the ids without a place of their own, then the lowest free ones, in file order.
    """
    frame = LocalFrame(scenario.origin)
    named = {place.vehicle for place in scenario.places if place.vehicle is not None}
    in_teams = [vehicle for team in scenario.teams for vehicle in team.vehicles if vehicle not in named]
    counted = sum(team.count for team in scenario.teams)
    taken = named | set(in_teams)
    free = [i for i in range(1, 255) if i not in taken][:counted]
    waiting = iter([*sorted(in_teams), *free])
    wanted = sum(len(team.vehicles) for team in scenario.teams) + counted
    places: list[tuple[int, float, float]] = []
    for place in scenario.places:
        system = place.vehicle if place.vehicle is not None else next(waiting, None)
        if system is not None and len(places) < wanted:
            lat_deg, lon_deg = frame.to_geodetic(*place.place_m)
            places.append((system, float(lat_deg), float(lon_deg)))
    return places
