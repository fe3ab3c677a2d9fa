"""The working copy: only valid scenarios get in, every change can be undone, and it knows what the station flies."""

from pathlib import Path

import pytest
from msgspec.structs import replace

import tui_gcs
from tui_gcs.core.geometry.zones import Circle, Rectangle, Role, Zone
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.load import parse, read_text
from tui_gcs.core.scenario.model import OperatingArea, Team
from tui_gcs.core.scenario.place_allocation import same_places
from tui_gcs.widgets.plan.forms.settings_draft import SettingsDraft
from tui_gcs.widgets.plan.forms.team_text import team_text
from tui_gcs.widgets.plan.forms.zone_text import ZoneText, zone_text
from tui_gcs.widgets.plan.plan_draft import PlanDraft
from tui_gcs.widgets.plan.scenario_editor import Problems, ScenarioEditor
from tui_gcs.widgets.plan.scenario_edits import RoundEdits, TeamEdits, ZoneEdits

TEXT = read_text(Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml")
ROUNDS = parse(TEXT).rounds


def change(text: str = TEXT, revision: int = 1) -> ScenarioChanged:
    return ScenarioChanged(revision=revision, path="/home/me/mine.toml", toml=text, scenario=parse(text))


@pytest.fixture
def model() -> ScenarioEditor:
    model = ScenarioEditor()
    model.station_changed(change())
    return model


def home(radius_m: float, name: str = "home") -> Zone:
    return Zone(name, Role.DEFEND, Circle((150.0, 200.0), radius_m))


def other_text(speed: str = "6.0") -> str:
    return TEXT.replace("speed_m_s = 8.0", f"speed_m_s = {speed}")


def test_empty_model_takes_no_edit() -> None:
    model = ScenarioEditor()
    assert ZoneEdits(model).set_zone("home", home(10.0)) == ("no scenario yet",)
    assert model.undo() == ""
    assert not model.select_round(0)


def test_valid_change_is_taken_and_keeps_comments(model: ScenarioEditor) -> None:
    assert ZoneEdits(model).set_zone("home", home(60.0)) == ()
    assert model.zone("home") == home(60.0)
    assert model.changes == 1
    assert model.text == TEXT.replace("radius_m = 80.0", "radius_m = 60.0", 1)


def test_change_to_the_same_is_none(model: ScenarioEditor) -> None:
    assert ZoneEdits(model).set_zone("home", home(80.0)) == ()
    assert model.changes == 0


def test_invalid_change_returns_key_path_and_what_is_allowed_and_changes_nothing(model: ScenarioEditor) -> None:
    (problem,) = ZoneEdits(model).set_zone("home", home(-1.0))
    assert problem.startswith("round[1].zone[1].radius_m: -1")
    assert "must be" in problem
    assert "line" not in problem
    assert model.text == TEXT


def test_typing_in_one_field_is_one_step(model: ScenarioEditor) -> None:
    for radius_m in (6.0, 60.0, 61.0):
        ZoneEdits(model).set_zone("home", home(radius_m), "radius_m")
    assert model.changes == 1
    model.end_field()
    ZoneEdits(model).set_zone("home", home(62.0), "radius_m")
    assert model.changes == 2
    assert model.undo() == "zone home"
    assert model.zone("home") == home(61.0)
    model.undo()
    assert model.text == TEXT


def test_undo_goes_back_to_the_round_of_the_change(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    model.select_round(2)
    model.undo()
    assert model.round_index == 0


def test_rename_of_a_served_zone_goes_through_all_rounds_and_teams(model: ScenarioEditor) -> None:
    assert ZoneEdits(model).set_zone("home", home(80.0, "base")) == ()
    assert model.scenario is not None
    assert [r.zones[0].name for r in model.scenario.rounds] == ["base"] * 3
    assert model.scenario.teams[0].zone == "base"
    model.undo()
    assert model.text == TEXT


def test_rename_of_another_zone_stays_in_its_round(model: ScenarioEditor) -> None:
    ZoneEdits(model).add_zone(home(20.0, "gate"))
    model.select_round(1)
    ZoneEdits(model).add_zone(home(20.0, "gate"))
    ZoneEdits(model).set_zone("gate", home(20.0, "gate 2"))
    assert model.scenario is not None
    assert [zone.name for zone in model.scenario.rounds[0].zones] == ["home", "field", "gate"]
    assert [zone.name for zone in model.scenario.rounds[1].zones] == ["home", "field", "gate 2"]


def test_zone_of_a_team_cannot_be_removed(model: ScenarioEditor) -> None:
    (problem,) = ZoneEdits(model).remove_zone("home")
    assert "a team's zone must exist in every round" in problem


def test_new_names_are_free_in_every_round(model: ScenarioEditor) -> None:
    ZoneEdits(model).add_zone(home(20.0, "zone 1"))
    model.select_round(1)
    assert ZoneEdits(model).new_name() == "zone 2"


def test_undone_changes_can_be_redone_until_something_else_is_changed(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    model.select_round(1)
    ZoneEdits(model).set_zone("home", home(50.0))
    assert (model.undo(), model.undo(), model.undo()) == ("zone home", "zone home", "")
    assert model.redo() == "zone home" and model.zone("home") == home(60.0) and model.round_index == 0
    assert model.redo() == "zone home" and model.round_index == 1 and model.redo() == ""
    model.undo()
    ZoneEdits(model).set_zone("home", home(40.0))
    assert model.redo() == ""


def test_rounds_are_added_named_and_deleted(model: ScenarioEditor) -> None:
    rounds = RoundEdits(model)
    model.select_round(1)
    assert rounds.add_round() == ()
    assert model.round_index == 3 and model.current_round is not None
    assert model.current_round == replace(ROUNDS[1], name="round 4")
    settings = SettingsDraft(model)
    settings.typed(settings.texts | {"round_name": "late", "duration_s": "60"}, "round_name")
    assert settings.problems == ()
    assert (model.current_round.name, model.current_round.duration_s) == ("late", 60.0)
    assert rounds.remove_round() == () and model.round_index == 2
    for _ in range(2):
        assert rounds.remove_round() == ()
    assert "must be 1 to 64 tables" in rounds.remove_round()[0]


def test_a_zone_is_copied_into_rounds_that_have_it_or_not(model: ScenarioEditor) -> None:
    zones = ZoneEdits(model)
    zones.add_zone(home(20.0, "gate"))
    gate = model.zone("gate")
    assert gate is not None
    assert zones.copy_zone(gate, [1, 2]) == () and "gate" in model.common_zones()
    bigger = home(25.0, "gate")
    assert zones.copy_zone(bigger, [0, 2]) == () and model.zone("gate") == bigger
    assert model.undo() == "copy zone gate" and model.zone("gate") == gate


def test_teams_come_with_places_and_go_with_them(model: ScenarioEditor) -> None:
    teams = TeamEdits(model)
    assert teams.add_team() == ((), "team-3")
    team = model.team("team-3")
    assert team is not None and team.vehicles == (9,) and team.zone == "home"
    assert teams.set_team("team-3", replace(team, name="scouts", vehicles=(9, 10))) == ()
    assert model.scenario is not None and [place.vehicle for place in model.scenario.places[8:]] == [9, 10]
    assert teams.remove_team("scouts") == () and model.scenario.places == parse(TEXT).places
    assert teams.remove_team("attack") == () and "must be 1 to 32 tables" in teams.remove_team("defend")[0]


def test_area_and_team(model: ScenarioEditor) -> None:
    area = OperatingArea(Rectangle((300.0, 200.0), 700.0, 400.0), 20.0, 90.0)
    assert ZoneEdits(model).set_area(area) == ()
    assert model.current_round is not None
    assert model.current_round.area == area
    team = Team("defend", "home", "patrol", (1, 2, 3, 4), 0, {"direction": "cw"})
    assert TeamEdits(model).set_team("defend", team) == ()
    assert model.team("defend") == team


def test_vehicle_typed_into_a_team_leaves_the_one_that_had_it(model: ScenarioEditor) -> None:
    edits = TeamEdits(model)

    def teams() -> list[tuple[int, ...]]:
        assert model.scenario is not None
        return [team.vehicles for team in model.scenario.teams]

    def typed(vehicles: tuple[int, ...]) -> Problems:
        return edits.set_team("attack", Team("attack", "field", "patrol", vehicles), "vehicles")

    assert typed((5, 6, 7, 8, 2, 4)) == ()
    assert teams() == [(1, 3), (5, 6, 7, 8, 2, 4)] and edits.moved == "2 4 from defend to attack"
    assert typed((5, 6, 7, 8, 4)) == (), "2 was not meant: it stays where it was"
    assert teams() == [(1, 2, 3), (5, 6, 7, 8, 4)] and edits.moved == "4 from defend to attack"
    assert typed((1, 2, 3, 4, 5)) == ("vehicles: 1-4 would leave no vehicle in team defend",)
    assert typed((5, 6)) == () and edits.moved == "7-8: in no team now, no take-off place"
    assert typed((5, 6, 7, 8, 9)) == () and edits.moved == "9: new take-off place and layer"
    assert model.scenario is not None and model.scenario.places[-1].vehicle == 9
    model.undo()
    assert teams() == [(1, 2, 3, 4), (5, 6, 7, 8)]


def test_a_vehicle_that_leaves_a_team_and_joins_another_keeps_its_place_and_layer(model: ScenarioEditor) -> None:
    """Flown: 4 was taken out of its team first, got a place 20 m farther, and the station refused that in flight."""
    edits = TeamEdits(model)
    assert model.scenario is not None
    flown = model.scenario.places
    assert edits.set_team("defend", Team("defend", "home", "patrol", (1, 2, 3)), "vehicles") == ()
    assert edits.moved == "4: in no team now, no take-off place"
    assert edits.set_team("attack", Team("attack", "field", "patrol", (4, 5, 6, 7, 8)), "vehicles") == ()
    assert edits.moved == "4: take-off place and layer as before"
    assert same_places(model.scenario.places, flown)


def test_a_vehicle_whose_place_was_given_away_gets_another_one(model: ScenarioEditor) -> None:
    edits = TeamEdits(model)
    assert model.scenario is not None
    (its,) = (place for place in model.scenario.places if place.vehicle == 4)
    assert edits.set_team("defend", Team("defend", "home", "patrol", (1, 2, 3, 9)), "vehicles") == ()
    assert [p.vehicle for p in model.scenario.places if p.place_m == its.place_m] == [9], "who left gave its place"
    assert edits.set_team("attack", Team("attack", "field", "patrol", (4, 5, 6, 7, 8)), "vehicles") == ()
    assert edits.moved == "4: new take-off place and layer"
    assert len({place.layer_m for place in model.scenario.places}) == 9


def test_common_zones_are_what_teams_can_serve(model: ScenarioEditor) -> None:
    ZoneEdits(model).add_zone(home(20.0, "gate"))
    assert model.common_zones() == ("home", "field")


# ---------------------------------------------------------------- the station


def test_applied_copy_has_no_changes_and_undo_makes_one(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    base_revision, text = model.sending()
    assert base_revision == 1
    model.applied(text, 2)
    assert (model.changes, model.base_revision) == (0, 2)
    model.undo()
    assert model.changes == 1
    assert model.text == TEXT


def test_own_apply_coming_back_is_no_newer_scenario(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    _, text = model.sending()
    ZoneEdits(model).set_zone("home", home(50.0))
    model.station_changed(change(text, 2))
    assert model.newer is None
    assert (model.changes, model.base_revision) == (1, 2)
    assert model.zone("home") == home(50.0)


def test_unedited_copy_follows(model: ScenarioEditor) -> None:
    model.station_changed(change(other_text(), 2))
    assert model.text == other_text()
    assert model.newer is None


def test_edited_copy_is_kept_until_the_operator_decides(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    model.station_changed(change(other_text(), 2))
    assert model.newer is not None
    assert model.zone("home") == home(60.0)
    model.keep()
    assert (model.newer, model.base_revision) == (None, 2)
    assert model.changes >= 1


def test_discard_takes_the_stations(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    model.station_changed(change(other_text(), 2))
    model.discard()
    assert (model.text, model.base_revision, model.changes) == (other_text(), 2, 0)
    assert model.undo() == ""


def test_restarted_station_counts_from_one_again(model: ScenarioEditor) -> None:
    model.station_changed(change(other_text(), 7))
    ZoneEdits(model).set_zone("home", home(60.0))
    model.station_changed(change(other_text("5.0"), 1))
    assert model.newer is not None


def test_same_scenario_published_again_changes_nothing(model: ScenarioEditor) -> None:
    ZoneEdits(model).set_zone("home", home(60.0))
    model.station_changed(change())
    assert model.newer is None
    assert model.changes == 1


def test_round_that_is_gone_is_not_edited(model: ScenarioEditor) -> None:
    model.select_round(2)
    two = TEXT[: TEXT.index('[[round]]\nname = "round 3"')] + TEXT[TEXT.index("# A team is vehicles") :]
    model.station_changed(change(two, 2))
    assert model.round_index == 1
    assert not model.select_round(2)


# ---------------------------------------------------------------- half-typed values


def typed(draft: PlanDraft, field: str, *values: str) -> None:
    edited = draft.zone
    assert edited is not None
    texts = zone_text(edited)
    for value in values:
        texts = ZoneText(**({name: getattr(texts, name) for name in texts.__dataclass_fields__} | {field: value}))
        draft.zone_typed(texts, field)


def test_beginning_of_a_value_that_is_not_allowed_is_not_left_behind(model: ScenarioEditor) -> None:
    draft = PlanDraft(model)
    draft.choose_zone("home")
    typed(draft, "radius_m", "2", "20", "200")
    assert "reaches outside" in draft.problems[0]
    assert model.text == TEXT
    typed(draft, "name", "f", "fi", "fie", "fiel", "field")
    assert draft.zone_name == "home"
    assert model.text == TEXT


def test_corrected_value_is_taken_and_can_be_undone(model: ScenarioEditor) -> None:
    draft = PlanDraft(model)
    draft.choose_zone("home")
    typed(draft, "radius_m", "20", "200", "20", "2")
    assert draft.problems == ()
    assert model.zone("home") == home(2.0)
    model.undo()
    assert model.text == TEXT


def test_earlier_changes_survive_a_bad_value_in_another_field(model: ScenarioEditor) -> None:
    draft = PlanDraft(model)
    draft.choose_zone("home")
    typed(draft, "radius_m", "60")
    draft.end_field()
    typed(draft, "east_m", "x")
    assert model.zone("home") == home(60.0)
    assert draft.problems == ("home: centre_m E: 'x' is not a number; must be a number like 80 or -12.5",)


def test_unknown_planner_is_refused_but_an_old_one_may_stay() -> None:
    model = ScenarioEditor()
    model.station_changed(change(TEXT.replace('planner = "patrol"', 'planner = "theirs"', 1)))
    draft = PlanDraft(model)
    draft.choose_zone("home")
    team = draft.team
    assert team is not None
    texts = team_text(team)
    draft.team_typed(type(texts)(texts.name, "1-4", "", "home", "nobody"), "planner")
    assert "nobody" in draft.problems[0]
    draft.team_typed(type(texts)(texts.name, "", "4", "home", "theirs"), "count")
    assert draft.problems == ()
