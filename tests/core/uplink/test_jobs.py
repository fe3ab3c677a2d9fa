"""Whose turn it is: one long exchange per vehicle, two per link, nothing lost silently."""

from pathlib import Path

import pytest

from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.uplink.jobs import Job, JobState


class Count(Job):
    """A job that takes a second."""

    def __init__(self, vehicle: int, name: str = "count") -> None:
        super().__init__(vehicle, name)
        self.ended: list[JobState] = []
        self.aborted = False
        self.on_done = lambda job: self.ended.append(job.state)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        if now - self.begun_s >= 1.0:
            self.finish()

    def abort(self) -> None:
        self.aborted = True


@pytest.fixture
def rig(tmp_path: Path) -> ServiceRig:
    return ServiceRig(tmp_path, *[Peer(i) for i in range(1, 5)]).heard()


def test_two_per_link_one_per_vehicle_in_order(rig: ServiceRig) -> None:
    jobs = [Count(v) for v in (1, 1, 2, 3)]
    for job in jobs:
        rig.station.comms.jobs.submit(job)
    assert [job.state for job in jobs] == ["running", "queued", "running", "queued"]
    rig.until(lambda: all(job.over for job in jobs), 5.0)
    assert [job.ended for job in jobs] == [[JobState.DONE]] * 4
    assert not rig.station.comms.jobs.busy


def test_a_short_one_does_not_wait_for_long_ones_of_others_and_who_waits_is_told_for_what(rig: ServiceRig) -> None:
    class Log(Count):
        takes_long = True

    logs = [Log(vehicle, "download log 1") for vehicle in (1, 2, 3)]
    for log in logs:
        rig.station.comms.jobs.submit(log)
    plan, behind = Count(4, "mission upload"), Count(1, "fence upload")
    rig.station.comms.jobs.submit(plan)
    rig.station.comms.jobs.submit(behind)
    assert [job.state for job in (*logs, plan, behind)] == ["running", "running", "queued", "running", "queued"]
    logs[0].done, logs[0].total = 34, 100
    assert rig.station.comms.jobs.waits_for(behind) == "vehicle 1: download log 1 (34 %)"
    assert rig.station.comms.jobs.waits_for(logs[2]) == "vehicle 1: download log 1 (34 %), vehicle 2: download log 1"
    assert rig.station.comms.jobs.waits_for(plan) == ""


def test_first_goes_before_those_that_wait(rig: ServiceRig) -> None:
    for vehicle in (1, 2, 3):
        rig.station.comms.jobs.submit(Count(vehicle))
    looked_at = Count(4)
    rig.station.comms.jobs.submit(looked_at, first=True)
    rig.run(1.1)
    assert looked_at.state is JobState.RUNNING
    assert rig.station.comms.jobs.jobs(3)[0].state is JobState.RUNNING


def test_what_is_over_cannot_be_cancelled_any_more(rig: ServiceRig) -> None:
    job = Count(1)
    rig.station.comms.jobs.submit(job)
    job.finish()  # the last answer came; the queue looks at its next tick
    assert rig.station.comms.jobs.cancel(1) == 0
    rig.run(0.1)
    assert job.ended == [JobState.DONE]


def test_cancelling_tells_the_running_one_and_drops_the_others(rig: ServiceRig) -> None:
    running, waiting = Count(1), Count(1)
    rig.station.comms.jobs.submit(running)
    rig.station.comms.jobs.submit(waiting)
    assert rig.station.comms.jobs.cancel(1) == 2
    assert running.aborted and not waiting.aborted
    assert running.ended == waiting.ended == [JobState.CANCELLED]


def test_a_lost_vehicle_gives_its_turn_away(rig: ServiceRig) -> None:
    class Endless(Count):
        def tick(self, vehicle: Vehicle, now: float) -> None:
            pass

    stuck, unknown = Endless(1), Count(77)
    rig.station.comms.jobs.submit(stuck)
    rig.station.comms.jobs.submit(unknown)
    assert unknown.state is JobState.FAILED and unknown.error == "unknown vehicle"
    rig.peers[1].silent = True
    rig.until(lambda: stuck.over, 6.0)
    assert stuck.error == "the vehicle is LOST"
    assert any("count: failed (the vehicle is LOST)" in text for text in rig.texts("vehicle 1"))
