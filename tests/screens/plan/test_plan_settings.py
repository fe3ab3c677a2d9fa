"""What a scenario says besides zones and teams is filled in on the plan screen, too."""

from pathlib import Path

import pytest

from tests.screens.rigs.console import NARROW, WIDE
from tests.screens.rigs.pictures import same_as_snapshot
from tests.screens.rigs.plan_station import KEYS, PlanConsole, plan_console
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.widgets.basics.glyphs import ASCII
from tui_gcs.widgets.plan.forms.settings_text import GROUP_OF

SIZES = pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
TAB_TO_PLACE = 9


def scenario(c: PlanConsole) -> Scenario:
    assert c.plan.model.scenario is not None
    return c.plan.model.scenario


async def to(c: PlanConsole, field: str) -> None:
    """Put the cursor there; team and settings form have fields of one name."""
    for widget in c.plan.settings_form.query("FormField, ChoiceField"):
        if getattr(widget, "field", "") == field:
            widget.focus()
            await c.pilot.pause()


async def fill(c: PlanConsole, field: str, text: str) -> None:
    """Replace what stands in a field, key by key."""
    await to(c, field)
    assert getattr(c.app.focused, "field", "") == field
    await c.press("ctrl+u", *(KEYS.get(character, character) for character in text))


@pytest.mark.long
@SIZES
async def test_pictures(size: tuple[int, int]) -> None:
    states = {
        "settings": ("g",),
        "place": ("tab",) * TAB_TO_PLACE + ("right",),
        "invalid": ("tab", "tab", "ctrl+u", "9", "9", "9"),
        "end": ("ctrl+z", "shift+tab", "shift+tab") + ("up",) * (TAB_TO_PLACE + 1),
        "closed": ("escape",),
    }
    async with plan_console(size) as c:
        for name, keys in states.items():
            await c.press(*keys)
            assert same_as_snapshot(f"plan-settings-{name}-{size[0]}x{size[1]}", c.text()), name


async def test_ascii_picture_has_only_ascii() -> None:
    async with plan_console(NARROW, glyphs=ASCII) as c:
        await c.press("g")
        assert c.text().isascii()


@pytest.mark.long
@SIZES
async def test_every_field_can_be_reached_and_seen(size: tuple[int, int]) -> None:
    seen = set()
    async with plan_console(size) as c:
        await c.press("g")
        for _ in range(len(GROUP_OF) + 2):
            focused = c.app.focused
            assert focused is not None
            assert c.plan.settings_form.region.contains_region(focused.region)
            seen.add(getattr(focused, "field", ""))
            await c.press("tab")
    assert seen == {*GROUP_OF, "round", "place"}


@pytest.mark.long
async def test_everything_that_is_filled_in_stands_in_the_file_and_comments_stay(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    async with plan_console(prepare=lambda station: station.keep_in(file)) as c:
        await c.press("g")
        filled = {
            "scenario_name": "field day",
            "seed": "7",
            "footprint_radius_m": "12.5",
            "lat_deg": "47.1234567",
            "lon_deg": "-8.5",
            "ground_amsl_m": "430",
            "round_name": "first",
            "duration_s": "200",
            "place_east_m": "46",
            "layer_m": "28",
            "speed_m_s": "6",
            "accel_m_s2": "2",
            "separation_horizontal_m": "9",
            "separation_vertical_m": "4",
            "geofence_margin_m": "6",
            "home_spread_m": "2",
            "measured_s": "60",
            "coverage_min": "0.9",
        }
        for field, text in filled.items():
            await fill(c, field, text)
            assert not c.plan.draft.problems, field
        await to(c, "resume")
        await c.press("right", "ctrl+s")
        assert "saved to" in c.said()
        new = load(file)
        assert (new.name, new.seed, new.footprint_radius_m) == ("field day", 7, 12.5)
        assert (new.origin.lat_deg, new.origin.lon_deg, new.origin.ground_amsl_m) == (47.1234567, -8.5, 430.0)
        assert (new.rounds[0].name, new.rounds[0].duration_s) == ("first", 200.0)
        assert (new.places[0].place_m, new.places[0].layer_m) == ((46.0, 170.0), 28.0)
        limits, results = new.limits, new.results
        assert (limits.speed_m_s, limits.accel_m_s2, limits.geofence_margin_m, limits.home_spread_m) == (6, 2, 6, 2)
        assert (limits.separation_horizontal_m, limits.separation_vertical_m) == (9, 4)
        assert (results.measured_s, results.coverage_min, new.link_loss.resume) == (60.0, 0.9, True)
        comments = [line for line in c.plan_station.toml.splitlines() if line.startswith("#")]
        assert [line for line in file.read_text().splitlines() if line.startswith("#")] == comments
        for _ in range(len(filled) + 1):
            await c.press("ctrl+z")
        assert c.plan.model.text == c.plan_station.toml
        for _ in range(len(filled) + 1):
            await c.press("ctrl+y")
        assert scenario(c) == new


NOT_ALLOWED = [
    ("seed", "-1", "seed: '-1' is not allowed; must be a whole number"),
    ("footprint_radius_m", "-5", "footprint_radius_m: -5.0 is out of range"),
    ("lat_deg", "95", "origin.lat_deg: 95.0 is out of range; must be a number from -89 to 89"),
    ("lon_deg", "1.2.3", "lon_deg: '1.2.3' is not a number"),
    ("scenario_name", " ", "name: nothing"),
    ("round_name", "round 2", "a second round 'round 2'"),
    ("duration_s", "0", "round[1].duration_s: 0.0 is out of range"),
    ("vehicle", "1-4", "vehicle: '1-4' is no system id"),
    ("vehicle", "9", "place[1].vehicle: vehicle 9 is in no team"),
    ("place_east_m", "900", "the place is outside the operating area"),
    ("layer_m", "34", "is 0.0 m from the layer of place"),
    ("layer_m", "12,5", "layer_m: '12,5' is not a number"),
    ("separation_horizontal_m", "30", "must be at least separation_horizontal_m = 30 m"),
    ("coverage_min", "2", "results.coverage_min: 2.0 is out of range"),
]


@pytest.mark.long
async def test_setting_that_is_not_allowed_shows_why_and_is_not_sent() -> None:
    async with plan_console() as c:
        await c.press("g")
        for field, typed, reason in NOT_ALLOWED:
            await fill(c, field, typed)
            assert reason in c.verdict(), field
            assert c.plan.model.text == c.plan_station.toml, field
            await c.press("ctrl+g")
            assert "not applied: a value is not allowed" in c.said() and c.station.commands() == [], field
            await c.press("ctrl+s")
            assert "not saved: a value is not allowed" in c.said(), field
            await c.press("ctrl+z")
            assert "put back" in c.said() and not c.plan.draft.problems, field
            assert c.plan.settings_form.texts == c.plan.draft.settings.texts, field


async def test_half_of_a_place_may_lie_outside_while_it_is_typed() -> None:
    async with plan_console() as c:
        await c.press("g")
        await fill(c, "place_east_m", "25")
        assert "is 0.0 m from place" in c.verdict()
        await fill(c, "place_north_m", "250")
        assert scenario(c).places[0].place_m == (25.0, 250.0) and not c.plan.draft.problems


async def test_a_vehicle_that_had_another_place_gives_it_to_the_one_that_was_here() -> None:
    async with plan_console() as c:
        await c.press("g")
        await fill(c, "vehicle", "3")
        assert "vehicle 1 has place 3 now" in c.said()
        assert [place.vehicle for place in scenario(c).places] == [3, 2, 1, 4, 5, 6, 7, 8]
        await c.press("ctrl+z")
        assert [place.vehicle for place in scenario(c).places] == [1, 2, 3, 4, 5, 6, 7, 8]
        await fill(c, "vehicle", "12")
        assert [place.vehicle for place in scenario(c).places] == [1, 2, 3, 4, 5, 6, 7, 8], "1 was half of 12"


async def test_each_round_has_its_own_name_and_duration() -> None:
    async with plan_console() as c:
        await c.press("g")
        await to(c, "round")
        await c.press("right", "right")
        assert c.plan.model.round_index == 2
        await fill(c, "duration_s", "90")
        await fill(c, "round_name", "last")
        assert [(r.name, r.duration_s) for r in scenario(c).rounds[1:]] == [("round 2", 300.0), ("last", 90.0)]
        await c.press("escape")
        assert "3 last" in c.plan.round_chooser.text()


async def test_a_letter_in_a_number_is_refused_and_reported() -> None:
    async with plan_console() as c:
        await c.press("g")
        await fill(c, "speed_m_s", "6a")
        assert "numbers only" in c.said()
        assert scenario(c).limits.speed_m_s == 6.0 and c.station.commands() == []


async def test_leaving_shows_the_zones_again_with_the_cursor_in_their_list() -> None:
    async with plan_console(NARROW) as c:
        await c.press("g", "escape")
        assert c.app.focused is c.plan.zone_list and "zone home" in c.text()
        await c.press("g", "escape", "t")
        assert not c.plan.settings_form.display and getattr(c.app.focused, "field", "") == "team"
