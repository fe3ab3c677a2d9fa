"""Checks of planners that need vehicles: fence and separation on the rounds, and what happens when a planner fails."""

from pathlib import Path

import pytest

from tests.planner.rigs import bad_planners as bad
from tui_gcs.cli.planner.check_flights import shipped
from tui_gcs.planner.check.subject import checked_planner
from tui_gcs.planner.check.suite import CHECKS, FIRST, findings

pytestmark = pytest.mark.long


@pytest.mark.parametrize("source", ["DRIFTS_AWAY", "ALL_IN_ONE_PLACE"])
def test_what_leaves_the_area_or_comes_too_close_is_found_by_flying_it(source: str, tmp_path: Path) -> None:
    """The guard keeps them inside and apart; its vetoes are what the author sees. Without them all seems well."""
    path = tmp_path / "mine.py"
    path.write_text(getattr(bad, source))
    mine = checked_planner(str(path), 1, True, lambda: None)
    assert [f for name in FIRST for f in findings(CHECKS[name], name, mine) if f.verdict == "FAIL"] == []
    wrong = {f.value.partition(":")[0]: f for f in findings(shipped, "flight", mine) if f.verdict == "FAIL"}
    assert "guard vetoes" in wrong
    assert not {"outside operating area, m", "separation, x limit"} & wrong.keys()
    assert "a vetoed vehicle brakes and holds" in wrong["guard vetoes"].advice
