"""The planners that come with tui-gcs pass the checks that their users' must pass."""

import pytest

from tui_gcs.planner.check.subject import checked_planner
from tui_gcs.planner.check.suite import CHECKS, findings

# Each takes 20 to 40 s of a core, most of it for the tours of many tasks.
PATROL = [
    pytest.param("same again", marks=pytest.mark.long),
    pytest.param("restart", marks=pytest.mark.long),
    pytest.param("vehicle order", marks=pytest.mark.endurance),
    pytest.param("loss and join", marks=pytest.mark.endurance),
]


def test_waypoints_go_on_where_they_were_and_are_flown_by_number() -> None:
    subject = checked_planner("waypoints", 1, True, lambda: None)
    found = [f for name in ("declares", "restart", "vehicle order") for f in findings(CHECKS[name], name, subject)]
    assert {f.check: f.verdict for f in found} == {"declares": "ok", "restart": "ok", "vehicle order": "note"}


@pytest.mark.parametrize("name", PATROL)
def test_patrol(name: str, request: pytest.FixtureRequest) -> None:
    if name == "restart":  # that the same tour is designed again is what "same again" shows
        request.getfixturevalue("designed_once")
    subject = checked_planner("patrol", 1, True, lambda: None)
    found = list(findings(CHECKS[name], name, subject))
    assert found
    assert [f for f in found if f.verdict == "FAIL"] == []


@pytest.mark.long
@pytest.mark.parametrize("name", ["search", "survey"])
def test_planners_of_single_missions(name: str) -> None:
    subject = checked_planner(name, 1, True, lambda: None)
    found = [f for check in CHECKS for f in findings(CHECKS[check], check, subject)]
    assert [f for f in found if f.verdict == "FAIL"] == []
