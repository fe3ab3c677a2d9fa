"""Downloads a log by LOG_REQUEST_DATA: window by window, and again what did not arrive of a window.

A whole log is never requested at once. The protocol has no flow control, and PX4 lost three quarters of one
(docs/autopilots.md "Logs of PX4").
"""

from collections.abc import Callable

from tui_gcs.core.base.safe_files import FileRefused
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.files.log_transfer import LogChannel, LogEntry, LogLister, LogPart
from tui_gcs.core.uplink.jobs import MAX_LONG_RUNNING_S, Job
from tui_gcs.core.uplink.rtt_estimator import RttEstimator

FRAME_BYTES = 90
"""How many bytes of a log one LOG_DATA carries."""
WINDOW_BYTES = 728 * FRAME_BYTES
"""64 kB, which ArduPilot sends in less than half a second (151 kB/s)."""
SLOW_SHARE = 0.4
"""The share of a slow link's budget that a download takes: telemetry and commands need the rest."""
SLOW_WINDOW_S = 2.0
"""A window over a slow link is what passes it in this time."""
# PX4 sends 2 MB/s without flow control: 9.9 MB brought 39 gaps. Many gaps are cheaper as one new window.
MAX_SINGLE_GAPS = 16
MAX_SILENCES = 10
# A download that was cut off goes on from here; saving each frame would wear the disk.
SAVE_EVERY_BYTES = 2 << 20


class LogDownloadJob(Job):
    """Downloads one log into a file; `path` is where it is once it is done."""

    takes_long = True
    max_running_s = MAX_LONG_RUNNING_S

    def __init__(
        self, channel: LogChannel, vehicle: int, entry: LogEntry, on_done: Callable[[Job], None] | None
    ) -> None:
        super().__init__(vehicle, f"download log {entry.id}", on_done)
        self._channel = channel
        self.entry = entry
        self.path = ""
        """The path below the station's state directory."""
        self.total = entry.size
        self._lister: LogLister | None = None
        self._part: LogPart | None = None
        self._window = (0, 0)
        self._window_bytes = WINDOW_BYTES
        self._pace_bytes_s = 0.0
        self._requested = (0, 0)
        self._requested_s = 0.0
        self._waits_turn = False
        """The next window over a slow link is not due yet."""
        self._window_s = self._due_s = 0.0
        self._silences = 0
        self._round_trip = RttEstimator()
        self._saved = 0

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Request the log's entry once more: it may have grown, and its number may be another log's by now."""
        spec = self._channel.context.specs.get(vehicle.link)
        slow = self._channel.context.is_slow(vehicle.link)
        self._round_trip = RttEstimator(slow=slow)
        if slow and spec is not None and spec.bytes_per_s:
            self._pace_bytes_s = SLOW_SHARE * spec.bytes_per_s
            frames = round(SLOW_WINDOW_S * self._pace_bytes_s / FRAME_BYTES)
            self._window_bytes = FRAME_BYTES * max(1, min(frames, WINDOW_BYTES // FRAME_BYTES))
        self._lister = self._channel.lister(vehicle, now, first=self.entry.id, last=self.entry.id)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Look for the entry, then read on; repeat what is not answered."""
        if self._lister is not None:
            self._lister.tick(now)
            self._look_entry(vehicle, now)
        elif self._part is not None and not self.over and now >= self._due_s:
            self._silent(vehicle, now)

    def pause(self) -> bool:
        """Keep what has arrived, and begin again with the entry when the turn comes back."""
        self.abort()
        return True

    def abort(self) -> None:
        """Keep what has arrived, to be resumed by the next download."""
        self._channel.ask_end(self.vehicle)
        if self._part is not None:
            self._part.keep()
            self._part = None

    def finish(self, error: str = "") -> None:
        """End the job; after an error what has arrived is kept."""
        if not self.over:
            self._channel.ask_end(self.vehicle)
            if error and self._part is not None:
                self._part.keep()
                self._part = None
        super().finish(error)

    def on_entry(self, vehicle: Vehicle, fields: Fields, now: float) -> None:
        """Take a LOG_ENTRY of the vehicle."""
        if self._lister is not None:
            self._lister.on_entry(fields, now)
            if self.entry.id in self._lister.entries:
                self._lister.over = True
            self._look_entry(vehicle, now)

    def _look_entry(self, vehicle: Vehicle, now: float) -> None:
        if self._lister is None:
            return
        refusal = self._channel.refusal(vehicle, self.begun_s)
        if refusal or self._lister.over:
            found = self._lister.entries.get(self.entry.id)
            self._lister = None
            if refusal or found is None:
                self.finish(refusal or "the vehicle has no log of that number")
            # A log never shrinks: erasing has given its number to another log.
            elif found.size < self.entry.size:
                self.finish("another log has that number now: list them again")
            else:
                self.entry, self.total = found, found.size
                self._open(vehicle, now)

    def _open(self, vehicle: Vehicle, now: float) -> None:
        try:
            self._part = self._channel.open_part(vehicle, self.entry)
        except FileRefused as error:
            self.finish(str(error))
            return
        free = self._part.room_bytes()
        if self.entry.size - self._part.ranges.held > free:
            room = f"{self.entry.size / 1e6:.0f} MB announced, room for {free / 1e6:.0f} MB"
            self.finish(f"{room}: free space in the state directory")
            return
        self.done = self._saved = self._part.ranges.held
        self._next_window(vehicle, now)

    def on_data(self, vehicle: Vehicle, fields: Fields, now: float) -> None:
        """Take a LOG_DATA if it belongs to the requested window."""
        part, offset, count = self._part, fields["ofs"], fields["count"]
        if part is None or self.over or fields["id"] != self.entry.id:
            self._channel.ignored["log data not requested"] += 1
            return
        start, stop = self._window
        end = min(offset + min(count, FRAME_BYTES), stop)
        # Data beyond the window are not ours, or a flood.
        if not start <= offset < end:
            self._channel.ignored["log data beyond what was asked"] += 1
            return
        if part.ranges.add(offset, end):
            try:
                part.write(offset, bytes(fields["data"][: end - offset]))
            except OSError as error:
                self._disk(error)
                return
            self._silences = 0
        # The first frame of a request measures the round trip.
        if offset == self._requested[0] and self._requested_s:
            self._round_trip.add_sample(now - self._requested_s)
            self._requested_s = 0.0
        self.done = part.ranges.held
        self._due_s = now + 2 * self._round_trip.wait_s
        # The window is complete, or the part was another log's and has been emptied.
        if part.ranges.covers(stop) or part.ranges.first_gap()[0] < start:
            self._next_window(vehicle, now)
        # The last frame came, and some before it did not.
        elif end >= self._requested[1]:
            self._ask_gap(part, now)

    def _next_window(self, vehicle: Vehicle, now: float) -> None:
        part = self._part
        if part is None:
            return
        start, gap_end = part.ranges.first_gap()
        size = self.entry.size
        if start >= size:
            self._whole(vehicle, size)
            return
        if part.ranges.held - self._saved >= SAVE_EVERY_BYTES:
            self._saved = part.ranges.held
            part.save()
        stop = min(size, start + self._window_bytes, gap_end if gap_end is not None else size)
        # Over a slow link the next window waits until the last one's share of the budget has passed.
        earliest_s = (
            self._window_s + (self._window[1] - self._window[0]) / self._pace_bytes_s if self._pace_bytes_s else 0
        )
        self._window = (start, stop)
        self._window_s = max(now, earliest_s)
        self._waits_turn = now < earliest_s
        if self._waits_turn:
            self._due_s = earliest_s
        else:
            self._ask(start, stop, now)

    def _ask(self, start: int, stop: int, now: float) -> None:
        self._waits_turn = False
        self._due_s = now + 2 * self._round_trip.wait_s
        self._requested, self._requested_s = (start, stop), now
        self._channel.ask_data(self.vehicle, self.entry.id, start, stop - start)

    def _silent(self, vehicle: Vehicle, now: float) -> None:
        """Repeat the request: nothing more came of the window."""
        part = self._part
        if part is None:
            return
        if self._waits_turn:
            self._ask(*self._window, now)
            return
        refusal = self._channel.refusal(vehicle, self.begun_s)
        if refusal or self._silences >= MAX_SILENCES:
            self.finish(refusal or "no answer: what is there is kept")
            return
        self._silences += 1
        if self._silences > 1:
            self._round_trip.add_loss()
        self._ask_gap(part, now)

    def _ask_gap(self, part: LogPart, now: float) -> None:
        start, gap_end = part.ranges.first_gap()
        # Where there are many gaps, everything behind the first is requested again: that is faster than one request
        # each.
        many = part.ranges.pieces > MAX_SINGLE_GAPS
        stop = self._window[1] if many or gap_end is None else min(self._window[1], gap_end)
        self._ask(start, max(stop, start + 1), now)

    def _whole(self, vehicle: Vehicle, size: int) -> None:
        part, self._part = self._part, None
        if part is None:
            return
        try:
            part.file.cut(size)
            self.path = self._channel.result_path(
                self.vehicle, part.finish(self._channel.final_name(vehicle, self.entry))
            )
        except (FileRefused, OSError) as error:
            self.finish(str(error))
            return
        self.done = self.total = size
        self.finish()

    def _disk(self, error: OSError) -> None:
        part, self._part = self._part, None
        if part is not None:
            part.discard()
        self._channel.alarm(self.vehicle, f"log {self.entry.id} cannot be written: {error.strerror or error}")
        self.finish(f"cannot be written here: {error.strerror or error}")
