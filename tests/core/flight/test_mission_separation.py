"""Two vehicles on missions that meet are stopped before they do, planner or not. Whole flights in lock-step."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from sitl.common.missions import Item
from tests.core.flight.test_other_stations import AUTO, OtherStation, order
from tests.core.rigs.rig import Rig, goto
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import Annotation, Phase
from tui_gcs.core.protocol.flight import GoTo, OnBoardMission
from tui_gcs.core.protocol.services import CompareMission, ServiceReply, SetMode
from tui_gcs.core.protocol.setup import SetCurrentItem
from tui_gcs.core.requests.plan_rows import plan_rows

pytestmark = pytest.mark.long

MakeRig = Callable[..., Rig]
Place = tuple[float, float, float]
MEETING = [(300.0, 300.0, 40.0), (300.0, 100.0, 40.0)]
LOITER = 5
NAN = math.nan


def spread(frame: m.FleetFrame, task: m.PlannerTask) -> list[m.Intent]:
    """Vehicles stand 100 m apart, west of the missions: nothing is in the way of a mission's begin."""
    return [goto(v, 120.0, 60.0 + 100.0 * v, task.layers_m[v]) for v in task.members]


def aloft(rig: MakeRig, vehicles: int, autopilots: str = "ardupilot") -> Rig:
    """So many vehicles stand in the air at the places of `spread`."""
    return rig(vehicles, autopilots=autopilots, wants=spread).flying().run(45.0)


def holds_missions(flight: Rig, ways: dict[int, list[Place]], *, known: bool) -> None:
    """Each vehicle holds a mission over its places; with `known` this station has read it."""
    for vehicle, places in ways.items():
        pilot = flight.sim._pilots[flight.sim_index[vehicle]]
        is_ardupilot = flight.station.picture.fleet.vehicles[vehicle].autopilot == 3
        items = []
        for x_m, y_m, z_m in [(0.0, 0.0, 0.0), *places] if is_ardupilot else places:  # its first item is home
            lat, lon = flight.station.picture.fleet.frame.to_geodetic(x_m, y_m)
            items.append(Item(16, frame=3, x=round(float(lat) * 1e7), y=round(float(lon) * 1e7), z=z_m))
        pilot.platform.plans.put(0, items)
        pilot.platform.plans.feasible = True
        state = flight.station.services.missions.state(vehicle)
        state.total = len(items)
        if known:
            state.held[PlanKind.MISSION].plan = plan_of_items(items[is_ardupilot:])


def plan_of_items(items: list[Item]) -> Plan:
    return Plan(PlanKind.MISSION, tuple(PlanItem(i.command, i.frame, x=i.x, y=i.y, z=i.z) for i in items))


def ask(flight: Rig, request: m.Request) -> ServiceReply:
    """Ask for what is done by tasks."""
    return m.decode(flight.bus.ask(REQUEST.format(principal="console-1"), m.encode(request)), ServiceReply)


def refusals(reply: ServiceReply) -> list[str]:
    return [result.text for result in reply.results if not result.ok]


def starts_missions(flight: Rig, ways: dict[int, list[Place]], *, known: bool = False, sure: bool = False) -> list[str]:
    """Each vehicle flies over its places, east, north and height in metres, by an operator's order."""
    holds_missions(flight, ways, known=known)
    reply = ask(flight, OnBoardMission(tuple(ways), "start", sure=sure or not known))
    return refusals(reply)


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


def test_one_that_turns_away_while_there_is_room_to_brake_is_not_stopped(rig: MakeRig) -> None:
    """It flies straight at a vehicle that stands, and turns 80 m before it: at 8 m/s it needs less than 60 m."""
    flight = aloft(rig, 2)
    x_m, y_m, z_m = flight.place(1)
    end_m = (x_m + 80.0, y_m + 200.0)
    starts_missions(flight, {2: [(x_m + 200.0, y_m, z_m), (x_m + 80.0, y_m, z_m), (*end_m, z_m)]})
    flight.until(lambda: math.dist(flight.place(2)[:2], end_m) < 5.0, 300.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    assert not [text for text in flight.texts() if text.startswith("HELD on its mission")]


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
    flight = aloft(rig, 3)
    starts_missions(flight, {1: [(300.0, 300.0, 40.0), (300.0, 100.0, 40.0)]}, known=True)
    across = starts_missions(flight, {2: [(200.0, 150.0, 40.0), (400.0, 150.0, 40.0)]}, known=True)
    assert len(across) == 1 and "of that of vehicle 1, which is on its mission" in across[0]
    assert starts_missions(flight, {3: [(80.0, 280.0, 45.0), (60.0, 320.0, 45.0)]}, known=True) == []


# ---------------------------------------------------------------- other ways to begin a mission


@pytest.mark.parametrize(("autopilots", "mode"), [("ardupilot", "AUTO"), ("px4", "MISSION")])
def test_a_mode_that_flies_the_mission_is_judged_as_its_start_is(rig: MakeRig, autopilots: str, mode: str) -> None:
    flight = aloft(rig, 2, autopilots)
    holds_missions(flight, dict.fromkeys((1, 2), MEETING), known=True)
    refused = refusals(ask(flight, SetMode((1, 2), mode, sure=True)))
    assert len(refused) == 2 and "it would come within" in refused[0] and "meant that ways meet" in refused[0]
    flight.run(3.0)
    assert flight.phases() == {Phase.FLYING}
    assert ask(flight, SetMode((1, 2), mode, sure=True, meet=True)).ok
    flight.run(1.5)
    assert {f.step for f in flight.station.flight.flights} == {TakenOut.ON_BOARD}
    assert least_apart_m(flight, 60.0) > 3.0


def test_a_mission_that_was_not_read_is_read_before_it_is_flown(rig: MakeRig) -> None:
    """Put there by another station: nothing was known of it, and nothing was said."""
    flight = aloft(rig, 3)
    holds_missions(flight, dict.fromkeys((1, 2), MEETING), known=False)
    order(flight, OnBoardMission((1,), "start", sure=True))
    flight.run(2.0)
    assert flight.station.flight.flights.by_id[1].step is TakenOut.ON_BOARD
    reply = ask(flight, OnBoardMission((2,), "start"))
    flight.run(8.0)
    task = flight.station.frontend.requests.tasks.get(reply.tasks[0].number)
    assert task is not None and "of that of vehicle 1, which is on its mission" in task.text
    assert flight.phase(2) is Phase.FLYING


def test_a_mission_that_cannot_be_read_is_said_to_be_not_compared(rig: MakeRig) -> None:
    flight = aloft(rig, 3)
    holds_missions(flight, {1: MEETING, 2: [(80.0, 280.0, 60.0)]}, known=False)
    order(flight, OnBoardMission((1,), "start", sure=True))
    flight.run(3.0)
    flight.station.picture.fleet._on_message["MISSION_COUNT"].clear()  # the vehicle does not answer
    reply = ask(flight, OnBoardMission((2,), "start"))
    flight.run(40.0)
    task = flight.station.frontend.requests.tasks.get(reply.tasks[0].number)
    assert task is not None
    assert task.text == "flies its mission; not compared with others: its mission was not read"


def test_a_mission_across_a_patrol_s_tour_is_refused(rig: MakeRig) -> None:
    flight = aloft(rig, 3)
    layer_m = flight.station.flight.flights.by_id[1].layer_m
    loop = tuple((300.0 + 50.0 * math.cos(a), 200.0 + 50.0 * math.sin(a)) for a in map(math.radians, range(0, 360, 30)))
    flight.planning = False
    flight.plan(goto(1, 250.0, 150.0, layer_m), annotations=(Annotation("polyline", (*loop, loop[0])),))
    assert flight.station.active.team_controllers["defend"].annotations[0].is_loop
    holds_missions(flight, {2: [(200.0, 200.0, layer_m), (400.0, 200.0, layer_m)]}, known=True)
    refused = refusals(ask(flight, OnBoardMission((2,), "start")))
    assert len(refused) == 1 and "of the tour of vehicle 1 for team defend" in refused[0]


def test_another_item_whose_way_meets_a_mission_is_refused(rig: MakeRig) -> None:
    flight = aloft(rig, 3)
    starts_missions(flight, {1: MEETING}, known=True)
    beside = [(80.0, 280.0, 45.0), (60.0, 320.0, 45.0), (200.0, 150.0, 40.0), (400.0, 150.0, 40.0)]
    starts_missions(flight, {3: beside}, known=True, sure=True)
    flight.run(4.0)
    refused = refusals(ask(flight, SetCurrentItem((3,), 4, sure=True)))
    assert len(refused) == 1 and "of that of vehicle 1, which is on its mission" in refused[0]
    assert refusals(ask(flight, SetCurrentItem((3,), 4, sure=True, meet=True))) == []


def test_an_upload_is_compared_with_what_others_hold(rig: MakeRig) -> None:
    ground = rig(3).ready()
    holds_missions(ground, {1: MEETING}, known=True)
    plan = ground.station.services.missions.state(1).held[PlanKind.MISSION].plan
    assert plan is not None
    reply = ask(ground, CompareMission((2,), plan_rows(plan)))
    assert not reply.ok and "of vehicle 1 after" in reply.results[0].text
    holds_missions(ground, {3: MEETING}, known=False)
    assert "not compared with vehicle 3" in ask(ground, CompareMission((2,), plan_rows(plan))).text
    beside = ask(ground, CompareMission((2,), plan_rows(plan), replaced=(1, 3)))
    assert beside.ok and beside.text == "", "what they hold is replaced at the same time"


def test_what_a_vehicle_flies_is_compared_although_its_mission_is_replaced(rig: MakeRig) -> None:
    flight = aloft(rig, 3)
    starts_missions(flight, {1: MEETING}, known=True)
    plan = flight.station.services.missions.state(1).held[PlanKind.MISSION].plan
    assert plan is not None
    reply = ask(flight, CompareMission((2,), plan_rows(plan), replaced=(1, 2)))
    assert not reply.ok and "of that of vehicle 1, which is on its mission" in reply.results[0].text


# ---------------------------------------------------------------- whoever began it


def test_missions_that_another_station_began_are_stopped_before_they_meet(rig: MakeRig) -> None:
    flight = aloft(rig, 2)
    holds_missions(flight, dict.fromkeys((1, 2), MEETING), known=False)
    for vehicle in (1, 2):
        OtherStation(flight).mode(vehicle, AUTO)
    flight.run(1.0)
    assert {int(mode) for mode in flight.sim.mode} == {AUTO}
    assert least_apart_m(flight, 90.0) > 3.0
    assert any(text.startswith("HELD on its mission: ") for text in flight.texts("vehicle 1"))


def test_missions_under_way_are_stopped_by_a_station_that_was_restarted(rig: MakeRig, tmp_path: Path) -> None:
    flight = aloft(rig, 2)
    starts_missions(flight, dict.fromkeys((1, 2), MEETING))
    flight.run(2.0)
    flight.restart_station(StateStore(tmp_path / "never-written.json"))
    assert least_apart_m(flight, 90.0) > 3.0
    assert any(text.startswith("HELD on its mission: ") for text in flight.texts("vehicle 1"))


def test_one_of_no_team_keeps_its_way_and_ours_is_stopped(rig: MakeRig) -> None:
    """What this station may not stop flies on; what it may stop is held."""
    flight = aloft(rig, 2)
    holds_missions(flight, dict.fromkeys((1, 2), MEETING), known=False)
    del flight.station.flight.flights.by_id[2]
    OtherStation(flight).mode(2, AUTO)
    order(flight, OnBoardMission((1,), "start", sure=True))
    assert least_apart_m(flight, 60.0) > 3.0
    assert flight.phase(1) is Phase.HOLDING and int(flight.sim.mode[1]) == AUTO
    assert any(text.startswith("HELD on its mission: ") for text in flight.texts("vehicle 1"))


def test_one_that_its_pilot_has_just_taken_may_not_be_stopped(rig: MakeRig) -> None:
    """For 3 s it counts as on its mission: a hold for separation took it from its pilot then."""
    flight = aloft(rig, 1)
    starts_missions(flight, {1: MEETING})
    flight.run(3.0)
    vehicle, executive = flight.station.picture.fleet.vehicles[1], flight.station.flight.executive
    assert executive.may_stop_by_itself(vehicle)
    flight.pilot(1, LOITER)
    flight.until(lambda: vehicle.telemetry.custom_mode == LOITER, 3.0)
    assert flight.station.flight.flights.by_id[1].step is TakenOut.ON_BOARD
    assert not executive.may_stop_by_itself(vehicle)


# ---------------------------------------------------------------- patrol and manual flight against missions


def test_a_patrol_and_a_mission_do_not_meet(rig: MakeRig) -> None:
    """The planner's vehicle is vetoed, the one on its mission is held."""

    def back_and_forth(frame: m.FleetFrame, task: m.PlannerTask) -> list[m.Intent]:
        y_m = 100.0 if frame.t_s % 80.0 < 40.0 else 300.0
        return [goto(v, 260.0 if v == 1 else 200.0, y_m if v == 1 else 400.0, task.layers_m[v]) for v in task.members]

    flight = rig(2, wants=back_and_forth).flying().run(25.0)
    layer_m = flight.station.flight.flights.by_id[1].layer_m
    starts_missions(flight, {2: [(260.0, 200.0 + 100.0 * (-1) ** n, layer_m) for n in range(6)]})
    assert least_apart_m(flight, 150.0) > 3.0


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_manual_flight_and_a_mission_do_not_meet(rig: MakeRig, autopilots: str) -> None:
    flight = aloft(rig, 2, autopilots)
    z_m = flight.place(2)[2]
    starts_missions(flight, {2: [(300.0, 200.0 + 100.0 * (-1) ** n, z_m) for n in range(6)]})
    flight.until(lambda: math.dist(flight.place(2), (300.0, 300.0, z_m)) < 10.0, 60.0)
    order(flight, GoTo((1,), ((300.0, 200.0, z_m),)))
    assert least_apart_m(flight, 60.0) > 3.0
    assert any("HELD on its mission" in text or "guard veto" in text for text in flight.texts())
