"""ArduPilot's compass calibration: all compasses at once, with progress and reports that must be requested."""

import math

from tui_gcs.core.firmware.calibration_setup import MAG_CAL_PROGRESS, MAG_CAL_REPORT
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.setup.calibration_job import CalibrationJob, CalibrationRequest
from tui_gcs.core.uplink.actions import RetryClass

EVERY_US, OFF_US = 500_000, -1
SILENT_S = 20.0
"""A calibration without progress or report for so long has stopped."""
ASK_AGAIN_S = 4.0
"""How often messages are requested again: over a slow link the ACK of one interval is taken for the next one's."""
MAX_COMPASSES = 8
"""The most compasses: `cal_mask` has 8 bits."""
STATUS = {
    0: "not started",
    1: "waiting to start",
    2: "first step",
    3: "second step",
    4: "success",
    5: "failed",
    6: "failed: wrong orientation",
    7: "failed: the field is too weak or too strong",
}
"""MAG_CAL_STATUS."""
SUCCESS, FIRST_FAILURE = 4, 5


class CompassCalibration(CalibrationJob):
    """Calibrates all compasses at once. A repeated start does no harm."""

    retry = RetryClass.SET

    def __init__(self, request: CalibrationRequest) -> None:
        super().__init__(request)
        self.compasses: dict[int, tuple[int, str]] = {}
        """Progress in percent and state by compass, counted from 0."""
        self._ended: dict[int, bool] = {}
        self._mask = 0
        self._received_s = 0.0
        self._intervals_s = 0.0
        """Station time at which the messages were last requested."""

    @property
    def lines(self) -> tuple[str, ...]:
        """One line for each compass."""
        return tuple(f"compass {n + 1}: {pct:>3} %  {words}" for n, (pct, words) in sorted(self.compasses.items()))

    def on_ordered(self, now: float) -> None:
        """Request progress and reports, which it does not send unasked."""
        self._received_s = now
        self._intervals(EVERY_US)

    def is_led_by_others(self) -> bool:
        """Whether its progress shows that it goes on."""
        return bool(self.compasses)

    def on_text(self, vehicle: Vehicle, text: str, now: float) -> None:
        """Keep the text for display: texts do not control this calibration."""
        self.note(text)

    def close(self) -> None:
        """Stop the messages that were requested."""
        if self._received_s:
            self._intervals(OFF_US)

    def watch(self, vehicle: Vehicle, now: float) -> None:
        """End when it has fallen silent; before that, request the messages again."""
        if not self._received_s or self.cancelling:
            return
        if now - self._received_s > SILENT_S:
            self.abort_on_board()
            self.finish("it stopped telling its progress")
        elif now - max(self._received_s, self._intervals_s) > ASK_AGAIN_S:
            self._intervals_s = now
            self._intervals(EVERY_US)

    def on_progress(self, fields: Fields, now: float) -> None:
        """Take the progress of one compass."""
        number, status = fields["compass_id"], fields["cal_status"]
        if not self._received_s or number >= MAX_COMPASSES:
            return
        self._received_s, self.order_received, self.began = now, True, True
        self._mask |= fields["cal_mask"] | 1 << number
        self._ended.pop(number, None)
        self._show(number, min(99, fields["completion_pct"]), STATUS.get(status, f"status {status}"))

    def on_report(self, vehicle: Vehicle, fields: Fields, now: float) -> None:
        """Take the report of one compass. Without progress before it, it is of an older calibration."""
        number, status = fields["compass_id"], fields["cal_status"]
        if not self._received_s or number not in self.compasses or status < SUCCESS:
            return
        self._received_s = now
        if number in self._ended:
            return
        fitness = f", fitness {fields['fitness']:.2f}" if math.isfinite(fields["fitness"]) else ""
        words = STATUS.get(status, f"failed with status {status}") + fitness
        # The vehicle has not stored the result: it would be lost.
        if status == SUCCESS and not fields["autosaved"]:
            status, words = FIRST_FAILURE, "done, but not saved"
        self._ended[number] = status == SUCCESS
        self._show(number, 100, words)
        self.note(f"compass {number + 1}: {words}")
        wanted = [n for n in range(MAX_COMPASSES) if self._mask >> n & 1]
        if all(n in self._ended for n in wanted):
            self._all_done()

    def _all_done(self) -> None:
        bad = [n for n, good in sorted(self._ended.items()) if not good]
        if bad:
            self.finish("; ".join(f"compass {n + 1}: {self.compasses[n][1]}" for n in bad))
        else:
            self.result = f"{len(self._ended)} compasses calibrated"
            self.finish()

    def _show(self, number: int, percent: int, words: str) -> None:
        self.compasses[number] = (percent, words)
        self.done = min(99, sum(p for p, _ in self.compasses.values()) // len(self.compasses))

    def _intervals(self, every_us: int) -> None:
        for message in (MAG_CAL_PROGRESS, MAG_CAL_REPORT):
            self.context.set_interval(self.vehicle, f"interval {message}", message, every_us)
