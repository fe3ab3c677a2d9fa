"""Checks of planners that need vehicles: fence and separation on the rounds, and what happens when a planner fails."""

from pathlib import Path

import pytest

from tests.core.rigs.rig import scenario, toml
from tests.planner.rigs import bad_planners as bad
from tui_gcs.cli.planner import check_flights
from tui_gcs.planner.check.subject import checked_planner
from tui_gcs.planner.check.suite import CHECKS, FIRST, findings

pytestmark = pytest.mark.long


@pytest.mark.parametrize("source", ["DRIFTS_AWAY", "ALL_IN_ONE_PLACE"])
def test_what_leaves_the_area_or_comes_too_close_is_found_by_flying_it(
    source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The guard keeps them inside and apart; its vetoes are what the author sees. Without them all seems well.

    Two of the eight vehicles are enough to be too close.
    """
    monkeypatch.setattr(check_flights, "read_scenario", lambda _: (scenario(2), toml(), ""))
    path = tmp_path / "mine.py"
    path.write_text(getattr(bad, source))
    mine = checked_planner(str(path), 1, True, lambda: None)
    assert [f for name in FIRST for f in findings(CHECKS[name], name, mine) if f.verdict == "FAIL"] == []
    wrong = {
        f.value.partition(":")[0]: f for f in findings(check_flights.shipped, "flight", mine) if f.verdict == "FAIL"
    }
    assert "guard vetoes" in wrong
    assert not {"outside operating area, m", "separation, x limit"} & wrong.keys()
    assert "a vetoed vehicle brakes and holds" in wrong["guard vetoes"].advice
