"""Layers by conflict: vehicles that can meet are on different layers, all others may share one; as few as possible."""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import tui_gcs
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.geometry.zones import polygon_of
from tui_gcs.core.missions.scenario_findings import layers_finding
from tui_gcs.core.scenario.layer_assignment import assign, layers_needed
from tui_gcs.core.scenario.load import ScenarioError, parse, read_text
from tui_gcs.core.scenario.template import new_scenario
from tui_gcs.core.scenario.vehicle_conflicts import apart_m, groups, member, place_conflicts, reaches

SHIPPED = read_text(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")
ORIGIN = Origin(52.0, -0.6, 100.0)


def without_layers(text: str) -> str:
    return re.sub(r"layer_m = .*\n", "", text)


def meet(pairs: list[tuple[int, int]], vehicles: int) -> np.ndarray:
    near = np.zeros((vehicles, vehicles), dtype=bool)
    for one, other in pairs:
        near[one, other] = near[other, one] = one != other
    return near


@given(st.integers(1, 14), st.data())
@settings(max_examples=60, deadline=None)
def test_no_two_that_meet_share_a_layer_and_those_that_were_given_stay(vehicles: int, data: st.DataObject) -> None:
    number = st.integers(0, vehicles - 1)
    near = meet(data.draw(st.lists(st.tuples(number, number), max_size=40)), vehicles)
    given_m = np.full(vehicles, np.nan)
    given_m[0] = 33.5
    layers_m = assign(near, given_m, 7.0, [25.0] * vehicles)
    assert layers_m[0] == 33.5 and (layers_m >= 25.0).all()
    for one, other in itertools.combinations(range(vehicles), 2):
        assert not near[one, other] or abs(layers_m[one] - layers_m[other]) >= 7.0 - 1e-6
    free = assign(near, np.full(vehicles, np.nan), 7.0, [25.0] * vehicles)
    needed = layers_needed(near)
    assert needed <= len(set(free.tolist())) <= 1 + int(near.sum(axis=1).max(initial=0)), "Brooks' bound of greedy"
    assert free.max() == 25.0 + 7.0 * (len(set(free.tolist())) - 1), "no layer is left out"


def test_a_ring_of_five_needs_three_layers_although_no_three_meet() -> None:
    ring = meet([(i, (i + 1) % 5) for i in range(5)], 5)
    assert layers_needed(ring) == 2
    assert sorted(set(assign(ring, np.full(5, np.nan), 7.0, [25.0] * 5).tolist())) == [25.0, 32.0, 39.0]


@pytest.mark.parametrize(("vehicles", "teams", "layers"), [(1, 1, 1), (9, 1, 9), (50, 6, 9), (250, 20, 13)])
def test_layers_do_not_grow_with_the_fleet_but_with_its_teams(vehicles: int, teams: int, layers: int) -> None:
    scenario = parse(without_layers(new_scenario("new", ORIGIN, vehicles, rounds=2)))
    assert (scenario.vehicle_count, len(scenario.teams)) == (vehicles, teams)
    assert len({place.layer_m for place in scenario.places}) == layers
    near = place_conflicts(scenario.rounds, scenario.limits, scenario.teams, scenario.places)
    assert (layers_needed(near), len(set(groups(near)))) == (layers, teams)


def test_the_two_teams_of_the_shipped_scenario_cross_each_others_ways() -> None:
    scenario = parse(SHIPPED)
    near = place_conflicts(scenario.rounds, scenario.limits, scenario.teams, scenario.places)
    assert near.sum() == 8 * 7 and set(groups(near)) == {0}
    assert [place.layer_m for place in parse(without_layers(SHIPPED)).places] == [22.0 + 7 * i for i in range(8)]


def test_ways_around_a_no_fly_zone_count() -> None:
    """Two teams side by side, apart; with a long wall between home and zone of one its ways lead past the other."""
    text = without_layers(new_scenario("new", ORIGIN, 2, teams=2))
    apart = parse(text)
    assert len({place.layer_m for place in apart.places}) == 1
    (x, y), _ = apart.places[0].place_m, apart.places[1]
    wall = (
        f'[[round.zone]]\nname = "wall"\nrole = "no-fly"\nshape = "rectangle"\ncentre_m = [{x + 100.0}, {y + 60.0}]\n'
    )
    wall += "width_m = 250.0\nheight_m = 5.0\n\n[[team]]"
    assert len({place.layer_m for place in parse(text.replace("[[team]]", wall, 1)).places}) == 2


def test_a_vehicle_that_brakes_weakly_shares_no_layer_with_a_team_that_is_otherwise_far_enough() -> None:
    """The guard predicts that all brake like the weakest class: at 8 m/s and 0.5 m/s² over 64 m each."""
    text = without_layers(new_scenario("new", ORIGIN, 2, teams=2))
    weak = text + '\n[[class]]\nname = "heavy"\nvehicles = [1]\naccel_m_s2 = 0.5\n'
    scenario = parse(weak)
    assert len({place.layer_m for place in parse(text).places}) == 1
    assert len({place.layer_m for place in scenario.places}) == 2
    assert "needed: all may come near each other" in layers_finding(scenario).detail
    same = re.sub(r"(\[\[place\]\]\n(?:.*\n)*?place_m = .*\n)", r"\1layer_m = 30.0\n", weak)
    with pytest.raises(ScenarioError, match="their vehicles may meet"):
        parse(same)


def test_reaches_hold_every_straight_way_between_home_and_zones() -> None:
    scenario = parse(SHIPPED)
    team, place = scenario.teams[1], scenario.places[4]
    (reach,) = reaches(scenario.rounds, [member([team], place.place_m)])
    zones = [zone for round_ in scenario.rounds for zone in round_.zones if zone.name == team.zone]
    corners = [corner for zone in zones for corner in polygon_of(zone.shape).exterior.coords] + [place.place_m]
    assert all(reach.buffer(1e-6).covers(shapely.LineString(pair)) for pair in itertools.combinations(corners[::7], 2))


def test_a_planner_that_may_leave_its_zone_meets_everybody() -> None:
    text = new_scenario("new", ORIGIN, 2, teams=2)
    with pytest.raises(ScenarioError, match=r"is 0\.0 m from the layer of place.1., and their vehicles may meet"):
        parse(text.replace('planner = "patrol"', 'planner = "guardian"', 1))


def problems_of(text: str) -> tuple[str, ...]:
    with pytest.raises(ScenarioError) as caught:
        parse(text)
    return tuple(caught.value.problems)


def test_one_mistake_that_brings_all_vehicles_near_each_other_is_one_line_with_its_reason() -> None:
    """A mistyped planner was 174 errors about layers, none of which named the planner."""
    text = new_scenario("new", ORIGIN, 60, teams=7)
    (line,) = problems_of(text.replace('"patrol"', '"patroll"'))
    assert "planner 'patroll' (did you mean patrol?) may use the whole operating area" in line
    assert "so are 173 more pairs of places" in line
    fast = problems_of(new_scenario("new", ORIGIN, 2, teams=2).replace("speed_m_s = 8.0", "speed_m_s = 28.8"))
    assert "zones 'zone 1' and 'zone 2' or the ways there are not apart by 343 m, as braking from 28.8" in fast[0]
    one_zone = problems_of(new_scenario("new", ORIGIN, 2, teams=2).replace('zone = "zone 2"', 'zone = "zone 1"'))
    assert "they serve one zone, 'zone 1'; must be" in one_zone[0]


def test_a_band_that_is_too_low_says_what_would_fit() -> None:
    text = without_layers(new_scenario("new", ORIGIN, 20, teams=2)).replace("alt_max_m = 100.0", "alt_max_m = 60.0")
    with pytest.raises(ScenarioError) as caught:
        parse(text)
    (line,) = caught.value.problems
    assert (
        "10 altitude layers are needed" in line and "22 to 58 m has room for 8 at 5 m: raise alt_max_m by 9 m" in line
    )
    assert "lower separation_vertical_m to 4 m" in line and "teams of at most 8" in line
    higher = parse(text.replace("alt_max_m = 60.0", "alt_max_m = 69.0"))
    assert {place.layer_m for place in higher.places} == {22.0 + 5.0 * i for i in range(10)}
    nearer = parse(text.replace("separation_vertical_m = 5.0", "separation_vertical_m = 4.0"))
    assert max(place.layer_m for place in nearer.places) == 58.0


def test_two_reaches_are_apart_when_both_can_brake_before_they_meet() -> None:
    limits = parse(SHIPPED).limits
    assert apart_m(limits) == pytest.approx(10.0 + 1.0 + 2 * 8.0**2 / (2 * 2.5))
    assert math.isfinite(apart_m(limits))
