"""Reading scenario files: the shipped one, and every way to get one wrong."""

from pathlib import Path

import pytest

import tui_gcs
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role
from tui_gcs.core.scenario.load import MAX_BYTES, MAX_PROBLEMS_LISTED, ScenarioError, load, parse
from tui_gcs.core.scenario.model import Scenario

SHIPPED = Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml"
TEXT = SHIPPED.read_text(encoding="utf-8")


def changed(*swaps: tuple[str, str]) -> str:
    """The shipped scenario with the first occurrence of each text swapped."""
    text = TEXT
    for old, new in swaps:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def problems(text: str, known_planners=None) -> list[str]:
    with pytest.raises(ScenarioError) as error:
        parse(text, "my.toml", known_planners)
    assert str(error.value)
    return error.value.problems


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


@pytest.fixture(scope="module")
def shipped() -> Scenario:
    return load(SHIPPED, {"patrol"})


def test_shipped_zones_are_the_challenge_s(shipped: Scenario) -> None:
    zones = [{(z.name, z.role): z.shape for z in r.zones} for r in shipped.rounds]
    home, field = ("home", Role.DEFEND), ("field", Role.ATTACK)
    assert zones[0] == {
        home: Circle((150.0, 200.0), 80.0),
        field: Rectangle((450.0, 200.0), 160.0, 120.0),
    }
    assert zones[1] == {
        home: Rectangle((160.0, 200.0), 180.0, 110.0, 30.0),
        field: Circle((450.0, 210.0), 75.0),
    }
    assert zones[2] == {
        home: Polygon(((90, 130), (230, 130), (230, 190), (160, 190), (160, 280), (90, 280))),
        field: Rectangle((460.0, 200.0), 120.0, 160.0),
    }


def test_shipped_areas_places_and_limits(shipped: Scenario) -> None:
    assert shipped.rounds[0].area.shape == shipped.rounds[1].area.shape == Rectangle((300.0, 200.0), 600.0, 400.0)
    assert isinstance(shipped.rounds[2].area.shape, Polygon)
    assert {(r.area.alt_min_m, r.area.alt_max_m, r.duration_s) for r in shipped.rounds} == {(20, 90, 300)}
    assert [(p.vehicle, p.place_m, p.layer_m) for p in shipped.places] == [
        (i + 1, (45.0 if i < 4 else 25.0, 170.0 + 20 * (i % 4)), 27.0 + 7 * i) for i in range(8)
    ]
    assert [(t.name, t.zone, t.vehicles) for t in shipped.teams] == [
        ("defend", "home", (1, 2, 3, 4)),
        ("attack", "field", (5, 6, 7, 8)),
    ]
    assert (shipped.limits.speed_m_s, shipped.limits.accel_m_s2) == (8.0, 2.5)
    assert (shipped.results.slot_error_max_m, shipped.results.slot_lag_max_s) == (2.0, 0.5)
    assert (shipped.footprint_radius_m, shipped.seed, shipped.name) == (15.0, 42, "swarm-challenge")


def test_degrees_are_taken_for_metres() -> None:
    scenario = parse(changed(("centre_m = [150.0, 200.0]", "centre_deg = [52.0738, -0.6258]")))
    circle = scenario.rounds[0].zones[0].shape
    assert isinstance(circle, Circle)
    assert circle.centre_m == pytest.approx((151, 200), abs=1)


def test_a_count_of_vehicles_with_parameters_and_a_no_fly_zone() -> None:
    no_fly = '[[round.zone]]\nname = "mast"\nrole = "no-fly"\nshape = "circle"\ncentre_m = [610, 390]\nradius_m = 30\n'
    text = changed(
        ("vehicles = [5, 6, 7, 8]", "count = 4\n[team.parameters]\nspeed_m_s = 6.5\nring = true\n"),
        ('[[round]]\nname = "round 2"', no_fly + '\n[[round]]\nname = "round 2"'),
    )
    scenario = parse(text)
    assert scenario.teams[1].count == 4
    assert scenario.teams[1].parameters == {"speed_m_s": 6.5, "ring": True}
    assert scenario.rounds[0].zones[2].role is Role.NO_FLY


ONE_PROBLEM = [  # (old, new, key path, what the error must say)
    ("format = 1", "format = 2", "format", "2 is not allowed; must be a whole number from 1 to 1"),
    ("seed = 42 ", "seed = 4.5 ", "seed", "must be a whole number"),
    ("seed = 42 ", "sead = 42 ", "sead", "did you mean seed?"),
    ("radius_m = 80.0", "radius_m = nan", "round[1].zone[1].radius_m", "nan is out of range"),
    ("radius_m = 80.0", "radius_m = -1", "round[1].zone[1].radius_m", "more than 0"),
    ("radius_m = 80.0", "radius_m = 1e9", "round[1].zone[1].radius_m", "to 100000"),
    ("radius_m = 80.0", f"radius_m = {'9' * 400}", "round[1].zone[1].radius_m", "a huge number is out of range"),
    ("radius_m = 80.0", 'radius_m = "80"', "round[1].zone[1].radius_m", "'80' is text; must be a number"),
    ("radius_m = 80.0", "radius_m = true", "round[1].zone[1].radius_m", "true is true or false; must be a number"),
    ("radius_m = 80.0", "", "round[1].zone[1].radius_m", "is missing"),
    ("centre_m = [150.0, 200.0]", "centre_m = [150.0]", "round[1].zone[1].centre_m", "must be two numbers"),
    ("centre_m = [150.0, 200.0]", "", "round[1].zone[1]", "centre_m is missing; give centre_m"),
    ("centre_m = [150.0, 200.0]", "centre_deg = [91, 0]", "round[1].zone[1].centre_deg", "not on the globe"),
    ("centre_m = [150.0, 200.0]", "centre_deg = [0, 181]", "round[1].zone[1].centre_deg", "not on the globe"),
    ("centre_m = [150.0, 200.0]", "centre_deg = [0, 180]", "round[1].zone[1].centre_deg", "far from the origin"),
    ("centre_m = [150.0, 200.0]", "centre_deg = [0.6, 52]", "round[1].zone[1].centre_deg", "far from the origin"),
    ('shape = "circle"', 'shape = "cirlce"', "round[1].zone[1].shape", "did you mean circle?"),
    ('role = "defend"', 'role = "guard"', "round[1].zone[1].role", "one of defend, attack, no-fly"),
    ("lat_deg = 52.0720", "lat_deg = 95.0", "origin.lat_deg", "from -89 to 89"),
    ("speed_m_s = 8.0", "speed_m_s = 0", "limits.speed_m_s", "more than 0"),
    ("accel_m_s2 = 2.5", "accel_m_s2 = -1", "limits.accel_m_s2", "more than 0 to 100"),
    ("separation_horizontal_m = 10.0", "separation_horizontal_m = -1", "limits.separation_horizontal_m", "0 to 1000"),
    ("separation_vertical_m = 5.0", "separation_vertical_m = -1", "limits.separation_vertical_m", "from 0 to 1000"),
    ("geofence_margin_m = 5.0", "geofence_margin_m = -0.1", "limits.geofence_margin_m", "from 0 to 1000"),
    ("geofence_margin_m = 5.0", "geofence_margin_m = 1001", "limits.geofence_margin_m", "from 0 to 1000"),
    ("home_spread_m = 3.0", "home_spread_m = -1", "limits.home_spread_m", "from 0 to 1000"),
    ("width_m = 160.0", "width_m = 0", "round[1].zone[2].width_m", "more than 0"),
    ("coverage_min = 1.0", "coverage_min = 2.0", "results.coverage_min", "from 0 to 1"),
    ("slot_error_max_m = 2.0", "slot_error_max_m = 0", "results.slot_error_max_m", "more than 0"),
    ("slot_lag_max_s = 0.5", "slot_lag_max_s = nan", "results.slot_lag_max_s", "nan is out of range"),
    ('planner = "hold"', 'planner = "land"', "link_loss.planner", "must be hold"),
    ("duration_s = 300.0", "duration_s = inf", "round[1].duration_s", "inf is out of range"),
    ('name = "round 2"', 'name = "round 1"', "round[2].name", "a second round 'round 1'; the first is round[1].name"),
    ('name = "attack"\nzone', 'name = "defend"\nzone', "team[2].name", "a second team"),
    ('name = "attack"\nzone', 'name = "red team"\nzone', "team[2].name", "'red team' is not a simple name"),
    ('name = "field"', 'name = "home"', "round[1].zone[2].name", "a second zone 'home'"),
    ('name = "field"', 'name = "felt"', "team[2].zone", "zone 'field' is not in round 'round 1'"),
    ("radius_m = 80.0", "radius_m = 200.0", "round[1].zone[1]", "reaches outside the operating area"),
    ("radius_m = 75.0", "radius_m = 0.1", "round[2].zone[2]", "the area is 0.0314 m2"),
    ("[160.0, 190.0], [160.0, 280.0]", "[160.0, 280.0], [160.0, 100.0]", "round[3].zone[1]", "crosses itself"),
    (
        '"field"\nrole = "attack"',
        '"x"\nrole = "no-fly"\nshape = "circle"\ncentre_m = [45.0, 170.0]\nradius_m = 5.0\n\n'
        '[[round.zone]]\nname = "field"\nrole = "attack"',
        "place[1]",
        "the place is inside no-fly zone 'x' of round 'round 1'",
    ),
    ("[90.0, 280.0]]", "[90.0, 130.0]]", "round[3].zone[1].vertices_m", "the last vertex is the first again"),
    ("alt_max_m = 90.0", "alt_max_m = 20.0", "round[1].area.alt_max_m", "not above alt_min_m"),
    ("vehicles = [5, 6, 7, 8]", "vehicles = [4, 5, 6, 7, 8]", "team[2].vehicles[1]", "a second use of vehicle 4"),
    ("vehicles = [5, 6, 7, 8]", "vehicles = [5, 6, 7, 8, 255]", "team[2].vehicles[5]", "1 to 254"),
    ("vehicles = [5, 6, 7, 8]", "vehicles = []", "team[2].vehicles", "must be a list of 1 to 254 ids"),
    ("vehicles = [5, 6, 7, 8]", "", "team[2]", "neither vehicles nor count is given"),
    ("vehicles = [5, 6, 7, 8]", "vehicles = [5, 6, 7, 8]\ncount = 4", "team[2]", "both given"),
    ("vehicles = [5, 6, 7, 8]", "count = 5", "place", "5 vehicles have no take-off place of their own, and 4"),
    ("vehicles = [5, 6, 7, 8]", "vehicles = [6, 7, 8]", "place[5].vehicle", "vehicle 5 is in no team"),
    ("vehicle = 8", "vehicle = 7", "place[8].vehicle", "a second take-off place for vehicle 7"),
    ("layer_m = 76.0", "layer_m = 91.0", "place[8].layer_m", "must be 20 to 90 m"),
    ("layer_m = 76.0", "layer_m = 73.0", "place[8].layer_m", "is 4.0 m from the layer of place[7]"),
    ("place_m = [25.0, 230.0]", "place_m = [25.0, 219.0]", "place[8]", "is 9.0 m from place[7]"),
    (
        "place_m = [25.0, 230.0]",
        "place_m = [-25.0, 230.0]",
        "place[8]",
        "outside the operating area of round 'round 1'",
    ),
    ("vehicles = [5, 6, 7, 8]", "vehicles = [5, 6, 7, 8]\nparameters = {a = [1]}", "team[2].parameters.a", "a list"),
]


@pytest.mark.parametrize(("old", "new", "key", "says"), ONE_PROBLEM)
def test_an_error_names_file_key_line_and_what_is_allowed(old: str, new: str, key: str, says: str) -> None:
    reported = problems(changed((old, new)))
    [line] = [line for line in reported if line.startswith((f"my.toml: {key} (line ", f"my.toml: {key}: "))][:1] or [""]
    assert says in line, reported
    assert "\n" not in line


def test_a_table_of_another_name_is_given_with_its_line_and_an_empty_team_is_no_list_of_a_wrong_kind() -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(TEXT.replace("[[team]]", "[[tema]]"))
    line = TEXT.splitlines().index("[[team]]") + 1
    assert any(f"tema[1] (line {line}): unknown key (did you mean team?)" in each for each in caught.value.problems)
    with pytest.raises(ScenarioError, match=r"a list of 0 ids is not allowed here; must be a list of 1 to 254 ids"):
        parse(TEXT.replace("vehicles = [1, 2, 3, 4]", "vehicles = []"))


def test_no_margin_at_all_may_be_asked_for() -> None:
    limits = parse(changed(("geofence_margin_m = 5.0", "geofence_margin_m = 0"))).limits
    assert (limits.geofence_margin_m, limits.separation_horizontal_m, limits.home_spread_m) == (0.0, 10.0, 3.0)


def test_an_error_gives_the_line_the_value_stands_in() -> None:
    text = changed(("radius_m = 75.0", "radius_m = -75.0"))
    assert f"(line {line_of(text, 'radius_m = -75.0')}): -75.0 is out of range" in problems(text)[0]


def test_planners_are_checked_where_they_are_known() -> None:
    assert "did you mean patrol?" in problems(changed(('planner = "patrol"', 'planner = "patorl"')), {"patrol"})[0]
    assert parse(changed(('planner = "patrol"', 'planner = "mine"'))).teams[0].planner == "mine"
    assert "is a file" in problems(changed(('planner = "patrol"', 'planner = "../x"')))[0]
    assert "simple name" in problems(changed(('planner = "patrol"', 'planner = "a b"')))[0]


def test_all_problems_are_told_at_once() -> None:
    text = changed(("seed = 42 ", "seed = true "), ("radius_m = 80.0", "radius_m = 0"), ("vehicle = 8", "vehicle = 0"))
    assert len(problems(text)) == 3


def test_very_many_problems_are_cut_short() -> None:
    with pytest.raises(ScenarioError) as error:
        parse("\n".join(f"key_{i} = 1" for i in range(300)))
    assert len(error.value.problems) > 300
    assert len(str(error.value).splitlines()) == MAX_PROBLEMS_LISTED + 1


@pytest.mark.parametrize("text", ['name = "a\\u001b[31m"', '"a\\u001b[2J\\nb" = 1', '[team]\n"\\u202e" = 1', "é = 1"])
def test_nothing_of_a_file_disturbs_the_terminal(text: str) -> None:
    assert all(line.isprintable() for line in problems(text))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = \nb = 1", "my.toml: line 1: not valid TOML: Invalid value (column 5)"),
        ("a = 1\na = 2", "not valid TOML: Cannot overwrite a value"),
        ("a = " + "[" * 5000, "nested too deep"),
        (f"a = {'9' * 5000}", "not valid TOML"),
        ("", "my.toml: round: 0 of them; must be 1 to 64 tables [[round]]"),
        ("round = 3", "my.toml: round (line 1): a whole number is not allowed; must be tables: [[round]]"),
        ("origin = 1", "my.toml: origin (line 1): 1 is a whole number; must be a table: [origin]"),
    ],
)
def test_what_is_no_scenario_at_all(text: str, says: str) -> None:
    assert any(says in line for line in problems(text))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "big.toml").write_bytes(b"#" * (MAX_BYTES + 1))
    (tmp_path / "latin.toml").write_bytes(b"# one\n# caf\xe9\n")
    for name, says in [
        ("none.toml", "no such file"),
        ("", "is a directory"),
        ("big.toml", "larger than 256 KiB"),
        ("latin.toml", "line 2: is not UTF-8"),
        ("nul\0.toml", "cannot be read"),
    ]:
        with pytest.raises(ScenarioError, match=says) as error:
            load(tmp_path / name)
        assert len(error.value.problems) == 1
        assert str(error.value).isprintable()


def test_a_zone_s_own_altitude_band_lies_inside_the_area_s() -> None:
    with pytest.raises(ScenarioError, match="200 m is outside the altitude band"):
        parse(changed(("radius_m = 80.0", "radius_m = 80.0\nalt_min_m = 200.0")))


def test_a_planner_in_a_file_is_told_how_to_give_it() -> None:
    hint = "must be petrol; one in a file of yours is given to fly, run and rehearse by --planner FILE.py"
    assert any(hint in line for line in problems(TEXT, known_planners=("petrol",)))


def test_a_checklist_is_a_list_of_texts_in_their_order() -> None:
    text = TEXT + '\n[[checklist]]\ntext = "props tight"\n[[checklist]]\ntext = "area clear"\n'
    assert parse(text).checklist == ("props tight", "area clear")
    assert parse(TEXT).checklist == ()


@pytest.mark.parametrize(
    ("items", "says"),
    [
        ('[[checklist]]\ntext = ""', "checklist[1].text"),
        ('[[checklist]]\ntext = "a\\u001b[2J"', "is not a name"),
        ('[[checklist]]\ntext = "a"\n[[checklist]]\ntext = "a"', "'a' is an item already"),
        ('[[checklist]]\ntxt = "a"', "checklist[1].txt"),
        ("[[checklist]]\n", "checklist[1].text"),
        ("checklist = 3", "checklist"),
        ('[[checklist]]\ntext = "a"\n' * 31, "31 of them"),
    ],
)
def test_a_wrong_item_is_one_line(items: str, says: str) -> None:
    text = f"{items}\n{TEXT}" if items.startswith("checklist =") else f"{TEXT}\n{items}\n"
    assert any(says in line for line in problems(text))
