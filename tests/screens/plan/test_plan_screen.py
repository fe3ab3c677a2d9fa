"""The plan screen: what is typed shows on the map and in the list; keys and files work here as everywhere."""

from pathlib import Path

import pytest
from textual.events import Key

from tests.screens.rigs.console import NARROW, WIDE
from tests.screens.rigs.fake_station import SCENARIO_FILE
from tests.screens.rigs.pictures import same_as_snapshot
from tests.screens.rigs.plan_station import PlanStation, plan_console
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role
from tui_gcs.core.protocol.common import Hold, PlannerInfo, Resume, RunPhase
from tui_gcs.core.scenario.load import parse, read_text
from tui_gcs.planner.api import Param
from tui_gcs.planner.runtime import registry
from tui_gcs.widgets.basics.glyphs import ASCII

SIZES = pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])


PARAMS = (
    Param("speed_fraction", float, 0.95, minimum=0.1, maximum=1.0, help="share of the allowed speed"),
    Param("margin_m", float, 1.0, minimum=0.0, unit="m"),
    Param("direction", str, "auto", choices=("auto", "cw", "ccw")),
)


@pytest.fixture(autouse=True)
def _planner(monkeypatch: pytest.MonkeyPatch) -> None:
    """One planner with these parameters, whatever the real ones are."""
    monkeypatch.setattr(registry, "names", lambda: ("patrol",))
    monkeypatch.setattr(registry, "declared", lambda _name: PARAMS)


# ---------------------------------------------------------------- what it looks like


@pytest.mark.long
@SIZES
async def test_pictures(size: tuple[int, int]) -> None:
    states = {
        "start": (),
        "polygon": ("3",),
        "area": ("1", "up"),
        "invalid": ("down", "tab", "tab", "tab", "tab", "tab", "tab", "9", "9", "9"),
        "team": ("escape", "2", "t"),
    }
    async with plan_console(size) as c:
        for name, keys in states.items():
            await c.press(*keys)
            assert same_as_snapshot(f"plan-{name}-{size[0]}x{size[1]}", c.text()), name


async def test_ascii_picture_has_only_ascii() -> None:
    async with plan_console(NARROW, glyphs=ASCII) as c:
        assert c.text().isascii()


@pytest.mark.long
@SIZES
async def test_every_field_of_every_form_can_be_reached_and_seen(size: tuple[int, int]) -> None:
    wanted = {"name", "role", "shape", "alt_min_m", "alt_max_m", "team", "vehicles", "count", "zone", "planner"}
    wanted |= {"east_m", "north_m", "radius_m", "width_m", "height_m", "heading_deg", "vertices_m", "direction"}
    seen = set()
    async with plan_console(size) as c:
        for key in ("1", "2", "3", "t"):
            await c.press("escape", key)
            first = c.app.focused
            for _ in range(20):
                await c.pilot.press("tab")
                focused = c.app.focused
                assert focused is not None
                assert c.plan.query_one("#side").region.contains_region(focused.region)
                seen.add(getattr(focused, "field", ""))
                if focused is first or (key in "23" and focused.parent is c.plan.team_form.query("FormRow").first()):
                    break
    assert wanted <= seen


# ---------------------------------------------------------------- the map follows


async def test_radius_is_on_the_map_as_it_is_typed() -> None:
    async with plan_console() as c:
        await c.field("radius_m")
        await c.press("6")
        assert c.map_zone("home") == Circle((150.0, 200.0), 6.0)
        await c.press("0")
        assert c.map_zone("home") == Circle((150.0, 200.0), 60.0)
        assert c.plan.map_view.edited_zone == "home"
        assert "1 change not applied" in c.said()


async def test_the_start_dialog_warns_that_edits_are_not_flown() -> None:
    async with plan_console() as c:
        await c.press("space")
        assert "NOT applied" not in c.text()
        await c.press("escape")
        await c.type_into("radius_m", "60")
        await c.press("escape", "space")
        assert "! 1 change on the plan screen NOT applied: not flown" in c.text()


async def test_ideal_follows_too() -> None:
    async with plan_console() as c:
        assert "ideal 20.9 s" in c.verdict()
        await c.type_into("radius_m", "40")
        assert "ideal 5.2 s" in c.verdict()


NOT_ALLOWED = [
    ("radius_m", "abc", "! home: radius_m: 'abc' is not a number; must be a number"),
    ("radius_m", "-5", "! home: radius_m: -5.0 is out of range; must be a number from more than 0"),
    ("radius_m", "200", "! home: zone 'home' reaches outside the operating area"),
    ("name", "field", "a second zone 'field'"),
    ("alt_max_m", "99999", "! home: alt_max_m: 99999.0 is out of range"),
    ("vehicles", "1-9x", "vehicles: '1-9x' is no system id; must be ids from 1 to 254"),
    ("vehicles", "1-8", "would leave no vehicle in team attack"),
    ("speed_fraction", "7", "speed_fraction: '7' is not allowed; must be 0.1 to 1"),
]


async def test_value_that_is_not_allowed_shows_why_and_reaches_neither_map_nor_station() -> None:
    async with plan_console() as c:
        for field, typed, reason in NOT_ALLOWED:
            await c.type_into(field, typed)
            assert reason in c.verdict()
            assert c.map_zone("home") == Circle((150.0, 200.0), 80.0)
            assert c.plan.model.text == c.plan_station.toml
            await c.pilot.press("ctrl+g")
            assert "not applied: a value is not allowed" in c.said()
            await c.press("ctrl+z")
            assert "ok:" in c.verdict()
        assert c.station.commands() == []


async def test_shape_can_be_changed_to_any_other() -> None:
    async with plan_console() as c:
        await c.field("shape")
        await c.press("right")
        assert c.map_zone("home") == Rectangle((150.0, 200.0), 160.0, 160.0)
        await c.press("right")
        assert isinstance(c.map_zone("home"), Polygon)
        await c.field("vertices_m")
        await c.press("space", "1", "5", "0", "comma", "2", "2", "0")
        shape = c.map_zone("home")
        assert isinstance(shape, Polygon)
        assert shape.vertices_m[-1] == (150.0, 220.0)


async def test_role_and_altitude_band() -> None:
    async with plan_console() as c:
        await c.field("role")
        await c.press("right")
        await c.type_into("alt_min_m", "30")
        zone = c.plan.draft.zone
        assert zone is not None
        assert (zone.role, zone.alt_min_m, zone.alt_max_m) == (Role.ATTACK, 30.0, None)


async def test_team_and_its_planners_parameters() -> None:
    async with plan_console() as c:
        await c.type_into("vehicles", "1-3")
        assert "4: in no team now, no take-off place" in c.said()
        await c.type_into("vehicles", "1-5")
        assert "5 from attack to defend" in c.said()
        await c.press("ctrl+z")
        await c.type_into("speed_fraction", "0.8")
        await c.field("direction")
        await c.press("right")
        team = c.plan.model.team("defend")
        assert team is not None
        assert team.parameters == {"speed_fraction": 0.8, "direction": "cw"}
        assert team.vehicles == (1, 2, 3, 4)


async def test_planner_from_a_file_is_edited_by_the_parameters_that_the_station_reports() -> None:
    lanes = Param("spacing_m", float, 25.0, minimum=5.0, maximum=100.0, unit="m", help="between two lanes")
    strips = PlannerInfo("strips", "1", (lanes.info(), PARAMS[2].info()), 5.0, file="/home/me/strips.py")
    toml = read_text(SCENARIO_FILE).replace('"patrol"', '"strips"', 1)
    async with plan_console(toml=toml, planners=(strips,)) as c:
        await c.field("spacing_m")
        assert "between two lanes" in c.said()
        await c.type_into("spacing_m", "500")
        assert "must be 5 to 100 m" in c.verdict()
        await c.type_into("spacing_m", "30")
        await c.press("ctrl+g")
        assert parse(c.station.applied()[-1].toml).teams[0].parameters["spacing_m"] == 30.0
        await c.field("planner")
        await c.press("left")
        assert c.plan.model.team("defend").planner == "patrol"  # type: ignore[union-attr]
        await c.press("right")
        assert c.plan.model.team("defend").planner == "strips"  # type: ignore[union-attr]


async def test_parameter_shows_its_help() -> None:
    async with plan_console() as c:
        await c.field("speed_fraction")
        assert "share of the allowed speed" in c.said()


async def test_editing_on_the_map_with_keys() -> None:
    async with plan_console() as c:
        await c.press("down", "e", "right", "up", "right_square_bracket", "right_curly_bracket")
        assert c.map_zone("field") == Rectangle((455.0, 205.0), 168.0, 126.0, 5.0)
        await c.press("escape", "down")
        assert c.map_zone("field") == Rectangle((455.0, 205.0), 168.0, 126.0, 5.0)


# ---------------------------------------------------------------- rounds, adding, deleting, undoing


async def test_round_edited_is_not_the_round_flown() -> None:
    async with plan_console() as c:
        await c.press("2")
        assert isinstance(c.map_zone("home"), Rectangle)
        chooser = c.plan.round_chooser.text()
        assert "▸2 round 2" in chooser
        assert "1 round 1 ►now" in chooser
        assert c.station.commands() == []
        await c.press("9")
        assert "there is no round 9" in c.said()


async def test_add_name_delete_and_undo() -> None:
    async with plan_console() as c:
        await c.press("plus")
        assert c.map_zone("zone 1") == Circle((300.0, 200.0), 30.0)
        await c.type_into("name", "gate")
        assert c.map_zone("gate") == Circle((300.0, 200.0), 30.0)
        await c.press("escape", "delete")
        assert c.map_zone("gate")
        assert "Del again" in c.said()
        await c.press("delete")
        assert c.plan.model.zone("gate") is None
        await c.press("u")
        assert c.map_zone("gate")
        await c.press("u", "u")
        assert c.plan.model.changes == 0
        await c.press("u")
        assert "nothing to undo" in c.said()


async def test_another_key_between_means_no() -> None:
    async with plan_console() as c:
        await c.press("plus", "escape", "delete", "escape", "delete")
        assert c.plan.model.zone("zone 1") is not None


async def test_zone_of_a_team_is_not_deleted() -> None:
    async with plan_console() as c:
        await c.press("delete", "delete")
        assert "a team's zone must exist in every round" in c.said() or "not deleted" in c.said()
        assert c.plan.model.zone("home") is not None


async def test_operating_area_is_not_deleted() -> None:
    async with plan_console() as c:
        await c.press("up", "delete", "delete")
        assert "the operating area stays" in c.said()


async def test_leaving_a_value_that_is_not_allowed_puts_it_back() -> None:
    async with plan_console() as c:
        await c.type_into("radius_m", "abc")
        await c.press("escape", "down")
        assert "put back" in c.said()
        await c.press("up")
        assert "ok:" in c.verdict()


# ---------------------------------------------------------------- the keys of everywhere


async def test_hold_all_works_with_the_cursor_in_a_field() -> None:
    async with plan_console(prepare=lambda station: station.fly()) as c:
        await c.field("name")
        await c.press("exclamation_mark", "h")
        assert c.station.commands() == [Hold()]


async def test_space_holds_from_list_and_choices_but_types_into_names() -> None:
    async with plan_console(prepare=lambda station: station.fly()) as c:
        await c.type_into("name", "x y")
        assert c.station.commands() == []
        await c.field("shape")
        await c.press("space")
        assert c.station.commands() == [Hold()]


async def test_enter_resumes_as_on_the_fly_screen() -> None:
    def held(station: PlanStation) -> None:
        station.fly()
        station.run = RunPhase.HOLD

    async with plan_console(prepare=held) as c:
        await c.field("radius_m")
        await c.press("enter")
        assert c.station.commands() == []
        await c.press("escape", "enter")
        assert c.station.commands() == [Resume()]


async def test_edits_survive_a_look_at_the_fly_screen() -> None:
    async with plan_console() as c:
        await c.type_into("radius_m", "60")
        await c.press("escape", "f", "p")
        assert c.map_zone("home") == Circle((150.0, 200.0), 60.0)
        assert "1 change not applied" in c.said()


async def test_detaching_with_changes_asks_once_more() -> None:
    async with plan_console() as c:
        await c.type_into("radius_m", "60")
        await c.press("escape", "q")
        assert c.app.is_running
        assert "q again leaves without them" in c.said()
        await c.pilot.press("q")
        assert not c.app.is_running


# ---------------------------------------------------------------- hostile text


HOSTILE = ("[red]x[/red]", "[/]", "[@click=app.quit]q[/]", "日本の基地", "a" * 32, "{0} %s")


@SIZES
async def test_names_are_only_ever_text(size: tuple[int, int]) -> None:
    def named(station: PlanStation) -> None:
        home, field, *rounds = HOSTILE
        text = station.toml.replace('"home"', f"'{home}'").replace('"field"', f"'{field}'")
        for number, name in enumerate(rounds[:3], 1):
            text = text.replace(f'"round {number}"', f"'{name}'")
        station.set_scenario(text.replace('"swarm-challenge"', f"'{HOSTILE[5]}'"))

    async with plan_console(size, prepare=named) as c:
        for name in HOSTILE[:2]:
            assert c.plan.draft.zone_name == name
            assert name[:9] in c.plan.zone_list.text()
            for key in ("t", "tab", "escape", "e", "escape", "delete", "2", "3", "1", "down"):
                await c.pilot.press(key)
            await c.settle()
        assert c.map_zone("[red]x[/red]") == Circle((150.0, 200.0), 80.0)
        assert "日本の基地" in c.plan.round_chooser.text() or size == NARROW


async def test_refusal_cannot_write_to_the_terminal() -> None:
    async with plan_console(refuse_apply="\x1b]52;c;aGk=\x07[bold]no") as c:
        await c.type_into("radius_m", "60")
        await c.press("ctrl+g")
        assert "\x1b" not in c.text()
        assert "[bold]no" in c.verdict()


# ---------------------------------------------------------------- files

KML = ("z", "full_stop", "k", "m", "l")


@pytest.mark.long
@SIZES
async def test_zones_come_from_a_map_program(
    size: tuple[int, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """^O, a path, Enter: the zone is on the map and in the list; u takes it back."""
    monkeypatch.chdir(tmp_path)
    at = parse(read_text(SCENARIO_FILE)).origin
    corners = ((3e-3, 2e-3), (4e-3, 2e-3), (4e-3, 3e-3), (3e-3, 2e-3))
    text = " ".join(f"{at.lon_deg + east:.7f},{at.lat_deg + north:.7f}" for east, north in corners)
    ring = f"<outerBoundaryIs><LinearRing><coordinates>{text}</coordinates></LinearRing></outerBoundaryIs>"
    async with plan_console(size) as c:
        Path("z.kml").write_text("<kml/>")
        await c.press("2", "ctrl+o", *KML, "enter")
        assert "not imported: z.kml: nothing is drawn" in c.said() and c.plan.model.changes == 0
        Path("z.kml").write_text(f"<kml><Placemark><name>barn</name><Polygon>{ring}</Polygon></Placemark></kml>")
        await c.press("ctrl+o", "ctrl+u", *KML, "enter")
        zone = c.plan.model.zone("barn")
        assert zone is not None and zone.role is Role.DEFEND and isinstance(zone.shape, Polygon)
        assert "z.kml: 1 zone added" in c.said() and "barn" in c.text()
        await c.press("u")
        assert c.plan.model.zone("barn") is None and c.plan.model.changes == 0
        await c.press("ctrl+o", "escape")
        assert "nothing imported" in c.said()


async def test_what_is_typed_ahead_of_a_slow_console_goes_into_the_next_field() -> None:
    async with plan_console() as c:
        await c.field("name")
        keys = "ctrl+u a b backspace c tab right tab tab ctrl+u 1 6 0 enter ctrl+u 2 0 1 down ctrl+u 5 9"
        for key in keys.split():  # all of them before any is looked at
            c.app.post_message(Key(key, key if len(key) == 1 else None))
        await c.settle()
        texts = c.plan.zone_form.texts
        assert (texts.name, texts.role) == ("ac", "attack")
        assert (texts.east_m, texts.north_m, texts.radius_m) == ("160", "201", "59")
