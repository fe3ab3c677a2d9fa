"""Ways home: not through each other, and not through what must not be flown over."""

import math
from collections.abc import Callable
from itertools import combinations
from unittest.mock import patch

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.fleet_monitor import FleetMonitor
from tui_gcs.core.flight.flights import Flight, FlightTable, ReturnStep
from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Shape, Zone, contains
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask, RunPhase, Vec3
from tui_gcs.core.scenario.model import Scenario

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]


def nearest_m(flight: Rig, until: Callable[[], bool], limit_s: float) -> float:
    """Let time pass; the smallest true distance of two vehicles that are both above 2 m."""
    nearest = math.inf

    def look() -> bool:
        nonlocal nearest
        high = [p for p in map(flight.place, flight.ids) if p[2] > 2.0]
        nearest = min([nearest, *(math.dist(a, b) for a, b in combinations(high, 2))])
        return until()

    flight.until(look, limit_s)
    return nearest


# ---------------------------------------------------------------- above and below each other


def one_above_the_other(rig: MakeRig) -> Rig:
    """Vehicles 1 and 2 hold at the same place; 1, whose layer is 7 m below 2's, was brought 11 m above it."""

    def same_place(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        x = {1: 200.0, 2: 200.0, 3: 290.0}
        return [Intent(vehicle=v, kind="goto", position_m=(x[v], 200.0, task.layers_m[v])) for v in task.members]

    flight = rig(3, wants=same_place).flying().run(30.0)
    assert flight.ask(m.Hold()).ok
    flight.run(10.0)
    i = flight.sim_index[1]
    flight.sim._vehicles.position_m[i, 2] = flight.sim._vehicles.target_m[i, 2] = 45.0
    flight.run(3.0)
    assert math.dist(flight.place(1), flight.place(2)) == pytest.approx(11.0, abs=1.0)
    return flight


def test_on_its_way_to_its_layer_a_returning_vehicle_does_not_descend_through_one_that_hovers(rig: MakeRig) -> None:
    flight = one_above_the_other(rig)
    assert flight.ask(m.Return(vehicles=(1,))).ok
    end_s = flight.clock.now() + 60.0
    assert nearest_m(flight, lambda: flight.clock.now() > end_s, 61.0) > 4.0
    assert flight.station.flight.monitor.violations == 0


def test_return_of_all_brings_them_down_without_meeting(rig: MakeRig) -> None:
    flight = one_above_the_other(rig)
    assert flight.ask(m.Return()).ok
    assert nearest_m(flight, lambda: not flight.sim.armed.any(), 200.0) > 4.0
    assert flight.station.flight.monitor.violations == 0
    for v, y in ((1, 170.0), (2, 190.0), (3, 210.0)):
        assert math.dist(flight.place(v)[:2], (45.0, y)) <= 1.5


def stacked(rig: MakeRig, heights_m: dict[int, float]) -> Rig:
    """All hold above one place; then they are brought to these heights, out of the order of their layers."""

    def same_place(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return [Intent(vehicle=v, kind="goto", position_m=(200.0, 200.0, task.layers_m[v])) for v in task.members]

    flight = rig(len(heights_m), wants=same_place).flying().run(35.0)
    assert flight.ask(m.Hold()).ok
    flight.run(8.0)
    for v, height_m in heights_m.items():
        i = flight.sim_index[v]
        flight.sim._vehicles.position_m[i, 2] = flight.sim._vehicles.target_m[i, 2] = height_m
    flight.run(1.0).station.picture.jump_monitor.__init__()  # forget: they are where they report
    return flight.run(2.0)


def test_a_stack_in_the_wrong_order_gets_home(rig: MakeRig) -> None:
    """Each is in the way of the others: they go aside, change their heights there, and come home."""
    flight = stacked(rig, {1: 41.0, 2: 34.0, 3: 27.0})
    seen_before = flight.station.flight.monitor.violations  # while they were brought there, positions come in turn
    assert flight.ask(m.Return()).ok
    assert nearest_m(flight, lambda: not flight.sim.armed.any(), 200.0) > 4.0
    assert flight.station.flight.monitor.violations == seen_before
    assert any("goes aside on its way home: too close to vehicle" in text for text in flight.texts())


def test_one_that_returns_goes_round_one_that_holds_at_the_height_of_its_layer(rig: MakeRig) -> None:
    flight = stacked(rig, {1: 41.0, 2: 27.0})
    assert flight.ask(m.Return(vehicles=(1,))).ok
    end_s = flight.clock.now() + 90.0
    assert nearest_m(flight, lambda: flight.phase(1) is Phase.GROUND or flight.clock.now() > end_s, 91.0) > 4.0
    assert flight.phase(1) is Phase.GROUND and flight.phase(2) is Phase.HOLDING
    assert flight.station.flight.monitor.violations == 0


@pytest.mark.parametrize(("late", "x", "y"), [(1, 240.0, 200.0), (3, 60.0, 120.0), (1, 60.0, 260.0)])
def test_with_an_empty_battery_nobody_waits_above_its_home(rig: MakeRig, late: int, x: float, y: float) -> None:
    """Two real ArduCopters did, at 0 %, for one with a weak motor. Unless that one passes below it."""

    def places(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        where = {v: (200.0 + 20.0 * v, 240.0) for v in task.members} | {late: (x, y)}
        return [Intent(vehicle=v, kind="goto", position_m=(*where[v], task.layers_m[v])) for v in task.members]

    flight = rig(3, wants=places).flying()
    flight.until(lambda: math.dist(flight.place(late)[:2], (x, y)) < 2.0 and flight.speed(2) < 0.3, 90.0)
    blocked = flight.station.flight.steering.blocked
    with patch.object(  # it does not come
        flight.station.flight.steering,
        "blocked",
        lambda f, *more: "somebody" if f.vehicle == late else blocked(f, *more),
    ):
        assert flight.ask(m.Return()).ok
        flight.until(lambda: flight.station.flight.flights.by_id[2].step is ReturnStep.OVER_HOME, 90.0)
        flight.run(5.0)
        assert flight.phase(2) is Phase.RETURNING, "its battery is good"
        flight.sim._pilots[flight.sim_index[2]].discharge(0.09)
        flight.run(5.0)
    passes = (x, y) == (60.0, 260.0)
    assert flight.phase(2) is (Phase.RETURNING if passes else Phase.LANDING)
    lands = any("lands before the others are above their homes" in text for text in flight.texts("vehicle 2"))
    assert lands is not passes


def test_one_that_cannot_go_on_says_why(rig: MakeRig) -> None:
    """In an area no wider than itself there is no place aside."""
    flight = stacked(rig, {1: 41.0, 2: 34.0})
    slot = Rectangle(centre_m=(200.0, 200.0), width_m=8.0, height_m=8.0)
    guard = flight.station.flight.guard
    guard.set_round(guard.limits, msgspec.structs.replace(guard.area, shape=slot), ())
    assert flight.ask(m.Return(vehicles=(1,))).ok
    flight.run(8.0)
    text = "waits on its way home: too close to vehicle 2 in 0.0 s; there is no free place beside it"
    assert any(text[:44] in reported and text[51:] in reported for reported in flight.texts("vehicle 1"))
    assert flight.place(1)[2] == pytest.approx(41.0, abs=2.0)


def test_planners_vehicles_keep_clear_of_one_that_lands_in_its_own_column(rig: MakeRig) -> None:
    """Vehicle 2 waits beside the column of vehicle 1 and is sent through it while 1 comes down."""
    begun: list[int] = []

    def through_the_column(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        begun.extend(v for v, phase in zip(frame.ids, frame.phase, strict=True) if phase is Phase.LANDING)
        there = (45.0, 170.0, 20.5) if begun else (66.0, 186.0, 20.5)
        return [
            Intent(vehicle=1, kind="goto", position_m=(100.0, 170.0, 27.0)),
            Intent(vehicle=2, kind="goto", position_m=there),
        ]

    flight = rig(2, wants=through_the_column).flying().run(25.0)
    assert math.dist(flight.place(2), (66.0, 186.0, 20.5)) < 1.0
    assert flight.ask(m.Return(vehicles=(1,))).ok
    flight.until(lambda: bool(begun), 60.0)
    while flight.place(1)[2] > 2.0:
        flight.step()
        down, passing = flight.place(1), flight.place(2)
        level, upright = math.dist(down[:2], passing[:2]), abs(down[2] - passing[2])
        assert level > 9.0 or upright > 4.5, (down, passing)
    flight.until(lambda: math.dist(flight.place(2), (45.0, 170.0, 20.5)) < 1.0, 30.0, "then the way is free")


def seen_by_the_monitor(at_m: Vec3, home_m: Vec3) -> int:
    """Violations counted when vehicle 1, whose home is there, lands at `at_m` with vehicle 2 1 m beside it."""
    whole = scenario(2)
    guard = Guard(whole.limits, whole.rounds[0].area, ())
    flights = FlightTable(
        {
            1: Flight(1, "defend", 27.0, Phase.LANDING, home_m=home_m),
            2: Flight(2, "defend", 34.0, Phase.HOLDING, home_m=(45.0, 190.0, 0.0)),
        }
    )
    monitor = FleetMonitor(guard, flights)
    monitor.look([hovering(1, at_m), hovering(2, (at_m[0] + 1.0, at_m[1], at_m[2]))])
    return monitor.violations


def hovering(system: int, position_m: Vec3) -> Vehicle:
    fix = (0, 0, 0, 0, 0, 0, 0, 100, 0)
    return a_vehicle(system, fix=fix, armed=True, landed_state=2, position_m=position_m)


def test_the_monitor_counts_who_lands_too_close_away_from_its_own_column() -> None:
    assert seen_by_the_monitor((200.0, 200.0, 20.0), home_m=(45.0, 170.0, 0.0)) == 1
    assert seen_by_the_monitor((45.0, 170.0, 20.0), home_m=(45.0, 170.0, 0.0)) == 0


# ---------------------------------------------------------------- no-fly zones

BETWEEN = Rectangle(centre_m=(130.0, 200.0), width_m=30.0, height_m=120.0)
OVER_THE_HOMES = Circle(centre_m=(45.0, 200.0), radius_m=25.0)


def with_no_fly(shape: Shape, round_index: int) -> Scenario:
    """Two vehicles; this shape must not be flown over in one of the rounds."""
    whole = scenario(2)
    rounds = list(whole.rounds)
    crowd = Zone(name="crowd", role=Role.NO_FLY, shape=shape)
    rounds[round_index] = msgspec.structs.replace(rounds[round_index], zones=(*rounds[round_index].zones, crowd))
    return msgspec.structs.replace(whole, rounds=tuple(rounds))


def test_return_goes_around_a_no_fly_zone(rig: MakeRig) -> None:
    flight = rig(mission=with_no_fly(BETWEEN, 1)).flying().run(30.0)
    assert all(flight.place(v)[0] > 200.0 for v in flight.ids)
    assert flight.ask(m.SwitchRound(index=1)).ok
    flight.run(3.0)
    assert flight.ask(m.Return()).ok
    inside = 0

    def landed() -> bool:
        nonlocal inside
        inside += int(contains(BETWEEN, [flight.place(v)[:2] for v in flight.ids]).sum())
        return not flight.sim.armed.any()

    flight.until(landed, 180.0)
    assert inside == 0
    for v, y in ((1, 170.0), (2, 190.0)):
        assert math.dist(flight.place(v)[:2], (45.0, y)) <= 1.5


def test_a_round_whose_no_fly_zone_covers_homes_in_use_is_refused_in_flight(rig: MakeRig) -> None:
    flight = rig(mission=with_no_fly(OVER_THE_HOMES, 1)).flying().run(20.0)
    reply = flight.ask(m.SwitchRound(index=1))
    assert not reply.ok and (reply.text or reply.results)
    assert flight.station.active.round_index == 0
    assert flight.station.flight.executive.run is RunPhase.RUNNING
