"""Writes a small scenario to begin with: one round, one zone, one team, take-off places around the origin."""

import json
import math

from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.model import BatteryLimits, Limits

MAX_VEHICLES = 250
VEHICLES_PER_ROW, PLACE_SPACING_M = 10, 20.0
"""Take-off places stand in rows of this many, this far apart."""
ZONE_NORTH_M, MIN_ZONE_RADIUS_M = 200.0, 80.0
"""How far north of the origin the zone's centre lies, and the smallest radius of the zone."""
FOOTPRINT_M = 15.0
ALT_MIN_M, ALT_MAX_M, FIRST_LAYER_M = 20.0, 90.0, 25.0
LAYER_GAP_M = 2.0
"""The distance between layers beyond the vertical separation.

Without it the guard holds every vehicle that passes another one a little too high or too low.
"""
_PLACE = """
[[place]]
vehicle = {vehicle}
place_m = [{east_m}, {north_m}]
layer_m = {layer_m}
"""
_TEXT = """# A tui-gcs scenario. Nothing in it has to be written by hand: `tui-gcs demo --scenario FILE`, then
# p shows the plan screen, where g opens these settings, + adds a zone, R a round, and ^S saves; comments stay.
# Places are metres east and north of the origin; heights are metres above each vehicle's take-off place.

format = 1
name = {name}
seed = 42                   # everything random comes from this: the same seed gives the same run
footprint_radius_m = {footprint_m}   # what one vehicle sees: a disc of this radius below it

[origin]
lat_deg = {origin.lat_deg}
lon_deg = {origin.lon_deg}
ground_amsl_m = {origin.ground_amsl_m}   # height of the ground above mean sea level

[limits]
speed_m_s = {limits.speed_m_s}
accel_m_s2 = {limits.accel_m_s2}
separation_horizontal_m = {limits.separation_horizontal_m}
separation_vertical_m = {limits.separation_vertical_m}

[battery]
return_pct = {battery.return_pct}   # a vehicle returns and lands at this charge; 0: never
reserve_s = {battery.reserve_s}    # or earlier, where the way home would leave less flight time than this

[[round]]
name = "round 1"
duration_s = 300.0

[round.area]
shape = "rectangle"
centre_m = [0.0, {centre_north_m}]
width_m = {width_m}
height_m = {height_m}
alt_min_m = {alt_min_m}
alt_max_m = {alt_max_m}

[[round.zone]]
name = "zone 1"
role = "defend"
shape = "circle"
centre_m = [0.0, {zone_north_m}]
radius_m = {radius_m}

[[team]]
name = "team-1"
zone = "zone 1"
planner = "patrol"
vehicles = {vehicles}
{places}"""


def new_scenario(name: str, origin: Origin, vehicles: int) -> str:
    """Return the TOML text of a scenario for the system ids from 1 on.

    Arguments are not checked: impossible ones, such as a latitude of 95 degrees, are found when the text is parsed.
    """
    limits = Limits()
    apart_m = limits.separation_vertical_m + LAYER_GAP_M
    places = [_place_m(i, vehicles) for i in range(vehicles)]
    layers_m = [FIRST_LAYER_M + apart_m * i for i in range(vehicles)]
    radius_m = max(MIN_ZONE_RADIUS_M, _round_up_to_tens(_min_zone_radius_m(vehicles, limits)))
    south_m, north_m = min(north for _, north in places) - 50.0, ZONE_NORTH_M + radius_m + 100.0
    return _TEXT.format(
        name=json.dumps(name, ensure_ascii=False),
        footprint_m=FOOTPRINT_M,
        origin=origin,
        limits=limits,
        battery=BatteryLimits(),
        centre_north_m=(south_m + north_m) / 2,
        width_m=2 * (radius_m + 100.0),
        height_m=north_m - south_m,
        alt_min_m=ALT_MIN_M,
        alt_max_m=max(ALT_MAX_M, _round_up_to_tens(layers_m[-1] + 5.0)),
        zone_north_m=ZONE_NORTH_M,
        radius_m=radius_m,
        vehicles=list(range(1, vehicles + 1)),
        places="".join(
            _PLACE.format(vehicle=i + 1, east_m=east_m, north_m=north, layer_m=layers_m[i])
            for i, (east_m, north) in enumerate(places)
        ),
    )


def _place_m(index: int, vehicles: int) -> tuple[float, float]:
    """Return a place in the rows of take-off places; the first row passes through the origin, the others lie south."""
    row, column = divmod(index, VEHICLES_PER_ROW)
    columns = min(vehicles, VEHICLES_PER_ROW)
    return PLACE_SPACING_M * (column - (columns - 1) / 2), 0.0 - PLACE_SPACING_M * row  # 0.0 -: no "-0.0" in the file


def _min_zone_radius_m(vehicles: int, limits: Limits) -> float:
    """Return the radius at which a tour over the zone is long enough for the vehicles to keep their separation."""
    return math.sqrt(vehicles * 2 * FOOTPRINT_M * limits.separation_horizontal_m / math.pi)


def _round_up_to_tens(metres: float) -> float:
    return 10.0 * math.ceil(metres / 10.0)
