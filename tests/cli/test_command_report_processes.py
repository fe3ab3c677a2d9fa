"""What commands print with `--json` about vehicles of a real station: one, many, none, and some that failed."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.test_command_report import line_of, with_json
from tests.cli.test_keys import Typist
from tests.rigs.own_station import Watcher, station_in, until
from tests.rigs.reports import report_of
from tui_gcs.cli.main import main
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.client.launcher import LaunchOptions, launch
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.scenario.load import load

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
ASKS_A_STATION = ("hold", "return", "land", "status", "preflight", "task", "vehicle")
WPL = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t{lat}\t{lon}\t0\t1\n1\t0\t3\t16\t0\t0\t0\t0\t{lat}\t{lon}\t20\t1\n"

pytestmark = [pytest.mark.process, pytest.mark.xdist_group("operator")]
OFTEN = ("1-2", "1,9")
"""Several vehicles, and one beside one that is not there: of a command for vehicles, `make flights` asks these."""


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watcher]:
    """A SIM station with an ArduCopter, 1, and a PX4, 2; there is no vehicle 9."""
    vehicles = spec_of(load(SCENARIO), autopilots="mixed")
    vehicles["vehicles"] = vehicles["vehicles"][:2]
    with station_in(
        tmp_path_factory.mktemp("r"),
        lambda: launch(RunKind.SIM, str(SCENARIO), SCENARIO.read_text(), [], LaunchOptions(vehicles)),
    ) as watcher:
        until(lambda: watcher.status is not None and watcher.status.heard == 2, 60, "2 vehicles heard")
        yield watcher


CASES = [
    pytest.param(
        command,
        who,
        marks=pytest.mark.long if who in OFTEN or "1-2" not in line_of(command, "1-2") else pytest.mark.endurance,
    )
    for who in ("1", "1-2", "9", "1,9")  # first: what a vehicle still does from a command would hold its next one up
    for command in sorted(with_json())
    if command.startswith(ASKS_A_STATION) and (who == "1" or who in line_of(command, who))
]


@pytest.mark.parametrize(("command", "who"), CASES)
def test_one_document_says_what_the_exit_code_says(
    fleet: Watcher,
    command: str,
    who: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = line_of(command, who)
    monkeypatch.setattr(sys, "stdin", Typist("", terminal=False))
    monkeypatch.chdir(tmp_path)
    Path("a").write_bytes(b"x")
    Path("a.param").write_text("RTL_ALT,1500\n")
    Path("a.plan").write_text(WPL.format(lat=52.072, lon=-0.628))
    code = main([*words, "--json"])
    report = report_of(capsys.readouterr().out, command)
    assert code in ((0,) if report["ok"] else (1, 2))
    if who in words and "9" in who and report["vehicles"]:
        assert not report["ok"] and not report["vehicles"][-1]["ok"] and report["vehicles"][-1]["vehicle"] == 9
