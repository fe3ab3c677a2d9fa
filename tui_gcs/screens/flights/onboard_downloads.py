"""Logs that vehicles hold: listed, downloaded several at once, cancelled; one outcome for each."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.services import CancelTask, DownloadLog, ListLogs, LogRow, TaskInfo
from tui_gcs.feed.requests import ConsoleRequests
from tui_gcs.feed.task_requests import TaskOutcome, carry_out


@dataclass
class OnboardLog:
    """One log on a vehicle, and how its download stands."""

    vehicle: int
    row: LogRow
    marked: bool = False
    task: TaskInfo | None = None
    """The download that is under way."""
    outcome: TaskOutcome | None = None
    """The end of the last download."""

    @property
    def key(self) -> tuple[int, int]:
        """The vehicle and the number of the log."""
        return self.vehicle, self.row.id


@dataclass
class OnboardDownloads:
    """Asks by `requests`; `on_news` is called whenever there is something new to show."""

    requests: ConsoleRequests
    clock: Clock
    on_news: Callable[[], None]
    logs: dict[tuple[int, int], OnboardLog] = field(default_factory=dict)
    """The logs in the lists of vehicles, by vehicle and number."""
    asking: set[int] = field(default_factory=set)
    """Vehicles that are asked for their list."""

    def rows(self) -> list[OnboardLog]:
        """Return all logs by vehicle, the newest first."""
        return sorted(self.logs.values(), key=lambda log: (log.vehicle, -log.row.id))

    def newest(self) -> list[OnboardLog]:
        """Return the newest log of each vehicle."""
        found: dict[int, OnboardLog] = {}
        for log in self.rows():
            found.setdefault(log.vehicle, log)
        return list(found.values())

    async def list_logs(self, vehicles: Sequence[int]) -> tuple[TaskOutcome, ...]:
        """Ask vehicles for their lists; return one outcome for each."""
        self.asking |= set(vehicles)
        self.on_news()
        try:
            ended = await carry_out(self.requests, self.clock, ListLogs(tuple(vehicles)))
        finally:
            self.asking -= set(vehicles)
        for one in ended:
            if one.ok and one.result is not None:
                self._take(one.vehicle, one.result.logs)
        self.on_news()
        return ended

    async def download(self, logs: Iterable[OnboardLog]) -> tuple[TaskOutcome, ...]:
        """Download these at once; the station reads one after the other from each vehicle."""
        wanted = [log for log in logs if log.task is None]
        ended = await asyncio.gather(*(self._download(log) for log in wanted))
        return tuple(ended)

    async def end(self, log: OnboardLog) -> str:
        """Cancel the download of a log; return the station's answer."""
        if log.task is None:
            return "it is not being downloaded"
        return (await self.requests.send(CancelTask(log.task.number))).text

    async def _download(self, log: OnboardLog) -> TaskOutcome:
        log.marked, log.outcome = False, None

        def progress(tasks: tuple[TaskInfo, ...]) -> None:
            log.task = tasks[0] if tasks else None
            self.on_news()

        try:
            (log.outcome,) = await carry_out(
                self.requests, self.clock, DownloadLog((log.vehicle,), log.row.id), progress
            )
        finally:
            log.task = None
        self.on_news()
        return log.outcome

    def _take(self, vehicle: int, rows: Iterable[LogRow]) -> None:
        """Replace what is known of a vehicle; logs that it still has keep their outcome."""
        before = {key: log for key, log in self.logs.items() if key[0] == vehicle}
        for key in before:
            del self.logs[key]
        for row in rows:
            log = before.get((vehicle, row.id), OnboardLog(vehicle, row))
            log.row = row
            self.logs[log.key] = log
