"""The container file and the unit for systemd: what they name is there, and no boot begins a flight."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tui_gcs.cli.main import command_line_parser

ROOT = Path(__file__).parents[2]
CONTAINER = (ROOT / "packaging/Containerfile").read_text(encoding="utf-8")
UNIT = (ROOT / "packaging/tui-gcs@.service").read_text(encoding="utf-8")
PROGRAM = "/opt/tui-gcs/bin/tui-gcs"


def test_what_the_container_copies_is_there_and_is_enough_to_install() -> None:
    copied = [name for line in re.findall(r"^COPY (.*) \S+$", CONTAINER, re.MULTILINE) for name in line.split()]
    assert [name for name in copied if not (ROOT / name).exists()] == []
    needed = {"pyproject.toml", "constraints.txt", "README.md", "LICENSE", "NOTICE", "tui_gcs", "sitl"}
    assert set(copied) == needed


def test_every_data_file_that_is_shipped_stands_in_the_notice() -> None:
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    files = [path for top in ("tui_gcs", "sitl") for path in (ROOT / top).rglob("*") if path.is_file()]
    data = {p for p in files if p.suffix not in (".py", ".pyc") and p.name != "py.typed"}
    assert {"px4.param", "newer.xml", "swarm-challenge.toml"} <= {path.name for path in data}
    named = [p for p in data if f"{p.parent.relative_to(ROOT).as_posix()}/" in notice]
    assert sorted(data) == sorted(named)
    assert [path.name for path in data if path.parent.name == "data" and path.name not in notice] == []


@pytest.mark.parametrize("text", [CONTAINER, UNIT], ids=["container", "unit"])
def test_the_commands_that_their_comments_name_are_understood(text: str) -> None:
    lines = re.findall(r"^#.*\b(?:tui-gcs|gcs) tui-gcs ([a-z].*)$", text, re.MULTILINE)
    assert lines
    for line in lines:
        command_line_parser().parse_args(shlex.split(line))


def test_no_boot_and_no_crash_begins_a_flight_and_a_stop_waits_for_the_landing() -> None:
    assert "\n[Install]" not in UNIT
    assert "\nRestart=no\n" in UNIT
    # `run` returns the vehicles on SIGTERM; the station must not be killed with it.
    assert "\nKillMode=process\nTimeoutStopSec=15min\n" in UNIT
    command = re.findall(rf"^ExecStart={PROGRAM} (.*)$", UNIT, re.MULTILINE)[0]
    arguments = command_line_parser().parse_args(shlex.split(command))
    assert arguments.module == "run"
    assert arguments.kind == "live"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_systemd_understands_the_unit(tmp_path: Path) -> None:
    unit = tmp_path / "tui-gcs@field.service"
    unit.write_text(UNIT.replace(PROGRAM, sys.executable), encoding="utf-8")
    done = subprocess.run(["systemd-analyze", "verify", str(unit)], capture_output=True, text=True, check=False)
    assert unit.name not in done.stderr, done.stderr
