"""Where vehicles stand before take-off, in degrees: what a simulator needs to know of a scenario."""

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.model import Scenario


def simulated_places(scenario: Scenario) -> list[tuple[int, float, float]]:
    """(system id, latitude, longitude) of one vehicle per place that a team needs.

    Ids are the scenario's where it names them; the others get the lowest free ones, in order of place.
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
