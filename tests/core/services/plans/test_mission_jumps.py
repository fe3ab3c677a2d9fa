"""What a change of the current item says about who made it: pure functions on plans."""

import math

import pytest

from tui_gcs.core.plans.model import JUMP, PlanItem
from tui_gcs.core.services.plans.mission_jumps import jump_words

HERE = (52.0, 0.0)
NOWHERE = (math.nan, math.nan)


def place(north_m: float) -> PlanItem:
    return PlanItem(16, 3, x=round((52.0 + north_m / 111_320.0) * 1e7), y=0, z=30.0)


SPEED = PlanItem(178, 2)
FLOWN = (place(0.0), SPEED, place(200.0), place(400.0), place(405.0))


@pytest.mark.parametrize(
    ("before", "now", "words"),
    [
        (0, 1, ""),  # it is at item 1
        (0, 2, ""),  # the speed between is done in passing
        (2, 3, "went from item 3 to item 4 of its mission"),  # item 3 is 200 m away
        (0, 4, "went from item 1 to item 5 of its mission"),
        (3, 2, "went from item 4 to item 3 of its mission"),
        (3, 3, ""),
        (3, 99, ""),  # no such item
    ],
)
def test_an_item_that_the_plan_does_not_lead_to_is_told(before: int, now: int, words: str) -> None:
    assert jump_words(FLOWN, before, now, HERE, 1.0) == words


def test_after_a_silence_it_may_have_flown_on() -> None:
    assert jump_words(FLOWN, 2, 3, HERE, 10.0) == ""


def test_without_a_place_nothing_is_told_of_items_ahead() -> None:
    assert jump_words(FLOWN, 2, 3, NOWHERE, 1.0) == ""


def test_a_jump_of_the_plan_explains_the_way_back() -> None:
    plan = (SPEED, place(0.0), place(200.0), PlanItem(JUMP, 2, (0.0, 3.0, 0.0, 0.0)), place(0.0))
    assert jump_words(plan, 2, 1, HERE, 1.0) == "", "item 1 is done in passing"
    assert jump_words(plan, 2, 0, HERE, 1.0) == ""
    assert jump_words(plan, 4, 1, HERE, 1.0) == "went from item 5 to item 2 of its mission"
