"""`tui-gcs export`: tracks of recorded flights as CSV, KML and GPX."""

import csv
import io
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from tests.core.records.onboard_log_files import copter_log, px4_log
from tui_gcs.cli.main import main

TLOG = Path(__file__).parents[2] / "data/arducopter-8.tlog"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("vehicle.bin").write_bytes(copter_log())
    Path("vehicle.ulg").write_bytes(px4_log())


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_a_row_for_each_position_of_each_vehicle(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(TLOG), "--vehicles", "2,5"]) == 0
    table = rows(capsys.readouterr().out)
    assert {row["vehicle"] for row in table} == {"2", "5"}
    assert float(table[0]["time_s"]) == 0.0 and table[0]["time_utc"].endswith("Z")
    times = [float(row["time_s"]) for row in table]
    assert times == sorted(times)


def test_logs_of_station_and_vehicles_are_joined_by_time(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "vehicle.ulg", "vehicle.bin"]) == 0
    table = rows(capsys.readouterr().out)
    assert [row["source"] for row in table] == ["vehicle.bin", "vehicle.bin", "vehicle.ulg", "vehicle.ulg"]
    assert [row["mode"] for row in table] == ["LOITER", "LOITER", "HOLD", "HOLD"]
    assert [row["armed"] for row in table] == ["1"] * 4


@pytest.mark.parametrize("kind", ["kml", "gpx"])
def test_map_files_hold_a_track_for_each_vehicle(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    target = Path(f"tracks.{kind}")
    assert main(["export", str(TLOG), "--vehicles", "1-3", "--file", str(target)]) == 0
    assert f"tracks.{kind} written: " in capsys.readouterr().out
    root = ET.fromstring(target.read_bytes())
    names = [name.text for name in root.iter() if name.tag.endswith("}name")][1:]
    assert sorted(str(name) for name in names) == [f"vehicle {v}, arducopter-8.tlog" for v in (1, 2, 3)]
    places = [each for each in root.iter() if each.tag.endswith(("}coord", "}trkpt"))]
    times = [each for each in root.iter() if each.tag.endswith(("}when", "}time"))]
    assert len(places) == len(times) > 100


def test_a_file_that_is_there_is_kept(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.csv").write_text("mine")
    assert main(["export", "vehicle.bin", "--file", "a.csv"]) == 2
    assert "--force overwrites it" in capsys.readouterr().err and Path("a.csv").read_text() == "mine"
    assert main(["export", "vehicle.bin", "--file", "a.csv", "--force"]) == 0
    assert len(rows(Path("a.csv").read_text())) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["field.plan"], "field.plan: no flight: .tlog, .bin, .ulg"),
        (["none.tlog"], "none.tlog: cannot be read: No such file or directory"),
        (["broken.bin"], "broken.bin: not a log of ArduPilot"),
        (["vehicle.bin", "--file", "out.doc"], "out.doc: csv, kml or gpx? --to FORMAT"),
        (["vehicle.bin", "--vehicles", "x"], "vehicles are named as 3, 3-7 or 1,4"),
    ],
)
def test_what_cannot_be_exported_is_one_line(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("broken.bin").write_bytes(b"")
    assert main(["export", *words]) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1


def test_a_log_without_the_vehicle_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "vehicle.bin", "--vehicles", "99"]) == 1
    assert "vehicle.bin: no positions in it" in capsys.readouterr().err
