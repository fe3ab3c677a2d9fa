"""Bad input on the command line: one clear line on stderr, exit code other than 0, no traceback, nothing started."""

import errno
import io
import os
import pty
import runpy
import socket
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from tests.rigs.console_pty import PtyConsole
from tests.rigs.reports import report_of
from tui_gcs import __version__ as tui_gcs_version
from tui_gcs.cli import common
from tui_gcs.cli.exit_codes import CANNOT, CommandError
from tui_gcs.cli.main import main
from tui_gcs.cli.vehicle_numbers import named_vehicles
from tui_gcs.core.base.directories import SUPERVISOR_LOCK, runtime_dir, try_lock
from tui_gcs.core.base.run_kind import RunKind

DATA = Path(__file__).parents[1] / "data"
SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"


@pytest.fixture(autouse=True)
def own_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))


def tui_gcs(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "tui_gcs.cli.main", *arguments],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=60,
        check=False,
    )


def refused(*arguments: str, code: int = 2) -> str:
    """The one line that says why; in this process, which costs a twentieth of starting one."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            returned: object = main(arguments)
        except SystemExit as ended:  # what argparse does not understand
            returned = ended.code
    assert returned == code, err.getvalue()
    assert "Traceback" not in err.getvalue()
    lines = err.getvalue().strip().splitlines()
    assert len(lines) == 1, err.getvalue()
    return lines[0]


def test_a_refusal_of_a_whole_process_is_the_same_line(tmp_path: Path):
    nowhere = ("run", str(tmp_path / "nowhere.toml"))
    done = tui_gcs(*nowhere)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", refused(*nowhere) + "\n")


def test_a_scenario_that_is_not_there(tmp_path: Path):
    assert "nowhere.toml" in refused("run", str(tmp_path / "nowhere.toml"))


def test_a_scenario_with_a_mistake_names_file_key_and_what_is_allowed(tmp_path: Path):
    bad = tmp_path / "bad.toml"
    bad.write_text(SCENARIO.read_text().replace("radius_m = 80.0", "radius_m = -80.0"))
    line = refused("run", str(bad))
    assert "bad.toml" in line
    assert "radius_m" in line
    assert "must be" in line


def test_a_busy_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        line = refused("run", str(SCENARIO), "--link", f"udpin:127.0.0.1:{port}")
    assert str(port) in line


@pytest.mark.long
@pytest.mark.parametrize("link", ["nonsense", "udpin:127.0.0.1", "udpin:127.0.0.1:99999", "serial:/dev/null:57600"])
def test_a_link_that_is_none(link: str):
    assert link in refused("run", str(SCENARIO), "--link", link)


def test_forced_sim_takes_loopback_only():
    assert "loopback" in refused("run", str(SCENARIO), "--kind", "sim", "--link", "udpin:0.0.0.0:14550")


@pytest.mark.parametrize("command", [("fly", str(SCENARIO)), ("attach",)])
def test_no_terminal_or_no_station(command: tuple[str, ...]):
    line = refused(*command)
    assert "terminal" in line or "no station runs" in line


def test_a_state_directory_that_others_may_change_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    state = tmp_path / "state"
    state.mkdir()
    state.chmod(0o777)
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(state))
    assert "every user may write there" in refused("run", str(SCENARIO), "--yes")


@pytest.mark.parametrize("verb", [f"run {SCENARIO} --yes", "demo --headless", f"rehearse {SCENARIO}"])
def test_too_few_open_files_is_one_line(verb: str):
    command = f"ulimit -n 24; exec {sys.executable} -m tui_gcs {verb}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr.startswith("tui-gcs: only 24 open files are allowed here, 64 are needed")
    assert done.stderr.count("\n") == 1


def test_too_few_open_files_for_a_console_are_one_line():
    command = f"ulimit -n 24; exec {sys.executable} -m tui_gcs replay {DATA / 'px4-8.tlog'}"
    environment = os.environ | {"TERM": "xterm-256color"}
    ours, terminal = pty.openpty()
    try:
        done = subprocess.run(
            ["sh", "-c", command],
            stdin=terminal,
            stdout=terminal,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            env=environment,
        )
    finally:
        os.close(ours)
        os.close(terminal)
    assert done.returncode == 2
    assert done.stderr.startswith("tui-gcs: only 24 open files are allowed here, 64 are needed")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("number", "advice"),
    [(errno.EMFILE, "raise the limit of open files"), (errno.ENOSPC, "make room"), (errno.EROFS, "name another place")],
)
def test_what_runs_out_in_the_midst_is_one_line(
    number: int, advice: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def run(_arguments: object) -> int:
        raise OSError(number, os.strerror(number), "log/run.tlog")

    monkeypatch.setattr("tui_gcs.cli.replay.run", run)
    assert main(["replay", str(DATA / "px4-8.tlog"), "--summary"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith(f"tui-gcs: log/run.tlog: {os.strerror(number)}: ") and advice in line


@pytest.mark.parametrize("command", ["status", "stop"])
def test_no_station(command: str):
    assert "no station runs" in refused(command)


@pytest.mark.parametrize("lacks", ["tui_gcs.cli.replay", "tui_gcs.core.records.tlog_reader"])
def test_a_part_that_cannot_be_imported_is_one_line(
    lacks: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    for name in (lacks, "tui_gcs.cli.replay"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, lacks, None)
    assert main(["replay", str(DATA / "px4-8.tlog"), "--summary"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "installation is not whole" in line and lacks in line


def test_not_a_tlog():
    assert "swarm-challenge.toml" in refused("replay", str(SCENARIO))


def test_an_empty_and_a_missing_tlog(tmp_path: Path):
    empty = tmp_path / "empty.tlog"
    empty.touch()
    assert "empty.tlog" in refused("replay", str(empty))
    assert "gone.tlog" in refused("replay", str(tmp_path / "gone.tlog"))


def test_a_truncated_tlog_is_summarised_as_far_as_it_goes_with_a_warning(tmp_path: Path):
    cut = tmp_path / "cut.tlog"
    cut.write_bytes((DATA / "arducopter-8.tlog").read_bytes()[:100_003])
    done = tui_gcs("replay", str(cut))
    assert done.returncode != 0
    assert "ends inside a record" in done.stderr
    assert "ArduPilot" in done.stdout


def test_the_summary_of_a_good_tlog_as_json():
    done = tui_gcs("replay", str(DATA / "px4-8.tlog"), "--json")
    assert done.returncode == 0
    assert done.stderr == ""
    report = report_of(done.stdout, "replay")
    assert report["ok"] and report["data"]["systems"][0]["autopilot"] == "PX4"


@pytest.mark.parametrize(
    ("environment", "columns", "lines", "why"),
    [({"TERM": "dumb"}, 120, 40, b"TERM"), ({}, 60, 20, b"60x20"), ({}, 79, 24, b"79x24")],
)
def test_terminals_that_cannot_show_a_console(
    environment: dict[str, str], columns: int, lines: int, why: bytes, monkeypatch: pytest.MonkeyPatch
):
    console = PtyConsole(["demo"], columns, lines, environment)
    assert console.wait_exit(20) == 2
    assert why in console.output
    assert b"Traceback" not in console.output


def test_a_runtime_directory_that_is_a_link_is_refused(tmp_path: Path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "elsewhere")
    assert "is not a directory" in refused("status")


def test_a_station_that_is_slow_to_start_is_not_told_as_one_that_did_not(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(common, "START_LIMIT_S", 0.0)
    with pytest.raises(CommandError, match="did not start: it does not answer"):
        common.join(RunKind.SIM)
    with (runtime_dir(RunKind.SIM) / SUPERVISOR_LOCK).open("a") as lock:
        assert try_lock(lock)
        with pytest.raises(CommandError, match="is running, but it does not answer"):
            common.join(RunKind.SIM)


def test_a_second_networks_vehicles_may_be_in_a_scenario_and_are_not_simulated_with_the_first(tmp_path: Path):
    whole = SCENARIO.read_text().replace("vehicles = [5, 6, 7, 8]", "vehicles = [5, 6, 7, 1008]")
    whole = whole.replace("vehicle = 8", "vehicle = 1008")
    assert "1008" in whole
    scenario = tmp_path / "two.toml"
    scenario.write_text(whole)
    assert "vehicle 1008 is on a second network" in refused("demo", "--headless", "--scenario", str(scenario))


def test_a_dialect_with_a_mistake_is_told_before_anything_starts(tmp_path: Path):
    xml = tmp_path / "mine.xml"
    message = "<message id='0' name='HEARTBEAT'><field type='float' name='x'/></message>"
    xml.write_text(f"<mavlink><messages>{message}</messages></mavlink>")
    reported = refused("run", str(SCENARIO), "--link", "udpin:127.0.0.1:14999", "--dialect", str(xml), "--yes")
    assert "mine.xml" in reported and "HEARTBEAT" in reported


def test_other_stations_are_named_like_links(tmp_path: Path):
    reported = refused("run", str(SCENARIO), "--link", "udpin:127.0.0.1:14999", "--forward", "somewhere", "--yes")
    assert "somewhere" in reported and "udpout:HOST:PORT" in reported


@pytest.mark.long
@pytest.mark.parametrize(
    ("options", "why"),
    [
        ("--operator-at 0 0", "no place on the globe"),
        ("--operator-at nan nan", "km from the scenario's origin"),
        ("--operator-at -33.0 151.0", "km from the scenario's origin"),
        ("--operator-at 52.07 -0.63 --operator-alt -1000", "cannot be"),
        ("--operator-alt 50", "needs --operator-at"),
    ],
)
def test_a_place_where_no_operator_can_stand_is_told_before_anything_starts(options: str, why: str):
    reported = refused("run", str(SCENARIO), "--link", "udpin:127.0.0.1:14999", *options.split(), "--yes")
    assert reported.startswith("tui-gcs: --operator-") and why in reported


@pytest.mark.parametrize("seed", ["-1", str(2**63), "9" * 30])
@pytest.mark.parametrize(
    "command", [["rehearse"], ["demo", "--headless"], ["sim", "--count", "1"], ["planner", "check", "patrol"]]
)
def test_a_seed_that_no_scenario_may_have_is_refused(
    command: list[str], seed: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from tui_gcs.cli.main import main

    assert main([*command, "--seed", seed]) == 2
    assert capsys.readouterr().err.startswith(f"tui-gcs: --seed {seed}: must be from 0 to 9")


def test_lost_vehicles_are_named_as_everywhere_else() -> None:
    assert named_vehicles(["1-3", "5", "2,7"]) == (1, 2, 3, 5, 7)
    with pytest.raises(CommandError, match="vehicles are named as"):
        named_vehicles(["one"])


def test_the_name_of_a_file_does_not_write_to_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(SCENARIO), "\x1b]0;hacked\x07.mid"]) == CANNOT
    assert capsys.readouterr().err.startswith("tui-gcs: ␛]0;hacked␇.mid: an ending that names the format")


@pytest.mark.parametrize(
    ("command", "hint"),
    [
        (["fly", "--link", "udpin:0.0.0.0:14550"], "`tui-gcs scenario new FILE.toml` writes one"),
        (["mode", "3", "RTL"], "for single vehicles: tui-gcs vehicle --help"),
    ],
)
def test_what_an_operator_of_mavproxy_types_first_says_what_to_do(
    command: list[str], hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main(command)
    assert end.value.code == CANNOT
    assert capsys.readouterr().err.rstrip().endswith(hint)


def test_an_option_that_there_is_not_does_not_write_to_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["check", "a.toml", "--\x1b]0;hacked\x07"])
    assert end.value.code == CANNOT
    assert capsys.readouterr().err.endswith("tui-gcs: error: unrecognized arguments: --␛]0;hacked␇\n")


def test_python_m_tui_gcs_is_the_same_program(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["tui-gcs", "--version"])
    with pytest.raises(SystemExit) as end:
        runpy.run_module("tui_gcs", run_name="__main__")
    assert (end.value.code, capsys.readouterr().out) == (0, f"tui-gcs {tui_gcs_version}\n")
