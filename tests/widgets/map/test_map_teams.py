"""Teams on a map: a colour and a dash for each, letters and a legend where they are wanted."""

import pytest

from tui_gcs.widgets.basics.palette import TEAM_INKS, Ink
from tui_gcs.widgets.map.map_scene import legend_words
from tui_gcs.widgets.map.map_teams import DASHES, PLAN_DASH, MapTeams


def test_one_team_needs_no_colour_of_its_own() -> None:
    alone = MapTeams(["defend", "", "defend"])
    assert alone.vehicle_ink("defend") is Ink.TEXT
    assert alone.tour("defend") == (Ink.PLAN, PLAN_DASH)
    assert alone.letters("defend") == ""


def test_teams_differ_in_colour_and_without_colour_in_dashes() -> None:
    names = [f"team {number}" for number in range(len(TEAM_INKS))]
    teams = MapTeams(names)
    assert len({teams.vehicle_ink(name) for name in names}) == len(names)
    tours = [teams.tour(name) for name in names]
    assert len({ink for ink, _ in tours}) == len({dash for _, dash in tours}) == len(names) == len(DASHES)


def test_a_vehicle_without_a_team_has_the_ordinary_colour() -> None:
    assert MapTeams(["a", "b"]).vehicle_ink("") is Ink.TEXT


@pytest.mark.parametrize(
    ("names", "letters"),
    [
        (["attack", "defend"], ["a", "d"]),
        (["north", "north-east", "south"], ["north", "north-", "s"]),
        (["t1", "t2"], ["t1", "t2"]),
    ],
)
def test_letters_are_the_shortest_that_tell_teams_apart(names: list[str], letters: list[str]) -> None:
    teams = MapTeams(names)
    assert [teams.letters(name) for name in names] == letters


def test_the_legend_is_as_wide_as_the_map() -> None:
    teams = MapTeams(["defend", "attack", "survey"])
    assert [(word.column, word.text) for word in legend_words(teams, 15)] == [(0, "attack"), (8, "defend")]
    assert len(legend_words(teams, 80)) == 3
