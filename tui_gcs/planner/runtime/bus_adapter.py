"""Connects a planner host to a bus in the caller's own process, for lock-step runs and tests."""

from tui_gcs.core.protocol.bus import FLEET, PLAN, PREVIEW, PREVIEW_TASK, TASK, Bus, Closable
from tui_gcs.core.protocol.common import PlannerFrame, PlannerTask, PreviewResult, PreviewTask, decode, encode
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.planner_errors import last_line
from tui_gcs.planner.runtime.preview import preview


def attach(host: PlannerHost, bus: Bus) -> Closable:
    """Run `host` on the caller's stack: step it on fleet frames and publish its plans.

    Closing the result disconnects.
    """

    def on_task(_key: str, payload: bytes) -> None:
        host.set_task(decode(payload, PlannerTask))

    def on_fleet(_key: str, payload: bytes) -> None:
        frame = decode(payload, PlannerFrame)
        if host.due(frame.t_s):
            bus.publish(PLAN.format(team=host.team), host.answer(frame))

    def on_preview(_key: str, payload: bytes) -> None:
        ask = decode(payload, PreviewTask)
        if ask.task is not None:
            try:
                data = encode(preview(ask, host.files))
            except Exception as error:  # noqa: BLE001 - the edge to foreign code: what it put in may be anything
                text = f"nothing can be shown: {last_line(str(error))}"
                data = encode(PreviewResult(ask.task.team, ask.number, "failed", text=text))
            bus.publish(PREVIEW.format(team=host.team), data)

    return _Subscriptions(
        bus.subscribe(TASK.format(team=host.team), on_task),
        bus.subscribe(FLEET, on_fleet),
        bus.subscribe(PREVIEW_TASK.format(team=host.team), on_preview),
    )


class _Subscriptions:
    """Several subscriptions that are closed together."""

    def __init__(self, *parts: Closable) -> None:
        self._parts = parts

    def close(self) -> None:
        for part in self._parts:
            part.close()
