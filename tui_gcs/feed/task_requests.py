"""Requests that become tasks of the station: sent once, followed together until each vehicle's task is over."""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.base import VehicleRequest
from tui_gcs.core.protocol.common import ReplyCode
from tui_gcs.core.protocol.services import GetTaskResult, GetTasks, TaskInfo, TaskResult
from tui_gcs.feed.requests import ConsoleRequests

LOOK_S = 0.3
"""Time between two questions how tasks stand."""
SILENT_S = 90.0
"""Tasks without news for this long are given up here; the station may still go on with them."""
NOT_KNOWN = "its result is not known"
"""The station may have carried it out, although no answer was heard."""


@dataclass(frozen=True)
class TaskOutcome:
    """The end of a request for one vehicle."""

    vehicle: int
    ok: bool
    text: str
    """Why it was refused or failed; a remark where it was done."""
    code: ReplyCode = ReplyCode.NONE
    """NO_ANSWER: nothing was heard of it any more, and it may have been done."""
    result: TaskResult | None = None


def by_reason(outcomes: Iterable[TaskOutcome]) -> dict[str, tuple[int, ...]]:
    """Return the vehicles for which a request failed, by why: eight that refuse for the same reason are one line."""
    found: dict[str, tuple[int, ...]] = {}
    for each in outcomes:
        if not each.ok:
            found[each.text] = (*found.get(each.text, ()), each.vehicle)
    return found


async def carry_out(
    requests: ConsoleRequests,
    clock: Clock,
    request: VehicleRequest,
    on_progress: Callable[[tuple[TaskInfo, ...]], None] = lambda tasks: None,
) -> tuple[TaskOutcome, ...]:
    """Send `request` and return one outcome per vehicle, in the order of `request.vehicles`, when all are over.

    `on_progress` gets the tasks that are under way, every time the station was asked. A station that was started anew
    or stays silent ends the wait: the text of the outcome is then `NOT_KNOWN`.
    """
    reply = await requests.send(request)
    ended: dict[int, TaskOutcome] = {}
    for refused in (each for each in reply.results if not each.ok):
        ended[refused.vehicle] = TaskOutcome(refused.vehicle, False, refused.text, refused.code)
    running = {task.number: task for task in reply.tasks}
    for vehicle in request.vehicles:
        if vehicle not in ended and not any(task.vehicle == vehicle for task in reply.tasks):
            ended[vehicle] = TaskOutcome(vehicle, False, reply.text or "no reason given", reply.code)
    answered_s = clock.now()
    while running:
        on_progress(tuple(running.values()))
        await asyncio.sleep(LOOK_S)
        asked = await requests.send(GetTasks(tuple(running)))
        if not asked.ok:
            if clock.now() - answered_s > SILENT_S:
                ended |= {task.vehicle: _unknown(task, NOT_KNOWN) for task in running.values()}
                break
            continue
        answered_s = clock.now()
        found = {task.number: task for task in asked.tasks}
        for number, task in list(running.items()):
            now = found.get(number)
            if now is None or not is_same_task(now, task):
                # Numbers begin anew with the station: another task may have this one.
                ended[task.vehicle] = _unknown(task, f"{NOT_KNOWN}: the station was started anew")
                del running[number]
            elif now.over:
                ended[task.vehicle] = await _outcome(requests, now)
                del running[number]
            else:
                running[number] = now
    return tuple(ended[vehicle] for vehicle in request.vehicles)


def _unknown(task: TaskInfo, text: str) -> TaskOutcome:
    return TaskOutcome(task.vehicle, False, text, ReplyCode.NO_ANSWER)


async def _outcome(requests: ConsoleRequests, task: TaskInfo) -> TaskOutcome:
    result = (await requests.send(GetTaskResult(task.number))).result
    ok = task.state == "done"
    return TaskOutcome(task.vehicle, ok, task.text or ("" if ok else task.state), result=result)


def is_same_task(task: TaskInfo, other: TaskInfo) -> bool:
    """Return whether two answers are about one task: a station that was started anew counts from 1 again."""
    return (task.number, task.vehicle, task.what, task.who) == (other.number, other.vehicle, other.what, other.who)
