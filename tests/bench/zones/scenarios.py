"""Random scenarios of one team over one zone, as TOML: every shape, holes, borders, sizes from 0.01 to 100 ha."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

KINDS = ("circle", "rectangle", "strip", "L", "U", "star", "comb", "concave", "triangle")
HOLES = ("none", "none", "circle", "polygon", "several", "border")
MIN_M2, MAX_M2 = 100.0, 1e6
IDEAL_S = (6.0, 60.0)
"""Ideal worst idleness: longer rounds would be no other question, only a longer flight."""
SPEEDS_M_S = {"ardupilot": (5.0, 8.0, 9.0), "px4": (5.0, 8.0, 8.0)}
"""Speed limits that vehicles can fly with the parameters they come with: `core/firmware/own_limits`."""
FOOTPRINTS_M = (6.0, 60.0)
LAYER_M, LAYER_GAP_M = 27.0, 7.0


@dataclass(frozen=True)
class RandomScenario:
    """One scenario and what it is made of."""

    number: int
    kind: str
    holes: str
    n: int
    autopilot: str
    area_m2: float
    toml: str


def random_scenario(seed: int, number: int) -> RandomScenario:
    """Return the scenario of this number; the same for the same seed."""
    rng = np.random.default_rng([seed, number])
    while True:
        found = _drawn(rng, number)
        if found is not None:
            return found


def _drawn(rng: np.random.Generator, number: int) -> RandomScenario | None:
    """Return a scenario, None if shape, holes and footprint do not fit each other."""
    kind, holes = str(rng.choice(KINDS)), str(rng.choice(HOLES))
    n, autopilot = int(rng.integers(1, 21)), str(rng.choice(["ardupilot", "px4"]))
    area_m2 = float(np.exp(rng.uniform(np.log(MIN_M2), np.log(MAX_M2))))
    zone = _of_area(_outline(kind, rng), area_m2, float(rng.uniform(0.0, 360.0)))
    speed, radius = float(rng.choice(SPEEDS_M_S[autopilot])), float(np.exp(rng.uniform(*np.log(FOOTPRINTS_M))))
    ideal_s = area_m2 / (2.0 * radius * n * speed)
    if not zone.is_valid or ideal_s > IDEAL_S[1] or (ideal_s < IDEAL_S[0] and area_m2 > 20_000.0):
        return None
    closed = _holes(holes, zone, radius, rng)
    # In one of four the zone touches the border of the operating area.
    west, south, east, north = zone.bounds
    room = [0.0 if rng.random() < 0.25 else float(rng.uniform(20.0, 80.0)) for _ in range(4)]
    places_m = 15.0 * math.ceil(math.sqrt(n)) + 30.0
    area = shapely.box(
        west - room[0] - places_m, south - room[1], east + room[2], max(north, south + places_m) + room[3]
    )
    corner = (area.bounds[0] + 15.0, area.bounds[1] + 15.0)
    if any(
        hole.distance(shapely.box(*corner, corner[0] + places_m - 30.0, corner[1] + places_m - 30.0)) < 20.0
        for hole in closed
    ):
        return None
    return RandomScenario(
        number, kind, holes, n, autopilot, area_m2, _toml(number, zone, closed, area, corner, n, speed, radius)
    )


def _outline(kind: str, rng: np.random.Generator) -> shapely.Polygon:
    wide, high, arm = (float(x) for x in rng.uniform((1.0, 0.7, 0.25), (2.5, 1.5, 0.45)))
    if kind == "circle":
        return shapely.Point(0.0, 0.0).buffer(1.0, quad_segs=24)
    if kind == "rectangle":
        return shapely.box(0.0, 0.0, wide, high)
    if kind == "strip":
        return shapely.box(0.0, 0.0, 1.0, float(rng.uniform(0.02, 0.15)))
    if kind == "L":
        return shapely.Polygon([(0, 0), (wide, 0), (wide, arm), (arm, arm), (arm, high), (0, high)])
    if kind == "U":
        legs = [(wide, high), (wide - arm, high), (wide - arm, arm), (arm, arm), (arm, high), (0, high)]
        return shapely.Polygon([(0, 0), (wide, 0), *legs])
    if kind == "triangle":
        return shapely.Polygon([(0, 0), (wide, 0), (float(rng.uniform(0.0, wide)), high)])
    if kind == "comb":
        teeth, corners = int(rng.integers(2, 5)), [(0.0, 0.0), (wide, 0.0)]
        tooth = wide / (2 * teeth - 1)
        for k in reversed(range(teeth)):
            right = tooth * (2 * k + 1)
            corners += [(right, high), (right - tooth, high)]
            corners += [(right - tooth, 0.3 * high), (right - 2 * tooth, 0.3 * high)] if k else []
        return shapely.Polygon(corners)
    count = 10 if kind == "star" else int(rng.integers(6, 12))
    angles = 2 * math.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count) * (kind == "concave")) / count
    inner = float(rng.uniform(0.4, 0.6))
    reach = np.where(np.arange(count) % 2, inner, 1.0) if kind == "star" else rng.uniform(0.45, 1.0, count)
    return shapely.Polygon(np.stack([reach * np.cos(angles), reach * np.sin(angles)], axis=1))


def _of_area(outline: shapely.Polygon, area_m2: float, turn_deg: float) -> shapely.Polygon:
    times = math.sqrt(area_m2 / outline.area)
    return affinity.rotate(affinity.scale(outline, times, times), turn_deg)


def _holes(kind: str, zone: shapely.Polygon, radius_m: float, rng: np.random.Generator) -> list[shapely.Polygon]:
    """Return no-fly zones of a twentieth to a third of the zone's width."""
    if kind == "none":
        return []
    west, south, east, north = zone.bounds
    size_m = max(2.0, min(east - west, north - south) * float(rng.uniform(0.05, 0.3)))
    count, found = (int(rng.integers(2, 5)) if kind == "several" else 1), []
    for k in range(count):
        if kind == "border":
            at = zone.exterior.interpolate(float(rng.uniform(0.0, zone.exterior.length)))
        else:
            at = shapely.Point(rng.uniform((west, south), (east, north)))
        if kind == "polygon" or k % 2:
            angles = np.sort(rng.uniform(0.0, 2 * math.pi, 5))
            spots = size_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            hole = shapely.Polygon(spots).convex_hull
        else:
            hole = shapely.Point(0.0, 0.0).buffer(size_m / 2.0, quad_segs=8)
        found.append(affinity.translate(hole, at.x, at.y))
    return [hole for hole in found if hole.area > 5.0]


def _toml(
    number: int,
    zone: shapely.Polygon,
    closed: list[shapely.Polygon],
    area: shapely.Polygon,
    corner: tuple[float, float],
    n: int,
    speed: float,
    radius: float,
) -> str:
    top_m = LAYER_M + LAYER_GAP_M * n + 10.0
    columns = math.ceil(math.sqrt(n))
    parts = [
        f'format = 1\nname = "zones {number}"\nseed = {number + 1}\nfootprint_radius_m = {radius:.2f}\n',
        "[origin]\nlat_deg = 52.0720\nlon_deg = -0.6280\nground_amsl_m = 110.0\n",
        f"[limits]\nspeed_m_s = {speed}\naccel_m_s2 = 2.5\n",
        "[results]\non_slot_max_s = 600.0\nmeasured_s = 90.0\nworst_ratio_max = 1000.0\n",
        f'[[round]]\nname = "round"\nduration_s = 3600.0\n\n[round.area]\n{_polygon(area)}'
        f"alt_min_m = 20.0\nalt_max_m = {top_m}\n",
        f'[[round.zone]]\nname = "zone"\nrole = "defend"\n{_polygon(zone)}',
        *(f'[[round.zone]]\nname = "closed {k}"\nrole = "no-fly"\n{_polygon(hole)}' for k, hole in enumerate(closed)),
        f'[[team]]\nname = "team"\nzone = "zone"\nplanner = "patrol"\nvehicles = {list(range(1, n + 1))}\n',
    ]
    for k in range(n):
        x, y = corner[0] + 15.0 * (k % columns), corner[1] + 15.0 * (k // columns)
        layer_m = LAYER_M + LAYER_GAP_M * k
        parts.append(f"[[place]]\nvehicle = {k + 1}\nplace_m = [{x:.1f}, {y:.1f}]\nlayer_m = {layer_m}\n")
    return "\n".join(parts)


def _polygon(shape: shapely.Polygon) -> str:
    corners = [[round(x, 2), round(y, 2)] for x, y in shapely.get_coordinates(shape.exterior)[:-1].tolist()]
    return f'shape = "polygon"\nvertices_m = {corners}\n'
