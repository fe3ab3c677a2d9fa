"""What a plan is worth is known before it is flown: idleness, its ratio to the ideal, separation, how many it takes."""

from pathlib import Path

import pytest

from tests.planner.rigs import bad_planners as bad
from tui_gcs.core.geometry.zones import Circle
from tui_gcs.core.protocol.common import PreviewTask
from tui_gcs.core.scenario.model import Limits
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet, scattered, task_for
from tui_gcs.planner.runtime.plan_forecast import forecast, vehicles_for, with_vehicles
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.preview import preview

LIMITS = Limits(separation_horizontal_m=10.0, separation_vertical_m=5.0)
SMALL = Circle((250.0, 200.0), 25.0)


def test_vehicles_that_do_not_exist_fly_above_the_others() -> None:
    task = task_for((1, 2), "patrol")
    four = with_vehicles(task, 4)
    assert four.members == (1, 2, 3, 4) and (four.layers_m[3], four.layers_m[4]) == (39.0, 44.0)
    assert with_vehicles(task, 1).members == (1,)


def test_a_patrol_says_how_often_it_will_see_all_and_is_seen_to_keep_apart() -> None:
    task = task_for((1, 2), "patrol", shape=SMALL)
    frame = KinematicFleet(task, scattered(2)).frame()
    found = forecast(task, frame, {})
    assert found.worst_s == found.plan.metrics["predicted_worst_s"]
    assert 1.0 < found.ratio < 3.0 and found.separation >= 1.0


def test_a_vehicle_in_reserve_does_not_count_in_the_ratio() -> None:
    task = task_for((1, 2), "patrol", shape=SMALL, parameters={"reserve": 1})
    found = forecast(task, KinematicFleet(task, scattered(2)).frame(), {})
    assert found.plan.metrics["slots"] == 1
    assert found.ratio == pytest.approx(found.plan.metrics["predicted_ratio"])


def test_ways_are_recorded_until_all_are_on_their_slots() -> None:
    """From far away: 40 s are not enough to get there."""
    task = task_for((1, 2), "patrol", shape=Circle((500.0, 200.0), 25.0))
    nobody = KinematicFleet(task_for((), "patrol"), scattered(0)).frame()
    found = forecast(task, nobody, {}, {1: (20.0, 30.0), 2: (20.0, 60.0)})
    assert found.ways is not None and found.ways.is_sound
    assert found.ways.ids == (1, 2) and found.ways.step_s == 1.0
    assert [places[0] for places in found.ways.places_m] == [(20.0, 30.0, 27.0), (20.0, 60.0, 34.0)]
    assert 60 < len(found.ways.places_m[0]) < 100
    assert all(400.0 < places[-1][0] < 600.0 for places in found.ways.places_m)
    (tour,) = found.ways.loops_m
    assert tour[0] == tour[-1]


def test_so_many_are_enough_and_one_less_is_not() -> None:
    task = task_for((1,), "patrol", shape=SMALL)
    frame = KinematicFleet(task, scattered(1)).frame()
    one = forecast(task, frame, {})
    n, found = vehicles_for(one.worst_s * 0.6, task, frame, {})
    assert n == 2 and found.worst_s <= one.worst_s * 0.6
    assert vehicles_for(one.worst_s, task, frame, {})[0] == 1


def test_what_cannot_be_is_told() -> None:
    task = task_for((1, 2), "patrol", shape=SMALL)
    frame = KinematicFleet(task, scattered(2)).frame()
    assert "not with 64 vehicles either" in preview(PreviewTask(1, task, frame, 1e-3), {}).text
    wrong = preview(PreviewTask(1, task_for((1, 2), "nobody"), frame), {})
    assert wrong.state == "failed" and "nobody" in wrong.text


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("raise ValueError('too small for us')", "too small for us"),
        ("np.zeros(0).max()", "mine.py:12 in configure: ValueError: zero-size array to reduction operation"),
    ],
    ids=["as the author says it", "a mistake, with its line"],
)
def test_why_a_planner_of_a_file_has_no_plan(statement: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(bad.GOOD.replace("super().configure(task, params, rng)", statement))
    task = task_for((1, 2), "mine", shape=SMALL)
    found = preview(
        PreviewTask(1, task, KinematicFleet(task, scattered(2)).frame()), {"mine": PlannerFile("mine", path, "")}
    )
    assert found.state == "failed" and found.text.startswith(told)
    assert (found.text == told) is ("raise" in statement)
