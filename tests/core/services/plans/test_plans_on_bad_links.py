"""Bad links: 100 items at 20 % loss each way are on board in a minute; at worse never "success" with wrong content.

One seed each; three more are in `make endurance`, and were thousands when this was written.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.plan_peers import ArduPilotPeer, PlanPeer, Px4Peer, circle, fence, mission, square
from tests.core.rigs.service_rig import ServiceRig
from tui_gcs.core.firmware.plan_dialects import dialect_of
from tui_gcs.core.missions.plan_compare import compare
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.core.services.plans.plan_jobs import DownloadJob, PlanJob
from tui_gcs.core.services.plans.plan_messages import item_of
from tui_gcs.core.uplink.jobs import JobState

AUTOPILOTS = [ArduPilotPeer, Px4Peer]
SEEDS = [
    pytest.param(0, marks=pytest.mark.long),
    *(pytest.param(seed, marks=pytest.mark.endurance) for seed in (1, 2, 3)),
]


def on_board(rig: ServiceRig, peer: PlanPeer, kind: PlanKind) -> Plan:
    return dialect_of(rig.vehicle()).from_wire(kind, tuple(item_of(f) for f in peer.stores[kind]))


def through(
    tmp_path: Path, peer: PlanPeer, begin: Callable[[ServiceRig], PlanJob], limit_s: float, **link: float
) -> tuple[ServiceRig, PlanJob]:
    """`begin` a job over a bad link; the vehicle itself is always heard, or it would just be LOST."""
    rig = ServiceRig(tmp_path, peer, seed=int(link.pop("seed"))).heard()
    for name, value in link.items():
        setattr(rig, name, value)
    job = begin(rig)
    rig.until(lambda: job.over, limit_s, f"{job.name} at {job.done} of {job.total}")
    return rig, job


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_hundred_items_at_20_percent_loss_within_a_minute(
    tmp_path: Path, autopilot: type[PlanPeer], seed: int
) -> None:
    plan = mission(100, first=seed)
    peer = autopilot(1)
    rig, job = through(
        tmp_path, peer, lambda rig: rig.station.services.missions.upload(1, plan), 60.0, loss=0.2, seed=seed
    )
    assert (job.state, job.error) == (JobState.DONE, "")
    assert compare(plan, on_board(rig, peer, PlanKind.MISSION), dialect_of(rig.vehicle())).same


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize(
    "link",
    [
        {"loss": 0.35},
        {"loss": 0.1, "duplicate": 0.3, "reorder": 0.3},
        {"loss": 0.2, "delay_s": 0.3, "reorder": 0.2, "duplicate": 0.1},
        {"delay_s": 1.0, "loss": 0.05},
    ],
    ids=["35 % loss", "copies and swaps", "slow and lossy", "satellite"],
)
def test_success_means_that_it_is_on_board(
    tmp_path: Path, autopilot: type[PlanPeer], link: dict[str, float], seed: int
) -> None:
    """Whatever the link does to the dialogue; and after a failure it is known what is on board, or known that not."""
    plan = mission(25, first=seed)
    peer = autopilot(1)
    rig, job = through(
        tmp_path, peer, lambda rig: rig.station.services.missions.upload(1, plan), 300.0, seed=seed, **link
    )
    held = rig.station.services.missions.state(1).held[PlanKind.MISSION]
    dialect = dialect_of(rig.vehicle())
    if job.state is JobState.DONE:
        assert compare(plan, on_board(rig, peer, PlanKind.MISSION), dialect).same
    assert job.state is JobState.DONE or job.error
    if held.known and held.plan is not None:
        assert compare(held.plan, on_board(rig, peer, PlanKind.MISSION), dialect).same


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_fence_over_the_mission_and_both_down_again(tmp_path: Path, autopilot: type[PlanPeer], seed: int) -> None:
    plan = fence(*square(), circle(12.0), *square(20_000, 5002, lat=473_990_000))
    peer = autopilot(1)
    rig, up = through(
        tmp_path, peer, lambda rig: rig.station.services.missions.upload(1, plan), 60.0, loss=0.25, seed=seed
    )
    assert up.state is JobState.DONE
    down = rig.station.services.missions.download(1, PlanKind.FENCE)
    rig.until(lambda: down.over, 60.0)
    assert isinstance(down, DownloadJob) and down.plan is not None
    assert compare(plan, down.plan, dialect_of(rig.vehicle())).same


@pytest.mark.long
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_link_that_dies_midway_ends_it_and_leaves_no_belief(tmp_path: Path, autopilot: type[PlanPeer]) -> None:
    rig = ServiceRig(tmp_path, peer := autopilot(1)).heard()
    missions = rig.station.services.missions
    first = missions.upload(1, mission(5))
    rig.until(lambda: first.over, 20.0)
    job = missions.upload(1, mission(80, first=9))
    rig.run(0.3)
    rig.loss = 1.0
    rig.until(lambda: job.over, 10.0)
    assert job.error == "the vehicle is LOST"
    assert missions.holds(1, mission(5)) is None and missions.holds(1, mission(80, first=9)) is None
    rig.loss = 0.0
    rig.run(10.0)
    again = missions.upload(1, mission(80, first=9))
    rig.until(lambda: again.over, 30.0)
    assert again.state is JobState.DONE
    assert compare(mission(80, first=9), on_board(rig, peer, PlanKind.MISSION), dialect_of(rig.vehicle())).same
