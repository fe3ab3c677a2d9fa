"""`tui-gcs scenario new`: a scenario to begin with, of which there is nothing to complain."""

import json
from pathlib import Path

import pytest

from tui_gcs.cli.main import main
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.load import load


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("vehicles", [1, 8, 13, 50, 68, 250])
def test_check_is_content_with_it_for_any_number_of_vehicles(vehicles: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenario", "new", "mine.toml", "--vehicles", str(vehicles)]) == 0
    assert "p shows the plan screen" in capsys.readouterr().out
    assert main(["check", "mine.toml", "--json"]) == 0
    assert {finding["level"] for finding in json.loads(capsys.readouterr().out)["data"]["findings"]} == {"note"}
    scenario = load("mine.toml")
    assert (scenario.name, scenario.vehicle_count) == ("mine", vehicles)
    assert [vehicle for team in scenario.teams for vehicle in team.vehicles] == list(range(1, vehicles + 1))


def test_the_origin_is_where_it_was_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenario", "new", "a.toml", "--origin", "47.1,8.5,430"]) == 0
    assert load("a.toml").origin == Origin(47.1, 8.5, 430.0) and "430 m above" in capsys.readouterr().out
    assert main(["scenario", "new", "b.toml", "--origin=-33.86,151.2"]) == 0
    assert load("b.toml").origin == Origin(-33.86, 151.2, 0.0)
    assert "0 m above mean sea level: set it" in capsys.readouterr().out
    assert main(["scenario", "new", "c.toml"]) == 0
    assert "where the demo does" in capsys.readouterr().out


def test_a_file_that_exists_is_left_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine.toml").write_text("precious")
    assert main(["scenario", "new", "mine.toml"]) == 2
    assert "exists already" in capsys.readouterr().err and Path("mine.toml").read_text() == "precious"


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("mine.plan",), "ends in .toml"),
        (("mine.toml", "--vehicles", "0"), "must be 1 to 250"),
        (("mine.toml", "--vehicles", "251"), "must be 1 to 250"),
        (("mine.toml", "--teams", "5"), "must be 1 to 4"),
        (("mine.toml", "--rounds", "4"), "must be 1 to 3"),
        (("mine.toml", "--origin", "95,8"), "origin.lat_deg"),
        (("mine.toml", "--origin", "nan,8"), "origin"),
        (("mine.toml", "--origin", "somewhere"), "must be LAT,LON"),
        (("mine.toml", "--origin", "1,2,3,4"), "must be LAT,LON"),
        (("none/mine.toml",), "cannot be written: No such file"),
    ],
)
def test_what_cannot_be_is_one_line_and_no_file(
    arguments: tuple[str, ...], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scenario", "new", *arguments]) == 2
    error = capsys.readouterr().err
    assert reason in error and error.count("\n") == 1
    assert not list(Path().iterdir())


def test_a_name_with_quotes_is_a_name() -> None:
    assert main(["scenario", "new", 'my "field" ü.toml']) == 0
    assert load('my "field" ü.toml').name == 'my "field" ü'
