"""LOG_*: how both autopilots list, send and erase their logs (docs/autopilots.md "Logs of ArduCopter")."""

from sitl.common.autopilot import Handler
from sitl.common.logs import Log
from sitl.common.platform import Part
from sitl.common.states import MavSeverity
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame

# LOG_DATA.data (common.xml); a shorter piece is the end of a log.
LOG_DATA_BYTES = 90
ARDUPILOT_DATA_US = 597
"""ArduPilot sent 1675 frames a second."""
PX4_DATA_US = 45
"""PX4 sends about 2 MB/s, without flow control."""
ENTRY_US = 20_000
ERASE_US = 3_000_000
"""Erasing takes an ArduPilot up to 5 s."""
HEARTBEAT_PAUSE_US = 3_000_000
"""ArduPilot pauses a download while the station's last heartbeat is older."""

_TRANSFER = "log transfer"


class LogServer(Part):
    """What both autopilots' log servers have in common."""

    _list: Handler
    _request_data: Handler
    _end: Handler
    _erase: Handler
    """Handlers that each autopilot has of its own."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {
            "LOG_REQUEST_LIST": self._list,
            "LOG_REQUEST_DATA": self._request_data,
            "LOG_REQUEST_END": self._end,
            "LOG_ERASE": self._erase,
        }

    def _send_entry(self, number: int, total: int, last: int, log: Log | None) -> None:
        self._outbox.send(
            "LOG_ENTRY",
            id=number,
            num_logs=total,
            last_log_num=last if log else 0,
            time_utc=log.utc_s if log else 0,
            size=log.size_at(self._clock.now_us) if log else 0,
        )

    def _send_data(self, number: int, offset: int, data: bytes) -> None:
        self._outbox.send("LOG_DATA", id=number, ofs=offset, count=len(data), data=data.ljust(LOG_DATA_BYTES, b"\0"))

    def _start(self, task: Task) -> None:
        self._tasks.start(_TRANSFER, task, self._clock.now_us)


class ArduPilotLogServer(LogServer):
    """ArduPilot's logs: numbered from 1, not served while armed."""

    def _may_serve(self) -> bool:
        """Return whether logs are served: not while armed, which is reported once."""
        logs = self._logs
        if not self._state.armed:
            logs.warned = False
            return True
        if not logs.warned:
            logs.warned = True
            self._outbox.text(MavSeverity.ERROR, "Disarm for log download")
        return False

    def _list(self, frame: ReceivedFrame) -> None:
        if not self._may_serve():
            return
        if _TRANSFER in self._tasks:
            self._outbox.text(MavSeverity.INFO, "Log download in progress")
            return
        total = len(self._logs.files)
        first, last = max(frame.fields["start"], 1), min(frame.fields["end"], total)
        # Without a log there is one entry, with the number 0.
        numbers = list(range(first, last + 1)) if total else [0]
        self._start(self._send_entries(numbers, total))

    def _send_entries(self, numbers: list[int], total: int) -> Task:
        for number in numbers:
            files = self._logs.files
            self._send_entry(number, total, numbers[-1], files[number - 1] if 1 <= number <= len(files) else None)
            yield ENTRY_US

    def _request_data(self, frame: ReceivedFrame) -> None:
        """Start a download. During another one the request is dropped; for an unknown log there is no answer."""
        if not self._may_serve() or _TRANSFER in self._tasks:
            return
        number, logs = frame.fields["id"], self._logs
        if not 1 <= number <= len(logs.files):
            logs.downloading = False
            return
        logs.downloading = True
        log = logs.files[number - 1]
        end = min(log.size_at(self._clock.now_us), frame.fields["ofs"] + frame.fields["count"])
        self._start(self._download(log, frame.fields["ofs"], end))

    def _download(self, log: Log, offset: int, end: int) -> Task:
        while True:
            last_heard_us, now_us = self._state.gcs_last_heard_us, self._clock.now_us
            # ArduPilot pauses for a silent station, and continues as soon as its heartbeats are back.
            if self._state.armed or last_heard_us is None or now_us - last_heard_us > HEARTBEAT_PAUSE_US:
                yield 100_000
                continue
            data = log.read(offset, min(LOG_DATA_BYTES, max(end - offset, 0)), now_us)
            self._send_data(log.number, offset, data)
            offset += len(data)
            if len(data) < LOG_DATA_BYTES or offset >= end:
                return
            yield ARDUPILOT_DATA_US

    def _end(self, _: ReceivedFrame) -> None:
        """End a download; until this comes, arming is refused."""
        if self._may_serve():
            self._logs.downloading = False
            self._tasks.stop(_TRANSFER)

    def _erase(self, _: ReceivedFrame) -> None:
        """Erase all logs after a while; there is no acknowledgement."""
        if self._may_serve():
            self._tasks.after("log erase", ERASE_US, self._logs.erase, self._clock.now_us)


class Px4LogServer(LogServer):
    """PX4's logs: numbered from 0, served at any time once they were listed."""

    def _list(self, frame: ReceivedFrame) -> None:
        """Send the entries; without a log nothing is sent."""
        self._logs.listed = True
        total = len(self._logs.files)
        last = total if frame.fields["end"] == 0xFFFF else frame.fields["end"]
        ids = [k for k in range(total) if frame.fields["start"] <= k <= last]
        self._start(self._send_entries(ids, total, last))

    def _send_entries(self, ids: list[int], total: int, last: int) -> Task:
        yield ENTRY_US
        for k in ids:
            if k < len(self._logs.files):
                self._send_entry(k, total, last, self._logs.files[k])
                yield 1000

    def _request_data(self, frame: ReceivedFrame) -> None:
        """Start a download in place of the one under way; for an unknown log there is no answer."""
        k, offset = frame.fields["id"], frame.fields["ofs"]
        self._tasks.stop(_TRANSFER)
        if not self._logs.listed or k >= len(self._logs.files):
            return
        size = self._logs.files[k].size_at(self._clock.now_us)
        self._start(self._download(k, offset, min(offset + frame.fields["count"], size), size))

    def _download(self, k: int, offset: int, end: int, size: int) -> Task:
        """Send whole frames only, so more than was requested at the end."""
        log = self._logs.files[k]
        while offset < end:
            data = log.read(offset, min(LOG_DATA_BYTES, size - offset), self._clock.now_us)
            self._send_data(k, offset, data)
            offset += LOG_DATA_BYTES
            yield PX4_DATA_US

    def _end(self, _: ReceivedFrame) -> None:
        self._tasks.stop(_TRANSFER)

    def _erase(self, _: ReceivedFrame) -> None:
        """Erase all logs at once; there is no acknowledgement."""
        self._tasks.stop(_TRANSFER)
        self._logs.erase()
