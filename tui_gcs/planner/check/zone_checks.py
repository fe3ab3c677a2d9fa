"""Whether a planner copes with zones and places that make no sense: it plans inside the area, or says why it cannot."""

from collections.abc import Iterator

import numpy as np
import shapely
import shapely.ops

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Shape, polygon_of
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.planner.check.finding import Finding, failed, noted, passed
from tui_gcs.planner.check.plan_form import faults, who_is_outside
from tui_gcs.planner.check.subject import Broken, Refused, Subject
from tui_gcs.planner.check.world import AREA, ZONE, Floats, World, scattered, task_for

COUNT = 3
FLIGHT_S = 12.0
NEAR_EDGE_M = 25.0
"""Vehicles begin so far inside, those in front a few metres less."""
SMALL_AREA = OperatingArea(Rectangle((60.0, 60.0), 110.0, 110.0), 20.0, 90.0)
CASES: tuple[tuple[str, Shape, OperatingArea], ...] = (
    ("a zone of 1 m", Circle((250.0, 200.0), 0.5), AREA),
    ("a zone 100 m long and 1 m wide", Rectangle((250.0, 200.0), 100.0, 1.0, 30.0), AREA),
    ("a zone outside the area", Circle((1500.0, 200.0), 60.0), AREA),
    ("a zone half outside the area", Circle((20.0, 200.0), 60.0), AREA),
    ("a zone larger than the area", Rectangle((60.0, 60.0), 300.0, 300.0), SMALL_AREA),
    (
        "a zone with a bay",
        Polygon(((200.0, 150.0), (330.0, 150.0), (330.0, 280.0), (265.0, 165.0), (200.0, 280.0))),
        AREA,
    ),
)


def zones(subject: Subject) -> Iterator[Finding]:
    """Zones that are tiny, thin, elsewhere, too large; and all vehicles in one place."""
    check = "odd zones"
    cases = CASES[:3] if subject.quick else CASES
    for what, shape, area in cases:
        try:
            _fly(subject, shape, area, _near(shape, area))
        except Refused as why:
            yield noted(check, f"{what}: refused, as configure may: {why}")
        except Broken as why:
            advice = "stay inside task.area, or raise ValueError in configure: the operator reads what it says"
            yield failed(check, f"{what}: {why}", advice)
            return
    try:
        _fly(subject, ZONE.shape, AREA, np.full((COUNT, 2), 60.0))
    except Broken as why:
        yield failed(check, f"all vehicles in one place: {why}", "distances may be 0: mind divisions")
        return
    yield passed(check, f"{', '.join(what for what, _, _ in cases)}; all vehicles in one place")


def _near(shape: Shape, area: OperatingArea) -> Floats:
    """(n, 2) places as near to the zone as vehicles may be: there those who leave the area for it are soon outside."""
    inside = polygon_of(area.shape).buffer(-NEAR_EDGE_M)
    nearest, _ = shapely.ops.nearest_points(inside, polygon_of(shape).representative_point())
    places = scattered(COUNT)
    places += np.array(nearest.coords[0]) - places.mean(axis=0)
    return places


def _fly(subject: Subject, shape: Shape, area: OperatingArea, xy_m: np.ndarray) -> None:
    task = task_for(range(1, COUNT + 1), subject.name, seed=subject.seed, shape=shape, area=area)
    host = subject.host(task)
    world = World(task, xy_m)
    for frame, plan in subject.fly(host, world, FLIGHT_S):
        if wrong := faults(plan, frame, task):
            raise Broken(wrong[0])
        if out := who_is_outside(world.position_m, task):
            x, y, _ = world.position_m[out[0]]
            raise Broken(f"vehicle {task.members[out[0]]} flies to ({x:.0f}, {y:.0f}), outside the operating area")
