"""Planners in processes of their own beside a lock-step run: the same flight, and the error when one dies."""

import os
from hashlib import sha256
from pathlib import Path

import msgspec
import pytest

from tui_gcs.core.protocol.bus import PLAN, REQUEST
from tui_gcs.core.protocol.common import Reply, Start, SwitchRound, TeamPlan, decode, encode
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.rehearsal.lock_step import LockStep
from tui_gcs.rehearsal.rehearse import rehearse

SHIPPED = Path(__file__).parents[3] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
SEARCH = 60
"""Two seconds of search for a better tour, so that both are through with it soon after each round began."""
DIES = """
import os
from tui_gcs.planner.api import Output, Planner

class Dies(Planner):
    name = "dies"
    def step(self, ctx):
        if ctx.t_s > 2.0:
            os._exit(3)
        return Output()
"""


def two_teams(planner: str, **parameters: int) -> Scenario:
    """Of two and of one."""
    whole = load(SHIPPED)
    teams = tuple(
        msgspec.structs.replace(team, vehicles=vehicles, planner=planner, parameters=parameters)
        for team, vehicles in zip(whole.teams, ((1, 2), (3,)), strict=True)
    )
    return msgspec.structs.replace(whole, teams=teams, places=whole.places[:3])


def flown(folder: Path, *, beside: bool) -> tuple[list[tuple[str, TeamPlan]], bytes]:
    """The plans of 50 s with a take-off and a change of the round, and the recording."""
    folder.mkdir()
    asked = {100: Start(vehicles=(1, 2, 3)), 800: SwitchRound(index=1)}
    flight, plans = (
        LockStep(two_teams("patrol", search=SEARCH), "", folder, beside=beside),
        list[tuple[str, TeamPlan]](),
    )
    flight.bus.subscribe(PLAN.format(team="*"), lambda key, data: plans.append((key, decode(data, TeamPlan))))
    for tick in range(1000):
        flight.step()
        if tick in asked:
            assert decode(flight.bus.ask(REQUEST.format(principal="test"), encode(asked[tick])), Reply).ok
    flight.close()
    return [(key, msgspec.structs.replace(plan, step_ms=0.0)) for key, plan in plans], (
        folder / "run.tlog"
    ).read_bytes()


@pytest.mark.long
def test_planners_beside_give_the_same_plans_in_the_same_order_and_the_same_flight(tmp_path: Path) -> None:
    plans, recording = flown(tmp_path / "in", beside=False)
    assert len(plans) >= 2 * 5 * 49 and plans[-1][1].metrics["searched"] == 1.0, "both searched while they flew"
    assert len({plan.metrics["predicted_worst_s"] for _, plan in plans}) > 2, "and found something"
    beside_plans, beside_recording = flown(tmp_path / "beside", beside=True)
    for (key, plan), (beside_key, beside_plan) in zip(plans, beside_plans, strict=True):
        assert (key, encode(plan)) == (beside_key, encode(beside_plan)), "as bytes: NaN is NaN there"
    assert beside_recording == recording


def test_a_planner_that_takes_its_process_with_it_ends_the_run_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "dies.py"
    path.write_text(DIES)
    file = PlannerFile("dies", path, sha256(DIES.encode()).hexdigest())
    result, problem = rehearse(two_teams("dies"), "", tmp_path, lambda share, text: None, files={"dies": file})
    assert problem == "team 'defend': the planner's process ended in mid-flight (exit code 3)"
    assert not result.ok


def test_nothing_is_left_of_them_when_the_run_ends(tmp_path: Path) -> None:
    flight = LockStep(two_teams("waypoints"), "", tmp_path, beside=True)
    assert flight._subprocesses is not None
    pids = [host._process.pid for host in flight._subprocesses._by_team.values()]
    flight.step()
    for pid in pids:
        os.kill(pid, 0)  # it is there
    flight.close()
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
