"""Who came into a defended zone, and who was met before."""

import msgspec
import pytest

from tests.core.judging.test_referee import status
from tests.core.rigs.rig import scenario
from tui_gcs.core.judging.incursions import Incursions, IntruderResult
from tui_gcs.core.protocol.common import RunPhase, StationStatus

WEST, EDGE, IN, FAR = (20.0, 200.0), (60.0, 200.0), (80.0, 200.0), (-100.0, 200.0)
"""The zone is a circle of 80 m about (150, 200)."""


def flown(run: RunPhase = RunPhase.RUNNING) -> StationStatus:
    return msgspec.structs.replace(status(2), run=run)


@pytest.fixture
def judge() -> Incursions:
    made = Incursions(scenario(2))
    made.on_status(flown())
    return made


def test_one_is_met_one_comes_in_and_one_is_still_on_its_way(judge: Incursions) -> None:
    for places, met in (
        ((WEST, WEST, FAR), (False, False, False)),
        ((EDGE, EDGE, WEST), (False, False, False)),
        ((EDGE, IN, EDGE), (True, False, False)),
    ):
        judge.see(places, (True, True, True), met)
    assert judge.results() == [IntruderResult("round 1", "home", came=2, met=1, under_way=1, nearest_m=0.0)]


def test_the_nearest_of_those_that_were_met_is_told(judge: Incursions) -> None:
    judge.see([EDGE], [True], [False])
    judge.see([WEST], [True], [True])
    judge.see([IN], [True], [True])
    (found,) = judge.results()
    assert (found.came, found.met) == (1, 1)
    assert found.nearest_m == pytest.approx(10.0, abs=0.1), "what it does after it was met does not count"


def test_who_comes_while_nothing_is_flown_does_not_count(judge: Incursions) -> None:
    judge.on_status(flown(RunPhase.HOLD))
    judge.see([IN], [True], [False])
    judge.see([WEST], [True], [True])
    assert judge.results() == []


def test_who_has_not_begun_is_not_there(judge: Incursions) -> None:
    judge.see([WEST], [False], [False])
    assert judge.results() == []
