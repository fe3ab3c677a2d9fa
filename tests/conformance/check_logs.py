"""Logs of the flights that were just flown."""

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.plans import finished
from tests.conformance.report import check
from tui_gcs.core.uplink.jobs import JobState

SHORT_LOG = 3_000_000
"""A longer log is downloaded for a few seconds only, then cancelled."""
LOG_S = 10.0
LIMIT_S = 120.0


@check("logs: listed and read", takes_s=15.0)
def logs(field: Field, vehicle: int) -> str:
    """Its logs are listed, and the newest one is downloaded, or its first part if it is long."""
    service = field.station.services.logs
    listing = service.list(vehicle)
    list_s = finished(field, listing)
    if not listing.entries:
        raise NotApplicable(f"it has no log yet (told after {list_s:.2f} s)")
    entry = listing.entries[-1]
    job = service.download(vehicle, entry)

    def long_enough() -> bool:
        running_s = field.clock.now() - job.begun_s if job.state is JobState.RUNNING else 0.0
        return job.total > SHORT_LOG and running_s > LOG_S

    field.until(lambda: job.over or long_enough(), LIMIT_S, "its newest log")
    took_s, done = field.clock.now() - job.begun_s, job.done
    if not job.over:
        field.station.comms.jobs.cancel_job(job)
    elif job.error:
        raise Failed(f"log {entry.id}: {job.error}")
    rate = done / 1000.0 / max(took_s, 0.05)
    return f"{len(listing.entries)} in {list_s:.2f} s; log {entry.id}: {done} of {entry.size} bytes, {rate:.0f} kB/s"
