"""Patrol tours: how good, how soon, with how many vehicles, and what else flies, on the same grid of 2.5 m."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import tui_gcs
from tests.bench.planning.baselines import greedy_worst, loops, strips, worst_of_tours
from tests.bench.planning.zones import unseen, wide, widest_swaths
from tests.bench.row import Row
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.firmware.px4 import Px4Multicopter
from tui_gcs.core.geometry.idleness_bounds import ideal_idleness_s
from tui_gcs.core.geometry.idleness_grid import cell_centres_m
from tui_gcs.core.geometry.zones import Shape, Zone, area_m2
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Limits, OperatingArea
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.patrol import ACCEL_SHARE, Patrol
from tui_gcs.planner.patrol.tour import evaluate
from tui_gcs.planner.patrol.tour_search import TourSearch, begin_search
from tui_gcs.planner.patrol.tour_site import EVENED_M, MISS_M, TourDesign, TourSite, site_of
from tui_gcs.planner.patrol.tour_smoothing import TourLimits

LIMITS, RADIUS_M = Limits(), 15.0
SPEED_M_S, ACCEL_M_S2 = LIMITS.speed_m_s, LIMITS.accel_m_s2
TEAM, MOST = 4, 8
BACKGROUND_S = 10.0
LONG_UNITS = (200, 2000, 20000)
PUBLISHED = {
    "round 1 home": 1.24,
    "round 2 home": 1.33,
    "round 3 home": 1.50,
    "round 1 field": 1.33,
    "round 2 field": 1.25,
    "round 3 field": 1.33,
}
"""Worst idleness over the ideal, planned for `TEAM` ArduCopters; as in docs/research/figures.md."""
WITHIN = 1.02
"""A plan may be this many times as long as the published one."""
UNSEEN, UNSEEN_SEED = 20, 20261


def planning(_: Path) -> Iterator[Row]:
    """The rounds of the shipped scenario, then unseen zones."""
    warm_up()
    for name, zone, area in rounds():
        yield from _round(name, zone, area)
    yield from _unseen()


def planning_long(_: Path) -> Iterator[Row]:
    """Whether time would help: searches without margins that go on for a hundred times as long."""
    warm_up()
    for name, zone, area in rounds():
        site = _site_without_margins(zone, area)
        search, begin_s = begin_search(site, 1, TEAM), time.process_time()
        for units in LONG_UNITS:
            while search.units < units:
                search.work(site)
            yield Row(f"{name}, no margins, {units} units: / ideal, n = {TEAM}", best_ratio(search, zone.shape), "")
        yield Row(f"{name}: CPU of that", time.process_time() - begin_s, "s")


def rounds() -> Iterator[tuple[str, Zone, OperatingArea]]:
    """(what it is, zone, area) of the shipped scenario's zones."""
    scenario = load(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")
    for number, round_ in enumerate(scenario.rounds, 1):
        for zone in round_.zones[:2]:
            yield f"round {number} {zone.name}", zone, round_.area


def _round(name: str, zone: Zone, area: OperatingArea) -> Iterator[Row]:
    ideal_s = _ideal_s(zone.shape, TEAM)
    yield Row(f"{name}: ideal, n = {TEAM}", ideal_s, "s")
    yield Row(f"{name}: widest disc inside, in swaths", widest_swaths(zone.shape), "")
    cpu_s = time.process_time()
    site = site_as_planned(zone, area, ())
    search = begin_search(site, 0, TEAM)
    cpu_s = time.process_time() - cpu_s
    assert search.best is not None
    yield Row(f"{name}: planned at once, CPU", cpu_s, "s", 1.0)
    yield from _judged(f"{name}, at once", search.best, zone.shape, None)
    cpu_s = time.process_time()
    _search_on(search, site)
    yield Row(f"{name}: {BACKGROUND_S:g} s in the background, CPU", time.process_time() - cpu_s, "s", BACKGROUND_S)
    yield from _judged(f"{name}, after {BACKGROUND_S:g} s", search.best, zone.shape, WITHIN * PUBLISHED[name])
    yield from _spent(f"{name}, after {BACKGROUND_S:g} s", search.best, zone.shape)
    site = site_as_planned(zone, area, (), Px4Multicopter.off_course_m)
    search = begin_search(site, 0, TEAM)
    _search_on(search, site)
    ratio = best_ratio(search, zone.shape)
    yield Row(f"{name}, PX4s, after {BACKGROUND_S:g} s: worst idleness / ideal, n = {TEAM}", ratio, "")
    site = _site_without_margins(zone, area)
    search = begin_search(site, 0, TEAM)
    _search_on(search, site)
    # On other cells than these it may miss one, for some number of vehicles: it has no margin.
    ratio = best_ratio(search, zone.shape)
    yield Row(f"{name}, no margins, after {BACKGROUND_S:g} s: worst idleness / ideal, n = {TEAM}", ratio, "")
    yield from _spent(f"{name}, no margins", search.best, zone.shape)
    yield Row(f"{name}: strips there and back / B1", worst_of_tours(zone.shape, strips(zone.shape, TEAM)) / ideal_s, "")
    yield Row(f"{name}: loops drawn by hand / B1", worst_of_tours(zone.shape, loops(zone.shape, TEAM)) / ideal_s, "")
    yield Row(f"{name}: greedy / B1", greedy_worst(zone.shape, TEAM) / ideal_s, "")


def _search_on(search: TourSearch, site: TourSite) -> None:
    while search.units < BACKGROUND_S * Patrol.iterations_per_s:
        search.work(site)


def _judged(name: str, design: TourDesign | None, shape: Shape, limit: float | None) -> Iterator[Row]:
    assert design is not None
    ratios = {n: _ratio(design, shape, n) for n in range(1, MOST + 1)}
    yield Row(f"{name}: worst idleness / ideal, n = {TEAM}", ratios[TEAM], "", limit)
    yield Row(f"{name}: the same, n = 1 … {MOST}, most", max(ratios.values()), "")
    yield Row(f"{name}: coverage", 100.0 * design.real.coverage, "%", 100.0, at_least=True)


def _spent(name: str, design: TourDesign | None, shape: Shape) -> Iterator[Row]:
    """Where the time goes: B1 is a way of A / 2r at full speed; the rest is overlap and outside, and turns."""
    assert design is not None
    tour = design.tour
    yield Row(f"{name}: way / (A / 2r): overlap, outside", 2.0 * RADIUS_M * tour.length_m / area_m2(shape), "")
    yield Row(f"{name}: duration / (way / v): turns", tour.period_s * SPEED_M_S / tour.length_m, "")


def _unseen() -> Iterator[Row]:
    now, later, narrow, covered, cpu = [], [], [], [], []
    for _, zone, area, closed in unseen(UNSEEN, UNSEEN_SEED):
        begin_s = time.process_time()
        site = site_as_planned(zone, area, closed)
        search = begin_search(site, 0, TEAM)
        cpu.append(time.process_time() - begin_s)
        assert search.best is not None
        covered.append(search.best.real.coverage)
        if wide(zone.shape):
            now.append(_ratio(search.best, zone.shape, TEAM))
        _search_on(search, site)
        if wide(zone.shape):
            later.append(_ratio(search.best, zone.shape, TEAM))
        else:
            other = min(worst_of_tours(zone.shape, kind(zone.shape, TEAM)) for kind in (loops, strips))
            narrow.append(search.best.real.worst_s / other)
    yield Row(f"{UNSEEN} unseen zones: planned at once, CPU, most", max(cpu), "s", 1.0)
    yield Row("unseen: coverage of what can be seen, least", 100.0 * min(covered), "%", 100.0, at_least=True)
    # How good these are beside what everybody can write is measured by the part `zones`.
    for name, found in (("at once", now), (f"after {BACKGROUND_S:g} s", later)):
        yield Row(f"unseen, 2 swaths or wider ({len(found)}), {name}: / B1, median", float(np.median(found)), "")
        yield Row(f"unseen, 2 swaths or wider, {name}: / B1, most", max(found), "")
    if narrow:
        yield Row(f"unseen, narrower ({len(narrow)}): / better of loops and strips, most", max(narrow), "", 1.0)


def site_as_planned(
    zone: Zone, area: OperatingArea, closed: tuple[Zone, ...] = (), off_course_m: float = ArduCopter.off_course_m
) -> TourSite:
    """As the patrol planner does by default for vehicles that may be so far beside their course."""
    default = {param.name: float(param.default) for param in Patrol.params if param.type is float}
    radius_m = RADIUS_M - off_course_m - default["margin_m"]
    motion = TourLimits(SPEED_M_S * default["speed_fraction"], ACCEL_M_S2 * ACCEL_SHARE, radius_m)
    return site_of(zone.shape, FlyableRegion(area, closed, LIMITS, zone), motion, RADIUS_M)


def _site_without_margins(zone: Zone, area: OperatingArea) -> TourSite:
    """What vehicles that never stray could do."""
    motion = TourLimits(SPEED_M_S, ACCEL_M_S2, RADIUS_M - MISS_M - EVENED_M)
    return site_of(zone.shape, FlyableRegion(area, (), LIMITS, zone), motion, RADIUS_M)


def best_ratio(search: TourSearch, shape: Shape) -> float:
    """Worst idleness over B1 of the best tour that was found, with `TEAM` vehicles."""
    assert search.best is not None
    return _ratio(search.best, shape, TEAM)


def _ratio(design: TourDesign, shape: Shape, n: int) -> float:
    return evaluate(design.tour, cell_centres_m(shape, 2.5), RADIUS_M, n).worst_s / _ideal_s(shape, n)


def _ideal_s(shape: Shape, n: int) -> float:
    return ideal_idleness_s(area_m2(shape), n, SPEED_M_S, RADIUS_M)
