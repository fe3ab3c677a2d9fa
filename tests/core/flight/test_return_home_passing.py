"""Who minds whom on the way home, who goes aside where, and who lands before its turn. No simulator."""

import math

import pytest

from tests.core.flight.test_return_home import returning, steps
from tests.core.rigs.flight_rig import GUIDED, LAND, Watch
from tui_gcs.core.flight.flights import ReturnStep
from tui_gcs.core.motion.course import PositionTarget
from tui_gcs.core.protocol.common import Phase


def passing(other_m: tuple[float, float, float], phase: Phase = Phase.HOLDING, layer_m: float = 35.0) -> Watch:
    """1 flies home on its layer at 30 m, northwards of 2, of which this is said; 2 took off at (0, 85)."""
    watch = Watch(2)
    watch.flies(1, (0.0, 100.0, 30.0))
    watch.flight(2).home_m = (0.0, 85.0, 0.0)
    watch.flies(2, other_m, phase, custom_mode=LAND if phase is Phase.LANDING else GUIDED)
    watch.flight(2).layer_m = layer_m
    return watch


def goes_home(watch: Watch) -> bool:
    """Whether 1 goes on, and does not wait."""
    watch.executive.go_home((1,))
    reported = watch.run(1.0).orders(1)
    assert ("to (0, 0, 30)" in reported) != any(text.startswith("waits on its way home: ") for text in watch.told())
    return "to (0, 0, 30)" in reported


@pytest.mark.parametrize(("height_m", "goes"), [(34.2, True), (33.8, False), (35.0, True)])
def test_one_within_a_metre_of_its_layer_is_above(height_m: float, goes: bool) -> None:
    """Both may be a metre off: that is less than the 5 m that the guard would want of anybody else."""
    assert goes_home(passing((0.0, 85.0, height_m))) is goes


def test_one_that_is_in_no_team_has_no_layer() -> None:
    watch = passing((0.0, 85.0, 34.2))
    del watch.flights.by_id[2]
    assert not goes_home(watch)


@pytest.mark.parametrize(("at_m", "goes"), [(85.0, True), (80.0, True), (78.0, False)])
def test_one_that_lands_at_its_own_place_is_passed(at_m: float, goes: bool) -> None:
    """Its column of 6 m is its own; who lands beside it has drifted."""
    assert goes_home(passing((0.0, at_m, 30.0), Phase.LANDING)) is goes


def test_on_the_way_to_its_layer_it_waits_for_one_on_its_own() -> None:
    watch = passing((0.0, 100.0, 25.0), layer_m=25.0)
    watch.place(1, (0.0, 100.0, 19.0))
    watch.executive.go_home((1,))
    assert watch.run(1.0).orders(1) == ["to (0, 100, 19)"] and steps(watch)[0] == "layer"


# ---------------------------------------------------------------- aside


def going_aside(
    reserved_m: tuple[float, float] | None = None, step: ReturnStep = ReturnStep.TO_LAYER
) -> tuple[float, float]:
    """Where 1 goes, that has to climb past 2; another one returns to `reserved_m` and is at that step."""
    watch = Watch(3)
    watch.flies(1, (0.0, 100.0, 20.0))
    watch.flies(2, (0.0, 100.0, 27.0), Phase.HOLDING)
    watch.flies(3, (300.0, -300.0, 80.0))
    watch.executive.go_home((1, 3))
    if reserved_m is not None:
        watch.flight(3).step = step
        watch.flight(3).course = PositionTarget((*reserved_m, 50.0), 8.0)
    watch.run(6.0)
    assert steps(watch)[0] == "aside" and watch.flight(1).course is not None
    (x, y, _), _ = watch.flight(1).course.at(0.0)
    return x, y


@pytest.mark.parametrize("step", [ReturnStep.TO_LAYER, ReturnStep.BYPASS])
def test_two_do_not_go_aside_to_one_place(step: ReturnStep) -> None:
    best_m = going_aside()
    assert math.dist(going_aside(best_m, step), best_m) >= 10.0


def test_a_place_that_another_one_only_passes_is_free() -> None:
    best_m = going_aside()
    assert going_aside(best_m, "home") == best_m


# ---------------------------------------------------------------- heights in doubt


@pytest.mark.parametrize(
    ("layer_m", "lift_m", "returns_at_m", "text"),
    [
        (30.0, 5.0, 35.0, "returns 5 m above its layer: its height is in doubt"),
        (30.0, 70.0, 90.0, "returns 60 m above its layer: its height is in doubt"),
        (95.0, 5.0, 95.0, "returns"),
        (30.0, 0.0, 30.0, "returns"),
    ],
)
def test_who_may_be_lower_than_it_says_returns_higher_but_not_above_the_area(
    layer_m: float, lift_m: float, returns_at_m: float, text: str
) -> None:
    watch = Watch(1)
    watch.flies(1, (0.0, 100.0, 30.0))
    watch.flight(1).layer_m = layer_m
    watch.executive.return_control.lift_m = lambda vehicle: lift_m
    (result,) = watch.executive.go_home((1,))
    assert result.text == text
    assert watch.flight(1).course == PositionTarget((0.0, 100.0, returns_at_m), 8.0)


# ---------------------------------------------------------------- an empty battery


def lands(watch: Watch, battery_pct: float = 14.0) -> bool:
    """Whether 1, above its home, lands while 2 is on its way."""
    watch.place(1, (0.0, 0.0, 30.0), battery_pct=battery_pct)
    watch.run(1.0)
    return watch.phases()[0] is Phase.LANDING


@pytest.mark.parametrize(("battery_pct", "at_once"), [(14.0, True), (15.0, False), (90.0, False), (math.nan, False)])
def test_with_an_empty_battery_it_lands_before_the_others_have_come(battery_pct: float, at_once: bool) -> None:
    watch = returning((0.0, 0.0, 30.0), (50.0, 150.0, 40.0))
    assert lands(watch, battery_pct) is at_once
    assert ("battery at 14 %: lands before the others are above their homes" in list(watch.told())) is at_once


@pytest.mark.parametrize(
    ("layer_m", "at_m", "at_once"),
    [
        (40.0, (-100.0, 0.0, 40.0), True),  # above it, and stays there
        (20.0, (-100.0, 0.0, 20.0), False),
        (20.0, (-100.0, 0.0, 40.0), False),  # still above it, on its way down to its layer
        (40.0, (-100.0, 0.0, 31.0), False),  # still below it, on its way up
        (20.0, (50.0, 150.0, 20.0), True),  # its way leads past it
    ],
)
def test_with_an_empty_battery_it_waits_for_one_that_passes_below(
    layer_m: float, at_m: tuple[float, float, float], at_once: bool
) -> None:
    watch = returning((0.0, 0.0, 30.0), at_m)
    watch.flight(2).layer_m = layer_m
    assert lands(watch) is at_once


def test_the_way_that_another_one_is_on_counts() -> None:
    """2 goes round something, and passes below 1."""
    watch = returning((0.0, 0.0, 30.0), (150.0, 0.0, 20.0))
    watch.flight(2).layer_m = 20.0
    watch.flight(2).step, watch.flight(2).route_m = ReturnStep.TO_HOME, [(0.0, 5.0), (50.0, 0.0)]
    watch.flight(2).course = PositionTarget((0.0, 5.0, 20.0), 8.0)
    assert not lands(watch)


def test_of_one_whose_place_is_not_known_nobody_knows_where_it_passes() -> None:
    watch = returning((0.0, 0.0, 30.0), (50.0, 150.0, 20.0))
    watch.flight(2).layer_m = 20.0
    watch.vehicle(2).telemetry.position_m = (math.nan, math.nan, math.nan)
    assert not lands(watch)
