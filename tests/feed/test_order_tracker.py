"""What becomes of an order, over a feed made of paper."""

import asyncio
from collections.abc import Callable
from typing import Any, cast

import pytest

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.common import Request, VehicleResult
from tui_gcs.core.protocol.preflight import ReadChecks
from tui_gcs.core.protocol.services import GetTasks, ServiceReply, TaskInfo
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.order_tracker import OrderState, OrderTracker, SentOrder

RUNNING = TaskInfo(7, 3, "read", "me", "running", 0, 0, "", 0.0)


class PaperFeed:
    """Answers each request by `answer`."""

    frame = None

    def __init__(self, answer: Callable[[Request], ServiceReply]) -> None:
        self.answer = answer
        self.requests = self

    async def send(self, request: Request, **_: Any) -> ServiceReply:
        return self.answer(request)


def followed(tasks_later: tuple[TaskInfo, ...]) -> SentOrder:
    """An order to vehicle 3 whose task is number 7, after the station was asked once how its tasks stand."""

    def answer(request: Request) -> ServiceReply:
        if isinstance(request, GetTasks):
            return ServiceReply(ok=True, tasks=tasks_later)
        return ServiceReply(ok=True, results=(VehicleResult(3, True, ""),), tasks=(RUNNING,))

    async def follow() -> SentOrder:
        feed = PaperFeed(answer)
        orders = OrderTracker(cast(Feed, feed), VirtualClock(), lambda _order: None)
        await orders.follow(feed.send(ReadChecks()), "read", (3,))
        await orders.ask_tasks()
        assert orders.newest is not None
        return orders.newest

    return asyncio.run(follow())


def test_a_task_is_followed_to_its_end() -> None:
    assert followed((RUNNING,)).waiting
    done = followed((TaskInfo(7, 3, "read", "me", "done", 1, 1, "", 1.0),))
    assert [result.state for result in done.results] == [OrderState.DONE]


@pytest.mark.parametrize("later", [(), (TaskInfo(7, 4, "reboot", "me", "done", 1, 1, "", 1.0),)])
def test_a_task_of_another_station_is_not_taken_for_ours(later: tuple[TaskInfo, ...]) -> None:
    lost = followed(later)
    assert [(result.state, result.text[:29]) for result in lost.results] == [
        (OrderState.NO_ANSWER, "the station was started anew:")
    ]
