"""Groups that never come near each other start, return and land at the same time; none waits for another."""

from tests.core.flight.test_return_home import returning, steps
from tests.core.rigs.flight_rig import LAND, Watch
from tui_gcs.core.flight.flights import FlightTable, HoldStep
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.template import new_scenario


def test_those_of_one_team_are_one_group_and_share_layers_with_the_other() -> None:
    flights = FlightTable()
    flights.assign(parse(new_scenario("new", Origin(52.0, -0.6, 100.0), 5, teams=2)), [])
    assert [flight.group for flight in flights] == [0, 0, 0, 3, 3]
    assert [flight.layer_m for flight in flights] == [25.0, 32.0, 39.0, 25.0, 32.0]


def test_one_that_starts_beside_the_others_is_of_their_group() -> None:
    """It stands at the place of a vehicle of the other team: on its way it crosses theirs."""
    watch, flights = Watch(5), FlightTable()
    flights.assign(parse(new_scenario("new", Origin(52.0, -0.6, 100.0), 5, teams=2)), [])
    assert flights.scenario is not None
    x, y = flights.scenario.places[0].place_m
    standing = {5: watch.place(5, (x, y - 15.0, 0.0))}
    flights.group_by(standing)
    assert {flight.group for flight in flights} == {0}


def test_a_group_that_is_up_flies_while_another_one_climbs() -> None:
    watch = Watch(3)
    watch.flight(3).group = 2
    for number, height_m in ((1, 12.0), (2, 40.0), (3, 50.0)):
        watch.flies(number, (0.0, 30.0 * number, height_m), Phase.TAKEOFF)
    watch.executive.run = RunPhase.STARTING
    assert watch.run(0.3).phases() == [Phase.TAKEOFF, Phase.HOLDING, Phase.FLYING]
    assert watch.flight(2).step is HoldStep.READY and watch.executive.run is RunPhase.STARTING
    watch.place(1, (0.0, 30.0, 30.0))
    assert watch.run(0.3).phases() == [Phase.FLYING] * 3 and watch.executive.run is RunPhase.RUNNING


def test_groups_land_at_the_same_time_and_each_in_turn() -> None:
    watch = returning((0.0, 0.0, 30.0), (50.0, 0.0, 40.0), (100.0, 0.0, 50.0), (150.0, 90.0, 60.0))
    for number in (3, 4):
        watch.flight(number).group = 2
    watch.run(0.2)
    assert watch.phases() == [Phase.LANDING, Phase.RETURNING, Phase.RETURNING, Phase.RETURNING]
    watch.vehicle(1).telemetry.custom_mode = LAND
    watch.run(2.1)
    assert watch.phases()[:2] == [Phase.LANDING] * 2 and steps(watch)[2] == "over home", "3 waits for 4, 2 did not"


def test_one_on_the_same_layer_is_no_less_in_the_way_because_it_is_on_its_layer() -> None:
    """Two groups share a layer, and one of the other group has strayed into the way home."""
    watch = Watch(2)
    watch.flight(2).layer_m = 30.0
    watch.flies(1, (0.0, 100.0, 30.0))
    watch.flies(2, (0.0, 85.0, 30.0), Phase.HOLDING)
    watch.executive.go_home((1,))
    assert "to (0, 0, 30)" not in watch.run(1.0).orders(1)
    assert any(text.startswith("waits on its way home: too close to vehicle 2") for text in watch.told())
