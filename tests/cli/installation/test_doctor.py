"""`tui-gcs doctor`: what is missing, and the command that mends it."""

import contextlib
import json
import os
import pty
import socket
import stat
from pathlib import Path

import pytest

from tui_gcs.cli.installation import checks
from tui_gcs.cli.installation.checks import Level
from tui_gcs.cli.main import main
from tui_gcs.client import user_settings


@pytest.fixture(autouse=True)
def own_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv(user_settings.FILE, "")


def test_here_nothing_is_to_be_mended(capsys):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("ok   packages      textual 8.2.8;") for line in lines)
    assert not any(line.startswith("BAD") for line in lines)


def test_what_is_bad_is_the_exit_code_and_stands_in_the_document(tmp_path: Path, monkeypatch, capsys):
    (tmp_path / "state").mkdir()
    (tmp_path / "state/live").write_text("in the way")
    assert main(["doctor", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["ok"] is False
    assert document["text"] == "to be mended: live files"
    bad = [check for check in document["data"]["checks"] if check["level"] == "BAD"]
    assert "set TUI_GCS_STATE_DIR" in bad[0]["text"]


def test_a_taken_port_says_how_to_find_who_listens():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        with contextlib.suppress(OSError):  # somebody else's is as good
            other.bind(("127.0.0.1", checks.PORT))
        (found,) = checks.port()
    assert found.level is Level.NOTE
    assert str(checks.PORT) in found.mend


@pytest.mark.parametrize(
    ("environ", "level", "word"),
    [
        ({"TERM": "dumb"}, Level.BAD, "export TERM=xterm-256color"),
        ({"TERM": "xterm-256color", "COLORTERM": "truecolor"}, Level.GOOD, ""),
        ({"TERM": "xterm-256color", "NO_COLOR": "1"}, Level.NOTE, "unset NO_COLOR"),
    ],
)
def test_terminals(environ: dict[str, str], level: Level, word: str, monkeypatch):
    monkeypatch.setattr(checks.shutil, "get_terminal_size", lambda: os.terminal_size((100, 30)))
    found = list(checks.terminal(environ, True))[-1]
    assert (found.level, found.mend) == (level, word)


def test_a_small_terminal_says_how_large_it_has_to_be(monkeypatch):
    monkeypatch.setattr(checks.shutil, "get_terminal_size", lambda: os.terminal_size((60, 20)))
    found = next(checks.terminal({"TERM": "xterm"}, True))
    assert found.level is Level.BAD
    assert "80x24" in found.mend


def test_a_serial_device_that_may_not_be_opened_names_its_group(monkeypatch):
    device, _ = pty.openpty()
    path = Path(os.ttyname(device))
    assert checks._device(path).level is Level.GOOD
    monkeypatch.setattr(checks.os, "access", lambda *_: False)
    found = checks._device(path)
    assert found.level is Level.BAD
    group = checks.grp.getgrgid(path.stat().st_gid).gr_name
    assert found.mend == f'sudo usermod -aG {group} "$USER"   then log in again'
    assert stat.S_ISCHR(path.stat().st_mode)


@pytest.mark.parametrize(
    ("version", "bounds", "within"),
    [
        ("8.2.8", "==8.2.8", True),
        ("8.2.9", "==8.2.8", False),
        ("15.0.0", "<16,>=14.2", True),
        ("16.0", "<16,>=14.2", False),
        ("2.4.50", "<2.5,>=2.4.49", True),
        ("2.10.0", ">=2.9", True),
        ("0.22.0.post1", "<1,>=0.18.6", True),
    ],
)
def test_bounds_of_versions(version: str, bounds: str, within: bool):
    assert checks._within(version, bounds) is within
