"""`--json` and `--output`: one shape for every command, alone on standard output, and for errors too."""

import io
import json
from pathlib import Path

import pytest

from tests.docs.test_pages import generator
from tests.rigs.reports import PAGE, documented, report_of
from tui_gcs.cli.exit_codes import ReportCode
from tui_gcs.cli.installation.general_options import commands
from tui_gcs.cli.main import command_line_parser, main

DATA = Path(__file__).parents[1] / "data"
TLOG = str(DATA / "px4-8.tlog")


@pytest.fixture(autouse=True)
def own_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO(""))


def with_json() -> set[str]:
    """The commands that take `--json`."""
    found = set()
    for path, parser in commands(command_line_parser()):
        flags = {option: action for action in parser._actions for option in action.option_strings}
        assert ("--json" in flags) is ("--output" in flags), path
        if "--json" in flags:
            assert flags["--json"].nargs == 0, f"{path}: a flag"
            found.add(" ".join(path))
    return found


def test_both_options_mean_the_same_everywhere_and_every_command_is_documented() -> None:
    assert with_json() == set(documented())


def test_the_schema_is_that_of_the_code() -> None:
    reference = generator("make_reference")
    assert reference.SCHEMA.read_text(encoding="utf-8") == reference.schema()


def test_every_code_is_documented() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"| `{code}` |" in text for code in ReportCode if code)


def test_the_document_is_alone_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", TLOG, "--json"]) == 0
    assert report_of(capsys.readouterr().out, "replay")["data"]["frames"] > 1000


def test_the_document_goes_to_a_file_beside_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", TLOG, "--output", "r.json"]) == 0
    assert capsys.readouterr().out.startswith(f"{TLOG}: ")
    assert json.loads((tmp_path / "r.json").read_text())["data"]["path"] == TLOG


def test_an_export_reports_the_file_it_wrote(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a file the tracks themselves are what is printed."""
    assert main(["export", TLOG, "--file", "t.csv", "--json"]) == 0
    report = report_of(capsys.readouterr().out, "export")
    assert report["data"]["file"] == "t.csv" and report["data"]["flights"][0]["points"] > 1000
    assert (tmp_path / "t.csv").stat().st_size > 10_000
    assert main(["export", TLOG, "--json"]) == 2
    assert "--file FILE" in report_of(capsys.readouterr().out, "export")["text"]


def test_a_warning_goes_to_standard_error_and_into_the_document(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cut.tlog").write_bytes(Path(TLOG).read_bytes()[:50_003])
    assert main(["replay", "cut.tlog", "--json"]) == 1
    out, err = capsys.readouterr()
    report = report_of(out, "replay")
    assert report["code"] == "failed" and "ends inside a record" in report["text"] and report["text"] in err


@pytest.mark.parametrize("command", sorted(with_json() - {"demo", "doctor", "planner list", "keys list"}))
def test_a_command_that_cannot_run_prints_the_same_shape(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """There is no station, and no file of any name."""
    assert main([*line_of(command, "1"), "--json"]) == 2
    out, err = capsys.readouterr()
    report = report_of(out, command)
    assert report["code"] == "cannot run" and report["data"] == {} and report["vehicles"] == []
    assert err == f"tui-gcs: {report['text']}\n"


LINES = {
    "vehicle list": "vehicle list",
    "vehicle tasks": "vehicle tasks",
    "vehicle cancel": "vehicle cancel 7",
    "vehicle traffic": "vehicle traffic ID",
    "hold": "hold ID",
    "return": "return ID",
    "land": "land ID",
    "task add": "task add --xy 1,2",
    "task cancel": "task cancel --all",
    "link add": "link add udpin:127.0.0.1:14551",
    "link rate": "link rate udpin:127.0.0.1:14551 none",
    "link close": "link close udpin:127.0.0.1:14551",
    "forward add": "forward add udpout:127.0.0.1:14560",
    "forward close": "forward close udpout:127.0.0.1:14560",
    "planner check": "planner check nowhere.py",
    "vehicle params get": "vehicle params get ID RTL_ALT",
    "vehicle params set": "vehicle params set ID RTL_ALT 1 --yes",
    "vehicle params save": "vehicle params save ID a.param --yes",
    "vehicle params load": "vehicle params load ID a.param --yes",
    "vehicle params diff": "vehicle params diff ID a.param",
    "vehicle plan show": "vehicle plan show ID --kind fence",
    "vehicle plan clear": "vehicle plan clear ID --kind fence --yes",
    "vehicle plan upload": "vehicle plan upload ID a.plan --yes",
    "vehicle plan download": "vehicle plan download ID a.plan --yes",
    "vehicle plan current": "vehicle plan current ID 2 --yes",
    "vehicle shell": "vehicle shell ID ver",
    "vehicle motor-test": "vehicle motor-test ID 1 --yes",
    "vehicle reboot": "vehicle reboot ID --yes",
    "vehicle roi": "vehicle roi ID none",
    "vehicle files ls": "vehicle files ID ls /",
    "vehicle files get": "vehicle files ID get /a",
    "vehicle files put": "vehicle files ID put a /a --yes",
    "vehicle files rm": "vehicle files ID rm /a --yes",
    "vehicle logs ls": "vehicle logs ID ls",
    "vehicle logs get": "vehicle logs ID get 1",
    "vehicle logs erase": "vehicle logs ID erase --yes",
    "run": "run nowhere.toml",
    "rehearse": "rehearse nowhere.toml",
    "check": "check nowhere.toml",
    "export": "export nowhere.tlog",
    "plot": "plot nowhere.tlog",
    "convert": "convert nowhere.plan there.wpl",
    "scenario new": "scenario new nowhere/a.toml",
    "planner new": "planner new a --dir nowhere",
    "keys add": "keys add no/name",
    "keys import": "keys import a --as hex",
    "keys assign": "keys assign a --vehicle 1",
    "keys unassign": "keys unassign --vehicle 1",
    "keys remove": "keys remove a",
    "keys provision": "keys provision 1 a",
    "replay": "replay nowhere.toml",
}
"""What is typed, where it is other than the command, and ID for `vehicle …`."""


def line_of(command: str, vehicles: str) -> list[str]:
    """The words of a command for these vehicles."""
    line = LINES.get(command, f"{command} ID" if command.startswith("vehicle") else command)
    return [vehicles if word == "ID" else word for word in line.split()]


def test_a_line_that_cannot_be_understood_is_reported_in_json_too(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["vehicle", "show", "--json", "--loud", "3"])
    assert end.value.code == 2
    out, err = capsys.readouterr()
    assert report_of(out)["text"] == "unrecognized arguments: --loud"
    assert err.endswith("tui-gcs: error: unrecognized arguments: --loud\n")


@pytest.mark.parametrize(
    "words",
    [
        ["demo", "--headless", "--json", "r.json"],
        ["rehearse", "--json", "r.json"],
        ["rehearse", "mine.toml", "--seed", "2", "--json", "r.json"],
        ["-q", "run", "mine.toml", "--json", "r.json", "--yes"],
        ["demo", "--json=r.json"],
        ["vehicle", "list", "--json=r.json"],
    ],
)
def test_a_file_after_json_as_it_was_before_names_the_new_options(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main(words)
    assert end.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "tui-gcs: --json is a flag: to write the result to a file, give --json --output r.json"


def test_a_scenario_may_follow_the_flag(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rehearse", "--json", "nowhere.toml"]) == 2
    assert "nowhere.toml" in report_of(capsys.readouterr().out, "rehearse")["text"]


def test_an_interrupt_is_reported_in_json_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(file: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tui_gcs.core.judging.tlog_summary.summarize", interrupted)
    assert main(["replay", TLOG, "--json"]) == 130
    report = report_of(capsys.readouterr().out, "replay")
    assert (report["code"], report["text"]) == ("cancelled", "interrupted")
