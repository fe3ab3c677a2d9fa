"""More vehicles need places: near the others, inside every area, each on a layer of its own."""

from pathlib import Path

import msgspec
import pytest

import tui_gcs
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse, read_text
from tui_gcs.core.scenario.model import TakeOffPlace, Team
from tui_gcs.core.scenario.place_allocation import new_place, unused_places, vehicles_without_place
from tui_gcs.core.scenario.template import new_scenario

TEXT = read_text(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")
SHIPPED = parse(TEXT)


def teams(*vehicles: tuple[int, ...]) -> list[Team]:
    return [Team(f"t{i}", "home", "patrol", ids) for i, ids in enumerate(vehicles)]


def test_who_has_no_place_and_which_places_nobody_needs() -> None:
    assert vehicles_without_place(SHIPPED.teams, SHIPPED.places) == []
    assert vehicles_without_place(teams((1, 2, 9), (5, 12)), SHIPPED.places) == [9, 12]
    assert vehicles_without_place(teams((1, 2, 9), (5, 12)), [*SHIPPED.places, TakeOffPlace((0.0, 0.0), 83.0)]) == [12]
    assert vehicles_without_place([Team("t", "home", "patrol", count=10)], SHIPPED.places) == [None, None]
    assert unused_places(teams((1, 2, 3)), SHIPPED.places) == [3, 4, 5, 6, 7]
    assert unused_places([Team("t", "home", "patrol", count=2)], SHIPPED.places) == []


def test_new_places_make_a_valid_scenario_until_the_altitude_band_is_full() -> None:
    document, places = ScenarioDocument(TEXT), list(SHIPPED.places)
    document.set_team("defend", count=4)
    document.set_team("attack", count=4)
    for layer_m in (83.0, 90.0, 20.0):
        places.append(new_place(places, SHIPPED.rounds, SHIPPED.limits, None))
        assert places[-1].layer_m == layer_m
        document.add_place(places[-1])
        assert parse(document.text).places[-1] == places[-1], "parse judges distances, layers and areas"
    with pytest.raises(ScenarioError, match="no altitude layer left for vehicle 12: 20 to 90 m has room for 15 at 5 m"):
        new_place(places, SHIPPED.rounds, SHIPPED.limits, None)


def test_there_may_be_no_room_on_the_ground() -> None:
    area = msgspec.structs.replace(SHIPPED.rounds[0].area.shape, width_m=8.0, height_m=8.0, centre_m=(25.0, 230.0))
    tight = msgspec.structs.replace(SHIPPED.rounds[0], area=msgspec.structs.replace(SHIPPED.rounds[0].area, shape=area))
    with pytest.raises(ScenarioError, match="no room for another take-off place"):
        new_place(SHIPPED.places, [tight], SHIPPED.limits, 9)


def test_a_new_place_shares_the_layer_of_a_team_that_it_never_meets() -> None:
    scenario = parse(new_scenario("new", SHIPPED.origin, 4, teams=2))
    larger = [scenario.teams[0], msgspec.structs.replace(scenario.teams[1], vehicles=(3, 4, 5))]
    taller = [*scenario.places[:1], msgspec.structs.replace(scenario.places[1], layer_m=60.0), *scenario.places[2:]]
    assert new_place(taller, scenario.rounds, scenario.limits, 5, larger).layer_m == 39.0, "above its team's 32 m"
    assert new_place(taller, scenario.rounds, scenario.limits, 5).layer_m == 67.0, "above all"
