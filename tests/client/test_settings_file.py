"""Changing `config.toml`: what the operator wrote beside a value stays, and nothing wrong is ever written."""

import os
import stat
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tui_gcs.client.settings_file import change, change_command, changed, changed_command, shown_value, typed_value
from tui_gcs.client.user_settings import SETTINGS, SettingsError, parsed

FILE = """\
# settings of the field laptop

theme = "night"   # easier on the eyes
link = [
    "udpin:0.0.0.0:14550",  # the radio
]

[commands]   # typed after :
low = "altitude"
"""


@pytest.mark.parametrize(
    ("key", "value", "old", "new"),
    [
        ("theme", "day", 'theme = "night"   # easier', 'theme = "day"   # easier'),
        ("operator", "Ada", "]\n\n[commands]", ']\noperator = "Ada"\n\n[commands]'),
        ("slow", True, "]\n\n[commands]", "]\nslow = true\n\n[commands]"),
        ("theme", None, 'theme = "night"   # easier on the eyes\n', ""),
    ],
)
def test_everything_else_stays(key: str, value: object, old: str, new: str) -> None:
    assert changed(FILE, key, value) == FILE.replace(old, new)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "text", ["", "\n\n", "# only a comment\n", '[commands]\nlow = "altitude"\n', '# mine\n[commands]\nlow = "altitude"']
)
def test_a_file_without_keys_of_its_own_gets_the_first_one(text: str, end: str) -> None:
    text = text.replace("\n", end)
    new = changed(text, "theme", "day")
    assert tomllib.loads(new) == {**tomllib.loads(text), "theme": "day"}
    assert text.strip() in new and ("\n" in new.replace("\r\n", "")) == ("\r\n" not in text)
    assert tomllib.loads(changed(new, "theme", None)) == tomllib.loads(text)


@pytest.mark.parametrize(
    ("name", "words", "old", "new"),
    [
        ("low", "altitude 20", 'low = "altitude"\n', 'low = "altitude 20"\n'),
        ("back", "select all; return", 'low = "altitude"\n', 'low = "altitude"\nback = "select all; return"\n'),
        ("low", None, 'low = "altitude"\n', ""),
        ("back", None, "", ""),
    ],
)
def test_of_own_commands_one_is_changed(name: str, words: str | None, old: str, new: str) -> None:
    assert changed_command(FILE, name, words) == FILE.replace(old, new)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("text", ["", "\n", "# only a comment", 'theme = "day"\n', 'theme = "day"\n\n[commands]\n'])
def test_a_file_without_own_commands_gets_the_first_one(text: str, end: str) -> None:
    text = text.replace("\n", end)
    new = changed_command(text, "low", 'say "\\" = x')
    assert tomllib.loads(new) == {**tomllib.loads(text), "commands": {"low": 'say "\\" = x'}}
    assert text.strip() in new
    assert tomllib.loads(changed_command(new, "low", None))["commands"] == {}


@pytest.mark.parametrize("text", ['commands = {low = "altitude"}\n', 'commands.low = "altitude"\n'])
def test_own_commands_in_another_form_are_left_to_an_editor(tmp_path: Path, text: str) -> None:
    path = tmp_path / "config.toml"
    path.write_text(text)
    with pytest.raises(SettingsError, match="edit it in the file"):
        change_command(path, "back", "return")
    assert path.read_text() == text


def test_a_file_is_made_with_its_folder_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "tui-gcs" / "config.toml"
    change(path, "operator", "Ada")
    assert path.read_text() == 'operator = "Ada"\n'
    assert stat.S_IMODE(path.stat().st_mode) == 0o600 and stat.S_IMODE(path.parent.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_permissions_and_a_link_to_the_file_stay(tmp_path: Path, mode: int) -> None:
    real, path = tmp_path / "dotfiles.toml", tmp_path / "config.toml"
    real.write_text(FILE)
    real.chmod(mode)
    path.symlink_to(real)
    change(path, "theme", "day")
    assert path.is_symlink() and 'theme = "day"' in real.read_text()
    assert stat.S_IMODE(real.stat().st_mode) == mode
    assert sorted(each.name for each in tmp_path.iterdir()) == ["config.toml", "dotfiles.toml"]


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("theme", "pink", "theme = 'pink': must be one of dark, night, day, contrast"),
        ("slow", "yes", "slow: must be true or false"),
        ("link", ["udp:1"], "link 'udp:1': unknown kind"),
        ("forward", ["nonsense"], "link 'nonsense': unknown kind"),
        ("keymap", "none.toml", "keymap: 'none.toml': there is no such file"),
        ("terrain", "", "terrain: '': there is no such file"),
        ("planner", ["a\0b"], "there is no such file"),
        ("overlay", ["~nobody-has-this-name/x"], "there is no such file"),
        ("operator", "A\x1b[2J", "operator: a name"),
        ("operator", " ", "operator: a name"),
        ("operator_at", [91.0, 0.0], "operator_at: latitude from -90 to 90"),
        ("operator_at", [float("nan"), 0.0], "operator_at: latitude from -90 to 90"),
        ("operator_alt", float("inf"), "operator_alt: metres from"),
        ("yes", True, "no such setting"),
    ],
)
def test_a_bad_value_is_refused_and_nothing_is_written(tmp_path: Path, key: str, value: object, says: str) -> None:
    path = tmp_path / "config.toml"
    path.write_text(FILE)
    with pytest.raises(SettingsError) as error:
        change(path, key, value)
    assert says in str(error.value)
    assert path.read_text() == FILE


def test_a_file_with_a_mistake_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    for text, says in (("a = ", ":1: no TOML"), ("\nthema = 1", ":2: 'thema': no such setting")):
        path.write_text(text)
        with pytest.raises(SettingsError, match=says):
            change(path, "theme", "day")
        assert path.read_text() == text


def test_a_value_in_another_form_is_left_to_an_editor(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text('"theme" = "night"\n')
    try:
        change(path, "theme", "day")
    except SettingsError as error:
        assert "edit it in the file" in str(error)
        assert path.read_text() == '"theme" = "night"\n'
    else:
        assert tomllib.loads(path.read_text()) == {"theme": "day"}


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_file_that_may_not_be_written_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text(FILE)
    path.chmod(0o400)
    with pytest.raises(SettingsError, match="cannot be written"):
        change(path, "theme", "day")


def test_a_folder_or_a_pipe_in_its_place_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    for name in ("folder", "pipe", "folder/" + "x" * 300):
        with pytest.raises(SettingsError) as error:
            change(tmp_path / name, "theme", "day")
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("link", "udpin:0.0.0.0:1,network=a; tcp:h:2 ;", ["udpin:0.0.0.0:1,network=a", "tcp:h:2"]),
        ("operator_at", "52.07, -0.62", [52.07, -0.62]),
        ("operator_alt", " 120 ", 120.0),
        ("operator", " Ada ", "Ada"),
    ],
)
def test_what_is_typed_becomes_the_value_and_is_shown_as_it_is_typed(key: str, text: str, value: object) -> None:
    assert typed_value(key, text) == value
    assert typed_value(key, shown_value(key, value)) == value


@pytest.mark.parametrize(("key", "text"), [("operator_alt", "high"), ("operator_alt", "1 2"), ("operator_at", "north")])
def test_what_is_no_number_is_refused(key: str, text: str) -> None:
    with pytest.raises(SettingsError, match=key):
        typed_value(key, text)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    key=st.sampled_from([key for key, setting in SETTINGS.items() if setting.kind in (str, list)]),
    text=st.text(max_size=30),
)
def test_any_text_is_written_whole_or_refused(tmp_path: Path, key: str, text: str) -> None:
    path = tmp_path / "config.toml"
    path.write_text(FILE)
    try:
        value = typed_value(key, text)
        change(path, key, value)
    except SettingsError as error:
        assert "\n" not in str(error).replace(text, "") and path.read_text() == FILE
    else:
        assert parsed(path.read_text(), path)[key] == value
        assert "# easier on the eyes" in path.read_text() or key == "theme"
