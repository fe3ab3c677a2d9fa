"""The settings screen: what each setting is and where it comes from, and every way to change one."""

from pathlib import Path

import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.client.user_settings import (
    DEFAULT,
    ENVIRONMENT,
    FROM_FILE,
    SETTINGS,
    TYPED,
    SettingInUse,
    SettingsInUse,
)
from tui_gcs.screens.settings.settings_screen import SettingsScreen

FILE = """\
# the field laptop
theme = "night"   # easier on the eyes
operator = "Ada"
link = ["udpin:0.0.0.0:14550"]

[commands]
low = "altitude"
"""
STARTED = {
    "theme": SettingInUse("night", FROM_FILE),
    "operator": SettingInUse("Ada", FROM_FILE),
    "link": SettingInUse(["tcp:10.0.0.7:5760"], TYPED),
    "slow": SettingInUse(True, ENVIRONMENT),
    "commands": SettingInUse({"low": "altitude"}, FROM_FILE),
}


def started(path: Path, text: str = FILE) -> SettingsInUse:
    """A console that was started with `--link`, with TUI_GCS_SLOW and with this file."""
    path.write_text(text)
    return SettingsInUse(path, {key: STARTED.get(key, SettingInUse(None, DEFAULT)) for key in SETTINGS})


async def opened(c: Console, setting: str) -> None:
    """The screen, with this setting chosen."""
    if not isinstance(c.app.screen, SettingsScreen):
        await c.press("S", "e")
    rows = [row.setting for row in c.app.screen.setting_list.rows]
    await c.press("home", *["down"] * rows.index(setting))


def panel(c: Console) -> str:
    return " ".join(c.app.screen.panel.text().split())


def chosen(c: Console) -> tuple[str, str]:
    """Value and origin of the chosen setting."""
    row = c.app.screen.setting_list.chosen_row
    return row.value, row.origin


@pytest.mark.parametrize("size", [NARROW, WIDE], ids=["80x24", "120x40"])
async def test_pictures(size: tuple[int, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    async with console(size, settings=started(Path("config.toml"))) as c:
        await opened(c, "theme")
        assert same_as_snapshot(f"settings-{size[0]}x{size[1]}", c.text())
        await opened(c, "link")
        await c.press("enter")
        assert same_as_snapshot(f"settings-typed-{size[0]}x{size[1]}", c.text())
        await c.press("escape")
        await opened(c, ":low")
        await c.press("enter")
        assert same_as_snapshot(f"settings-command-{size[0]}x{size[1]}", c.text())


async def test_each_setting_says_where_its_value_comes_from(tmp_path: Path) -> None:
    async with console(settings=started(tmp_path / "config.toml")) as c:
        for setting, shown in (
            ("theme", ("night", "file")),
            ("link", ("tcp:10.0.0.7:5760", "option")),
            ("slow", ("yes", "environment")),
            ("plain", ("no", "default")),
            ("commands", ("low", "file")),
        ):
            await opened(c, setting)
            assert chosen(c) == shown
        await opened(c, "link")
        assert "from --link of this console" in panel(c)
        assert "the file says udpin:0.0.0.0:14550: --link comes before it" in panel(c)
        await opened(c, "slow")
        assert "from TUI_GCS_SLOW of this console" in panel(c)


async def test_a_theme_is_the_next_one_at_once_and_the_comment_stays(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        await opened(c, "theme")
        await c.press("enter")
        assert path.read_text() == FILE.replace("night", "day")
        assert "theme = day is written; it counts: at once" in panel(c)
        assert c.app.display_theme == "day" and chosen(c) == ("day", "file")
        await c.press("delete")
        assert "theme" not in path.read_text() and chosen(c) == ("dark", "default")
        assert "theme is removed from the file" in panel(c)


async def test_the_operator_s_name_is_typed_and_signs_from_now_on(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        assert c.app.operator.name == "Ada", "the file names who signs"
        await opened(c, "operator")
        await c.press("enter", *["backspace"] * 3, *"Bob", "enter")
        assert path.read_text() == FILE.replace("Ada", "Bob") and c.app.operator.name == "Bob"


async def test_a_list_is_typed_and_counts_for_the_next_station(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        await opened(c, "link")
        await c.press("enter", "end", *"; tcp:h:2", "enter")
        assert 'link = ["udpin:0.0.0.0:14550", "tcp:h:2"]' in path.read_text()
        assert "is written; it counts: next station" in panel(c)
        assert chosen(c) == ("tcp:10.0.0.7:5760", "option"), "this one goes on"


async def test_yes_and_no_change_places(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        await opened(c, "read_only")
        await c.press("enter")
        assert "read_only = true" in path.read_text()
        assert "the file says yes: that counts for the next console" in panel(c) and chosen(c) == ("no", "default")
        assert c.app.feed.requests.read_only == "", "this console commands on"
        await c.press("enter")
        assert "read_only = false" in path.read_text()


@pytest.mark.parametrize(
    ("setting", "typed", "says"),
    [
        ("link", "udp:1", "NOT WRITTEN: link 'udp:1': unknown kind"),
        ("keymap", "none.toml", "NOT WRITTEN: keymap: 'none.toml': there is no such file"),
        ("operator_alt", "high", "NOT WRITTEN: operator_alt: 'high': only numbers"),
        ("operator_at", "91 0", "NOT WRITTEN: operator_at: latitude from -90 to 90"),
        ("operator_alt", "", "operator_alt: nothing was typed, left as it is; Del removes it"),
    ],
)
async def test_a_bad_value_is_refused(tmp_path: Path, setting: str, typed: str, says: str) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        await opened(c, setting)
        await c.press("enter", *["backspace"] * 30, *typed, "enter")
        assert says in panel(c) and path.read_text() == FILE


async def test_escape_leaves_a_value_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        await opened(c, "operator")
        await c.press("enter", *"xy", "escape")
        assert "operator: left as it is" in panel(c) and path.read_text() == FILE
        await c.press("escape")
        assert "left as it is" not in panel(c)


async def test_what_is_not_in_the_file_is_not_removed(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        await opened(c, "terrain")
        await c.press("delete")
        assert "terrain is not in the file" in panel(c) and path.read_text() == FILE
        await opened(c, "commands")
        await c.press("delete")
        assert "choose one of the commands below this line" in panel(c) and path.read_text() == FILE


async def test_an_own_command_is_added_and_can_be_typed_at_once(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path), own_commands={"low": "altitude"}) as c:
        await opened(c, "commands")
        await c.press("enter", *"seen = show vehicles", "enter")
        assert ":seen = show vehicles is written; it counts: at once" in panel(c)
        assert path.read_text() == FILE + 'seen = "show vehicles"\n'
        assert [row.setting for row in c.app.screen.setting_list.rows][-2:] == [":low", ":seen"]
        assert not any(row.waits for row in c.app.screen.setting_list.rows if row.setting[0] in ":c")
        await c.press(":", *"seen", "enter")
        assert c.app.current_mode == "vehicles"


async def test_an_own_command_is_changed_and_removed_on_its_line(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path), own_commands={"low": "altitude"}) as c:
        await opened(c, ":low")
        assert chosen(c) == ("altitude", "file") and "what is typed instead of :low" in panel(c)
        await c.press("enter", *["backspace"] * 20, *"altitude 20", "enter")
        assert path.read_text() == FILE.replace('"altitude"', '"altitude 20"')
        assert chosen(c) == ("altitude 20", "file")
        await c.press("enter", "escape")
        assert ":low: left as it is" in panel(c)
        await c.press("delete")
        assert ":low is removed from the file; it counts: at once" in panel(c)
        assert path.read_text() == FILE.replace('low = "altitude"\n', "")
        assert c.app.own_commands.words == {}


@pytest.mark.parametrize(
    ("typed", "says"),
    [
        ("low", "type a name, = and words"),
        ("= altitude", "type a name, = and words"),
        ("low = return", "there is :low already"),
        ("hold = return", "'hold': there is such a command already"),
        ("Far = return", "a name has small letters"),
        ("x1 = far away", "'far away' is not the name of an action"),
        ("x1 = x1", "goes in a circle"),
        ("x1 = return; hold", "must be the last step"),
    ],
)
async def test_a_command_that_means_nothing_is_not_written(tmp_path: Path, typed: str, says: str) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path), own_commands={"low": "altitude"}) as c:
        await opened(c, "commands")
        await c.press("enter", *typed, "enter")
        assert "NOT WRITTEN" in panel(c) and says in panel(c)
        assert path.read_text() == FILE and c.app.own_commands.words == {"low": "altitude"}


async def test_a_command_that_another_one_uses_is_not_removed(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    text = f'{FILE}lower = "low 5"\n'
    async with console(settings=started(path, text)) as c:
        await opened(c, ":low")
        await c.press("delete")
        assert "NOT WRITTEN: 'lower': 'low 5' is not the name" in panel(c) and path.read_text() == text


async def test_a_command_that_an_editor_wrote_counts_for_the_next_console(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        path.write_text(f'{FILE}back = "select all; return"\n')
        await opened(c, ":back")
        assert "the file says 'select all; return': that counts for the next console" in panel(c)


async def test_a_file_that_was_spoilt_meanwhile_is_shown_and_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    async with console(settings=started(path)) as c:
        path.write_text("theme = ")
        await opened(c, "theme")
        assert "config.toml:1: no TOML" in panel(c)
        await c.press("enter")
        assert "NOT WRITTEN" in panel(c) and path.read_text() == "theme = "


async def test_without_a_file_nothing_is_written() -> None:
    async with console(settings=SettingsInUse(None)) as c:
        await opened(c, "theme")
        for key in ("enter", "delete"):
            await c.press(key)
            assert "NOT WRITTEN: TUI_GCS_CONFIG is empty, so no file is read" in panel(c)
        assert "no file is read" in c.text()


async def test_the_palette_finds_the_screen_and_stops_work_on_it(tmp_path: Path) -> None:
    def flight(station: object) -> None:
        station.fly()

    async with console(prepare=flight, settings=started(tmp_path / "config.toml")) as c:
        await c.press("colon", *"settings", "enter")
        assert isinstance(c.app.screen, SettingsScreen)
        await opened(c, "operator")
        await c.press("enter", "!", "h")
        assert len(c.station.commands()) == 1, "HOLD ALL, also while a value is typed"
