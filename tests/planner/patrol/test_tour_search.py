"""The search goes on from an instant plan, gets better, and can be stored between any two of its units."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.bench.zones.baseline import boustrophedon_worst_s
from tests.bench.zones.flown import task_of
from tests.bench.zones.scenarios import random_scenario
from tests.planner.rigs.flights import region_of, zone_of
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.scenario.load import parse
from tui_gcs.planner.patrol.formation import Formation
from tui_gcs.planner.patrol.patrol_state import PatrolState, decode, encode
from tui_gcs.planner.patrol.tour_search import TourSearch, begin_search
from tui_gcs.planner.patrol.tour_site import TourSite, site_of
from tui_gcs.planner.patrol.tour_smoothing import PATH_STEPS, TourLimits, flown_as
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet, scattered

FIELD = Rectangle((300.0, 200.0), 110.0, 85.0, 20.0)


@cache
def site() -> TourSite:
    return site_of(FIELD, region_of(zone_of(FIELD)), TourLimits(7.76, 2.375, 14.3), 15.0)


@cache
def first() -> TourSearch:
    return begin_search(site(), 7, 4)


def searched(units: int) -> TourSearch:
    search = replace(first(), pool=list(first().pool))
    while search.units < units:
        search.work(site())
    return search


@pytest.mark.long
def test_a_search_never_gets_worse_and_finds_something() -> None:
    search = searched(60)
    assert search.units == 60
    before = first().best
    assert search.best is not None and before is not None
    assert search.best.rank <= before.rank
    assert sum(draft.cost for draft in search.pool) < sum(draft.cost for draft in first().pool)


@pytest.mark.long
def test_a_stored_search_goes_on_as_if_nothing_had_been() -> None:
    through = searched(30)
    for units in (10, 11, 12):
        halves = searched(units)
        assert halves.best is not None
        data = encode(PatrolState(halves, halves.best, Formation()))
        again = decode(data, site()).search
        while again.units < 30:
            again.work(site())
        assert [draft.cost for draft in again.pool] == [draft.cost for draft in through.pool]
        np.testing.assert_array_equal(again.pool[0].controls, through.pool[0].controls)
        assert len(data) < 100_000


def test_a_draft_takes_over_the_time_law_by_which_it_is_flown() -> None:
    """Its own is slower than the path allows; bent on by that, it gets shorter in the wrong places."""
    draft = first().pool[0]
    tour = site().timed(draft)
    again = flown_as(draft, tour)
    knots = len(again.controls)
    assert knots == len(draft.controls)
    assert again.interval_s * knots == pytest.approx(tour.period_s)
    at_knots, _ = tour.at(again.interval_s * np.arange(knots))
    np.testing.assert_allclose(again.path_m()[::PATH_STEPS], at_knots, atol=1e-6)


def test_a_zone_under_one_footprint_needs_no_search() -> None:
    tiny = Rectangle((300.0, 200.0), 10.0, 10.0)
    small = site_of(tiny, region_of(zone_of(tiny)), TourLimits(7.76, 2.375, 14.3), 15.0)
    search = begin_search(small, 1, 2)
    search.work(small)
    assert search.best is not None
    assert search.best.name == "loop"
    assert search.best.real.coverage == 1.0


def test_a_footprint_that_fills_a_zone_too_often_is_refused_before_anything_is_computed() -> None:
    with pytest.raises(ValueError, match=r"a footprint of 0.001 m radius is too fine to plan a zone of \d+ m2"):
        site_of(FIELD, region_of(zone_of(FIELD)), TourLimits(7.76, 2.375, 0.001), 0.001)


def test_where_footprints_are_large_a_longer_tour_may_be_better_and_is_found() -> None:
    """Seven vehicles that see 50 m far over 2.5 ha: the shortest tour left places out for 7.9 s, lanes for 3.3 s."""
    drawn = random_scenario(25225, 2)
    task = task_of(parse(drawn.toml), drawn.autopilot)
    host = PlannerHost(task.team)
    host.set_task(task)
    plan = host.step(KinematicFleet(task, scattered(len(task.members))).frame())
    assert plan.error == ""
    assert plan.metrics["predicted_worst_s"] <= boustrophedon_worst_s(task) + 0.05
