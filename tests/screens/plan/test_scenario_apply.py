"""What was edited on the plan screen reaches the station by an explicit apply, and a file by an explicit save."""

from pathlib import Path

import pytest

from tests.screens.rigs.plan_station import PlanConsole, PlanStation, plan_console
from tui_gcs.core.geometry.zones import Circle
from tui_gcs.core.scenario.load import parse

MINE = ("a", "full_stop", "t", "o", "m", "l")

# ---------------------------------------------------------------- apply


async def test_nothing_is_sent_before_apply_and_all_of_it_then() -> None:
    async with plan_console() as c:
        await c.type_into("radius_m", "60")
        await c.press("escape")
        assert c.station.commands() == []
        await c.press("a")
        (request,) = c.plan_station.applied()
        assert request.base_revision == 1
        assert parse(request.toml).rounds[0].zones[0].shape == Circle((150.0, 200.0), 60.0)
        assert "the station flies this now" in c.said()
        assert c.plan.model.changes == 0
        assert c.plan.model.base_revision == 2
        await c.press("a")
        assert len(c.plan_station.applied()) == 1


async def test_a_letter_typed_into_a_field_is_no_command() -> None:
    async with plan_console() as c:
        await c.type_into("radius_m", "60")
        await c.type_into("name", "a q")
        assert c.station.commands() == []
        assert c.plan.draft.zone_name == "a q"
        assert c.app.is_running


async def test_refusal_stays_with_its_reason() -> None:
    async with plan_console(refuse_apply="not applied: who is in which team cannot change in flight") as c:
        await c.type_into("radius_m", "60")
        await c.press("ctrl+g")
        assert "NOT APPLIED" in c.said()
        await c.press("escape", "down")
        assert "who is in which team cannot change in flight" in c.verdict()
        assert c.plan.model.changes == 1
        await c.press("u")
        assert "cannot change in flight" not in c.verdict(), "of this copy nobody has said anything"


async def test_in_flight_apply_asks_once_more() -> None:
    async with plan_console(prepare=lambda station: station.fly()) as c:
        await c.type_into("radius_m", "60")
        await c.press("escape", "a")
        assert c.plan_station.applied() == []
        assert "8 vehicles armed" in c.said()
        await c.press("a")
        assert len(c.plan_station.applied()) == 1


async def test_a_second_press_that_comes_late_or_to_another_fleet_asks_again() -> None:
    async with plan_console(prepare=lambda station: station.fly()) as c:
        await c.type_into("radius_m", "60")
        await c.press("escape", "a")
        c.clock.advance(10.1)
        await c.press("a")
        assert "8 vehicles armed" in c.said()
        c.station.changes[8] = {"armed": False}
        await c.tick()
        await c.press("a")
        assert "7 vehicles armed" in c.said()
        assert c.plan_station.applied() == []
        await c.press("a")
        assert len(c.plan_station.applied()) == 1


async def test_silent_station_is_no_apply() -> None:
    async with plan_console() as c:
        await c.type_into("radius_m", "60")
        c.station.silent = True
        await c.press("ctrl+g")
        assert "does not answer" in c.verdict()
        assert c.plan.model.changes == 1


# ---------------------------------------------------------------- somebody else's change


def with_speed(station: PlanStation, speed: str) -> str:
    return station.toml.replace("speed_m_s = 8.0", f"speed_m_s = {speed}")


async def test_unedited_copy_follows_the_station() -> None:
    async with plan_console() as c:
        c.plan_station.set_scenario(with_speed(c.plan_station, "6.0"))
        await c.settle()
        assert c.plan.model.scenario is not None
        assert c.plan.model.scenario.limits.speed_m_s == 6.0
        assert c.plan.model.changes == 0


async def edited_meanwhile(c: PlanConsole) -> None:
    await c.type_into("radius_m", "60")
    await c.press("escape")
    c.plan_station.set_scenario(with_speed(c.plan_station, "6.0"))
    await c.settle()
    assert "older revision" in c.said()
    await c.press("a")
    assert c.plan_station.applied() == []


async def test_edited_copy_can_be_kept() -> None:
    async with plan_console() as c:
        await edited_meanwhile(c)
        await c.press("k", "a")
        (request,) = c.plan_station.applied()
        assert request.base_revision == 2
        assert parse(request.toml).limits.speed_m_s == 8.0


async def test_edited_copy_can_be_discarded() -> None:
    async with plan_console() as c:
        await edited_meanwhile(c)
        await c.press("d")
        assert c.map_zone("home") == Circle((150.0, 200.0), 60.0)
        await c.press("d")
        assert c.map_zone("home") == Circle((150.0, 200.0), 80.0)
        assert c.plan.model.changes == 0


# ---------------------------------------------------------------- save


async def test_save_goes_to_the_operators_file_with_its_comments(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    async with plan_console(prepare=lambda station: station.keep_in(path)) as c:
        await c.type_into("radius_m", "60")
        await c.press("ctrl+s")
        assert f"saved to {path}"[:40] in c.said()
        text = path.read_text()
        assert "radius_m = 60.0" in text
        assert "# what one vehicle sees" in text
        assert c.station.commands() == []
        assert "not saved" not in c.said()


async def test_shipped_scenario_is_saved_somewhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    async with plan_console() as c:
        await c.press("ctrl+s")
        assert c.plan.save_bar.is_open
        assert "the shipped scenario stays as it is" in c.said()
        await c.press("ctrl+u", *MINE, "enter")
        assert (tmp_path / "a.toml").read_text() == c.plan_station.toml
        assert not c.plan.save_bar.is_open
        assert c.plan.model.path == str(tmp_path / "a.toml")


async def test_another_file_is_overwritten_only_when_asked_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.toml"
    path.write_text("theirs")
    async with plan_console() as c:
        await c.press("ctrl+s", "ctrl+u", *MINE, "enter")
        assert path.read_text() == "theirs"
        await c.press("escape")
        assert not c.plan.save_bar.is_open
        await c.press("ctrl+s", "ctrl+u", *MINE, "enter", "enter")
        assert path.read_text() == c.plan_station.toml
