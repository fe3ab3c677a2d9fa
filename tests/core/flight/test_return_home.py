"""The way home: to its layer, home, and down in turn; past those who are in the way. No simulator."""

import math

import pytest

from tests.core.rigs.flight_rig import GUIDED, LAND, Watch
from tui_gcs.core.flight.flights import ReturnStep
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.protocol.common import Phase, RunPhase


def returning(*places: tuple[float, float, float]) -> Watch:
    """Vehicles at these places are told to return; homes are 50 m apart, layers 30, 40, 50 m."""
    watch = Watch(len(places))
    for number, place in enumerate(places, 1):
        watch.flies(number, place)
    watch.executive.run = RunPhase.RUNNING
    watch.executive.go_home(())
    return watch


def to(x: float, y: float, z: float) -> str:
    """As a set-point to there reads."""
    watch = Watch(1)
    watch.command_encoder.position(1, PASS, (x, y, z))
    return watch.sent[0][1]


def steps(watch: Watch) -> list[str]:
    return [
        flight.step.value if isinstance(flight.step, ReturnStep) else flight.phase.value for flight in watch.flights
    ]


def test_first_to_its_layer_then_home_then_down() -> None:
    watch = returning((0.0, 100.0, 20.0))
    assert watch.run().orders(1) == ["to (0, 100, 30)"] and steps(watch) == ["layer"]
    watch.place(1, (0.0, 100.0, 28.9))
    assert "to (0, 100, 30)" in watch.run(0.5).orders(1)
    watch.place(1, (0.0, 100.0, 29.1))
    assert watch.run(0.5).orders(1) == ["to (0, 0, 30)", "at most 8 m/s"] and steps(watch) == ["home"]
    watch.place(1, (0.0, 1.4, 30.0), moving=(0.0, -0.8, 0.0))
    assert watch.run(0.5).orders(1) == ["to (0, 0, 30)", "at most 8 m/s"], "too fast to be there"
    watch.place(1, (0.0, 1.6, 30.0))
    watch.run(0.5)
    assert steps(watch) == ["home"]
    watch.place(1, (0.0, 1.4, 30.0))
    assert watch.run().orders(1)[-1] == "LAND" and watch.phases() == [Phase.LANDING]


def test_the_speed_is_said_when_a_leg_begins_and_not_with_every_target() -> None:
    watch = returning((0.0, 100.0, 30.0))
    watch.run(3.0)
    said = [words for _, words in watch.sent]
    assert said.count("to (0, 0, 30)") == 6
    watch.commands.on_ack(watch.vehicle(1), 178, 0)
    watch.run().orders(1)
    assert watch.run(3.0).orders(1) == ["to (0, 0, 30)"]


def test_one_above_its_home_goes_only_down() -> None:
    watch = returning((1.0, 0.0, 20.0))
    assert watch.run().orders(1) == ["to (1, 0, 20)", "LAND"]


def test_nobody_descends_before_all_are_there_and_then_the_lowest_first() -> None:
    watch = returning((0.0, 0.0, 30.0), (50.0, 0.0, 40.0), (100.0, 50.0, 50.0))
    watch.run(10.0)
    assert steps(watch) == ["over home", "over home", "home"]
    watch.place(3, (100.0, 0.0, 50.0))
    watch.run()
    assert watch.phases() == [Phase.LANDING, Phase.RETURNING, Phase.RETURNING]
    watch.vehicle(1).telemetry.custom_mode = LAND
    assert watch.run(1.8).phases() == [Phase.LANDING, Phase.RETURNING, Phase.RETURNING]
    assert watch.run(0.3).phases() == [Phase.LANDING, Phase.LANDING, Phase.RETURNING]
    watch.vehicle(2).telemetry.custom_mode = LAND
    assert watch.run(2.1).phases() == [Phase.LANDING] * 3


def test_one_that_does_not_come_is_waited_for_only_so_long() -> None:
    watch = returning((0.0, 0.0, 30.0), (50.0, 100.0, 40.0))
    watch.run(1.0)
    watch.flight(2).since_s = watch.clock.now() - 239.0
    assert watch.run(0.9).phases() == [Phase.RETURNING, Phase.RETURNING]
    assert watch.run(0.3).phases() == [Phase.LANDING, Phase.RETURNING]


def test_one_that_stands_still_on_its_way_is_told() -> None:
    watch = returning((0.0, 100.0, 30.0))
    watch.run(14.5)
    assert not any("does not return" in text for text in watch.told())
    watch.run(1.5)
    assert "does not return: stands still for 15 s" in list(watch.told())


def test_one_that_moves_or_waits_above_its_home_is_not_told_to_stand_still() -> None:
    watch = returning((0.0, 0.0, 30.0), (50.0, 100.0, 40.0))
    watch.place(2, (50.0, 100.0, 40.0), moving=(0.0, -0.4, 0.0))
    watch.run(20.0)
    assert not any("does not return" in text for text in watch.told())


def test_turning_points_are_flown_one_after_the_other() -> None:
    watch = returning((0.0, 100.0, 30.0))
    watch.run()
    watch.flight(1).route_m = [(60.0, 80.0), (60.0, 20.0), (0.0, 0.0)]
    for place, target in (((59.0, 80.0), "to (60, 20, 30)"), ((60.0, 19.0), "to (0, 0, 30)")):
        watch.orders(1)
        watch.place(1, (*place, 30.0), moving=(0.0, -5.0, 0.0))
        assert target in watch.run(0.3).orders(1)
    assert steps(watch) == ["home"]


def test_who_is_below_another_on_its_way_up_waits_and_then_goes_aside() -> None:
    """2 holds above 1, which has to climb past it to its layer at 30 m."""
    watch = Watch(2)
    watch.flies(1, (0.0, 100.0, 20.0))
    watch.flies(2, (0.0, 100.0, 27.0), Phase.HOLDING)
    watch.executive.go_home((1,))
    assert watch.run(4.5).orders(1) == ["to (0, 100, 20)"]
    assert any(text.startswith("waits on its way home: ") for text in watch.told())
    watch.run(1.0).orders(1)
    assert steps(watch)[0] == "aside"
    assert any(text.startswith("goes aside on its way home: ") for text in watch.told())
    assert watch.flight(1).course is not None
    (x, y, z), _ = watch.flight(1).course.at(0.0)
    assert math.dist((x, y), (0.0, 100.0)) >= 10.0 and z == 20.0
    assert watch.run(0.5).orders(1) == [to(x, y, 20.0)]
    watch.place(1, (x, y, z))
    assert to(x, y, 30.0) in watch.run(0.5).orders(1) and steps(watch)[0] == "layer"


def test_without_a_free_place_it_waits_and_says_what_to_do() -> None:
    watch = Watch(2)
    watch.flies(1, (0.0, 100.0, 20.0))
    watch.flies(2, (0.0, 100.0, 27.0), Phase.HOLDING)
    watch.guard.allowed = watch.guard.allowed.intersection(watch.guard.allowed.centroid.buffer(1.0))
    watch.executive.go_home((1,))
    watch.run(20.0)
    assert steps(watch)[0] == "layer" and watch.orders(1) == ["to (0, 100, 20)"]
    assert any("there is no free place beside it: move the other one, or land" in text for text in watch.told())


def test_when_the_other_one_has_gone_it_goes_on() -> None:
    watch = Watch(2)
    watch.flies(1, (0.0, 100.0, 20.0))
    watch.flies(2, (0.0, 100.0, 27.0), Phase.HOLDING)
    watch.executive.go_home((1,))
    watch.run(4.5).orders(1)
    watch.place(2, (100.0, 100.0, 27.0))
    assert watch.run(1.0).orders(1) == ["to (0, 100, 30)"] and steps(watch)[0] == "layer"
    watch.place(2, (0.0, 100.0, 27.0))
    watch.run(4.0)
    assert steps(watch)[0] == "layer", "it waits anew"


def test_on_their_layers_they_pass_each_other() -> None:
    watch = returning((0.0, 100.0, 30.0), (0.0, 90.0, 40.0))
    watch.run(1.0)
    assert steps(watch) == ["home", "home"] and "to (0, 0, 30)" in watch.orders(1)


def test_one_not_on_its_layer_is_in_the_way_of_who_is() -> None:
    """2 holds at 1's height, 15 m before it."""
    watch = Watch(2)
    watch.flies(1, (0.0, 100.0, 30.0))
    watch.flies(2, (0.0, 85.0, 30.0), Phase.HOLDING)
    watch.executive.go_home((1,))
    reported = watch.run(1.0).orders(1)
    assert "to (0, 100, 30)" in reported and "to (0, 0, 30)" not in reported


@pytest.mark.parametrize("home", [None, (5.0, 5.0, 0.0)])
def test_home_is_where_it_took_off_or_where_it_says(home: tuple[float, float, float] | None) -> None:
    watch = Watch(1)
    watch.flies(1, (5.0, 100.0, 30.0), custom_mode=GUIDED)
    watch.flight(1).home_m, watch.vehicle(1).telemetry.home_m = None, home
    (result,) = watch.executive.go_home((1,))
    waits = "has no home; the return is kept until it can be done"
    assert (result.ok, result.text) == ((True, "returns") if home else (False, waits))
    assert watch.flight(1).home_m == home
