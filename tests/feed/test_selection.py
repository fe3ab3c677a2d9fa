"""Vehicles by what an operator types."""

import pytest

from tui_gcs.feed.selection import KnownVehicles, Selection, SelectionChoice, SelectionError, parse_selection

KNOWN = KnownVehicles(
    (1, 2, 3, 4, 5, 6, 7, 1003),
    {"defend": (1, 2, 3), "attack": (4, 5, 6, 7)},
    {"low": (2, 4)},
    selected=(2, 3),
)


@pytest.mark.parametrize(
    ("text", "ids"),
    [
        ("3", (3,)),
        ("3-5,7", (3, 4, 5, 7)),
        ("1000-1010", (1003,)),
        ("1-1003", KNOWN.ids),
        (" t2 ", (4, 5, 6, 7)),
        ("Defend,7", (1, 2, 3, 7)),
        ("low", (2, 4)),
        ("all", KNOWN.ids),
        ("none", ()),
        ("invert", (1, 4, 5, 6, 7, 1003)),
        ("+7", (2, 3, 7)),
        ("-2-3", ()),
        ("-low", (3,)),
    ],
)
def test_what_is_typed_means_these_vehicles(text: str, ids: tuple[int, ...]) -> None:
    assert parse_selection(text, KNOWN) == SelectionChoice(ids)


def test_a_name_and_an_equals_sign_save_a_group() -> None:
    assert parse_selection("north=1,t2", KNOWN) == SelectionChoice((1, 4, 5, 6, 7), "north")
    assert parse_selection("these=", KNOWN) == SelectionChoice((2, 3), "these")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "name vehicles"),
        ("8", "no vehicle 8"),
        ("8-9", "no vehicle from 8 to 9"),
        ("5-3", "5-3 is no range"),
        ("900000-999999", "no vehicle from 900000 to 999999"),
        ("t3", "no team or group 't3'; there are: defend, attack, low"),
        ("all=1", "a group cannot be called 'all'"),
        ("defend=1", "a group cannot be called 'defend'"),
        ("t1=4", "a group cannot be called 't1'"),
    ],
)
def test_what_names_nobody_is_refused_and_changes_nothing(text: str, why: str) -> None:
    selection = Selection()
    selection.set((2, 3))
    with pytest.raises(SelectionError, match=why.replace("(", r"\(")):
        selection.choose(text, KNOWN)
    assert selection.ids == (2, 3)


def test_steps_go_round_the_fleet_or_round_the_selected() -> None:
    changes: list[int | None] = []
    selection = Selection(lambda: changes.append(selection.lead))
    selection.step(-1, ())
    for _ in range(2):
        selection.step(1, (4, 7))
    selection.step(1, (4, 7))
    assert changes == [4, 7, 4]
    selection.set((4, 7, 9))
    selection.step(-1, (4, 7, 9, 12))
    assert (selection.ids, selection.lead) == ((4, 7, 9), 9)
