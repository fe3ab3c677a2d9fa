"""Parameters in flight, edits in flight, and a look at what an edit would give."""

from collections.abc import Callable

import pytest
from msgspec.structs import replace

from tests.core.rigs.rig import Rig
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.protocol.planning import ParamInfo, PlannerInfo
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import parse

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]


def revisions(flight: Rig) -> dict[str, int]:
    return {
        name: controller.task.revision
        for name, controller in flight.station.active.team_controllers.items()
        if controller.task is not None
    }


def smaller(flight: Rig) -> str:
    """The scenario with another defended circle."""
    before = flight.station.active.round.zones[0].shape.radius_m  # type: ignore[union-attr]
    assert f"radius_m = {before}" in flight.station.active.toml
    return flight.station.active.toml.replace(f"radius_m = {before}", f"radius_m = {before - 20.0}", 1)


def test_a_parameter_changes_in_flight_and_nobody_holds(rig: MakeRig) -> None:
    flight = rig(4, wants=None).flying().run(15.0)
    reply = flight.ask(m.SetParameters(team="defend", parameters={"speed_fraction": 0.6}))
    assert reply.ok and reply.text == "team defend, planner patrol: speed_fraction 0.985 -> 0.6"
    assert "team defend, planner patrol: speed_fraction 0.985 -> 0.6" in flight.journal.path.read_text()
    assert "speed_fraction = 0.6" in flight.station.active.toml, "a restarted station knows it, too"
    slowest = []
    for _ in range(40):
        flight.run(0.1)
        slowest.append(min(flight.speed(v) for v in flight.ids))
    assert flight.phases() == {Phase.FLYING}
    assert max(slowest) > 1.0
    flight.run(60.0)
    assert max(flight.speed(v) for v in flight.ids) < 0.6 * 8.0 * 1.15
    assert flight.ask(m.SetParameters(team="defend", parameters={"speed_fraction": 0.6})).text.endswith(
        "nothing changes"
    )


def test_a_wrong_parameter_changes_nothing(rig: MakeRig) -> None:
    flight = rig(1, wants=None).ready()
    before = revisions(flight)
    for team, parameters, reported in [
        ("nobody", {"speed_fraction": 0.6}, "no team nobody"),
        ("defend", {"speed_fraction": 9.0}, "speed_fraction must be at most 0.985"),
        ("defend", {"speed_fraction": float("nan")}, "speed_fraction must be a finite number"),
        ("defend", {"speed_fraction": "fast"}, "speed_fraction must be float, not str"),
        ("defend", {"spede": 1.0}, "spede is no parameter of it (it has: speed_fraction,"),
    ]:
        reply = flight.ask(m.SetParameters(team=team, parameters=parameters))
        assert not reply.ok and reported in reply.text
        assert revisions(flight) == before
        assert any(reported in text for text in flight.texts("console-1")), "the refusal is told"


def test_what_a_saved_file_declares_is_what_parameters_are_checked_by(rig: MakeRig) -> None:
    flight = rig(1, wants=None, planning=False).ready()
    mine = PlannerInfo("patrol", "1", (), 5.0, file="/home/me/mine.py", sha256="old")
    flight.station.config.planners["patrol"] = mine
    spacing = ParamInfo("spacing_m", "float", 25.0)
    for declared, problem in [
        (PlannerInfo("patrol", "1", (spacing,), 5.0, file="/home/other/mine.py"), "is no parameter of it"),
        (PlannerInfo("other", "1", (spacing,), 5.0, file="/home/me/mine.py"), "is no parameter of it"),
        (PlannerInfo("patrol", "2", (spacing,), 5.0, file="/home/me/mine.py", sha256="new"), ""),
    ]:
        flight.plan(declares=declared)
        flight.run(0.1)
        reply = flight.ask(m.SetParameters(team="defend", parameters={"spacing_m": 30.0}))
        assert problem in reply.text and reply.ok is not bool(problem)
    assert any("planner patrol: parameters spacing_m" in text for text in flight.texts("planner defend"))


def test_a_planner_worker_may_not_set_parameters(rig: MakeRig) -> None:
    flight = rig(1, wants=None)
    request = m.SetParameters(team="defend", parameters={"speed_fraction": 0.6})
    assert not flight.ask(request, principal="planner-defend").ok


def test_an_edit_disturbs_only_the_team_it_concerns(rig: MakeRig) -> None:
    flight = rig(8, planning=False).ready()
    before = revisions(flight)
    edited = smaller(flight)
    assert flight.ask(m.ApplyScenario(base_revision=flight.station.active.revision, toml=edited)).ok
    after = revisions(flight)
    assert after["defend"] > before["defend"]
    assert flight.station.active.team_controllers["defend"].task.zones == flight.station.active.round.zones  # type: ignore[union-attr]


def test_what_an_edit_changes_of_planners_is_in_the_journal(rig: MakeRig) -> None:
    flight = rig(2, planning=False).ready()
    document = ScenarioDocument(flight.station.active.toml)
    document.set_team("defend", parameters={"speed_fraction": 0.6})
    document.set_team("attack", planner="waypoints")
    reply = flight.ask(m.ApplyScenario(base_revision=flight.station.active.revision, toml=document.text))
    words = "scenario applied; team defend: speed_fraction its default -> 0.6"
    assert reply.ok and reply.text.startswith(words)
    assert words in flight.journal.path.read_text()
    document.set_team("defend", parameters={"speed_fraction": 0.5, "direction": "cw"})
    reply = flight.ask(m.ApplyScenario(base_revision=flight.station.active.revision, toml=document.text))
    assert "team defend: direction its default -> cw; team defend: speed_fraction 0.6 -> 0.5" in reply.text


def test_a_preview_tells_numbers_and_touches_nothing(rig: MakeRig) -> None:
    flight = rig(4, wants=None).ready()
    before, revision = revisions(flight), flight.station.active.revision
    reply = flight.ask(m.Preview(base_revision=revision, toml=smaller(flight)))
    assert reply.ok
    found = flight.ask(m.GetPreviews()).previews["defend"]
    assert found.state == "done"
    assert found.metrics["predicted_worst_s"] < 20.0 and found.annotations
    assert revisions(flight) == before and flight.station.active.revision == revision
    assert flight.station.frontend.requests.in_control == ""
    assert flight.ask(m.CancelPreview()).ok
    assert flight.ask(m.GetPreviews()).previews == {}


def test_a_zone_is_edited_in_flight_in_two_steps_and_nobody_holds(rig: MakeRig) -> None:
    flight = rig(8, wants=None).flying()
    controller = flight.station.active.team_controllers["defend"]
    flight.until(controller.all_on_slot, 60.0, "all on slot")
    edited = smaller(flight)
    assert flight.ask(m.Preview(base_revision=flight.station.active.revision, toml=edited)).ok
    found = flight.ask(m.GetPreviews()).previews["defend"]
    before = controller.metrics["predicted_worst_s"]
    assert found.state == "done" and found.metrics["predicted_worst_s"] < before
    flight.run(5.0)
    assert controller.all_on_slot() and controller.metrics["predicted_worst_s"] <= before, "a look changes nothing"
    assert flight.ask(m.ApplyScenario(base_revision=flight.station.active.revision, toml=edited)).ok
    flight.run(1.0)
    assert controller.metrics["predicted_worst_s"] == pytest.approx(found.metrics["predicted_worst_s"], rel=0.02)
    flight.until(controller.all_on_slot, 60.0, "all on slot")
    assert flight.phases() == {Phase.FLYING}
    assert flight.station.flight.guard.vetoes == {}


def test_a_preview_of_nonsense_or_of_an_old_edit_is_refused(rig: MakeRig) -> None:
    flight = rig(1, planning=False).ready()
    assert not flight.ask(m.Preview(base_revision=flight.station.active.revision, toml="nonsense")).ok
    assert not flight.ask(
        m.Preview(base_revision=flight.station.active.revision + 1, toml=flight.station.active.toml)
    ).ok


def asked_of(flight: Rig) -> list[tuple[str, m.PreviewTask]]:
    """From now on: (whose worker, question)."""
    found: list[tuple[str, m.PreviewTask]] = []
    key = keys.PREVIEW_TASK.format(team="*")
    flight.station.records.bus.subscribe(
        key, lambda at, data: found.append((at.split("/")[2], m.decode(data, m.PreviewTask)))
    )
    return found


def test_a_new_team_is_foretold_by_another_ones_worker(rig: MakeRig) -> None:
    flight = rig(8, planning=False).ready()
    document = ScenarioDocument(flight.station.active.toml)
    before = flight.station.active.scenario
    third = replace(before.teams[1], name="third", vehicles=(7, 8))
    document.set_team("attack", vehicles=(5, 6))
    document.add_team(third)
    asked = asked_of(flight)
    assert flight.ask(m.Preview(base_revision=flight.station.active.revision, toml=document.text)).ok
    by_team = {ask.task.team: (worker, ask.task) for worker, ask in asked if ask.task is not None}
    worker, task = by_team["third"]
    assert worker in flight.station.active.team_controllers and worker != "third"
    assert task.members == (7, 8) and task.planner == third.planner and task.zone.name == third.zone
    assert task.layers_m == {7: 69.0, 8: 76.0} and by_team["attack"][1].members == (5, 6)
    planners, number = flight.station.frontend.requests.planners, asked[0][1].number
    planners.take("third", m.PreviewResult("third", number, "done", vehicles=2))
    assert flight.ask(m.GetPreviews()).previews["third"].state == "running", "it has no worker of its own"
    planners.take(worker, m.PreviewResult("third", number, "done", vehicles=2))
    assert flight.ask(m.GetPreviews()).previews["third"].vehicles == 2
    asked.clear()
    assert flight.ask(m.CancelPreview()).ok
    assert sorted(worker for worker, ask in asked if ask.task is None) == ["attack", "defend"]


def test_who_is_not_heard_begins_a_preview_at_its_take_off_place(rig: MakeRig) -> None:
    flight = rig(2, planning=False).ready()
    asked = asked_of(flight)
    assert flight.ask(m.Preview(base_revision=flight.station.active.revision, toml=flight.station.active.toml)).ok
    starts_m = asked[0][1].starts_m
    assert starts_m == {place.vehicle: place.place_m for place in parse(flight.station.active.toml).places}


def test_a_preview_is_told_what_the_teams_planner_learnt(rig: MakeRig) -> None:
    flight = rig(1, wants=None, planning=False).ready()
    asked = asked_of(flight)
    flight.plan(snapshot=b"slow in this wind")
    flight.run(0.1)
    assert flight.ask(m.Preview(base_revision=flight.station.active.revision, toml=flight.station.active.toml)).ok
    assert asked[0][1].snapshot == b"slow in this wind"


def test_a_preview_that_nobody_answers_ends(rig: MakeRig) -> None:
    flight = rig(1, planning=False).ready()
    assert flight.ask(m.Preview(base_revision=flight.station.active.revision, toml=flight.station.active.toml)).ok
    assert flight.ask(m.GetPreviews()).previews["defend"].state == "running"
    late = m.PreviewResult("defend", 77, "done")
    flight.station.frontend.requests.planners.take("defend", late)
    assert flight.ask(m.GetPreviews()).previews["defend"].state == "running", "of another preview"
    flight.run(91.0)
    assert flight.ask(m.GetPreviews()).previews["defend"].state == "failed"
