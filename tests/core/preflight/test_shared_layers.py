"""Vehicles that share a layer start from their own places; from elsewhere their ways could cross."""

from types import SimpleNamespace
from typing import cast

from tests.core.rigs.flight_rig import Watch
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.preflight.readiness import Readiness
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.scenario.template import new_scenario
from tui_gcs.core.station.assembly import StationParts

SCENARIO = parse(new_scenario("new", Origin(52.0, -0.6, 100.0), 4, teams=2))
"""1 and 3, of two teams, are on 25 m; 2 and 4 on 32 m."""


def refused(standing_m: dict[int, Vec3]) -> dict[int, str]:
    """Why vehicles may not start together, if these stand elsewhere than at their places."""
    watch, flights = Watch(4), FlightTable()
    flights.assign(SCENARIO, [])
    for place in SCENARIO.places:
        assert place.vehicle is not None
        watch.place(place.vehicle, standing_m.get(place.vehicle, (*place.place_m, 0.0)))
    parts = SimpleNamespace(
        flight=SimpleNamespace(flights=flights),
        picture=SimpleNamespace(fleet=watch.fleet),
        active=SimpleNamespace(scenario=SCENARIO),
    )
    results = Readiness(cast(StationParts, parts)).beside((1, 2, 3, 4))
    return {result.vehicle: result.text for result in results if not result.ok}


def test_at_their_places_all_may_start_with_the_noise_of_their_gps() -> None:
    x, y = SCENARIO.places[0].place_m
    assert refused({}) == {} and refused({1: (x + 3.0, y - 4.0, 0.0)}) == {}


def test_one_that_stands_with_the_other_team_is_named_before_the_start() -> None:
    x, y = SCENARIO.places[2].place_m
    text = "from where it stands it may meet vehicle {} on the same layer: carry it to its place"
    assert refused({1: (x, y - 30.0, 0.0)}) == {1: text.format(3), 3: text.format(1)}
