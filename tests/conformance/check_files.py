"""Files and logs. On the ground."""

from random import Random

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.plans import ended, finished
from tests.conformance.report import check
from tui_gcs.core.services.files.ftp_codec import crc_fits

FTP = 32
"""MAV_PROTOCOL_CAPABILITY_FTP."""
AUTOPILOT_VERSION = 148
BYTES = 5000


def _folder(field: Field, vehicle: int) -> str:
    """Where files may be written: a memory card, where it has one."""
    version = field.station.picture.fleet.newest(field.vehicle(vehicle), AUTOPILOT_VERSION)
    if version is not None and not int(version.fields["capabilities"]) & FTP:
        raise NotApplicable("it has no file transfer (AUTOPILOT_VERSION.capabilities)")
    root = field.station.services.ftp.list(vehicle, "/")
    finished(field, root)
    names = {str(entry.name) for entry in root.task.entries if entry.is_directory}
    return "/fs/microsd" if "fs" in names else ""


@check("files: the root is listed")
def files(field: Field, vehicle: int) -> str:
    """MAVFTP lists a directory."""
    _folder(field, vehicle)
    job = field.station.services.ftp.list(vehicle, "/")
    took_s = finished(field, job)
    if not job.task.entries:
        raise Failed("the root is empty")
    names = ", ".join(str(entry.name) for entry in job.task.entries[:4])
    return f"{len(job.task.entries)} entries in {took_s:.2f} s: {names} …"


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
        if sum_.task.number is None or not crc_fits(data, sum_.task.number):
            raise Failed(f"its checksum {sum_.task.number} is not that of the file")
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
