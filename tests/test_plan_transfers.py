"""Plans on their way to vehicles, seen from a console: in order, told truthfully, over a feed made of paper."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import msgspec
import pytest

from tui_gcs import plan_transfers
from tui_gcs.core.clock import VirtualClock
from tui_gcs.core.messages import Request, VehicleResult
from tui_gcs.core.messages_services import GetTasks, ServiceReply, TaskInfo, UploadPlan
from tui_gcs.core.missions import fences
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.plan import LAND, PlanItem
from tui_gcs.feed import NO_ANSWER, Feed
from tui_gcs.plan_transfers import Transfer, Transfers, progress

PLANS = VehicleDraft((PlanItem(LAND),), fences.circle((52.0, 0.0), 100.0), (fences.rally_point((52.0, 0.0), 20.0),))
RUNNING = TaskInfo(1, 3, "upload", "me", "running", 0, 0, "", 0.0)


@dataclass
class PaperFeed:
    """Answers each request by `answer`."""

    answer: Callable[[Request], ServiceReply]
    asked: list[Request] = field(default_factory=list)

    async def request(self, request: Request, **_: Any) -> ServiceReply:
        self.asked.append(request)
        return self.answer(request)


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_transfers, "LOOK_S", 0.0)


def sent(answer: Callable[[Request], ServiceReply]) -> tuple[Transfer, list[str]]:
    """What came of sending `PLANS` to vehicle 3, and the kinds that were asked for."""
    feed = PaperFeed(answer)
    transfers = Transfers(cast(Feed, feed), VirtualClock(), lambda: None)
    (came,) = asyncio.run(transfers.send({3: PLANS}))
    return came, [request.kind for request in feed.asked if isinstance(request, UploadPlan)]


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
    came, _ = sent(lambda _request: ServiceReply(ok=False, text=NO_ANSWER))
    assert came.text.startswith("fence perhaps on board (= compares):")


def test_how_far_it_is_and_how_long_it_takes() -> None:
    task = msgspec.structs.replace(RUNNING, done=30, total=120)
    assert progress(task, 10.0) == "30/120 30 s"
    assert progress(task, 0.5) == "30/120"
    assert progress(RUNNING, 10.0) == ""
    assert progress(msgspec.structs.replace(task, state="queued"), 10.0) == "waits"
