"""Completion for shells, and the options that every command takes."""

import subprocess

import pytest

from tui_gcs.cli.installation.general_options import NO_COLOR, QUIET, VERBOSE, apply, commands
from tui_gcs.cli.main import command_line_parser, main
from tui_gcs.cli.progress_bar import ProgressBar
from tui_gcs.client import user_settings


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_knows_every_command(shell: str, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    words = {word for path, _ in commands(command_line_parser()) for word in path}
    assert {"rehearse", "doctor", "motor-test"} <= words
    assert [word for word in words if word not in script] == []


def test_bash_completes_a_command_and_its_options(capsys, tmp_path):
    main(["completion", "bash"])
    script = tmp_path / "completion"
    script.write_text(capsys.readouterr().out, encoding="utf-8")
    line = 'source "$0"; COMP_WORDS=(tui-gcs vehicle par); COMP_CWORD=2; _shtab_tui_gcs; echo "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", line, str(script)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["params"]


def test_general_options_stand_before_or_after_the_command():
    parser = command_line_parser()
    for line in ("-v status", "status -v", "vehicle -v list", "vehicle params get 3 A --verbose"):
        environ: dict[str, str] = {}
        apply(parser.parse_args(line.split()), environ)
        assert environ == {VERBOSE: "1"}
    environ = {}
    apply(parser.parse_args(["--no-color", "rehearse", "-q"]), environ)
    assert environ == {NO_COLOR: "1", QUIET: "1"}


def test_quiet_shows_no_progress(monkeypatch, capsys):
    ProgressBar().show(0.5, "half")
    assert "half" in capsys.readouterr().err
    monkeypatch.setenv(QUIET, "1")
    ProgressBar().show(0.5, "half")
    assert capsys.readouterr().err == ""


def test_verbose_says_which_settings_are_used_and_where_an_error_comes_from(monkeypatch, tmp_path, capsys):
    (tmp_path / "config.toml").write_text('operator = "Ada"')
    monkeypatch.setenv(user_settings.FILE, str(tmp_path / "config.toml"))
    for name in (VERBOSE, QUIET, NO_COLOR):
        monkeypatch.setenv(name, "")
    assert main(["run", str(tmp_path / "none.toml"), "-v"]) == 2
    reported = capsys.readouterr().err
    assert "config.toml: operator = 'Ada'" in reported
    assert "Traceback" in reported
