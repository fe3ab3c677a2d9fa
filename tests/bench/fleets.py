"""Random fleets: `python -m tests.bench fleets --seed S --count N [--flown K]`; without a seed it is a fresh one.

Each has 10 to 250 vehicles in teams, take-off places in one cluster or beside their zones, zones that overlap or lie
apart, sometimes no-fly zones. Its layers are found as a file's are, and then checked independently: ways are drawn at
random, around no-fly zones, and no two of vehicles that share a layer may come nearer than they need to brake.
"""

import argparse
import math
import random
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import shapely

from tests.bench.row import Row
from tui_gcs.core.geometry.shortest_route import route
from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.scenario.layer_assignment import layers_needed
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.model import Scenario, Team
from tui_gcs.core.scenario.vehicle_conflicts import place_conflicts
from tui_gcs.rehearsal.rehearse import rehearse

WAYS = 12
"""Ways that are drawn for each vehicle and round."""
FLOWN_MOST = 24
"""Fleets that are rehearsed have at most so many vehicles."""
BAND_M = (20.0, 2500.0)
Point = tuple[float, float]


@dataclass(frozen=True)
class Checked:
    """What was found of one fleet."""

    vehicles: int
    layers: int
    needed: int
    pairs: int
    too_near: int
    outside_band: int
    took_s: float


def main(arguments: list[str]) -> int:
    """Check random fleets, and fly some; 1 if a limit is not kept."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench fleets")
    parser.add_argument("--seed", type=int, default=time.time_ns() % 100_000)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--flown", type=int, default=0, help="so many are rehearsed, one round each")
    given = parser.parse_args(arguments)
    print(f"seed {given.seed}")
    kept = True
    for row in [*_checked(given.seed, given.count), *_flown(given.seed, given.flown)]:
        kept &= row.kept
        print(row, flush=True)
    return 0 if kept else 1


def fleet_text(seed: int, most: int = 250, *, plain: bool = False) -> str:
    """Return a random scenario without layers; a `plain` one can be flown: zones apart, nothing forbidden."""
    rng = random.Random(seed)
    vehicles = rng.randint(10, most)
    teams = rng.randint(max(1, vehicles // 14), max(2, vehicles // 4))
    teams = min(teams, 24)
    apart_m = 260.0 if plain else rng.choice((90.0, 180.0, 260.0, 420.0))
    columns = math.ceil(math.sqrt(teams))
    zones = [((i % columns) * apart_m, (i // columns) * apart_m * 1.4) for i in range(teams)]
    clustered = rng.random() < 0.5 and not plain
    sizes = [vehicles // teams + (i < vehicles % teams) for i in range(teams)]
    homes = [_homes(i, size, zones, sizes, clustered=clustered) for i, size in enumerate(sizes)]
    walls = [] if plain else [_wall(rng, zones, homes) for _ in range(rng.randint(0, 3))]
    x, y = ([p[k] for p in [*zones, *(h for team in homes for h in team)]] for k in (0, 1))
    lines = [
        f'format = 1\nname = "fleet {seed}"\nseed = {seed}\nfootprint_radius_m = 15.0\n',
        "[origin]\nlat_deg = 52.0\nlon_deg = -0.6\nground_amsl_m = 100.0\n",
        f"[limits]\nspeed_m_s = {rng.choice((5.0, 8.0, 8.0, 12.0))}\n" if not plain else "",
    ]
    for number in range(1, 2 if plain else rng.randint(2, 4)):
        lines.append(
            f'[[round]]\nname = "round {number}"\nduration_s = 300.0\n[round.area]\nshape = "rectangle"\n'
            f"centre_m = [{(min(x) + max(x)) / 2}, {(min(y) + max(y)) / 2}]\nwidth_m = {max(x) - min(x) + 500.0}\n"
            f"height_m = {max(y) - min(y) + 500.0}\nalt_min_m = {BAND_M[0]}\nalt_max_m = {BAND_M[1]}\n"
        )
        lines += [_zone(rng, i, zone, number) for i, zone in enumerate(zones)]
        lines += [wall.format(number=k) for k, wall in enumerate(walls) if wall]
    first = 1
    for i, size in enumerate(sizes):
        ids = list(range(first, first + size))
        lines.append(f'[[team]]\nname = "t{i}"\nzone = "z{i}"\nplanner = "patrol"\nvehicles = {ids}\n')
        first += size
    ids = list(range(1, vehicles + 1))
    places = [home for team in homes for home in team]
    lines += [f"[[place]]\nvehicle = {v}\nplace_m = [{a}, {b}]\n" for v, (a, b) in zip(ids, places, strict=True)]
    return "\n".join(lines)


def _homes(team: int, size: int, zones: list[Point], sizes: list[int], *, clustered: bool) -> list[Point]:
    """Rows of places: all teams' in one field south of everything, or each south of its zone."""
    if clustered:
        first = sum(sizes[:team])
        return [(20.0 * (k % 16), -150.0 - 20.0 * (k // 16)) for k in range(first, first + size)]
    x, y = zones[team]
    return [(x - 40.0 + 16.0 * (k % 6), y - 80.0 - 16.0 * (k // 6)) for k in range(size)]


def _zone(rng: random.Random, number: int, centre_m: Point, round_number: int) -> str:
    x, y = centre_m[0] + rng.uniform(-8, 8) * (round_number > 1), centre_m[1] + rng.uniform(-8, 8) * (round_number > 1)
    head = f'[[round.zone]]\nname = "z{number}"\nrole = "defend"\n'
    kind = rng.randrange(3)
    if kind == 0:
        return f'{head}shape = "circle"\ncentre_m = [{x}, {y}]\nradius_m = {rng.uniform(45, 55)}\n'
    if kind == 1:
        size = f"width_m = {rng.uniform(75, 95)}\nheight_m = {rng.uniform(75, 95)}\nheading_deg = {rng.uniform(0, 90)}"
        return f'{head}shape = "rectangle"\ncentre_m = [{x}, {y}]\n{size}\n'
    corners = [
        [x + r * math.cos(math.tau * k / 7), y + r * math.sin(math.tau * k / 7)]
        for k in range(7)
        for r in [rng.uniform(40, 60)]
    ]
    return f'{head}shape = "polygon"\nvertices_m = {corners}\n'


def _wall(rng: random.Random, zones: list[Point], homes: list[list[Point]]) -> str:
    """A no-fly circle that holds no take-off place and no middle of a zone; "" if none was found."""
    busy = [*zones, *(home for team in homes for home in team)]
    for _ in range(20):
        zone = rng.choice(zones)
        x, y = zone[0] + rng.uniform(-150, 150), zone[1] + rng.uniform(-150, 150)
        if all(math.dist((x, y), place) > 45.0 for place in busy):
            head = '[[round.zone]]\nname = "wall {number}"\nrole = "no-fly"\nshape = "circle"\n'
            return f"{head}centre_m = [{x}, {y}]\nradius_m = {rng.uniform(10, 35)}\n"
    return ""


def check(seed: int) -> Checked:
    """Find the layers of one random fleet and check them."""
    text = fleet_text(seed)
    began_s = time.process_time()
    scenario = parse(text)
    took_s = time.process_time() - began_s
    layers_m = np.array([place.layer_m for place in scenario.places])
    rng = random.Random(seed)
    ways = [_ways(rng, scenario, i) for i in range(len(layers_m))]
    limits, pairs, too_near = scenario.limits, 0, 0
    least_m = limits.separation_horizontal_m + limits.speed_m_s**2 / limits.accel_m_s2
    for i, j in combinations(range(len(layers_m)), 2):
        if abs(layers_m[i] - layers_m[j]) < limits.separation_vertical_m - 1e-6:
            pairs += 1
            too_near += shapely.distance(ways[i], ways[j]) < least_m
    near = place_conflicts(scenario.rounds, limits, scenario.teams, scenario.places)
    outside = int(((layers_m < BAND_M[0]) | (layers_m > BAND_M[1])).sum())
    used = len(set(layers_m.tolist()))
    return Checked(len(layers_m), used, layers_needed(near), pairs, too_near, outside, took_s)


def _ways(rng: random.Random, scenario: Scenario, place: int) -> shapely.Geometry:
    """Ways of one vehicle: from places in its zones, of any two rounds, to each other and home, and straight home."""
    home, vehicle = scenario.places[place].place_m, scenario.places[place].vehicle
    team: Team = next(team for team in scenario.teams if vehicle in team.vehicles)
    lines = []
    for round_ in scenario.rounds:
        free = Guard(scenario.limits, round_.area, round_.no_fly).allowed
        here, there = (_inside(rng, scenario, team) for _ in range(2))
        lines.append(shapely.LineString([here, home]))  # a failsafe knows no zones
        if free.covers(shapely.Point(here)) and free.covers(shapely.Point(there)):
            lines.append(shapely.LineString([here, *route(free, here, there)]))
            lines.append(shapely.LineString([here, *route(free, here, home)]))
    lines += [shapely.LineString([_inside(rng, scenario, team), home]) for _ in range(WAYS)]
    return shapely.MultiLineString(lines)


def _inside(rng: random.Random, scenario: Scenario, team: Team) -> Point:
    """A place in the team's zone of any round."""
    round_ = rng.choice(scenario.rounds)
    zone = polygon_of(next(zone.shape for zone in round_.zones if zone.name == team.zone))
    low_x, low_y, high_x, high_y = zone.bounds
    while True:
        x, y = rng.uniform(low_x, high_x), rng.uniform(low_y, high_y)
        if zone.covers(shapely.Point(x, y)):
            return x, y


def _checked(first: int, count: int) -> Iterator[Row]:
    found = [check(seed) for seed in range(first, first + count)]
    yield Row(f"{count} random fleets: vehicles in all", sum(each.vehicles for each in found), "")
    yield Row("pairs on one layer that were checked", sum(each.pairs for each in found), "")
    yield Row("of them too near to brake", sum(each.too_near for each in found), "", 0)
    yield Row("layers outside the altitude band", sum(each.outside_band for each in found), "", 0)
    over = [each.layers - each.needed for each in found]
    yield Row("layers more than the largest set that meets, worst", max(over), "")
    yield Row("fleets with the fewest layers possible", 100.0 * over.count(0) / count, "%")
    yield Row("layers per 10 vehicles, median", 10 * float(np.median([e.layers / e.vehicles for e in found])), "")
    yield Row("reading a scenario and finding its layers, worst CPU", max(each.took_s for each in found), "s")


def _flown(first: int, count: int) -> Iterator[Row]:
    for seed in range(first, first + count):
        text = fleet_text(seed, FLOWN_MOST, plain=True)
        scenario = parse(text)
        with tempfile.TemporaryDirectory() as folder:
            result, problem = rehearse(scenario, text, Path(folder), lambda _share, _text: None)
        failed = [check.name for check in result.checks if not check.ok]
        name = f"fleet {seed}: {scenario.vehicle_count} in {len(scenario.teams)} teams flown: gates failed"
        yield Row(name, len(failed) + bool(problem), "", 0)
        for text in [*failed, problem]:
            if text:
                print(f"  {text}")
