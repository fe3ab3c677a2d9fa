"""Files and logs. On the ground."""

from random import Random

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.plans import ended, finished
from tests.conformance.report import check
from tui_gcs.core.services.ftp_codec import crc_fits

FTP = 32
"""MAV_PROTOCOL_CAPABILITY_FTP."""
AUTOPILOT_VERSION = 148
BYTES = 5000
SHORT_LOG = 3_000_000
"""A longer log is downloaded for a few seconds only, then cancelled."""
LOG_S = 20.0


def _folder(field: Field, vehicle: int) -> str:
    """Where files may be written: a memory card, where it has one."""
    version = field.station.fleet.newest(field.vehicle(vehicle), AUTOPILOT_VERSION)
    if version is not None and not int(version.fields["capabilities"]) & FTP:
        raise NotApplicable("it has no file transfer (AUTOPILOT_VERSION.capabilities)")
    root = field.station.services.ftp.list(vehicle, "/")
    finished(field, root)
    names = {str(entry.name) for entry in root.entries if entry.is_directory}
    return "/fs/microsd" if "fs" in names else ""


@check("files: the root is listed")
def files(field: Field, vehicle: int) -> str:
    """MAVFTP lists a directory."""
    _folder(field, vehicle)
    job = field.station.services.ftp.list(vehicle, "/")
    took_s = finished(field, job)
    if not job.entries:
        raise Failed("the root is empty")
    names = ", ".join(str(entry.name) for entry in job.entries[:4])
    return f"{len(job.entries)} entries in {took_s:.2f} s: {names} …"


@check("files: written, read back, checked, removed")
def written(field: Field, vehicle: int) -> str:
    """5000 bytes go up, come back the same, have the right checksum, and are gone after removing."""
    ftp, path = field.station.services.ftp, f"{_folder(field, vehicle)}/conform.tmp"
    data = Random(vehicle).randbytes(BYTES)
    up_s = finished(field, ftp.write(vehicle, path, data))
    try:
        reading = ftp.read(vehicle, path)
        down_s = finished(field, reading)
        sum_ = ftp.crc32(vehicle, path)
        finished(field, sum_)
        if bytes(reading.data) != data:
            raise Failed(f"{len(reading.data)} bytes came back, and they are others")
        if sum_.number is None or not crc_fits(data, sum_.number):
            raise Failed(f"its checksum {sum_.number} is not that of the file")
    finally:
        ended(field, ftp.remove(vehicle, path))
    gone = ftp.read(vehicle, path)
    ended(field, gone)
    if not gone.error:
        raise Failed(f"{path} is still there after it was removed")
    return f"{BYTES} bytes up in {up_s:.2f} s, down in {down_s:.2f} s, checksum right, removed ({gone.error})"


@check("files: what is not there is told")
def no_file(field: Field, vehicle: int) -> str:
    """Reading a file that does not exist ends with a reason."""
    _folder(field, vehicle)
    job = field.station.services.ftp.read(vehicle, "/no-such-file.txt")
    took_s = ended(field, job)
    if not job.error:
        raise Failed("/no-such-file.txt was read")
    return f"{job.error} after {took_s:.2f} s"


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
    began_s = field.clock.now()
    field.until(
        lambda: job.over or (job.total > SHORT_LOG and field.clock.now() - began_s > LOG_S / 2), 90.0, "its newest log"
    )
    took_s, done = field.clock.now() - began_s, job.done
    if not job.over:
        field.station.jobs.cancel_job(job)
    elif job.error:
        raise Failed(f"log {entry.id}: {job.error}")
    rate = done / 1000.0 / max(took_s, 0.05)
    return f"{len(listing.entries)} in {list_s:.2f} s; log {entry.id}: {done} of {entry.size} bytes, {rate:.0f} kB/s"
