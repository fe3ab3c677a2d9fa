"""An operator flies the demo from start to landing with nothing but keys, by nothing but what the screen shows.

Real processes at 1x, on the smallest terminal and on a usual one; about three minutes each.
"""

import subprocess
import sys
from collections.abc import Iterator

import pytest

from tests.rigs.pty_operator import Operator, end_programs

pytestmark = [pytest.mark.process, pytest.mark.xdist_group("operator")]
SIZES = (
    pytest.param((80, 24, "R2/3"), marks=pytest.mark.long, id="80x24"),
    pytest.param((120, 40, "Round 2/3"), marks=pytest.mark.by_keys, id="120x40"),
)
"""Columns and lines, and how the second round is written there."""


@pytest.fixture(params=SIZES)
def flown(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Operator, str]]:
    for name in ("RUNTIME", "STATE"):
        monkeypatch.setenv(f"TUI_GCS_{name}_DIR", str(tmp_path_factory.mktemp(name[0])))
    columns, lines, second_round = request.param
    one = Operator(["demo"], columns, lines)
    yield one, second_round
    one.console.end()
    end_programs()


def test_eight_vehicles_one_mission_keys_only(flown: tuple[Operator, str]) -> None:
    operator, second_round = flown
    operator.sees("ready 8/8", 60.0)
    operator.sees("Space start")
    operator.press(" ", "Enter = start")
    operator.press("\r", "start 1-8: begun for all 8")
    operator.sees("all 4 on their slots over home", 120.0)

    operator.press("o", "y = switch")
    operator.press("y", second_round)

    operator.press(" ", "HOLD ALL: done for all 8", 30.0)
    operator.sees("Enter resume")
    operator.press("\r", "resume: begun for all 8")

    operator.press("7", "select 7_")
    operator.press("\r", "selected 7")
    operator.press("c", "l  land here")
    operator.press("l", "Enter = do it")
    operator.press("\r", "land here 7: begun")
    operator.sees("armed 7", 120.0)

    operator.press("!", "h HOLD   r return   l land here")
    operator.press("r", "RETURN ALL: begun for all 7")
    operator.sees("armed 0", 200.0)
    operator.sees("all landed and disarmed")
    operator.press("J", "land")  # what happened to whom is in the journal
    operator.leaves()

    stopped = subprocess.run(
        [sys.executable, "-m", "tui_gcs.cli.main", "stop"], capture_output=True, text=True, timeout=60
    )
    assert stopped.returncode == 0, stopped.stderr
