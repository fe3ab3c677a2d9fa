"""`config.toml`: which settings reach which commands, what comes before what, and mistakes by file and line."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.installation import config
from tui_gcs.cli.installation.general_options import commands
from tui_gcs.cli.main import command_line_parser, main
from tui_gcs.client.user_settings import FILE, SETTINGS, path_of, problem_of

PARSER = command_line_parser()


class Typed:
    """What a command would run with, after a file and the environment were read."""

    def __init__(self, folder: Path, text: str, **environ: str) -> None:
        self.path = folder / "config.toml"
        self.path.write_text(text, encoding="utf-8")
        self.environ = {FILE: str(self.path), **environ}

    def __call__(self, line: str) -> dict[str, Any]:
        arguments = PARSER.parse_args(line.split())
        config.apply(arguments, self.environ)
        return vars(arguments)


def test_a_list_of_links_is_typed_once(tmp_path: Path):
    typed = Typed(tmp_path, 'link = ["udpin:0.0.0.0:14550", "serial:/dev/ttyUSB0:57600"]\noperator = "Ada"')
    assert typed("fly field.toml")["link"] == ["udpin:0.0.0.0:14550", "serial:/dev/ttyUSB0:57600"]
    assert typed("run field.toml")["operator"] == "Ada"


def test_the_command_line_replaces_the_file_and_so_does_the_environment(tmp_path: Path):
    typed = Typed(tmp_path, 'link = ["tcp:127.0.0.1:5760"]\noperator = "Ada"\ntheme = "night"', TUI_GCS_THEME="day")
    assert typed("fly field.toml --link udpin:0.0.0.0:14551")["link"] == ["udpin:0.0.0.0:14551"]
    assert typed("fly field.toml")["theme"] is None  # the variable is read later
    assert typed("run field.toml --operator Bob")["operator"] == "Bob"
    typed.environ["TUI_GCS_OPERATOR"] = "Cleo"
    assert typed("run field.toml")["operator"] == "Cleo"
    assert typed("run field.toml --operator Bob")["operator"] == "Bob"


def test_zero_is_a_height_that_was_given(tmp_path: Path):
    typed = Typed(tmp_path, "operator_alt = 120")
    assert typed("fly f.toml --operator-at 52 0 --operator-alt 0")["operator_alt"] == 0.0
    assert typed("fly f.toml --operator-at 52 0")["operator_alt"] == 120


def test_files_are_named_from_where_the_settings_lie(tmp_path: Path):
    typed = Typed(tmp_path, 'planner = ["mine.py"]\nkeymap = "keys.toml"')
    assert typed("fly f.toml")["planner"] == [str(tmp_path / "mine.py")]
    assert typed("fly f.toml")["keymap"] == str(tmp_path / "keys.toml")


@pytest.mark.parametrize("line", ["hold", "return 3", "land", "stop", "doctor", "completion bash"])
def test_a_mistake_in_the_file_never_keeps_a_vehicle_in_the_air(tmp_path: Path, line: str):
    Typed(tmp_path, "nonsense")(line)
    typed = Typed(tmp_path, 'kind = "sim"')
    assert typed(line).get("kind") is None


@pytest.mark.parametrize("line", ["fly f.toml", "run f.toml", "keys list"])
def test_that_vehicles_are_simulated_is_always_typed(tmp_path: Path, line: str):
    typed = Typed(tmp_path, 'kind = "sim"')
    assert typed(line)["kind"] == "live"
    assert typed("status")["kind"] == "sim"
    assert typed("vehicle list")["station"] == "sim"
    assert typed("vehicle plan show 3")["kind"] == "mission"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('theme = "dark"\nlinks = ["x"]', ":2: 'links': no such setting; there are: link,"),
        ("\n\nlink = 5", ':3: link: must be a list of texts, as link = ["…"]'),
        ('theme = "pink"', ":1: theme = 'pink': must be one of dark, night, day, contrast"),
        ("slow = 1", ":1: slow: must be true or false"),
        ("operator_at = [1]", ":1: operator_at: must be [latitude, longitude] in degrees"),
        ("operator_alt = true", ":1: operator_alt: must be a number"),
        ("a = 1\nb = ", ":2: no TOML: "),
        ('[link]\nx = "y"', ":1: link: must be a list"),
        ("yes = true", ":1: 'yes': no such setting"),
        ("\n[commands]\nlow = 3", ":2: commands: must be a table of texts, as [commands] and below it name ="),
        ("commands = 3", ":1: commands: must be a table of texts"),
        ('forward_commands = ["udpout:10.0.0.1:14550"]', ":1: 'forward_commands': no such setting"),
    ],
)
def test_a_mistake_is_a_line_with_file_and_line(tmp_path: Path, text: str, problem: str):
    typed = Typed(tmp_path, text)
    with pytest.raises(CommandError) as error:
        typed("status")
    assert str(error.value).startswith(f"{typed.path}{problem}")


def test_a_named_file_has_to_be_there_and_an_empty_name_reads_none(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setenv(FILE, str(tmp_path / "none.toml"))
    assert main(["status"]) == 2
    assert "none.toml: cannot be read (No such file" in capsys.readouterr().err
    assert config.read({FILE: "", "XDG_CONFIG_HOME": "/nowhere"}) == {}
    assert config.read({"XDG_CONFIG_HOME": str(tmp_path)}) == {}
    assert path_of({"XDG_CONFIG_HOME": "/x"}) == Path("/x/tui-gcs/config.toml")


@given(st.dictionaries(st.text(max_size=8) | st.sampled_from(sorted(SETTINGS)), st.text() | st.integers()))
def test_any_content_is_taken_or_refused_by_one_line(content: dict[str, object]):
    for key, value in content.items():
        assert "\n" not in problem_of(key, value).replace(str(value), "")


def test_every_setting_is_an_option_of_some_command():
    known = {action.dest for _, parser in commands(PARSER) for action in parser._actions}
    assert {key for key, setting in SETTINGS.items() if setting.kind is not dict} <= known


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('theme = "night"\n[commands]\nhold = "return"', ":3: commands: 'hold': there is such a command already"),
        ('[commands]\nlow = "altitude"\nx1 = "low;x1"', ":3: commands: 'x1': goes in a circle: x1 -> x1"),
        ('[commands]\nx1 = "far away"', ":2: commands: 'x1': 'far away' is not the name of an action"),
        ('commands = { x1 = "" }', ": commands: 'x1': has no words"),
    ],
)
def test_an_own_command_with_a_mistake_is_a_line_with_file_line_and_name(tmp_path: Path, text: str, problem: str):
    typed = Typed(tmp_path, text)
    with pytest.raises(CommandError) as error:
        config.own_commands(typed.environ)
    assert str(error.value).startswith(f"{typed.path}{problem}")


def test_own_commands_are_read_where_there_are_some(tmp_path: Path):
    typed = Typed(tmp_path, '[commands]\nlow = "select t1; altitude"')
    own = config.own_commands(typed.environ)
    assert own is not None and [step.text for step in own.steps("low 20")] == ["select t1", "altitude 20"]
    assert "commands" not in typed("fly f.toml"), "they are no option"
    typed.path.write_text("slow = true")
    assert config.own_commands(typed.environ) is None
