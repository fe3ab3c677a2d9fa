"""Where two teams come near each other: at the same time, or over the same place with nothing to spare in height."""

import math

import pytest

from tui_gcs.core.judging.team_separation import findings, nearest_at_once, summary, tightest_crossing
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.protocol.common import FlownWays
from tui_gcs.core.scenario.model import Limits

LIMITS = Limits(separation_horizontal_m=10.0, separation_vertical_m=5.0)


def eastward(vehicle: int, layer_m: float, north_m: float = 0.0, *, begin_s: int = 0, seconds: int = 30) -> FlownWays:
    """Along y = `north_m` from x = 0 at 10 m/s, after standing for `begin_s`."""
    places = tuple((10.0 * max(0, t - begin_s), north_m, layer_m) for t in range(seconds + 1))
    return FlownWays((vehicle,), 1.0, (places,))


def northward(vehicle: int, layer_m: float, east_m: float, *, begin_s: int = 0, seconds: int = 30) -> FlownWays:
    places = tuple((east_m, -100.0 + 10.0 * max(0, t - begin_s), layer_m) for t in range(seconds + 1))
    return FlownWays((vehicle,), 1.0, (places,))


def test_two_who_are_over_one_place_at_the_same_time_on_layers_far_enough_apart() -> None:
    met = nearest_at_once(eastward(1, 30.0), northward(5, 37.0, 100.0), LIMITS)
    assert met is not None
    assert met.vehicles == (1, 5) and met.place_m == (100.0, 0.0) and met.after_s == 10.0
    assert (met.beside_m, met.above_m, met.separation) == (0.0, 7.0, 1.4)
    (found,) = findings({"north": eastward(1, 30.0), "south": northward(5, 37.0, 100.0)}, LIMITS)
    assert found.teams == ("north", "south") and found.finding.level is FindingLevel.NOTE
    assert found.finding.text == "north and south: separation 1.40 x after 10 s at [100 0] (1 and 5)"
    assert found.finding.detail == "0.0 m beside and 7.0 m above each other"


def test_teams_that_are_far_apart_share_one_line() -> None:
    ways = {name: eastward(n, 30.0, 50.0 * n) for n, name in enumerate("abcd")}
    ways |= {"e": eastward(5, 37.0)}
    lines = [finding.text for finding in summary(findings(ways, LIMITS))]
    assert lines == [
        "a and e: separation 1.40 x after 0 s at [0 0] (0 and 5)",
        "9 other pairs of teams: separation 5.0 x or more",
    ]


def test_between_two_moments_the_nearest_counts() -> None:
    """At whole seconds they are 5 m and more from each other."""
    half = FlownWays((5,), 1.0, (tuple((105.0, -105.0 + 10.0 * t, 30.0) for t in range(30)),))
    met = nearest_at_once(eastward(1, 30.0), half, LIMITS)
    assert met is not None
    assert met.after_s == 10.5 and met.beside_m == 0.0 and met.place_m == (105.0, 0.0)


def test_too_near_is_a_caution() -> None:
    """A planner may leave its layers."""
    (found, crossing) = findings({"a": eastward(1, 30.0), "b": northward(5, 33.0, 100.0)}, LIMITS)
    assert found.finding.level is crossing.finding.level is FindingLevel.CAUTION
    assert found.finding.text == "a and b: too near, separation 0.60 x after 10 s at [100 0] (1 and 5)"
    assert found.finding.detail.endswith("the guard would stop them")


@pytest.mark.parametrize(("layer_m", "told"), [(35.0, True), (35.9, True), (36.0, False), (24.5, True), (23.9, False)])
def test_ways_that_cross_at_different_times_count_where_heights_have_nothing_to_spare(
    layer_m: float, told: bool
) -> None:
    """Half a metre up and half a metre down, and the guard holds who comes."""
    first, late = eastward(1, 30.0), northward(5, layer_m, 200.0, begin_s=9)
    crossing = tightest_crossing(first, late, LIMITS)
    assert (crossing is not None) is told
    if crossing is not None:
        assert crossing.place_m == (200.0, 0.0) and math.isnan(crossing.after_s)
        grave = findings({"a": first, "b": late}, LIMITS)[0].finding
        assert grave.level is FindingLevel.CAUTION and "a and b: ways cross at [200 0] (1 and 5)" in grave.text


def test_a_tour_counts_though_nobody_has_flown_it_yet() -> None:
    loop = ((300.0, -50.0), (400.0, -50.0), (400.0, 50.0), (300.0, 50.0), (300.0, -50.0))
    waits = FlownWays((5,), 1.0, (((350.0, 300.0, 35.0),) * 31,), (loop,))
    crossing = tightest_crossing(eastward(1, 30.0, seconds=40), waits, LIMITS)
    assert crossing is not None and crossing.place_m == (300.0, 0.0)
    assert tightest_crossing(eastward(1, 30.0, seconds=20), waits, LIMITS) is None, "it does not come so far"


def test_the_nearest_two_teams_first_and_nobody_is_left_out() -> None:
    ways = {"a": eastward(1, 30.0), "b": northward(5, 60.0, 100.0), "c": eastward(9, 80.0, 300.0)}
    found = findings(ways, LIMITS)
    assert [each.teams for each in found] == [("a", "b"), ("b", "c"), ("a", "c")]
    assert [each.separation for each in found] == sorted(each.separation for each in found)


@pytest.mark.parametrize(
    "wrong",
    [
        FlownWays((), 1.0, ()),
        FlownWays((5,), 1.0, ()),
        FlownWays((5,), 0.0, (((0.0, 0.0, 30.0),) * 3,)),
        FlownWays((5, 6), 1.0, (((0.0, 0.0, 30.0),), ((0.0, 0.0, 30.0),) * 2)),
        FlownWays((5,), 1.0, (((math.nan, 0.0, 30.0),) * 3,)),
        FlownWays((5,), 1.0, (((0.0, 0.0, 30.0),) * 3,), (((math.inf, 0.0),) * 5,)),
    ],
)
def test_ways_that_say_nothing_sensible_are_not_compared(wrong: FlownWays) -> None:
    assert findings({"a": eastward(1, 30.0), "b": wrong}, LIMITS) == []


def test_limits_of_nothing_and_ways_of_one_moment() -> None:
    still = FlownWays((5,), 1.0, (((0.0, 0.0, 30.0),),))
    assert findings({"a": still, "b": still}, Limits(separation_horizontal_m=0.0, separation_vertical_m=0.0)) == []
    assert nearest_at_once(still, eastward(1, 30.0), LIMITS) is None
