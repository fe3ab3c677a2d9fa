"""The planners that come with tui-gcs pass the checks that their users' must pass."""

import pytest

from tui_gcs.planner.check.subject import checked_planner
from tui_gcs.planner.check.suite import CHECKS, findings

PATROL = ("same again", "restart", "vehicle order", "loss and join")


def test_waypoints_go_on_where_they_were_and_are_flown_by_number() -> None:
    subject = checked_planner("waypoints", 1, True, lambda: None)
    found = [f for name in ("declares", "restart", "vehicle order") for f in findings(CHECKS[name], name, subject)]
    assert {f.check: f.verdict for f in found} == {"declares": "ok", "restart": "ok", "vehicle order": "note"}


@pytest.mark.long
@pytest.mark.parametrize("name", PATROL)
def test_patrol(name: str) -> None:
    subject = checked_planner("patrol", 1, True, lambda: None)
    found = list(findings(CHECKS[name], name, subject))
    assert found
    assert [f for f in found if f.verdict == "FAIL"] == []
