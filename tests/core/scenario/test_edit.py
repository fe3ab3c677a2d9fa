"""Edits of a scenario file: what is set is read back, what is not set stays as it was."""

import difflib
import tomllib
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tui_gcs
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Zone
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Limits, OperatingArea, ResultLimits, TakeOffPlace, Team

TEXT = (Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml").read_text(encoding="utf-8")
COMMENTS = [line for line in TEXT.splitlines() if line.lstrip().startswith("#")]

centres = st.tuples(st.floats(250, 350), st.floats(180, 220))
circles = st.builds(Circle, centres, st.floats(2, 60))
rectangles = st.builds(Rectangle, centres, st.floats(2, 80), st.floats(2, 80), st.floats(-360, 360))
triangles = st.builds(
    lambda c, size: Polygon((c, (c[0] + size, c[1]), (c[0], c[1] + size))), centres, st.integers(2, 60)
)
bands = st.one_of(st.just((None, None)), st.tuples(st.floats(20, 40), st.floats(41, 90)))
names = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=32)
zones = st.builds(
    lambda name, role, shape, band: Zone(name, role, shape, *band),
    names.filter(lambda name: name not in ("home", "field")),
    st.sampled_from(Role),
    st.one_of(circles, rectangles, triangles),
    bands,
)


def changed_lines(before: str, after: str) -> list[str]:
    return [d for d in difflib.ndiff(before.splitlines(), after.splitlines()) if d[:2] in ("+ ", "- ")]


@pytest.mark.parametrize("text", [TEXT, TEXT.replace("\n", "\r\n"), "", "# only a comment", "a = 1"])
def test_an_untouched_document_is_the_very_text(text: str) -> None:
    assert ScenarioDocument(text).text == text


def test_setting_what_is_already_there_changes_nothing() -> None:
    document, scenario = ScenarioDocument(TEXT), parse(TEXT)
    for i, round_ in enumerate(scenario.rounds):
        document.set_area(i, round_.area)
        document.set_round(i, name=round_.name, duration_s=round_.duration_s)
        for zone in round_.zones:
            document.set_zone(i, zone.name, zone)
    for team in scenario.teams:
        document.set_team(team.name, zone=team.zone, planner=team.planner, vehicles=team.vehicles, parameters={})
    document.set_scenario(name=scenario.name, seed=scenario.seed, footprint_radius_m=scenario.footprint_radius_m)
    assert document.text == TEXT


def test_one_value_changes_one_line_and_keeps_its_comment() -> None:
    document = ScenarioDocument(TEXT.replace("radius_m = 80.0", "radius_m = 80.0   # as asked"))
    before = document.text
    document.set_zone(0, "home", Zone("home", Role.DEFEND, Circle((150.0, 200.0), 85.5)))
    assert changed_lines(before, document.text) == ["- radius_m = 80.0   # as asked", "+ radius_m = 85.5   # as asked"]


def test_limits_of_results_and_their_comments_outlive_other_edits() -> None:
    document = ScenarioDocument(TEXT.replace("slot_error_max_m = 2.0 ", "slot_error_max_m = 3.0 "))
    document.set_zone(0, "home", Zone("home", Role.DEFEND, Circle((150.0, 200.0), 85.5)))
    kept = [line for line in document.text.splitlines() if line.startswith("slot_")]
    assert [line.split("#")[0].strip() for line in kept] == ["slot_error_max_m = 3.0", "slot_lag_max_s = 0.5"]
    assert all("#" in line for line in kept)
    assert parse(document.text).results.slot_error_max_m == 3.0


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2), zones, st.booleans())
def test_a_zone_that_was_set_is_read_back(round_index: int, zone: Zone, crlf: bool) -> None:
    text = TEXT.replace("\n", "\r\n") if crlf else TEXT
    document = ScenarioDocument(text)
    before = parse(text)
    document.set_zone(round_index, "field", zone)
    document.rename_zone(zone.name, "field")
    if zone.role is not Role.NO_FLY:
        expected = Zone("field", zone.role, zone.shape, zone.alt_min_m, zone.alt_max_m)
        after = parse(document.text)
        assert after.rounds[round_index].zones == (before.rounds[round_index].zones[0], expected)
        assert after.teams == before.teams
    assert [line for line in document.text.splitlines() if line.lstrip().startswith("#")] == COMMENTS
    assert document.text.count("\r") == (document.text.count("\n") if crlf else 0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2), zones)
def test_add_then_remove_gives_the_text_back(round_index: int, zone: Zone) -> None:
    document = ScenarioDocument(TEXT)
    document.add_zone(round_index, zone)
    after = parse(document.text)
    assert after.rounds[round_index].zones == (*parse(TEXT).rounds[round_index].zones, zone)
    document.remove_zone(round_index, zone.name)
    assert document.text == TEXT


def test_comments_between_tables_outlive_the_zone_above_them() -> None:
    document = ScenarioDocument(TEXT)
    document.remove_zone(2, "field")
    document.remove_zone(2, "home")
    assert [line for line in document.text.splitlines() if line.startswith("#")] == COMMENTS
    assert "zone" not in tomllib.loads(document.text)["round"][2]
    document.add_zone(2, parse(TEXT).rounds[2].zones[0])
    document.add_zone(2, parse(TEXT).rounds[2].zones[1])
    assert parse(document.text) == parse(TEXT)


def test_a_zone_is_renamed_everywhere() -> None:
    document = ScenarioDocument(TEXT)
    document.rename_zone("home", 'base "1" \\ #x')
    scenario = parse(document.text)
    assert [r.zones[0].name for r in scenario.rounds] == ['base "1" \\ #x'] * 3
    assert scenario.teams[0].zone == 'base "1" \\ #x'
    assert len(changed_lines(TEXT, document.text)) == 8


def test_a_polygon_over_several_lines_is_replaced_whole() -> None:
    text = TEXT.replace("vertices_m = [[0.0, 100.0], ", "vertices_m = [\n  [0.0, 100.0],  # west ]\n  ")
    document = ScenarioDocument(text)
    area = OperatingArea(Polygon(((0.0, 0.0), (600.0, 0.0), (600.0, 400.0), (0.0, 400.0))), 20.0, 85.0)
    document.set_area(2, area)
    assert parse(document.text).rounds[2].area == area


def test_positions_in_degrees_stay_in_degrees() -> None:
    text = TEXT.replace("centre_m = [150.0, 200.0]", "centre_deg = [52.0738, -0.6258]")
    document = ScenarioDocument(text)
    document.set_zone(0, "home", Zone("home", Role.DEFEND, Circle((160.0, 210.0), 80.0)))
    assert "centre_deg = [52.0738" in document.text
    [zone, _] = parse(document.text).rounds[0].zones
    assert isinstance(zone.shape, Circle)
    assert zone.shape.centre_m == pytest.approx((160, 210), abs=1e-3)


parameters = st.dictionaries(
    st.from_regex(r"[a-z][a-z0-9_]{0,12}", fullmatch=True),
    st.one_of(st.booleans(), st.integers(-(10**6), 10**6), st.floats(-1e6, 1e6), names),
    max_size=4,
)


@settings(max_examples=40, deadline=None)
@given(parameters, parameters, st.booleans())
def test_team_parameters_are_set_and_set_again(first: dict, second: dict, inline: bool) -> None:
    text = TEXT.replace("vehicles = [5, 6, 7, 8]", "vehicles = [5, 6, 7, 8]\nparameters = {}") if inline else TEXT
    document = ScenarioDocument(text)
    for chosen in (first, second):
        document.set_team("attack", parameters=chosen)
        team = parse(document.text).teams[1]
        assert team.parameters == chosen
        assert {k: type(v) for k, v in team.parameters.items()} == {k: type(v) for k, v in chosen.items()}
    assert [line for line in document.text.splitlines() if line.startswith("#")] == COMMENTS


def test_vehicles_take_out_the_count_and_the_other_way_round() -> None:
    document = ScenarioDocument(TEXT)
    document.set_team("attack", count=4, planner="sweep", name="red")
    team = parse(document.text).teams[1]
    assert (team.name, team.count, team.vehicles, team.planner) == ("red", 4, (), "sweep")
    document.set_team("red", vehicles=[5, 6, 7, 8], planner="patrol", name="attack")
    assert parse(document.text) == parse(TEXT)


def test_what_is_not_there_is_named() -> None:
    document = ScenarioDocument(TEXT)
    zone = parse(TEXT).rounds[0].zones[0]
    for edit in (
        lambda: document.set_zone(3, "home", zone),
        lambda: document.remove_zone(0, "nowhere"),
        lambda: document.set_team("blue", count=1),
    ):
        with pytest.raises(ScenarioError, match=r"there is no (round 4|zone named 'nowhere'|team named 'blue')"):
            edit()
    assert document.text == TEXT


def test_an_edit_that_cannot_be_made_leaves_the_text_as_it_was() -> None:
    area = (
        "[round.area]\n"
        'shape = "rectangle"\ncentre_m = [300.0, 200.0]\nwidth_m = 600.0\nheight_m = 400.0\n'
        "alt_min_m = 20.0\nalt_max_m = 90.0\n"
    )
    inline = "area = { " + ", ".join(area.strip().splitlines()[1:]) + " }\n"
    text = TEXT.replace(area, inline, 1)
    before = parse(text)
    document = ScenarioDocument(text)
    with pytest.raises(ScenarioError, match="write it under a header of its own"):
        document.set_area(0, OperatingArea(Circle((300.0, 200.0), 300.0), 20.0, 90.0))
    assert document.text == text
    document.add_zone(0, Zone("new", Role.NO_FLY, Circle((0.0, 0.0), 5.0)))
    assert parse(document.text).rounds[0].area == before.rounds[0].area


def test_a_text_that_is_no_toml_is_refused() -> None:
    with pytest.raises(ScenarioError, match="not valid TOML"):
        ScenarioDocument("a = ")


# ---------------------------------------------------------------- rounds, teams, places


def test_a_round_is_added_like_another_one_and_taken_out_again() -> None:
    document = ScenarioDocument(TEXT)
    document.add_round(2, "round 4")
    before, after = parse(TEXT).rounds, parse(document.text).rounds
    assert after[:3] == before
    assert msgspec.structs.replace(after[3], name="round 3") == before[2]
    assert set(TEXT.splitlines()) <= set(document.text.splitlines()), "comments stay"
    document.remove_round(3)
    assert parse(document.text) == parse(TEXT)
    document.remove_round(0)
    assert parse(document.text).rounds == before[1:]


def test_a_team_and_its_places_are_added_and_taken_out_again() -> None:
    document = ScenarioDocument(TEXT)
    document.add_team(Team("scouts", "home", "patrol", (9,), parameters={"search": 5}))
    document.add_place(TakeOffPlace((65.0, 200.0), 83.0, 9))
    after = parse(document.text)
    assert after.teams[2] == Team("scouts", "home", "patrol", (9,), parameters={"search": 5})
    document.set_place(8, TakeOffPlace((66.0, 200.0), 84.0, None))
    assert parse(document.text).places[8] == TakeOffPlace((66.0, 200.0), 84.0, None)
    document.remove_team("scouts")
    document.remove_place(8)
    assert parse(document.text) == parse(TEXT)


def test_places_in_degrees_stay_in_degrees() -> None:
    text = TEXT.replace("place_m = [45.0, 170.0]", "place_deg = [52.0735, -0.6274]")
    document = ScenarioDocument(text)
    place = parse(text).places[0]
    document.set_place(0, msgspec.structs.replace(place, place_m=(place.place_m[0] + 10.0, place.place_m[1])))
    assert "place_deg = [52.073" in document.text
    assert parse(document.text).places[0].place_m[0] == pytest.approx(place.place_m[0] + 10.0, abs=1e-3)


BARE = TEXT[: TEXT.index("# What no vehicle may exceed")] + TEXT[TEXT.index("# A round is a named set") :]
INLINE = BARE.replace("[[round]]", "LATER", 1).replace(
    "[origin]\nlat_deg = 52.0720\nlon_deg = -0.6280\nground_amsl_m = 110.0 ",
    "origin = {lat_deg = 52.0720, lon_deg = -0.6280, ground_amsl_m = 110.0} # here\n"
    "limits = {speed_m_s = 8.0} # at most\n#",
).replace("LATER", "[[round]]")  # fmt: skip


def test_settings_change_their_own_lines_and_keep_the_comments() -> None:
    document = ScenarioDocument(TEXT)
    document.set_scenario(name="mine", seed=7, footprint_radius_m=12.5)
    document.set_origin(Origin(47.1234567, 8.5, 430.0))
    document.set_limits(Limits(speed_m_s=6.0, separation_vertical_m=4.0))
    document.set_results(ResultLimits(measured_s=60.0))
    document.set_resume(True)
    new = parse(document.text)
    assert (new.name, new.seed, new.footprint_radius_m) == ("mine", 7, 12.5)
    assert new.origin == Origin(47.1234567, 8.5, 430.0)
    assert new.limits == Limits(speed_m_s=6.0, separation_vertical_m=4.0)
    assert new.results == ResultLimits(measured_s=60.0) and new.link_loss.resume
    assert [line for line in document.text.splitlines() if line.lstrip().startswith("#")] == COMMENTS
    assert len(changed_lines(TEXT, document.text)) == 2 * 10
    assert "measured_s = 60.0          # how long" in document.text


@pytest.mark.parametrize("text", [BARE, INLINE], ids=["no tables", "inline tables"])
def test_settings_that_are_not_written_are_added_only_where_they_differ(text: str) -> None:
    document = ScenarioDocument(text)
    document.set_limits(Limits())
    document.set_results(ResultLimits())
    document.set_resume(False)
    document.set_origin(parse(text).origin)
    assert document.text == text
    document.set_limits(Limits(speed_m_s=6.0, home_spread_m=4.0))
    document.set_results(ResultLimits(coverage_min=0.9))
    document.set_origin(Origin(47.0, 8.5, 430.0))
    new = parse(document.text)
    assert new.limits == Limits(speed_m_s=6.0, home_spread_m=4.0) and "accel_m_s2" not in document.text
    assert new.results == ResultLimits(coverage_min=0.9) and new.origin == Origin(47.0, 8.5, 430.0)
    assert new.rounds == parse(text).rounds
    assert ("# at most" in document.text) is (text is INLINE)
