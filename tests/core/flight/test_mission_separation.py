"""Two vehicles on missions that meet are stopped before they do, planner or not. Whole flights in lock-step."""

import math
from collections.abc import Callable

import pytest

from sitl.common.missions import Item
from tests.core.flight.test_other_stations import order
from tests.core.rigs.rig import Rig
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.protocol.flight import OnBoardMission
from tui_gcs.core.protocol.services import ServiceReply

pytestmark = pytest.mark.long

MakeRig = Callable[..., Rig]
Place = tuple[float, float, float]


def starts_missions(flight: Rig, ways: dict[int, list[Place]], *, known: bool = False, sure: bool = False) -> list[str]:
    """Each vehicle flies over its places, east, north and height in metres, by an operator's order."""
    for vehicle, places in ways.items():
        pilot = flight.sim._pilots[flight.sim_index[vehicle]]
        is_ardupilot = flight.station.picture.fleet.vehicles[vehicle].autopilot == 3
        items = []
        for x_m, y_m, z_m in [(0.0, 0.0, 0.0), *places] if is_ardupilot else places:  # its first item is home
            lat, lon = flight.station.picture.fleet.frame.to_geodetic(x_m, y_m)
            items.append(Item(16, frame=3, x=round(float(lat) * 1e7), y=round(float(lon) * 1e7), z=z_m))
        pilot.platform.plans.put(0, items)
        pilot.platform.plans.feasible = True
        flight.station.services.missions.state(vehicle).total = len(items)
        state = flight.station.services.missions.state(vehicle)
        if known:
            state.held[PlanKind.MISSION].plan = Plan(
                PlanKind.MISSION, tuple(PlanItem(i.command, i.frame, x=i.x, y=i.y, z=i.z) for i in items[is_ardupilot:])
            )
    if known and not sure:
        key, asked = REQUEST.format(principal="console-1"), OnBoardMission(tuple(ways), "start")
        reply = m.decode(flight.bus.ask(key, m.encode(asked)), ServiceReply)
        return [result.text for result in reply.results if not result.ok]
    order(flight, OnBoardMission(tuple(ways), "start", sure=sure))
    return []


def least_apart_m(flight: Rig, seconds: float, one: int = 1, other: int = 2) -> float:
    """The least distance of two vehicles in this time."""
    least_m = math.inf
    for _ in range(round(seconds / 0.1)):
        flight.run(0.1)
        least_m = min(least_m, math.dist(flight.place(one), flight.place(other)))
    return least_m


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_two_on_one_mission_are_stopped_before_they_meet(rig: MakeRig, autopilots: str) -> None:
    """Two real ArduCopters on one mission came to 0 m of each other."""
    flight = rig(2, autopilots=autopilots).flying().run(15.0)
    starts_missions(flight, {v: [(300.0, 300.0, 40.0), (300.0, 100.0, 40.0)] for v in (1, 2)})
    assert least_apart_m(flight, 90.0) > 3.0
    assert any(text.startswith("HELD on its mission: ") for text in flight.texts("vehicle 1"))
    assert flight.phases() == {Phase.HOLDING} and max(flight.speed(1), flight.speed(2)) < 0.5


def test_one_that_meets_a_vehicle_which_stands_is_stopped(rig: MakeRig) -> None:
    flight = rig(2).flying().run(15.0)
    x_m, y_m, z_m = flight.place(1)
    starts_missions(flight, {2: [(x_m + 150.0, y_m, z_m), (x_m - 100.0, y_m, z_m)]})
    assert least_apart_m(flight, 120.0) > 3.0
    assert flight.phase(2) is Phase.HOLDING


def test_missions_apart_are_flown_to_their_ends(rig: MakeRig) -> None:
    flight = rig(2).flying().run(15.0)
    starts_missions(flight, {v: [(300.0, 300.0, 20.0 + 15.0 * v), (300.0, 100.0, 20.0 + 15.0 * v)] for v in (1, 2)})
    for vehicle in (1, 2):
        flight.until(lambda vehicle=vehicle: math.dist(flight.place(vehicle)[:2], (300.0, 100.0)) < 5.0, 300.0)
    assert not [text for text in flight.texts() if text.startswith("HELD on its mission")]


def test_missions_that_would_meet_are_not_begun_unless_that_is_meant(rig: MakeRig) -> None:
    flight = rig(2).flying().run(15.0)
    ways = {v: [(300.0, 300.0, 40.0), (300.0, 100.0, 40.0)] for v in (1, 2)}
    refused = starts_missions(flight, ways, known=True)
    assert len(refused) == 2 and "it would come within" in refused[0] and "say that it is meant" in refused[0]
    assert flight.phases() == {Phase.FLYING}
    starts_missions(flight, ways, known=True, sure=True)
    assert flight.phases() == {Phase.TAKEN_OUT}


def test_one_that_crosses_a_mission_under_way_is_refused_and_one_beside_it_is_not(rig: MakeRig) -> None:
    flight = rig(3).flying().run(15.0)
    starts_missions(flight, {1: [(300.0, 300.0, 40.0), (300.0, 100.0, 40.0)]}, known=True)
    across = starts_missions(flight, {2: [(200.0, 150.0, 40.0), (400.0, 150.0, 40.0)]}, known=True)
    assert len(across) == 1 and "meets that of vehicle 1, which is on its mission" in across[0]
    assert starts_missions(flight, {3: [(80.0, 280.0, 45.0), (60.0, 320.0, 45.0)]}, known=True) == []
