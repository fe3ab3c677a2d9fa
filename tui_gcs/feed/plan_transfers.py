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
from tui_gcs.core.protocol.base import VehicleRequest
from tui_gcs.core.protocol.common import ReplyCode
from tui_gcs.core.protocol.services import (
    CancelTask,
    DownloadPlan,
    TaskInfo,
    UploadPlan,
)
from tui_gcs.core.requests.plan_rows import plan_of, plan_rows
from tui_gcs.feed.requests import ConsoleRequests
from tui_gcs.feed.task_requests import TaskOutcome, carry_out
from tui_gcs.feed.transfer_pace import TransferPace, all_words, steps_of

# The fence is held before there is a mission to fly (docs/threats.md D.4).
ORDER = (PlanKind.FENCE, PlanKind.RALLY, PlanKind.MISSION)
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
            outcome = await self._carry_out(transfer, request, f"{kind.word} to it")
            if not outcome.ok:
                left = [k.word for k in ORDER[ORDER.index(kind) + 1 :] if transfer.plans.items(k)]
                also = f"; {' and '.join(left)} not sent" if left else ""
                held = f" ({' and '.join(done)} held)" if done else ""
                self._end(transfer, False, f"{kind.word} {_whether_on_board(outcome)}{held}: {outcome.text}{also}")
                return
            done.append(kind.word + (f" ({outcome.text})" if outcome.text else ""))
            transfer.steps_over += steps_of([len(plan.items)])
            transfer.part = TransferPace()
        self._end(transfer, True, f"{', '.join(done)} on board, read back" if done else "nothing planned, nothing sent")

    async def _fetch(self, transfer: PlanTransfer) -> None:
        for kind in ORDER:
            if transfer.over:
                return
            request = DownloadPlan((transfer.vehicle,), _WORDS[kind])
            outcome = await self._carry_out(transfer, request, f"{kind.word} from it")
            rows = outcome.result.plan if outcome.result is not None else None
            if not outcome.ok or rows is None:
                why = outcome.text if not outcome.ok else "the station has forgotten it"
                self._end(transfer, False, f"{kind.word} not read: {why}")
                return
            transfer.plans = transfer.plans.with_items(kind, plan_of(kind, rows).items)
        plans = transfer.plans
        words = f"{len(plans.mission)} items, fence {len(plans.fence)}, rally {len(plans.rally)}"
        self._end(transfer, True, f"it holds {words}")

    async def _carry_out(self, transfer: PlanTransfer, request: VehicleRequest, what: str) -> TaskOutcome:
        """Send a request for the vehicle of `transfer` and follow its task to the end; `what` names it meanwhile."""

        def show(tasks: tuple[TaskInfo, ...]) -> None:
            for info in tasks:
                transfer.task = info.number
                transfer.part.look(info, self._clock.now())
                transfer.state = f"{what} {transfer.part.words(info)}".rstrip()
            self._on_news()

        transfer.state, transfer.part = what, TransferPace()
        self._on_news()
        (outcome,) = await carry_out(self._requests, self._clock, request, show)
        transfer.task = 0
        return outcome

    def _end(self, transfer: PlanTransfer, good: bool, text: str) -> None:
        if not transfer.over:
            transfer.over, transfer.good, transfer.text = True, good, text
        self._on_news()


def _whether_on_board(failed: TaskOutcome) -> str:
    """Whether the plan is on board: a station that did not answer may have begun all the same."""
    return "perhaps on board (= compares)" if failed.code is ReplyCode.NO_ANSWER else "NOT on board"
