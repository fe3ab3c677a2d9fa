"""LOG_*: how both autopilots list, send and erase their logs. Handlers get the vehicle and the frame."""

from sitl.common.autopilot import Autopilot
from sitl.common.logs import Log
from sitl.common.states import Severity
from sitl.common.tasks import Task
from sitl.links.wire import Received

LOG_DATA_BYTES = 90
ARDUPILOT_DATA_US = 597
"""1675 frames/s were measured."""
PX4_DATA_US = 45
"""About 2 MB/s, without flow control."""
ENTRY_US = 20_000
ERASE_US = 3_000_000
"""ArduPilot's erasing takes up to 5 s."""
HEARTBEAT_PAUSE_US = 3_000_000
"""ArduPilot sends nothing of a log while the station's last heartbeat is older."""

_TRANSFER = "log transfer"

# ArduPilot


def _ardupilot_may(ap: Autopilot) -> bool:
    """Not while armed; said once."""
    if not ap.armed:
        ap.logs.warned = False
        return True
    if not ap.logs.warned:
        ap.logs.warned = True
        ap.text(Severity.ERROR, "Disarm for log download")
    return False


def ardupilot_list(ap: Autopilot, frame: Received) -> None:
    """LOG_REQUEST_LIST: numbers from 1; without a log one entry that says so."""
    if not _ardupilot_may(ap):
        return
    if _TRANSFER in ap.tasks:
        ap.text(Severity.INFO, "Log download in progress")
        return
    total = len(ap.logs.files)
    first, last = max(frame.fields["start"], 1), min(frame.fields["end"], total)
    numbers = list(range(first, last + 1)) if total else [0]
    ap.tasks.start(_TRANSFER, _ardupilot_entries(ap, numbers, total), ap.now_us)


def _ardupilot_entries(ap: Autopilot, numbers: list[int], total: int) -> Task:
    for number in numbers:
        log = ap.logs.files[number - 1] if 1 <= number <= len(ap.logs.files) else None
        _entry(ap, number, total, numbers[-1], log)
        yield ENTRY_US


def ardupilot_data(ap: Autopilot, frame: Received) -> None:
    """LOG_REQUEST_DATA: while one is sent, another is dropped; an unknown log is met with silence."""
    if not _ardupilot_may(ap) or _TRANSFER in ap.tasks:
        return
    number = frame.fields["id"]
    if not 1 <= number <= len(ap.logs.files):
        ap.logs.downloading = False
        return
    ap.logs.downloading = True
    log = ap.logs.files[number - 1]
    end = min(log.size_at(ap.now_us), frame.fields["ofs"] + frame.fields["count"])
    ap.tasks.start(_TRANSFER, _ardupilot_send(ap, log, frame.fields["ofs"], end), ap.now_us)


def _ardupilot_send(ap: Autopilot, log: Log, offset: int, end: int) -> Task:
    while True:
        heard_us = ap.gcs_heard_us
        if ap.armed or heard_us is None or ap.now_us - heard_us > HEARTBEAT_PAUSE_US:
            yield 100_000
            continue
        data = log.read(offset, min(LOG_DATA_BYTES, max(end - offset, 0)), ap.now_us)
        _data(ap, log.number, offset, data)
        offset += len(data)
        if len(data) < LOG_DATA_BYTES or offset >= end:
            return
        yield ARDUPILOT_DATA_US


def ardupilot_end(ap: Autopilot, _: Received) -> None:
    """LOG_REQUEST_END: only now arming is possible again."""
    if _ardupilot_may(ap):
        ap.logs.downloading = False
        ap.tasks.stop(_TRANSFER)


def ardupilot_erase(ap: Autopilot, _: Received) -> None:
    """LOG_ERASE: no acknowledgement; takes a while."""
    if _ardupilot_may(ap):
        ap.tasks.after("log erase", ERASE_US, ap.logs.erase, ap.now_us)


# PX4


def px4_list(ap: Autopilot, frame: Received) -> None:
    """LOG_REQUEST_LIST: ids from 0. Without a log nothing is sent."""
    ap.logs.listed = True
    total = len(ap.logs.files)
    last = total if frame.fields["end"] == 0xFFFF else frame.fields["end"]
    ids = [k for k in range(total) if frame.fields["start"] <= k <= last]
    ap.tasks.start(_TRANSFER, _px4_entries(ap, ids, total, last), ap.now_us)


def _px4_entries(ap: Autopilot, ids: list[int], total: int, last: int) -> Task:
    yield ENTRY_US
    for k in ids:
        if k < len(ap.logs.files):
            _entry(ap, k, total, last, ap.logs.files[k])
            yield 1000


def px4_data(ap: Autopilot, frame: Received) -> None:
    """LOG_REQUEST_DATA: a new one takes the place of the old one; what does not exist is met with silence."""
    k, offset = frame.fields["id"], frame.fields["ofs"]
    ap.tasks.stop(_TRANSFER)
    if not ap.logs.listed or k >= len(ap.logs.files):
        return
    log = ap.logs.files[k]
    size = log.size_at(ap.now_us)
    ap.tasks.start(_TRANSFER, _px4_send(ap, k, offset, min(offset + frame.fields["count"], size), size), ap.now_us)


def _px4_send(ap: Autopilot, k: int, offset: int, end: int, size: int) -> Task:
    """Always whole frames, beyond what was asked for, too."""
    log = ap.logs.files[k]
    while offset < end:
        data = log.read(offset, min(LOG_DATA_BYTES, size - offset), ap.now_us)
        _data(ap, k, offset, data)
        offset += LOG_DATA_BYTES
        yield PX4_DATA_US


def px4_end(ap: Autopilot, _: Received) -> None:
    """LOG_REQUEST_END."""
    ap.tasks.stop(_TRANSFER)


def px4_erase(ap: Autopilot, _: Received) -> None:
    """LOG_ERASE: no acknowledgement, at once."""
    ap.tasks.stop(_TRANSFER)
    ap.logs.erase()


# Both


def _entry(ap: Autopilot, number: int, total: int, last: int, log: Log | None) -> None:
    ap.send(
        "LOG_ENTRY",
        id=number,
        num_logs=total,
        last_log_num=last if log else 0,
        time_utc=log.utc_s if log else 0,
        size=log.size_at(ap.now_us) if log else 0,
    )


def _data(ap: Autopilot, number: int, offset: int, data: bytes) -> None:
    ap.send("LOG_DATA", id=number, ofs=offset, count=len(data), data=data.ljust(LOG_DATA_BYTES, b"\0"))
