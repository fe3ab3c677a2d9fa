"""A host that works for the next task while the present one is flown: the same plans as one that does not."""

import msgspec
import pytest

from tests.planner.rigs.flights import SMALL, fleet, task_of, zone_of
from tui_gcs.core.geometry.zones import Circle, Rectangle
from tui_gcs.core.protocol.common import PlannerTask, encode
from tui_gcs.planner.patrol import tour_search
from tui_gcs.planner.runtime.background_host import BackgroundHost
from tui_gcs.planner.runtime.host import PlannerHost

pytestmark = pytest.mark.usefixtures("designed_once")

UNITS = {"search": 40}
NOW = task_of(zone_of(SMALL), **UNITS)
NEXT = msgspec.structs.replace(task_of(zone_of(Rectangle((200.0, 200.0), 90.0, 70.0)), **UNITS), revision=2)


def plans_after(host: PlannerHost, task: PlannerTask, steps: int = 15) -> list[bytes]:
    """What it plans from `task` on, for vehicles that stand."""
    vehicles, plans = fleet(4), list[bytes]()
    vehicles.t_s = 100.0
    host.set_task(task)
    for _ in range(steps):
        plans.append(encode(msgspec.structs.replace(host.step(vehicles.frame()), step_ms=0.0, seq=0)))
        vehicles.t_s += 0.2
    return plans


@pytest.fixture
def units(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Of the search, as they are done."""
    done, work = list[int](), tour_search.TourSearch.work
    monkeypatch.setattr(
        tour_search.TourSearch, "work", lambda self, site: (work(self, site), done.append(self.units))[0]
    )
    return done


def begun() -> BackgroundHost:
    host = BackgroundHost(NOW.team)
    host.set_task(NOW)
    return host


def test_what_was_foreseen_is_at_hand_and_is_what_would_have_been_found(units: list[int]) -> None:
    expected = plans_after(PlannerHost(NOW.team), NEXT)
    assert units == list(range(1, 41)), "all of it was searched"
    units.clear()
    host = begun()
    host.foresee(msgspec.structs.replace(NEXT, t_s=7.0, revision=9))
    assert host._next is not None
    host._next._thread.join()
    assert units == list(range(1, 41))
    assert plans_after(host, NEXT) == expected
    assert len(units) == 40, "nothing was searched twice"
    assert host.revision == 2


@pytest.mark.long
def test_an_interrupted_search_continues_where_it_was(units: list[int]) -> None:
    expected = plans_after(PlannerHost(NOW.team), NEXT)
    units.clear()
    host = begun()
    host.foresee(NEXT)
    assert plans_after(host, NEXT) == expected
    assert sorted(set(units)) == list(range(1, 41)), "ahead or when it was granted"


@pytest.mark.long
def test_another_task_than_was_foreseen_is_planned_anew() -> None:
    other = msgspec.structs.replace(NEXT, zone=zone_of(Circle((220.0, 200.0), 45.0)))
    host = begun()
    host.foresee(NEXT)
    assert plans_after(host, other) == plans_after(PlannerHost(NOW.team), other)
    assert host._next is None


def test_the_present_task_said_again_changes_nothing() -> None:
    host = begun()
    host.foresee(NEXT)
    host.set_task(msgspec.structs.replace(NOW, t_s=5.0))
    assert host._next is not None and host.revision == NOW.revision


def test_a_planner_that_cannot_work_ahead_is_not_foreseen() -> None:
    host = BackgroundHost(NOW.team)
    host.foresee(NEXT)
    assert host._next is None, "it has nothing to fly yet"
    host.set_task(msgspec.structs.replace(NOW, planner="waypoints", parameters={}))
    host.foresee(msgspec.structs.replace(NEXT, planner="waypoints", parameters={}))
    assert host._next is None


def test_what_fails_ahead_is_done_again_when_it_is_due(monkeypatch: pytest.MonkeyPatch) -> None:
    from tui_gcs.planner.patrol.patrol import Patrol

    expected = plans_after(PlannerHost(NOW.team), NEXT)

    def fails(self: Patrol, go_on: object) -> None:
        raise RuntimeError("not now")

    monkeypatch.setattr(Patrol, "ahead", fails)
    host = begun()
    host.foresee(NEXT)
    assert plans_after(host, NEXT) == expected
