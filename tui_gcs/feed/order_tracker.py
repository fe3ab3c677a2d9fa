"""Orders that were sent to the station, followed until every vehicle has its result."""

import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.common import Freshness, Reply, ReplyCode, VehicleRow
from tui_gcs.core.protocol.services import GetTasks, ServiceReply, TaskInfo
from tui_gcs.feed.feed import Feed

SEEN_S = 15.0
"""Telemetry may take this long to show what was begun; then its absence is reported."""
MAX_FOLLOWED = 8
"""Orders that are followed at once; older ones are forgotten."""
TASK_S = 90.0
"""A task may take this long; then its vehicle counts as unanswered."""
Seen = Callable[[VehicleRow], bool]


class OrderState(Enum):
    """How an order stands for one vehicle; the value is the word that the operator reads."""

    WAITING = "waiting"
    BEGUN = "begun"
    DONE = "done"
    REFUSED = "REFUSED"
    FAILED = "FAILED"
    NO_ANSWER = "NO ANSWER"
    NOT_SEEN = "NOT SEEN"
    LEFT_OUT = "left out"


SUCCEEDED = frozenset({OrderState.DONE, OrderState.BEGUN})


@dataclass
class VehicleProgress:
    """How an order stands for one vehicle, and the reason or detail of that."""

    vehicle: int
    state: OrderState = OrderState.WAITING
    text: str = ""


@dataclass
class SentOrder:
    """One order, and how it stands for each vehicle."""

    title: str
    results: list[VehicleProgress] = field(default_factory=list)
    tasks: dict[int, VehicleProgress] = field(default_factory=dict)
    """Progress of vehicles whose task still runs at the station, by the task's number."""
    seen: Seen | None = None
    """Whether telemetry shows that it came about; None: the station's answer decides."""
    begins: bool = False
    """Whether success only means that vehicles do it now, not that they have arrived."""
    asked_s: float = math.inf
    text: str = ""
    """What the station answered for all of them."""
    answered: bool = False
    refused: bool = False
    """Whether the station refused it as a whole, without naming vehicles."""
    reported: str = ""
    """The notice that the operator was shown last."""

    @property
    def waiting(self) -> bool:
        """Whether something is still to come."""
        return any(result.state is OrderState.WAITING for result in self.results)

    @property
    def is_over(self) -> bool:
        """Whether nothing more is to come."""
        return self.answered and not self.waiting

    @property
    def good(self) -> bool:
        """Whether it succeeded for every vehicle."""
        return not self.refused and all(result.state in SUCCEEDED for result in self.results)


class OrderTracker:
    """Follows orders that were sent: the newest and those before it that are not over or have failed."""

    def __init__(self, feed: Feed, clock: Clock, on_news: Callable[[SentOrder], None]) -> None:
        """`on_news` is called with an order whenever it may stand differently."""
        self._feed = feed
        self._clock = clock
        self._on_news = on_news
        self.orders: list[SentOrder] = []
        """Orders that are followed, the newest last."""

    @property
    def newest(self) -> SentOrder | None:
        """The last order; None before the first."""
        return self.orders[-1] if self.orders else None

    def forget_over(self) -> None:
        """Forget orders that are over; the newest stays."""
        last = self.newest
        self.orders = [order for order in self.orders if order is last or not order.is_over]

    def _replace_by(self, order: SentOrder) -> None:
        """Stop waiting, in older orders, for vehicles that do something else now: telemetry will never show it."""
        vehicles = {result.vehicle for result in order.results if result.state is not OrderState.REFUSED}
        for older in self.orders[: self.orders.index(order)] if order in self.orders else ():
            by_task = {id(result) for result in older.tasks.values()}
            older.results = [
                result
                for result in older.results
                if result.state is not OrderState.WAITING or id(result) in by_task or result.vehicle not in vehicles
            ]

    async def follow(
        self,
        reply: Awaitable[ServiceReply],
        title: str,
        vehicles: Sequence[int] = (),
        left_out: Mapping[int, str] | None = None,
        *,
        seen: Seen | None = None,
        begins: bool = False,
    ) -> None:
        """Follow an order for `vehicles` whose reply is to come; without any, the station answers for which.

        `left_out` has the vehicles that the console leaves out, and why. `seen` and `begins` are as in `SentOrder`.
        """
        order = SentOrder(
            title, [VehicleProgress(v, OrderState.WAITING, "sent") for v in vehicles], seen=seen, begins=begins
        )
        order.asked_s = self._clock.now()
        self.orders = [*(one for one in self.orders if not one.is_over), order][-MAX_FOLLOWED:]
        self._on_news(order)
        self._take(order, await reply)
        self._replace_by(order)
        order.results += [VehicleProgress(v, OrderState.LEFT_OUT, why) for v, why in (left_out or {}).items()]
        self._on_news(order)

    def look(self) -> None:
        """Compare every order with telemetry, and give up on vehicles when their time is up."""
        for order in self.orders:
            if order.answered and order.waiting:
                self._look(order)

    def _look(self, order: SentOrder) -> None:
        rows = {row.id: row for row in self._feed.frame.rows()} if self._feed.frame is not None else {}
        by_task = {id(result) for result in order.tasks.values()}
        for result in order.results:
            if result.state is not OrderState.WAITING or id(result) in by_task:
                continue
            row = rows.get(result.vehicle)
            # The row of a lost vehicle is old: it shows nothing of this order.
            heard = row is not None and row.freshness is not Freshness.LOST
            if row is not None and heard and order.seen is not None and order.seen(row):
                # Disarmed, it is down: nothing more is to come of a return or a landing.
                result.state = OrderState.BEGUN if order.begins and row.armed else OrderState.DONE
            elif self._clock.now() - order.asked_s > SEEN_S:
                result.state, result.text = OrderState.NOT_SEEN, "asked, but telemetry does not show it"
        self._on_news(order)

    async def ask_tasks(self) -> None:
        """Ask the station how its tasks stand."""
        followed = [order for order in self.orders if order.tasks]
        if not followed:
            return
        numbers = tuple(number for order in followed for number in order.tasks)
        reply = await self._feed.requests.send(GetTasks(numbers))
        answered = isinstance(reply, ServiceReply) and reply.ok
        infos = reply.tasks if isinstance(reply, ServiceReply) and reply.ok else ()
        for order in followed:
            for info in infos:
                _follow(order, info)
            if answered:
                _lose(order, [number for number in numbers if all(info.number != number for info in infos)])
            if self._clock.now() - order.asked_s > TASK_S:
                for result in order.tasks.values():
                    result.state, result.text = OrderState.NO_ANSWER, "its result is not known"
                order.tasks.clear()
            self._on_news(order)

    def _take(self, order: SentOrder, reply: Reply) -> None:
        order.text, order.answered = reply.text, True
        unnamed = {result.vehicle for result in order.results} - {answer.vehicle for answer in reply.results}
        known = {result.vehicle: result for result in order.results}
        for answer in reply.results:
            result = known.setdefault(answer.vehicle, VehicleProgress(answer.vehicle))
            if not answer.ok:
                # The station leaves vehicles out of an order that it carries out for the others.
                result.state = OrderState.LEFT_OUT if reply.ok else OrderState.REFUSED
                result.text = answer.text or "no reason given"
            else:
                result.state = OrderState.WAITING if order.seen is not None else OrderState.BEGUN
                result.text = answer.text
        order.results = [known[v] for v in sorted(known)]
        silent = reply.code is ReplyCode.NO_ANSWER
        good = OrderState.BEGUN if order.begins else OrderState.DONE
        for result in order.results:
            if result.vehicle in unnamed:
                result.state = OrderState.NO_ANSWER if silent else good if reply.ok else OrderState.REFUSED
                result.text = reply.text
        order.refused = not reply.ok and not order.results
        tasks = reply.tasks if isinstance(reply, ServiceReply) else ()
        for info in tasks:
            if info.vehicle in known:
                known[info.vehicle].state = OrderState.WAITING
                order.tasks[info.number] = known[info.vehicle]
                _follow(order, info)


def _lose(order: SentOrder, numbers: Sequence[int]) -> None:
    """Give up on tasks: a station that was started anew knows nothing of those from before."""
    for number in numbers:
        if (result := order.tasks.pop(number, None)) is not None:
            result.state, result.text = (
                OrderState.NO_ANSWER,
                "the station was started anew: its result is not known",
            )


def _follow(order: SentOrder, info: TaskInfo) -> None:
    result = order.tasks.get(info.number)
    if result is None:
        return
    if result.vehicle != info.vehicle:
        # Numbers begin anew with the station: this is another task.
        _lose(order, [info.number])
        return
    result.text = info.text or info.state
    if info.over:
        del order.tasks[info.number]
        good = OrderState.BEGUN if order.begins else OrderState.DONE
        result.state = good if info.state == "done" else OrderState.FAILED
