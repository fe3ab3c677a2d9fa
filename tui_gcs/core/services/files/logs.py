"""Lists, downloads and erases the logs of vehicles.

logs.list(1, on_done=lambda job: print(job.entries))
logs.download(1, entry)         # job.path, job.done of job.total
"""

from collections.abc import Callable

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.files.log_download import LogDownloadJob
from tui_gcs.core.services.files.log_transfer import LogChannel, LogEntry, LogLister
from tui_gcs.core.uplink.jobs import Job

ERASE_LOOK_S, ERASE_LONGEST_S = 3.0, 90.0
"""How often after erasing the list is read, and how long: a flash chip takes its time."""
# LOG_ERASE is never acknowledged (docs/autopilots.md): that the list is empty is the only proof.
ERASE_COPIES = 3

Done = Callable[[Job], None] | None


class LogService:
    """Submits log jobs, and passes them the messages about logs."""

    def __init__(self, context: ServiceContext) -> None:
        self.context = context
        self._channel = LogChannel(context)
        self.ignored = self._channel.ignored
        """Messages about logs that belonged to no request, counted by reason."""
        context.fleet.on_message("LOG_ENTRY", self._on_entry)
        context.fleet.on_message("LOG_DATA", self._on_data)

    def list(self, vehicle: int, on_done: Done = None) -> "LogListJob":
        """Submit a job that lists the logs: `job.entries`, the newest last."""
        return self.context.jobs.submit(LogListJob(self._channel, vehicle, on_done))

    def download(self, vehicle: int, entry: LogEntry, on_done: Done = None) -> LogDownloadJob:
        """Submit a job that downloads one log. What an interrupted download left of it is used."""
        return self.context.jobs.submit(LogDownloadJob(self._channel, vehicle, entry, on_done))

    def erase(self, vehicle: int, on_done: Done = None) -> "LogEraseJob":
        """Submit a job that erases all logs. It is done when the vehicle lists none, or only the one it is writing."""
        return self.context.jobs.submit(LogEraseJob(self._channel, vehicle, on_done))

    def _on_entry(self, vehicle: Vehicle, fields: Fields) -> None:
        job, now = self.context.jobs.running(vehicle.id), self.context.clock.now()
        if isinstance(job, LogListJob | LogEraseJob):
            job.on_entry(fields, now)
        elif isinstance(job, LogDownloadJob):
            job.on_entry(vehicle, fields, now)
        else:
            self.ignored["log entry not requested"] += 1

    def _on_data(self, vehicle: Vehicle, fields: Fields) -> None:
        job = self.context.jobs.running(vehicle.id)
        if isinstance(job, LogDownloadJob):
            job.on_data(vehicle, fields, self.context.clock.now())
        else:
            self.ignored["log data not requested"] += 1


class LogListJob(Job):
    """Lists the logs of a vehicle."""

    def __init__(self, channel: LogChannel, vehicle: int, on_done: Done) -> None:
        super().__init__(vehicle, "list logs", on_done)
        self._channel = channel
        self._lister: LogLister | None = None

    @property
    def entries(self) -> list[LogEntry]:
        """The logs, ordered by number."""
        return sorted(self._lister.entries.values(), key=lambda entry: entry.id) if self._lister is not None else []

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Request the list of logs."""
        self._lister = self._channel.lister(vehicle, now)

    def on_entry(self, fields: Fields, now: float) -> None:
        """Take a LOG_ENTRY of the vehicle."""
        if self._lister is not None:
            self._lister.on_entry(fields, now)
            self._look()

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered; end with a refusal of the vehicle."""
        refusal = self._channel.refusal(vehicle, self.begun_s)
        if refusal and not self.entries:
            self.finish(refusal)
        elif self._lister is not None:
            self._lister.tick(now)
            self._look()

    def _look(self) -> None:
        if self._lister is not None:
            self.done, self.total = len(self._lister.entries), self._lister.count
            if self._lister.over:
                self.finish(self._lister.error)


class LogEraseJob(Job):
    """Erases all logs. No autopilot acknowledges LOG_ERASE, so the list is read until it is empty.

    A PX4 that logs from its boot on keeps the log that it is writing: the one that is left and grows.
    """

    def __init__(self, channel: LogChannel, vehicle: int, on_done: Done) -> None:
        super().__init__(vehicle, "erase logs", on_done)
        self._channel = channel
        self._lister: LogLister | None = None
        self._sent = 0
        self._look_s = 0.0
        self._only: LogEntry | None = None
        """The log that was left alone at the last look."""

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Send the order, unless the vehicle is armed."""
        # ArduPilot ignores LOG_ERASE while armed, and sends nothing (docs/autopilots.md "Logs of ArduCopter").
        if vehicle.telemetry.armed:
            self.finish("disarm it first: armed, it ignores this")
        elif vehicle.why_not_commanded:
            self.finish(vehicle.why_not_commanded)
        else:
            self._erase(now)

    def on_entry(self, fields: Fields, now: float) -> None:
        """Take a LOG_ENTRY of the vehicle."""
        if self._lister is not None:
            self._lister.on_entry(fields, now)
            # One entry proves that they are not gone yet.
            self._lister.over = True

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Read the list, and repeat the order until the list is empty."""
        if self._lister is None:
            if now >= self._look_s and not self.over:
                self._lister = self._channel.lister(vehicle, now)
            return
        self._lister.tick(now)
        if not self._lister.over:
            return
        left, entries, self._lister = self._lister.count, list(self._lister.entries.values()), None
        before, only = self._only, entries[0] if left == 1 and entries else None
        self._only = only
        if not left or (only is not None and before is not None and _has_grown(before, only)):
            self.finish()
        elif now - self.begun_s > ERASE_LONGEST_S:
            self.finish(f"{left} logs are still there")
        else:
            self._erase(now)

    def _erase(self, now: float) -> None:
        self._look_s = now + ERASE_LOOK_S
        if self._sent == 0:
            self._channel.context.uplink.action(self.vehicle, Order("erase logs"), "LOG_ERASE")
        elif self._sent < ERASE_COPIES and not self._channel.context.uplink.transfer(
            self.vehicle, "erase logs", "LOG_ERASE"
        ):
            self.finish("not sent")
        self._sent += 1


def _has_grown(before: LogEntry, now: LogEntry) -> bool:
    return now.id == before.id and now.size > before.size
