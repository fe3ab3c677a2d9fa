"""Tasks from outside: added, seen by vehicles, missed, cancelled, and known again after a restart."""

import math

import pytest
from msgspec import structs

from tests.core.rigs.rig import Rig, toml
from tui_gcs.core.flight.point_table import PointTable
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.points import MAX_POINTS, AddPoints, CancelPoints, NewPoint
from tui_gcs.core.scenario.load import ScenarioError, parse


def table_of(flight: Rig) -> PointTable:
    return flight.station.flight.points


@pytest.fixture
def flight(rig) -> Rig:  # type: ignore[no-untyped-def]  # the fixture of tests/core
    made: Rig = rig(2)
    made.run(1.0)
    return made


def states(flight: Rig) -> dict[str, str]:
    return {point.name: point.state for point in table_of(flight).all()}


def add(flight: Rig, *points: NewPoint) -> m.Reply:
    return flight.ask(AddPoints(points))


def test_points_are_added_all_or_none_and_told(flight: Rig) -> None:
    reply = add(flight, NewPoint("well", (10.0, 20.0)), NewPoint("", (30.0, 20.0)))
    assert reply.text == "2 added: well, point 1; patrol: not made for tasks, so they may stay open"
    refused = add(flight, NewPoint("new", (0.0, 0.0)), NewPoint("well", (0.0, 0.0)))
    assert (refused.ok, refused.text) == (False, "there is a point well already")
    assert states(flight) == {"well": "open", "point 1": "open"}
    assert [point.name for point in flight.station.publisher.frame().points] == ["well", "point 1"]
    assert [point.name for point in flight.station.publisher.status().points] == ["well", "point 1"]


def test_it_is_told_where_no_planner_visits_them(flight: Rig) -> None:
    patrol = flight.station.parts.config.planners["patrol"]
    assert add(flight, NewPoint("well", (10.0, 20.0), team="defend")).text.endswith("they may stay open")
    flight.station.parts.config.planners["patrol"] = structs.replace(patrol, judged_by="tasks")
    assert add(flight, NewPoint("tower", (10.0, 20.0))).text == "1 added: tower"
    del flight.station.parts.config.planners["patrol"]
    assert add(flight, NewPoint("barn", (10.0, 20.0))).text == "1 added: barn", "it has not declared itself yet"


@pytest.mark.parametrize(
    ("point", "why"),
    [
        (NewPoint("a", (math.nan, 0.0)), "its place is not within 100 km of the origin"),
        (NewPoint("a", (0.0, 1e9)), "its place is not within 100 km of the origin"),
        (NewPoint("a", (0.0, 0.0), priority=0.0), "priority and time must be above 0"),
        (NewPoint("a", (0.0, 0.0), priority=math.inf), "priority and time must be above 0"),
        (NewPoint("a", (0.0, 0.0), within_s=-1.0), "priority and time must be above 0"),
        (NewPoint("a", (0.0, 0.0), team="nobody"), "there is no team nobody"),
        (NewPoint("\x1b[2J", (0.0, 0.0)), "printable characters"),
        (NewPoint("x" * 100, (0.0, 0.0)), "printable characters"),
    ],
)
def test_a_wrong_point_is_refused(flight: Rig, point: NewPoint, why: str) -> None:
    reply = add(flight, point)
    assert not reply.ok and why in reply.text
    assert states(flight) == {}


def test_there_is_a_limit(flight: Rig) -> None:
    many = tuple(NewPoint("", (float(i), 0.0)) for i in range(MAX_POINTS))
    assert add(flight, *many).ok
    assert add(flight, NewPoint("", (0.0, 0.0))).text == "200 points are open, at most 200 can be"
    assert flight.ask(CancelPoints()).ok
    assert add(flight, *many[:3]).ok, "closed ones give way"
    assert len(states(flight)) == MAX_POINTS


def test_a_point_is_missed_when_its_time_is_up_and_cancelled_by_name(flight: Rig) -> None:
    add(flight, NewPoint("late", (10.0, 20.0), within_s=2.0), NewPoint("off", (10.0, 20.0)))
    assert flight.ask(CancelPoints(("off", "what"))).text == "no open task what; cancelled: off"
    flight.run(3.0)
    assert states(flight) == {"late": "missed", "off": "cancelled"}
    assert any("task late MISSED: its time is up, 2 s after it was added" in text for text in flight.texts("tasks"))


def test_a_restarted_station_knows_them(flight: Rig) -> None:
    add(flight, NewPoint("well", (10.0, 20.0), 3.0, 500.0), NewPoint("off", (10.0, 20.0)))
    flight.ask(CancelPoints(("off",)))
    before = table_of(flight)
    after = PointTable(before._services, before.scenario, before._executive)
    after.recall(before.memory())
    assert [(p.name, p.state, p.due_s) for p in after.all()] == [(p.name, p.state, p.due_s) for p in before.all()]


# ---------------------------------------------------------------- in the scenario


def with_task(lines: str) -> str:
    return toml() + f"\n[[task]]\n{lines}\n"


def test_a_scenario_holds_tasks() -> None:
    lines = 'name = "well"\nplace_m = [10, 20]\npriority = 3\ndeadline_s = 90\nteam = "defend"'
    (task,) = parse(with_task(lines)).tasks
    assert (task.name, task.place_m, task.priority) == ("well", (10.0, 20.0), 3.0)
    assert (task.deadline_s, task.team) == (90.0, "defend")
    assert parse(toml()).tasks == ()


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ('name = "well"', "task[1] (line {}): place_m or place_deg must be given"),
        ('name = "well"\nplace_m = [1]', "task[1].place_m (line {}): "),
        ('name = "well"\nplace_m = [1, 2]\nteam = "defnd"', "there is no team 'defnd' (did you mean defend?)"),
        ('name = "well"\nplace_m = [1, 2]\ndeadline_s = 0', "0 is out of range"),
        ('name = "well"\nplace_m = [1, 2]\n[[task]]\nname = "well"\nplace_m = [3, 4]', "'well' is a task already"),
    ],
)
def test_mistakes_in_a_task_are_told_with_their_line(lines: str, why: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(with_task(lines))
    said = str(caught.value)
    assert why.partition(" (line")[0] in said and "(line" in said
