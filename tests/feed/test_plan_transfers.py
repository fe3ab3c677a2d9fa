"""Plans on their way to vehicles, seen from a console: in order, told truthfully, over a feed made of paper."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import msgspec
import pytest

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.missions import fences
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.plans.model import LAND, PlanItem
from tui_gcs.core.protocol.common import ReplyCode, Request, VehicleResult
from tui_gcs.core.protocol.services import GetTasks, ServiceReply, TaskInfo, UploadPlan
from tui_gcs.feed import task_requests
from tui_gcs.feed.plan_transfers import PlanTransfer, PlanTransfers
from tui_gcs.feed.requests import NO_ANSWER, ConsoleRequests
from tui_gcs.feed.transfer_pace import TransferPace

PLANS = VehicleDraft((PlanItem(LAND),), fences.circle((52.0, 0.0), 100.0), (fences.rally_point((52.0, 0.0), 20.0),))
RUNNING = TaskInfo(1, 3, "upload", "me", "running", 0, 0, "", 0.0)


@dataclass
class PaperStation:
    """Answers each request by `answer`."""

    answer: Callable[[Request], ServiceReply]
    asked: list[Request] = field(default_factory=list)

    async def send(self, request: Request, **_: Any) -> ServiceReply:
        self.asked.append(request)
        return self.answer(request)


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task_requests, "LOOK_S", 0.0)


def sent(answer: Callable[[Request], ServiceReply]) -> tuple[PlanTransfer, list[str]]:
    """What came of sending `PLANS` to vehicle 3, and the kinds that were asked for."""
    station = PaperStation(answer)
    transfers = PlanTransfers(cast(ConsoleRequests, station), VirtualClock(), lambda: None)
    (came,) = asyncio.run(transfers.send({3: PLANS}))
    return came, [request.kind for request in station.asked if isinstance(request, UploadPlan)]


def told(state: str, text: str = "") -> ServiceReply:
    return ServiceReply(ok=True, tasks=(msgspec.structs.replace(RUNNING, state=state, text=text),))


def test_fence_rally_points_mission_each_after_the_other_is_held() -> None:
    came, kinds = sent(lambda request: told("done" if isinstance(request, GetTasks) else "running"))
    assert (came.good, kinds) == (True, ["fence", "rally", "mission"])
    assert came.text == "fence, rally, mission on board, read back"


def test_what_fails_ends_it_and_says_what_was_not_sent() -> None:
    came, kinds = sent(
        lambda request: told("failed", "no answer") if isinstance(request, GetTasks) else told("running")
    )
    assert (came.good, kinds) == (False, ["fence"])
    assert came.text == "fence NOT on board: no answer; rally and mission not sent"


def test_a_refusal_is_told_with_its_reason() -> None:
    refused = ServiceReply(
        ok=False, text="nothing was sent", results=(VehicleResult(3, False, "it flies its mission"),)
    )
    came, _ = sent(lambda _request: refused)
    assert came.text.startswith("fence NOT on board: it flies its mission;")


def test_a_station_that_does_not_answer_may_have_begun() -> None:
    came, _ = sent(lambda _request: ServiceReply(ok=False, text=NO_ANSWER, code=ReplyCode.NO_ANSWER))
    assert came.text.startswith("fence perhaps on board (= compares):")


@pytest.mark.parametrize(
    "tasks",
    [(), (msgspec.structs.replace(RUNNING, vehicle=4, state="done"),), (msgspec.structs.replace(RUNNING, what="x"),)],
)
def test_a_station_that_was_started_anew_knows_nothing_of_it_and_another_task_has_its_number(
    tasks: tuple[TaskInfo, ...],
) -> None:
    came, kinds = sent(
        lambda request: ServiceReply(ok=True, tasks=tasks) if isinstance(request, GetTasks) else told("running")
    )
    assert (came.good, kinds) == (False, ["fence"])
    assert came.text.startswith("fence perhaps on board (= compares): its result is not known: the station was")


def test_what_is_being_read_back_is_not_over_and_the_time_in_a_queue_is_no_pace() -> None:
    part = TransferPace()
    waiting = msgspec.structs.replace(RUNNING, state="queued", text="vehicle 1: mission upload")
    part.look(waiting, 0.0)
    assert part.words(waiting) == "waits for vehicle 1"
    sending = msgspec.structs.replace(RUNNING, total=80)
    for now_s, done in ((30.0, 0), (34.0, 20), (38.0, 40)):  # all 40 are there after 8 s, however long it waited before
        sending = msgspec.structs.replace(sending, done=done)
        part.look(sending, now_s)
    assert part.words(sending) == "50 %, 0:09 left"
    part.look(back := msgspec.structs.replace(sending, done=80), 46.0)
    assert part.words(back) == "100 %, 0:01 left", "0 s is over"


def test_before_it_moves_no_time_is_told() -> None:
    part = TransferPace()
    assert part.words(RUNNING) == ""
    part.look(first := msgspec.structs.replace(RUNNING, done=1, total=80), 10.0)
    assert part.words(first) == "1 %"


def test_all_together_counts_what_waits_too() -> None:
    transfers = PlanTransfers(
        cast(ConsoleRequests, PaperStation(lambda _request: told("running"))), clock := VirtualClock(), lambda: None
    )
    assert transfers.overall() == ""
    for vehicle in (1, 2):
        transfers._begin(vehicle, to_vehicle=True, plans=PLANS)
    clock.advance(6.0)
    transfers.by_vehicle[1].part.done = 2  # of 24 steps: two vehicles, three plans of an item each
    assert transfers.overall() == "8 %, about 1:06 left"
    transfers._end(transfers.by_vehicle[1], False, "refused")
    assert transfers.overall() == "14 %, about 0:36 left", "what failed is not waited for"
    transfers._end(transfers.by_vehicle[2], True, "on board")
    assert transfers.overall() == ""
