"""Writes a scenario to begin with: rounds, and teams with zones and take-off places of their own.

A small fleet is one team around the origin. A larger one is dealt out to teams in cells of a grid: vehicles of
different teams never come near each other, so they share altitude layers and start, return and land independently.
"""

import json
import math
from dataclasses import dataclass

import numpy as np

from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.layer_assignment import LAYER_GAPS_M, assign
from tui_gcs.core.scenario.model import BatteryLimits, Limits
from tui_gcs.core.scenario.vehicle_conflicts import apart_m

MAX_VEHICLES = 250
MAX_TEAMS, MAX_ROUNDS = 32, 3
TEAM_SIZE, USUAL_TEAMS = 9, 20
"""A fleet of more vehicles than this is dealt out to teams of this size, up to so many teams; then teams grow."""
VEHICLES_PER_ROW, PLACE_SPACING_M = 10, 20.0
"""Take-off places stand in rows of this many, this far apart."""
ZONE_GAP_M, MIN_ZONE_RADIUS_M = 120.0, 80.0
"""How far north of its take-off places a zone begins, and the smallest radius of a zone."""
FOOTPRINT_M = 15.0
ALT_MIN_M, ALT_MAX_M, FIRST_LAYER_M = 20.0, 90.0, 25.0
_PLACE = """[[place]]
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

{rounds}{teams}{places}"""
_ROUND = """[[round]]
name = "round {number}"
duration_s = 300.0

[round.area]
shape = "rectangle"
centre_m = [{east_m}, {north_m}]
width_m = {width_m}
height_m = {height_m}
alt_min_m = {alt_min_m}
alt_max_m = {alt_max_m}

"""
_ZONE = """[[round.zone]]
name = "zone {number}"
role = "defend"
{shape}
"""
_TEAM = """[[team]]
name = "team-{number}"
zone = "zone {number}"
planner = "patrol"
vehicles = {vehicles}

"""
_CIRCLE = """shape = "circle"
centre_m = [{east_m}, {north_m}]
radius_m = {radius_m}
"""
_RECTANGLE = """shape = "rectangle"
centre_m = [{east_m}, {north_m}]
width_m = {width_m}
height_m = {height_m}
"""


@dataclass(frozen=True)
class _Cell:
    """The ground of one team: its vehicles, their take-off places, and the middle of its zone."""

    vehicles: tuple[int, ...]
    places_m: tuple[tuple[float, float], ...]
    zone_m: tuple[float, float]
    radius_m: float


def new_scenario(name: str, origin: Origin, vehicles: int, teams: int | None = None, rounds: int = 1) -> str:
    """Return the TOML text of a scenario for the system ids from 1 on; `teams` None takes as many as are sensible.

    Arguments are not checked: impossible ones, such as a latitude of 95 degrees, are found when the text is parsed.
    """
    limits = Limits()
    cells = _cells(vehicles, usual_teams(vehicles) if teams is None else teams, limits)
    layers_m = _layers_m(cells, limits)
    return _TEXT.format(
        name=json.dumps(name, ensure_ascii=False),
        footprint_m=FOOTPRINT_M,
        origin=origin,
        limits=limits,
        battery=BatteryLimits(),
        rounds="".join(_round(number, cells, max(layers_m)) for number in range(1, rounds + 1)),
        teams="".join(_TEAM.format(number=i, vehicles=list(cell.vehicles)) for i, cell in enumerate(cells, 1)),
        places="\n".join(
            _PLACE.format(vehicle=vehicle, east_m=east_m, north_m=north_m, layer_m=layers_m[vehicle - 1])
            for cell in cells
            for vehicle, (east_m, north_m) in zip(cell.vehicles, cell.places_m, strict=True)
        ),
    )


def usual_teams(vehicles: int) -> int:
    """Return into how many teams a fleet is divided by default."""
    return min(USUAL_TEAMS, math.ceil(vehicles / TEAM_SIZE))


def _cells(vehicles: int, teams: int, limits: Limits) -> list[_Cell]:
    """Deal the vehicles out to teams, and lay those out in a grid whose first cell is at the origin."""
    sizes = [vehicles // teams + (i < vehicles % teams) for i in range(teams)]
    per_row = VEHICLES_PER_ROW if teams == 1 else max(1, math.ceil(math.sqrt(2 * sizes[0])))
    radius_m = max(MIN_ZONE_RADIUS_M, _round_up_to_tens(_min_zone_radius_m(sizes[0], limits)))
    gap_m = _round_up_to_tens(apart_m(limits)) + PLACE_SPACING_M
    rows_m = PLACE_SPACING_M * (math.ceil(sizes[0] / per_row) - 1)
    wide_m = max(2 * radius_m, PLACE_SPACING_M * (min(per_row, sizes[0]) - 1)) + gap_m
    high_m = rows_m + ZONE_GAP_M + 2 * radius_m + gap_m
    columns = math.ceil(math.sqrt(teams * high_m / wide_m))
    cells, first = [], 1
    for i, size in enumerate(sizes):
        row, column = divmod(i, columns)
        east_m, north_m = wide_m * (column - (min(columns, teams) - 1) / 2), high_m * row
        places_m = tuple(_place_m(k, size, per_row, east_m, north_m) for k in range(size))
        zone_m = (east_m, north_m + ZONE_GAP_M + radius_m)
        cells.append(_Cell(tuple(range(first, first + size)), places_m, zone_m, radius_m))
        first += size
    return cells


def _layers_m(cells: list[_Cell], limits: Limits) -> list[float]:
    """Return a layer for each vehicle: those of one team meet, those of different cells do not."""
    team = np.array([i for i, cell in enumerate(cells) for _ in cell.vehicles])
    near = (team[:, None] == team[None, :]) & ~np.eye(len(team), dtype=bool)
    spacing_m = limits.separation_vertical_m + LAYER_GAPS_M[0]
    layers_m: list[float] = assign(near, np.full(len(team), np.nan), spacing_m, [FIRST_LAYER_M] * len(team)).tolist()
    return layers_m


def _round(number: int, cells: list[_Cell], highest_m: float) -> str:
    """Return one round: an area around everything, and a zone for each team. Zones are circles and squares in turn."""
    east = [x for cell in cells for x in (cell.zone_m[0] - cell.radius_m, cell.zone_m[0] + cell.radius_m)]
    east += [x for cell in cells for x, _ in cell.places_m]
    south_m = min(y for cell in cells for _, y in cell.places_m) - 50.0
    north_m = max(cell.zone_m[1] + cell.radius_m for cell in cells) + 100.0
    area = _ROUND.format(
        number=number,
        east_m=(min(east) + max(east)) / 2,
        north_m=(south_m + north_m) / 2,
        width_m=max(east) - min(east) + 200.0,
        height_m=north_m - south_m,
        alt_min_m=ALT_MIN_M,
        alt_max_m=max(ALT_MAX_M, _round_up_to_tens(highest_m + 5.0)),
    )
    return area + "".join(_zone(i, cell, number) for i, cell in enumerate(cells, 1))


def _zone(number: int, cell: _Cell, round_number: int) -> str:
    (east_m, north_m), radius_m = cell.zone_m, cell.radius_m
    if round_number % 2:
        shape = _CIRCLE.format(east_m=east_m, north_m=north_m, radius_m=radius_m)
    else:
        side_m = math.floor(radius_m * math.sqrt(math.pi))  # about the same area
        shape = _RECTANGLE.format(east_m=east_m, north_m=north_m, width_m=side_m, height_m=side_m)
    return _ZONE.format(number=number, shape=shape)


def _place_m(index: int, vehicles: int, per_row: int, east_m: float, north_m: float) -> tuple[float, float]:
    """Return a place in the rows of take-off places; the first row begins at `north_m`, the others lie south."""
    row, column = divmod(index, per_row)
    columns = min(vehicles, per_row)
    return east_m + PLACE_SPACING_M * (column - (columns - 1) / 2), north_m - PLACE_SPACING_M * row


def _min_zone_radius_m(vehicles: int, limits: Limits) -> float:
    """Return the radius at which a tour over the zone is long enough for the vehicles to keep their separation."""
    return math.sqrt(vehicles * 2 * FOOTPRINT_M * limits.separation_horizontal_m / math.pi)


def _round_up_to_tens(metres: float) -> float:
    return 10.0 * math.ceil(metres / 10.0)
