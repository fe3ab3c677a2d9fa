"""PX4's calibrations, which report by texts that begin with [cal].

ACCEPTED comes at the start and never at the end; without "calibration started" after it, nothing happens (measured).
The sensors see how the vehicle is turned, so there is nothing to confirm. Texts may be lost, so the heartbeat's
CALIBRATING shows when it is over though no text reported how.
"""

import re
from enum import StrEnum

from tui_gcs.core.firmware.calibration_setup import is_calibrating
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.setup.calibration_job import CalibrationJob, CalibrationRequest
from tui_gcs.core.uplink.actions import VehicleAction

PREFIX = "[cal] "
NO_STATUS_S = 0.3
"""A heartbeat that is so much newer than the order shows whether the order was received."""
START_S = 4.0
"""How long after its ACK it must have begun."""
OVER_S = 4.0
"""How long after CALIBRATING ended its last text may come."""
STORED_S = 1.0
SIDES = ("back", "front", "left", "right", "up", "down")
SIDE_WORDS = {
    "back": "tail down",
    "front": "nose down",
    "left": "on its left side",
    "right": "on its right side",
    "up": "on its back",
    "down": "level",
}
"""PX4 names the side that points down; "up" is upside down."""
_PROGRESS = re.compile(r"(?:[a-z]+ side calibration: )?progress <(\d{1,3})>")
"""Progress of the whole; a side that is being turned is sent with its name before it."""
_RESULT = re.compile(r"[a-z]+ side result: ")
_BESIDE = ("denied during", "Preflight Fail", "side result")
"""Beginnings of notes that are no reason of a failure: it lies on its side, so that its other checks fail meanwhile."""
_PENDING = re.compile(r"pending:((?: +[a-z]+)+)")
_SIDE = re.compile(r"([a-z]+) (orientation detected|side done|side already completed)")


class Side(StrEnum):
    """The state of one side."""

    PENDING = "pending"
    DETECTED = "detected"
    DONE = "done"


class TextCalibration(CalibrationJob):
    """Follows the texts of the vehicle."""

    ack_s = 3.0

    def __init__(self, request: CalibrationRequest) -> None:
        super().__init__(request)
        self.sides: dict[str, Side] = {}
        """The state of each side, in calibrations that turn the vehicle; else empty."""
        self._accepted_s: float | None = None
        self._calibrating_s: float | None = None
        """Station time of the last heartbeat with CALIBRATING."""
        self._started = False

    @property
    def lines(self) -> tuple[str, ...]:
        """The sides that are done; the prompt has the others."""
        done = [SIDE_WORDS[name] for name, state in self.sides.items() if state is Side.DONE]
        return (f"done: {', '.join(done)}",) if done else ()

    def may_repeat(self, vehicle: Vehicle) -> bool:
        """Whether a copy may be sent: only when a heartbeat shows that the first was not received."""
        # A second order during a calibration makes PX4 refuse everything in a storm of texts (measured).
        return vehicle.telemetry.heartbeat_s > self.sent_s + NO_STATUS_S and not is_calibrating(vehicle)

    def accepted(self, now: float) -> None:
        """Wait for the text or heartbeat that shows that it began."""
        self._accepted_s = now

    def is_led_by_others(self) -> bool:
        """Whether its texts show that it goes on."""
        return self._started

    def watch(self, vehicle: Vehicle, now: float) -> None:
        """Follow CALIBRATING in the heartbeat."""
        if is_calibrating(vehicle):
            self.order_received = self._started = True
            self._calibrating_s = now
        elif self._calibrating_s is not None and now - self._calibrating_s > OVER_S:
            if not self.cancelling:
                self.finish("it is over, but how it ended was lost on the way: look, or do it again")
        elif not self._started and self._accepted_s is not None and now - self._accepted_s > START_S:
            self.finish("accepted, but it did not begin: this vehicle does not have it")

    def on_text(self, vehicle: Vehicle, text: str, now: float) -> None:
        """Take a text. Texts without the prefix may be of anything, and are only kept."""
        if not text.startswith(PREFIX):
            self.note(text.rstrip("\u2409 "))
            return
        self.order_received = True
        self._on_cal_text(text.removeprefix(PREFIX).strip())

    def shows_cancelled(self, action: VehicleAction, vehicle: Vehicle) -> bool:
        """Whether its text (see `_on_cal_text`), or its heartbeat where that was lost, shows that it was cancelled."""
        return self.over or (vehicle.telemetry.heartbeat_s > action.first_s + STORED_S and not is_calibrating(vehicle))

    def _on_cal_text(self, text: str) -> None:
        if text.startswith("calibration done"):
            self.finish()
        elif text.startswith("calibration failed"):
            why = [note for note in self.notes[-3:] if not any(words in note for words in _BESIDE)]
            self.finish("; ".join([text, *why]))
        # Only its text proves a cancel: one of its ACKs accepts, one refuses (docs/autopilots.md "Calibration of PX4").
        elif text.startswith("calibration cancelled"):
            self.cancelled()
        elif text.startswith("calibration started"):
            self._started = True
        else:
            self._started = True
            self._goes_on(text)
            # It finishes the present measurement before it looks.
            if self.cancelling:
                self.prompt = ""

    def _goes_on(self, text: str) -> None:
        progress, pending, side = _PROGRESS.match(text), _PENDING.match(text), _SIDE.match(text)
        if progress:
            self.done = max(self.done, min(99, int(progress[1])))
        elif _RESULT.match(text):
            self.note(text)
        elif pending:
            self._pending(pending[1].split())
        elif side and side[1] in SIDES:
            self._side(side[1], side[2])
        elif text.startswith("hold vehicle still on a pending side"):
            self._ask_side()
        elif text.startswith(("detected", "Hold still")):
            self.prompt = "hold it still"
        elif text.startswith("Rotate vehicle"):
            self.prompt = "turn it slowly about the axis that points down, until this side is done"
        else:
            self.prompt = text
            self.note(text)

    def _pending(self, names: list[str]) -> None:
        for name in SIDES:
            self.sides[name] = Side.PENDING if name in names else Side.DONE
        self._ask_side()

    def _side(self, name: str, what: str) -> None:
        if what == "orientation detected":
            self.sides[name] = Side.DETECTED
            self.prompt = f"{SIDE_WORDS[name]}: hold it still"
        else:
            self.sides[name] = Side.DONE
            self._ask_side()

    def _ask_side(self) -> None:
        left = [SIDE_WORDS[name] for name, state in self.sides.items() if state is not Side.DONE]
        self.prompt = f"place the vehicle {' or '.join(left)}, and hold it still" if left else "hold it still"
