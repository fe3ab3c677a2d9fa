"""What an operator says about the console: on the command line or in the environment, the same."""

import argparse
from pathlib import Path

import pytest

from tui_gcs.cli import console_options
from tui_gcs.cli.console import operators_theme
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.file_access import base_map_of
from tui_gcs.cli.main import main
from tui_gcs.terminal.themes import THEMES


def parsed(*said: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    console_options.add(parser)
    return parser.parse_args(said)


def test_options_are_handed_on_in_the_environment() -> None:
    environ: dict[str, str] = {}
    console_options.apply(parsed("--slow", "--plain", "--theme", "night", "--read-only", "--keymap", "k.toml"), environ)
    assert environ == {
        "TUI_GCS_SLOW": "1",
        "TUI_GCS_PLAIN": "1",
        "TUI_GCS_READ_ONLY": "1",
        "TUI_GCS_THEME": "night",
        "TUI_GCS_KEYMAP": "k.toml",
    }
    console_options.apply(argparse.Namespace(), environ := {})
    assert environ == {}


def test_every_theme_has_its_name_on_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(console_options.THEMES) == len(THEMES)
    for name, theme in zip(console_options.THEMES, THEMES, strict=True):
        monkeypatch.setenv("TUI_GCS_THEME", name)
        assert operators_theme() == theme and name in theme
    monkeypatch.setenv("TUI_GCS_THEME", "pink")
    with pytest.raises(CommandError, match="no theme 'pink'; there are: dark, night"):
        operators_theme()


@pytest.mark.parametrize("command", ["demo", "fly", "replay", "attach", "planner watch"])
def test_every_command_with_a_console_has_them(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([*command.split(), "--help"])
    reported = capsys.readouterr().out
    assert all(
        option in reported for option in ("--slow", "--theme", "--overlay", "--read-only", "--keymap", "--base-map")
    )


@pytest.mark.parametrize(
    ("content", "told"),
    [(None, "No such file or directory"), (b"a picture", "no base map: .pmtiles or .mbtiles with vector tiles")],
)
def test_a_file_that_is_no_base_map_is_named_in_one_line(tmp_path: Path, content: bytes | None, told: str) -> None:
    path = tmp_path / "map.pmtiles"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(CommandError) as error:
        base_map_of(str(path))
    assert str(error.value) == f"--base-map {path}: {told}"
    assert base_map_of(None) is None
