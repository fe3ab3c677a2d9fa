"""`tui-gcs plot` without a terminal: panes as text, values as JSON, and refusals in one line."""

import json
from pathlib import Path

import pytest

from tests.core.records.test_flight_series import START_S
from tests.screens.plots.test_flight_plots import recorded
from tui_gcs.cli.files.plot import moment_s
from tui_gcs.cli.main import main


def test_a_value_is_printed_as_a_plot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(recorded(tmp_path)), "--show", "v1 attitude.roll deg"]) == 0
    out = capsys.readouterr().out
    assert "ATTITUDE.roll  deg" in out and "NOW    MIN    MAX" in out


def test_values_are_printed_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(recorded(tmp_path)), "--show", "wpnav_speed", "--json"]) == 0
    curves = json.loads(capsys.readouterr().out)["data"]["curves"]
    assert [(curve["vehicle"], curve["name"], curve["value"]) for curve in curves] == [(1, "WPNAV_SPEED", [500.0])]


def test_all_values_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(recorded(tmp_path)), "--list"]) == 0
    assert any(line.split()[:3] == ["ATTITUDE.roll", "deg", "1"] for line in capsys.readouterr().out.splitlines())


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--show", "nothing of the kind"], "no such value"),
        (["--show", "v9 attitude.roll"], "no such value"),
        ([], "nothing to plot"),
        (["--at", "noon"], "--at noon: no time: 95, 1:35 or 12:41:07Z"),
    ],
)
def test_what_cannot_be_plotted_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], why: str
) -> None:
    assert main(["plot", str(recorded(tmp_path)), *words]) == 2
    assert why in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "at_s"),
    [
        ("20", 20.0),
        ("1:30", 60.0),  # the log ends before
        ("14:13:55.5Z", 35.5),
        ("14:13:18Z", 0.0),  # the station's journal begins before the log
    ],
)
def test_the_cursor_begins_at_a_time_since_the_beginning_or_of_the_day(text: str, at_s: float) -> None:
    assert moment_s(text, START_S, START_S + 60.0) - START_S == pytest.approx(at_s)


def test_what_is_no_flight_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("")
    assert main(["plot", str(path), "--list"]) == 2
    assert "no flight: .tlog, .bin, .ulg" in capsys.readouterr().err
