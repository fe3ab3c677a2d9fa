"""`tui-gcs convert`: what is written, what is told, how it ends."""

import json
from pathlib import Path

import pytest
import shapely

from tui_gcs.cli.main import main
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.missions import fences
from tui_gcs.core.missions.draft import MissionDraft, VehicleDraft
from tui_gcs.core.missions.draft_file import SavedDraft, to_bytes

SCENARIO = str(Path(__file__).parents[3] / "tui_gcs/scenarios/swarm-challenge.toml")
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
        (["a.waypoints", "b"], "an ending that names the format"),
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


# ---------------------------------------------------------------- missions of many vehicles


@pytest.fixture
def missions(folder: Path) -> Path:
    """Two vehicles, the second with a fence only."""
    ours = read_file(WPL.encode()).mission
    assert ours is not None
    fence = fences.circle((47.3977, 8.5456), 100.0, inside=False)
    draft = MissionDraft({2: VehicleDraft(ours.items), 11: VehicleDraft(fence=fence)})
    (folder / "missions.json").write_bytes(to_bytes(SavedDraft(draft)))
    (folder / "a.waypoints").unlink()
    return folder


def test_missions_of_many_vehicles_become_a_file_for_each(missions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "missions.json", "field.plan"]) == 0
    out = capsys.readouterr().out
    assert "vehicle 2: field-2.plan written" in out and "vehicle 11: field-11.plan written" in out
    first, second = (json.loads((missions / f"field-{vehicle}.plan").read_text()) for vehicle in (2, 11))
    assert len(first["mission"]["items"]) == 3 and not second["mission"]["items"]
    assert second["geoFence"]["circles"][0]["circle"]["radius"] == 100.0
    assert main(["convert", "missions.json", "field.plan"]) == 2, "all or none, and none over another"
    assert "field-2.plan: is there already" in capsys.readouterr().err


def test_one_vehicle_of_many(missions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "missions.json", "two.waypoints", "--vehicle", "2"]) == 0
    assert (missions / "two.waypoints").read_text().splitlines()[2:] == WPL.splitlines()[2:]
    assert main(["convert", "missions.json", "b.plan", "--vehicle", "3"]) == 2
    assert "--vehicle 3: nothing is planned for it in missions.json; there are: 2 11" in capsys.readouterr().err
    assert main(["convert", "two.waypoints", "b.plan", "--vehicle", "2"]) == 2
    assert "only the missions screen's own file holds several" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("target", "why"),
    [
        ("b.fen", "vehicle 2: there is no fence in it; nothing is written"),
        ("b.param", "missions do not become parameters"),
        ("b.toml", "missions do not become a scenario"),
    ],
)
def test_what_missions_cannot_become(target: str, why: str, missions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "missions.json", target]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1
    assert [path.name for path in missions.iterdir()] == ["missions.json"]


def test_missions_that_cannot_be_read(missions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (missions / "missions.json").write_text('{"missions":1,"vehicles":{"2":')
    assert main(["convert", "missions.json", "b.plan"]) == 2
    assert "missions.json: no missions of this program" in capsys.readouterr().err
    (missions / "missions.json").write_bytes(to_bytes(SavedDraft(MissionDraft())))
    assert main(["convert", "missions.json", "b.plan"]) == 2
    assert "nothing is planned in it" in capsys.readouterr().err


def test_a_circle_to_keep_out_of_is_drawn_about_it(missions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With corners on its rim another program would let vehicles in by 0.1 m."""
    assert main(["convert", "missions.json", "out.geojson", "--vehicle", "11"]) == 0
    (area,) = read_file((missions / "out.geojson").read_bytes()).drawings
    frame = LocalFrame(Origin(47.3977, 8.5456, 0.0))
    border = shapely.LinearRing([frame.to_enu(lat, lon) for lat, lon, _ in area.places])
    assert 100.0 <= border.distance(shapely.Point(0.0, 0.0)) + 1e-3 < 100.2
    assert main(["convert", "out.geojson", "back.plan"]) == 0
    assert json.loads((missions / "back.plan").read_text())["geoFence"]["circles"][0]["circle"]["radius"] == 100.0
