"""What a question tells of the way that vehicles are sent on."""

import math

from tests.core.rigs.rig import scenario
from tui_gcs.actions.order_forecast import forecast_order
from tui_gcs.core.protocol.common import Freshness, Phase, Request, VehicleRow
from tui_gcs.core.protocol.flight import Arm, CircleFlight, Follow, GoTo, Nudge, TakeOff

NAN = math.nan
WHOLE = scenario()
LIMITS, ROUND = WHOLE.limits, WHOLE.rounds[0]
"""Separation 10 m and 5 m; 8 m/s, 2.5 m/s²."""


def row(vehicle: int, place: tuple[float, float, float], *, phase: Phase = Phase.BY_HAND) -> VehicleRow:
    values = dict.fromkeys(VehicleRow._fields, 0)
    values |= {"id": vehicle, "position_m": place, "phase": phase, "armed": phase is not Phase.GROUND}
    return VehicleRow(**values | {"freshness": Freshness.OK, "layer_m": place[2] or 34.0})  # type: ignore[arg-type]


HOMES = {1: (200.0, 150.0), 2: (300.0, 150.0)}
FLEET = {r.id: r for r in (row(1, (200.0, 200.0, 30.0)), row(2, (300.0, 212.0, 40.0)), row(3, (200.0, 300.0, 50.0)))}


def seen(request: Request) -> tuple[str, ...]:
    reported = forecast_order(request, FLEET, HOMES, LIMITS, ROUND)
    return (reported.way, *reported.warnings)


def test_how_far_and_how_long() -> None:
    """(100 + 8²/2.5) m at 8 m/s; straight up at 3 m/s, down at 1.5."""
    assert seen(GoTo((1,), ((300.0, 200.0, NAN),))) == ("100 m away: about 16 s",)
    assert seen(GoTo((1,), ((300.0, 200.0, NAN),), speed_m_s=2.0)) == ("100 m away: about 51 s",)
    assert seen(GoTo((1,), ((NAN, NAN, 33.0),))) == ("0 m away, up 3 m: about 1 s",)
    assert seen(GoTo((3,), ((NAN, NAN, 47.0),))) == ("0 m away, down 3 m: about 2 s",)
    far = seen(GoTo((1, 3), ((300.0, 200.0, NAN), (250.0, 300.0, NAN))))
    assert far == ("50-100 m away: about 16 s",)


def test_a_way_counted_from_each_ones_own_home() -> None:
    assert seen(GoTo((1, 2), ((0.0, 10.0, NAN),) * 2, from_home=True)) == ("40-52 m away: about 10 s",)


def test_the_layer_of_another_and_how_near_its_way_comes_to_it() -> None:
    _, warning = seen(GoTo((1,), ((400.0, 200.0, 38.0),)))
    assert warning == "1 on the layer of 2 (40 m); 2 is 12 m from its way"
    _, *warnings = seen(GoTo((1,), ((NAN, NAN, 52.0),)))
    assert warnings == [
        "1 on the layer of 3 (50 m); 3 is 100 m from its way",
        "1 passes the layer of 2 (40 m); 2 is 101 m from its way",
    ]


def test_layers_of_those_on_the_ground_are_free_and_a_take_off_is_warned_of_those_above() -> None:
    fleet = FLEET | {4: row(4, (210.0, 200.0, 0.0), phase=Phase.GROUND)}
    assert not forecast_order(GoTo((1,), ((NAN, NAN, 34.0),)), fleet, {}, LIMITS, ROUND).warnings
    reported = forecast_order(TakeOff((4,), 34.0), fleet, {}, LIMITS, ROUND)
    assert (reported.way, reported.warnings) == ("", ("4 on the layer of 1 (30 m); 1 is 10 m from its way",))


def test_a_place_outside_or_at_a_height_that_is_not_allowed() -> None:
    _, out = seen(GoTo((1,), ((-500.0, 200.0, 30.0),)))
    assert "outside the area" in out and "the guard stops vehicle 1" in out
    _, high = seen(GoTo((2,), ((NAN, NAN, 500.0),)))[:2]
    assert high.startswith("500 m is outside the band")


def test_two_that_would_meet() -> None:
    _, meet = seen(GoTo((1, 2), ((300.0, 200.0, 40.0), (304.0, 200.0, 40.0))))
    assert meet == "1 and 2 would be 4 m from each other at one height"
    assert seen(CircleFlight((1, 2), (250.0, 200.0, 35.0), 20.0))[1:] == (
        "1 and 2 would be on one circle at one height",
    )


def test_who_follows_is_told_how_far_he_stays_from_whom() -> None:
    assert seen(Follow((1,), 3)) == ("100 m from it, and stays so",)
    near = FLEET | {4: row(4, (206.0, 200.0, 36.0))}
    assert forecast_order(Follow((1,), 4), near, {}, LIMITS, ROUND).warnings == ("vehicle 1 too near: at least 10 m",)


def test_who_leaves_a_planner_and_who_is_pulled_along_is_told() -> None:
    mixed = FLEET | {1: row(1, (200.0, 200.0, 30.0), phase=Phase.FLYING), 3: FLEET[3]._replace(slot=">1")}
    for request in (
        GoTo((1,), ((250.0, 200.0, 30.0),)),
        CircleFlight((1,), (250.0, 200.0, NAN), 20.0),
        Follow((1,), 2),
    ):
        assert forecast_order(request, mixed, HOMES, LIMITS, ROUND).warnings == (
            "vehicle 1 will fly for no planner until ordered to: order p",
            "vehicle 3 will move with it: it is followed",
        )
    assert forecast_order(Nudge((1, 3), (0.0, 0.0, 0.0)), mixed, HOMES, LIMITS, ROUND).warnings == (
        "vehicle 1 will fly for no planner until ordered to: order p",
    )


def test_nothing_is_told_of_what_is_not_known() -> None:
    assert seen(Arm((1,))) == seen(GoTo((9,), ((0.0, 0.0, 0.0),))) == ("",)
    assert "is not known here" in seen(GoTo((1, 3), ((50.0, 0.0, NAN),) * 2, from_home=True))[0]
