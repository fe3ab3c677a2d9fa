"""`tui-gcs convert`: what is written, what is told, how it ends."""

import json
from pathlib import Path

import pytest

from tui_gcs.cli import main

SCENARIO = str(Path(__file__).parents[1] / "tui_gcs/scenarios/swarm-challenge.toml")
WPL = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977000\t8.5456000\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\t0\t47.3977000\t8.5456000\t15\t1\n2\t0\t3\t16\t0\t0\t0\t0\t47.3978000\t8.5457000\t20\t1\n"
    "3\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1\n"
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.waypoints").write_text(WPL)
    return tmp_path


def test_a_mission_for_qgroundcontrol_and_back(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "a.waypoints", "b.plan"]) == 0
    assert "its first line is home" in capsys.readouterr().out
    made = json.loads((folder / "b.plan").read_text())["mission"]
    assert made["plannedHomePosition"] == [47.3977, 8.5456, 488.0] and len(made["items"]) == 3
    assert main(["convert", "b.plan", "c.waypoints"]) == 0
    assert (folder / "c.waypoints").read_text() == WPL


def test_what_is_left_out_is_told_and_the_exit_code_says_so(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "a.waypoints", "b.kml"]) == 1
    assert "left out: 1 item without a place (1 x return)" in capsys.readouterr().out
    assert (folder / "b.kml").read_text().count("<Placemark>") == 4


def test_nothing_is_overwritten_without_force(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "b.plan").write_text("mine")
    assert main(["convert", "a.waypoints", "b.plan"]) == 2
    assert "--force overwrites it" in capsys.readouterr().err and (folder / "b.plan").read_text() == "mine"
    assert main(["convert", "a.waypoints", "b.plan", "--force"]) == 0
    assert json.loads((folder / "b.plan").read_text())["fileType"] == "Plan"
    (folder / "link.plan").symlink_to(folder / "b.plan")
    assert main(["convert", "a.waypoints", "link.plan", "--force"]) == 2
    assert "not a plain file" in capsys.readouterr().err


def test_a_disk_that_refuses_leaves_nothing_behind(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "a.waypoints", "gone/b.plan"]) == 2
    assert "gone/b.plan: cannot be written (No such file or directory)" in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["a.waypoints"]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["a.waypoints", "b"], "an ending that says the format"),
        (["a.waypoints", "b.param"], "parameters and plans do not become each other"),
        (["a.waypoints", "b.toml"], "zones come from KML"),
        (["a.waypoints", "b.fen"], "there is no fence in it"),
        (["a.waypoints", "b.plan", "--base", "gone.toml"], "gone.toml"),
        (["gone.plan", "b.kml"], "No such file"),
        ([SCENARIO, "b.kml", "--round", "9"], "no such round; there are: round 1"),
        (["a.waypoints", "b.plan", "--round", "1"], "there is no scenario that has rounds"),
        ([SCENARIO, "b.param"], "a scenario does not become parameters"),
        (["a.waypoints", "b.plan", "--height", "nan"], "no height"),
    ],
)
def test_what_cannot_be_is_one_line(
    words: list[str], why: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", *words]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1
    assert [path.name for path in folder.iterdir()] == ["a.waypoints"]


def test_zones_out_to_a_map_program_and_back(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", SCENARIO, "zones.kmz"]) == 1, "teams and planners are not in a drawing"
    assert main(["convert", "zones.kmz", "new.toml", "--base", SCENARIO]) == 1, "nor are take-off places taken from it"
    assert (folder / "new.toml").read_text() == Path(SCENARIO).read_text()
    assert main(["convert", SCENARIO, "fence.plan", "--round", "round 2"]) == 1
    assert "round 2: its operating area" in capsys.readouterr().out


def test_a_path_from_a_map_program_needs_a_height(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = "<LineString><coordinates>8.5,47.3 8.6,47.3</coordinates></LineString>"
    (folder / "way.kml").write_text(f"<kml><Placemark><name>way</name>{line}</Placemark></kml>")
    assert main(["convert", "way.kml", "way.plan"]) == 2
    assert "--height M gives metres above home" in capsys.readouterr().err
    assert main(["convert", "way.kml", "way.plan", "--height", "40"]) == 0
    items = json.loads((folder / "way.plan").read_text())["mission"]["items"]
    assert [item["params"][4:] for item in items] == [[47.3, 8.5, 40.0], [47.3, 8.6, 40.0]]


def test_one_part_of_a_plan_for_a_format_that_holds_one(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["convert", SCENARIO, "fence.plan"])
    plan = json.loads((folder / "fence.plan").read_text())
    main(["convert", "a.waypoints", "m.plan"])
    plan["mission"] = json.loads((folder / "m.plan").read_text())["mission"]
    (folder / "both.plan").write_text(json.dumps(plan))
    capsys.readouterr()
    assert main(["convert", "both.plan", "m.waypoints"]) == 1
    assert "left out: fence of 4 items (--kind fence writes it)" in capsys.readouterr().out
    assert main(["convert", "both.plan", "f.txt", "--kind", "fence"]) == 1
    assert "5001" in (folder / "f.txt").read_text()
