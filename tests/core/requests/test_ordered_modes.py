"""Modes that an operator orders by name: what the vehicle then does by itself is no surprise. Flights in lock-step."""

from collections.abc import Callable

import pytest

from tests.core.flight.test_other_stations import GUIDED, LAND, OtherStation, left, on_its_mission, order
from tests.core.rigs.rig import Rig
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.protocol.services import SetMode

pytestmark = pytest.mark.long

MakeRig = Callable[..., Rig]
LOITER, RTL = 5, 6
PX4_RTL = 4 << 16 | 5 << 24


def lefts(flight: Rig, seconds: float) -> set[str]:
    """The texts of the alarm "left the mission" in this time."""
    seen = set()
    for _ in range(round(seconds / 0.5)):
        flight.run(0.5)
        seen.add(left(flight))
    return seen - {""}


@pytest.mark.parametrize(("autopilots", "rtl"), [("ardupilot", RTL), ("px4", PX4_RTL)])
def test_a_return_by_its_own_mode_is_no_surprise(rig: MakeRig, autopilots: str, rtl: int) -> None:
    """`tui-gcs vehicle mode 2 RTL` raised "a pilot or failsafe flies it"."""
    flight = rig(3, autopilots=autopilots).flying().run(20.0)
    order(flight, SetMode((2,), "RTL"))
    flight.run(2.0)
    assert int(flight.sim.mode[1]) == rtl
    assert flight.station.flight.flights.by_id[2].step is TakenOut.OWN_MODE
    assert lefts(flight, 8.0) == set()
    flight.until(lambda: not flight.sim.armed[1], 200.0, "landed")
    flight.run(2.0)
    assert left(flight) == ""
    assert "landed and disarmed in the mode that was ordered" in flight.texts("vehicle 2")


def test_a_landing_by_its_own_mode_is_a_landing_and_a_brake_is_a_hold(rig: MakeRig) -> None:
    flight = rig(3).flying().run(20.0)
    order(flight, SetMode((1,), "LAND"))
    order(flight, SetMode((2,), "BRAKE"))
    assert lefts(flight, 8.0) == set()
    assert (flight.phase(1), flight.phase(2), flight.phase(3)) == (Phase.LANDING, Phase.HOLDING, Phase.FLYING)
    assert flight.ask(m.Resume((2,))).ok
    flight.until(lambda: flight.phase(2) is Phase.FLYING, 30.0)


def test_a_mode_without_a_stop_takes_it_from_its_planner_when_it_is_there(rig: MakeRig) -> None:
    flight = rig(3).flying().run(20.0)
    order(flight, SetMode((2,), "LOITER", sure=True))
    assert flight.phase(2) is Phase.FLYING
    assert lefts(flight, 6.0) == set()
    assert int(flight.sim.mode[1]) == LOITER and flight.phase(2) is Phase.TAKEN_OUT
    assert "flies in LOITER, as ordered: not for its planner any more" in flight.texts("vehicle 2")


def test_a_vehicle_that_leaves_the_ordered_mode_is_alarmed(rig: MakeRig) -> None:
    flight = rig(3).flying().run(20.0)
    order(flight, SetMode((2,), "RTL"))
    flight.run(4.0)
    OtherStation(flight).mode(2, GUIDED)
    flight.run(6.0)
    assert left(flight) == "GUIDED: commanded by system 252"


def test_an_ordered_mode_that_came_from_another_station_before_it_was_ordered_is_alarmed(rig: MakeRig) -> None:
    flight = rig(3).flying().run(20.0)
    OtherStation(flight).mode(2, LAND)
    flight.run(5.0)
    assert left(flight) == "LAND: commanded by system 252"
    order(flight, SetMode((2,), "RTL"))
    assert lefts(flight.run(4.0), 4.0) == set()


@pytest.mark.parametrize("in_team", [True, False])
def test_a_vehicle_on_its_mission_that_is_sent_home_by_mode_is_not_alarmed(rig: MakeRig, in_team: bool) -> None:
    flight = on_its_mission(rig)
    if not in_team:
        del flight.station.flight.flights.by_id[2]
        flight.station.flight.courses.watch_mission(2)
        flight.run(1.0)
    order(flight, SetMode((2,), "RTL"))
    assert lefts(flight, 10.0) == set()


def test_a_mode_that_was_refused_is_news_when_it_comes_later(rig: MakeRig) -> None:
    flight = rig(3).flying().run(20.0)
    flight.station.flight.executive.mode_ordered(flight.station.picture.fleet.vehicles[2], LOITER)
    flight.station.flight.executive.mode_refused(flight.station.picture.fleet.vehicles[2], LOITER)
    flight.pilot(2, LOITER)
    flight.run(6.0)
    assert left(flight) == "LOITER"
