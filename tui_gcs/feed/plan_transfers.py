"""Plans on their way to vehicles and from them, several vehicles at once.

A vehicle gets its fence first, then rally points, then the mission, each only when the one before was read back and is
held. A kind that is not planned is left as it is on board.
"""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.missions.draft import VehicleDraft
from tui_gcs.core.plans.model import PlanKind, PlanWord
from tui_gcs.core.protocol.common import ReplyCode, Request
from tui_gcs.core.protocol.services import (
    CancelTask,
    DownloadPlan,
    GetTaskResult,
    GetTasks,
    ServiceReply,
    TaskInfo,
    UploadPlan,
)
from tui_gcs.core.requests.plan_rows import plan_of, plan_rows
from tui_gcs.feed.requests import ConsoleRequests
from tui_gcs.feed.task_requests import LOOK_S, SILENT_S, is_same_task
from tui_gcs.feed.transfer_pace import TransferPace, all_words, steps_of

# The fence is held before there is a mission to fly (docs/threats.md D.4).
ORDER = (PlanKind.FENCE, PlanKind.RALLY, PlanKind.MISSION)
NOBODY_KNOWS = "its result is not known"
_WORDS: dict[PlanKind, PlanWord] = {
    PlanKind.MISSION: "mission",
    PlanKind.FENCE: "fence",
    PlanKind.RALLY: "rally",
}


@dataclass
class PlanTransfer:
    """The plans of one vehicle on their way: how they stand, or what came of them."""

    vehicle: int
    to_vehicle: bool
    state: str = "waits"
    over: bool = False
    good: bool = False
    task: int = 0
    """Number of the station's task while it runs, else 0."""
    plans: VehicleDraft = field(default_factory=VehicleDraft)
    """What is sent, or what was read."""
    text: str = ""
    """What the station answered at the end."""
    is_unknown: bool = False
    """Whether the station may have carried it out although nothing was heard of it."""
    part: TransferPace = field(default_factory=TransferPace)
    """Pace of the plan that is on its way now."""
    steps_over: int = 0
    """Steps of the plans before it."""

    @property
    def steps(self) -> tuple[float, int]:
        """Number of steps done and of all; a transfer that is over counts only those that were done."""
        total = steps_of(len(self.plans.items(kind)) for kind in ORDER)
        done = self.steps_over + self.part.done
        return (done, done) if self.over else (min(done, total), total)


class PlanTransfers:
    """All transfers, one for each vehicle."""

    def __init__(self, requests: ConsoleRequests, clock: Clock, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called whenever a transfer stands differently."""
        self._requests = requests
        self._clock = clock
        self._on_news = on_news
        self.by_vehicle: dict[int, PlanTransfer] = {}
        self._together: list[PlanTransfer] = []
        """Transfers begun since nothing was on its way."""
        self._begun_s = 0.0

    @property
    def running(self) -> list[PlanTransfer]:
        """Transfers that are not over."""
        return [each for each in self.by_vehicle.values() if not each.over]

    @property
    def failed(self) -> list[PlanTransfer]:
        """Transfers that failed and can be tried again."""
        return [each for each in self.by_vehicle.values() if each.over and not each.good]

    def states(self) -> dict[int, str]:
        """How the running transfers stand, by vehicle."""
        return {each.vehicle: each.state for each in self.running}

    def overall(self) -> str:
        """How far all that is being sent is, and how long it still takes; "" while nothing is sent."""
        sent = [each for each in self._together if each.to_vehicle]
        if all(each.over for each in sent):
            return ""
        steps = [each.steps for each in sent]
        return all_words(sum(d for d, _ in steps), sum(t for _, t in steps), self._clock.now() - self._begun_s)

    async def send(self, plans: dict[int, VehicleDraft]) -> list[PlanTransfer]:
        """Send each vehicle its plans; return when all transfers are over."""
        begun = [self._begin(vehicle, to_vehicle=True, plans=plan) for vehicle, plan in plans.items()]
        await asyncio.gather(*(self._send(each) for each in begun))
        return begun

    async def fetch(self, vehicles: Sequence[int]) -> list[PlanTransfer]:
        """Read the plans that vehicles hold; return when all transfers are over."""
        begun = [self._begin(vehicle, to_vehicle=False, plans=VehicleDraft()) for vehicle in vehicles]
        await asyncio.gather(*(self._fetch(each) for each in begun))
        return begun

    async def cancel(self) -> None:
        """Cancel all transfers that are not over, here and at the station."""
        for each in self.running:
            each.over, each.text = True, "cancelled"
            if each.task:
                await self._requests.send(CancelTask(each.task))
        self._on_news()

    def _begin(self, vehicle: int, *, to_vehicle: bool, plans: VehicleDraft) -> PlanTransfer:
        if not self.running:
            self._together, self._begun_s = [], self._clock.now()
        transfer = PlanTransfer(vehicle, to_vehicle, plans=plans)
        self._together.append(transfer)
        self.by_vehicle[vehicle] = transfer
        self._on_news()
        return transfer

    async def _send(self, transfer: PlanTransfer) -> None:
        done: list[str] = []
        for kind in ORDER:
            plan = transfer.plans.plan(kind)
            if not plan.items or transfer.over:
                continue
            request = UploadPlan((transfer.vehicle,), _WORDS[kind], plan_rows(plan))
            info = await self._carry_out(transfer, request, f"{kind.word} to it")
            if info is None or info.state != "done":
                left = [k.word for k in ORDER[ORDER.index(kind) + 1 :] if transfer.plans.items(k)]
                also = f"; {' and '.join(left)} not sent" if left else ""
                held = f" ({' and '.join(done)} held)" if done else ""
                self._end(
                    transfer, False, f"{kind.word} {_outcome(transfer, info)}{held}: {_why(transfer, info)}{also}"
                )
                return
            done.append(kind.word + (f" ({info.text})" if info.text else ""))
            transfer.steps_over += steps_of([len(plan.items)])
            transfer.part = TransferPace()
        self._end(transfer, True, f"{', '.join(done)} on board, read back" if done else "nothing planned, nothing sent")

    async def _fetch(self, transfer: PlanTransfer) -> None:
        for kind in ORDER:
            if transfer.over:
                return
            request = DownloadPlan((transfer.vehicle,), _WORDS[kind])
            info = await self._carry_out(transfer, request, f"{kind.word} from it")
            if info is None or info.state != "done":
                self._end(transfer, False, f"{kind.word} not read: {_why(transfer, info)}")
                return
            reply = await self._requests.send(GetTaskResult(info.number))
            rows = reply.result.plan if isinstance(reply, ServiceReply) and reply.result is not None else None
            if rows is None:
                self._end(transfer, False, f"{kind.word} not read: {reply.text or 'the station has forgotten it'}")
                return
            transfer.plans = transfer.plans.with_items(kind, plan_of(kind, rows).items)
        plans = transfer.plans
        words = f"{len(plans.mission)} items, fence {len(plans.fence)}, rally {len(plans.rally)}"
        self._end(transfer, True, f"it holds {words}")

    async def _carry_out(self, transfer: PlanTransfer, request: Request, what: str) -> TaskInfo | None:
        """Send a request and follow its task to the end; None if it was refused or is unknown: `transfer` has why."""
        transfer.state, transfer.text, transfer.is_unknown, transfer.part = what, "", False, TransferPace()
        self._on_news()
        reply = await self._requests.send(request)
        info = reply.tasks[0] if reply.tasks else None
        if info is None:
            transfer.text = next((result.text for result in reply.results if result.text), reply.text)
            transfer.is_unknown = reply.code is ReplyCode.NO_ANSWER
            return None
        transfer.task = info.number
        answered_s = self._clock.now()
        transfer.part.look(info, answered_s)
        while not info.over and not transfer.over:
            await asyncio.sleep(LOOK_S)
            reply = await self._requests.send(GetTasks((info.number,)))
            now = self._clock.now()
            if reply.ok:
                found = next((each for each in reply.tasks if is_same_task(each, info)), None)
                if found is None:
                    # Numbers begin anew with the station: another task may have this one.
                    transfer.text, transfer.is_unknown = f"{NOBODY_KNOWS}: the station was started anew", True
                    return None
                info, answered_s = found, now
                transfer.part.look(info, now)
                transfer.state = f"{what} {transfer.part.words(info)}".rstrip()
                self._on_news()
            elif now - answered_s > SILENT_S:
                transfer.text, transfer.is_unknown = NOBODY_KNOWS, True
                return None
        transfer.task = 0
        return info

    def _end(self, transfer: PlanTransfer, good: bool, text: str) -> None:
        if not transfer.over:
            transfer.over, transfer.good, transfer.text = True, good, text
        self._on_news()


def _outcome(transfer: PlanTransfer, info: TaskInfo | None) -> str:
    """Whether the plan is on board: a station that did not answer may have begun all the same."""
    unknown = info is None and transfer.is_unknown
    return "perhaps on board (= compares)" if unknown else "NOT on board"


def _why(transfer: PlanTransfer, info: TaskInfo | None) -> str:
    return (info.text or info.state) if info is not None else (transfer.text or "no reason given")
