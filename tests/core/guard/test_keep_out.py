"""Keep-out volumes: what planners are told of where lost vehicles may be is what the guard predicts."""

from dataclasses import replace

from tests.core.rigs.guard_rig import LIMITS, guard, sight, stand
from tui_gcs.core.guard.keep_out import keep_out
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour, MotionModel, VehicleState
from tui_gcs.core.protocol.common import KeepOut

HOME = (20.0, 50.0, 0.0)
SINKS, RETURNS = LostLinkBehaviour(HOME, 4.0, sinks=True), LostLinkBehaviour(HOME, 4.0, height_m=60.0)
LOST = VehicleState(2, (80.0, 100.0, 40.0), (8.0, 0.0, 0.0), age_s=4.0, lost_link_behaviour=SINKS)
"""Flew east, and would come to rest 48 m farther when it leaves OFFBOARD after 4 s."""


def volumes(state: VehicleState, age_s: float) -> list[KeepOut]:
    return list(keep_out([replace(state, age_s=age_s)], LIMITS))


def test_one_that_holds_is_kept_clear_of_at_its_height() -> None:
    (here,) = volumes(replace(LOST, lost_link_behaviour=None), 4.0)
    assert (here.vehicle, here.begin_m, here.end_m) == (2, (80.0, 100.0), (136.0, 100.0))
    assert (here.radius_m, here.low_m, here.high_m) == (10.0 + 1.0 + 12.5, 34.7, 45.3)


def test_one_that_may_sink_is_kept_clear_of_down_to_the_ground() -> None:
    _, column = volumes(LOST, 4.0)
    assert (column.begin_m, column.end_m, column.radius_m) == ((80.0, 100.0), (128.0, 100.0), 10.0 + 1.0 + 10.0)
    assert column.low_m < 0.0 and column.high_m == 45.3


def test_its_way_home_counts_before_it_gets_there() -> None:
    *_, up, over, down = volumes(replace(LOST, lost_link_behaviour=RETURNS), 4.0)
    assert up.high_m == over.high_m == 65.3 and over.low_m == 54.7
    assert over.end_m == down.begin_m == down.end_m == (20.0, 50.0) and down.low_m < 0.0


def test_a_volume_stays_the_same_until_it_is_over() -> None:
    """Planners plan anew whenever one changes: not in every step while it is still growing."""
    assert volumes(LOST, 3.0) == volumes(LOST, 4.0) == volumes(LOST, 114.0)
    assert len(volumes(LOST, 114.1)) == 1, "on the ground by then; at its height it is still looked for"


def test_nobody_is_kept_clear_of_who_is_heard_or_flies_on_a_course() -> None:
    assert volumes(LOST, 2.9) == []
    assert volumes(replace(LOST, motion=MotionModel.STOPS), 9.0) == []


def test_the_guard_lets_vehicles_come_up_to_the_volume_and_not_into_it() -> None:
    """What a planner flies round is what it would be vetoed for, and hardly more."""
    later = replace(LOST, age_s=20.0)
    _, column = volumes(later, 20.0)
    x, y = column.end_m
    for stops_m, passes in ((column.radius_m + 0.5, True), (column.radius_m - 2.0, False)):
        way = sight((x, y + column.radius_m + 3.0, 30.0), stand(x, y + stops_m, 30.0))
        assert guard().separation(way, [later], 0.0).ok is passes
