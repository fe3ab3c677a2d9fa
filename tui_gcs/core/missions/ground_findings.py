"""Findings about a scenario over real ground: layers that come too near to it, a wrong height of the origin.

A scenario's heights are above one level, `ground_amsl_m` of its origin. Over hills a layer is lower above the ground
than its number suggests; the lowest altitude of the operating area is taken for what the ground must keep clear.
"""

import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.missions.scenario_findings import ScenarioFinding
from tui_gcs.core.scenario.model import Round, Scenario

SPACING_M = 20.0
"""The ground is looked at in a square grid of this spacing; the finest SRTM tiles have 30 m."""
MAX_SIDE = 300
"""Points along one side of the operating area's box: larger areas are looked at more coarsely."""
ORIGIN_OFF_M = 10.0
"""The terrain file and a scenario's origin may differ by this: SRTM heights are off by up to 10 m."""


def ground_findings(scenario: Scenario, elevation: Elevation) -> list[tuple[str, ScenarioFinding]]:
    """Return (round, finding) about the ground below every round, as `elevation` describes it."""
    origin = scenario.origin
    found = [(scenario.name, each) for each in _origin_findings(origin, elevation)]
    for round_ in scenario.rounds:
        found += [(round_.name, each) for each in _round_findings(scenario, round_, elevation)]
    return found


def _origin_findings(origin: Origin, elevation: Elevation) -> list[ScenarioFinding]:
    ground_m = elevation.place_amsl_m(origin.lat_deg, origin.lon_deg)
    if ground_m is None or abs(ground_m - origin.ground_amsl_m) <= ORIGIN_OFF_M:
        return []
    says = f"ground_amsl_m of the origin is {origin.ground_amsl_m:g}"
    return [
        ScenarioFinding(FindingLevel.CAUTION, f"{says}, the ground there is at {ground_m:.0f} m in {elevation.name}")
    ]


def _round_findings(scenario: Scenario, round_: Round, elevation: Elevation) -> list[ScenarioFinding]:
    frame = LocalFrame(scenario.origin)
    places_m = _grid_in(polygon_of(round_.area.shape))
    lat_deg, lon_deg = frame.to_geodetic(places_m[:, 0], places_m[:, 1])
    # Against the ground at the origin: layers are flown above home, and an offset of the whole file is no hill.
    level_m = elevation.place_amsl_m(scenario.origin.lat_deg, scenario.origin.lon_deg)
    ground_m = elevation.amsl_m(lat_deg, lon_deg) - (scenario.origin.ground_amsl_m if level_m is None else level_m)
    unknown = float(np.isnan(ground_m).mean())
    found = []
    if unknown > 0.0:
        text = f"the ground is unknown in {max(unknown, 0.01):.0%} of the operating area"
        found.append(ScenarioFinding(FindingLevel.CAUTION, text, f"{elevation.name} does not reach there"))
    if unknown == 1.0 or not scenario.places:
        return found
    top = int(np.nanargmax(ground_m))
    lowest_m = min(place.layer_m for place in scenario.places)
    clear_m = lowest_m - float(ground_m[top])
    where = f"at {lat_deg[top]:.5f}, {lon_deg[top]:.5f}"
    needed_m = round_.area.alt_min_m
    if clear_m >= needed_m:
        text = f"ok: the lowest layer passes {clear_m:.0f} m or more above the ground"
        return [*found, ScenarioFinding(FindingLevel.NOTE, text, f"least {where}", is_ok=True)]
    low = [place.vehicle for place in scenario.places if place.layer_m - float(ground_m[top]) < needed_m]
    how = f"{clear_m:.0f} m above the ground" if clear_m > 0 else f"{-clear_m:.0f} m below the ground"
    text = f"the layer of {lowest_m:g} m is {how} {where}: {needed_m:g} m are the least here"
    many = f"{len(low)} of {len(scenario.places)} vehicles fly too low there"
    return [*found, ScenarioFinding(FindingLevel.CAUTION, text, many)]


def _grid_in(area: shapely.Polygon) -> NDArray[np.float64]:
    """Return places (n, 2) of a square grid in the area, and the corners of its border, in ENU metres."""
    west, south, east, north = area.bounds
    spacing_m = max(SPACING_M, (east - west) / MAX_SIDE, (north - south) / MAX_SIDE)
    x_m, y_m = np.meshgrid(np.arange(west, east, spacing_m), np.arange(south, north, spacing_m))
    places_m = np.stack([x_m.ravel(), y_m.ravel()], axis=1)
    inside = shapely.contains_xy(area, places_m)
    return np.concatenate([places_m[inside], shapely.get_coordinates(area.exterior)])
