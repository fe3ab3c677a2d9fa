"""What all calibrations have in common: how one is started, cancelled and given up."""

from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.firmware.calibration_setup import CalibrationProcedure, Sensor, is_calibrating
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction
from tui_gcs.core.uplink.jobs import Job, JobState

MAX_NOTES = 100
PERCENT = 100
STALE_STATUS_S = 3.0
"""How long after the last calibration ended the heartbeat may still show it."""
CANCEL_S = 5.0
"""How long after the last copy of a cancel its effect may take."""


@dataclass(frozen=True)
class CalibrationRequest:
    """A calibration to be started."""

    context: ServiceContext
    vehicle: int
    sensor: Sensor
    procedure: CalibrationProcedure
    begin_s: float
    """The earliest start: another calibration may just have ended."""
    on_done: Callable[[Job], None] | None = None


class CalibrationJob(Job):
    """One calibration of one vehicle; subclasses know the dialogue."""

    waits_for_operator = True
    retry = RetryClass.START
    ack_s = 40.0
    """How long its acknowledgement may take: ArduPilot's comes at the end, and a board that is moved takes 30 s."""

    def __init__(self, request: CalibrationRequest) -> None:
        procedure = request.procedure
        super().__init__(request.vehicle, f"{request.sensor} calibration", request.on_done)
        self.sensor = request.sensor
        self.prompt = procedure.prompt
        """What the operator has to do now; "" if nothing."""
        self.waits = False
        """Whether the vehicle waits for `confirm`."""
        self.notes: list[str] = []
        """Texts of the vehicle during the calibration, oldest first."""
        self.result = ""
        """How it ended, for the operator."""
        self.needs_reboot = False
        self.total = PERCENT
        self.on_end: Callable[[CalibrationJob], None] | None = None
        self.context, self.procedure = request.context, procedure
        self.order_received = False
        """Whether any message has shown that the vehicle received the order."""
        self.began = False
        """Whether it was acknowledged, or made progress."""
        self.cancelling = False
        self._begin_s = request.begin_s
        self._ordered_s: float | None = None
        self.sent_s = 0.0

    @property
    def lines(self) -> tuple[str, ...]:
        """The state of each of its parts, one line each."""
        return ()

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Send the order, unless another calibration has just ended."""
        self.tick(vehicle, now)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Send the order when it is time, watch, and give up in time."""
        if vehicle.telemetry.armed:
            self.finish("it was armed meanwhile")
        elif self._ordered_s is None:
            if is_calibrating(vehicle) and now > self._begin_s + STALE_STATUS_S:
                self.finish("it is being calibrated already")
            elif now >= self._begin_s and not is_calibrating(vehicle):
                self._ask(now)
        elif now - self._ordered_s > self.procedure.limit_s:
            self.give_up()
        else:
            self.watch(vehicle, now)

    def finish(self, error: str = "") -> None:
        """End the calibration: done, or failed because of `error`."""
        if self.over:
            return
        super().finish(error)
        self._end(error)

    def abort(self) -> None:
        """Stop the calibration on the vehicle, where there is an order for it."""
        if self._ordered_s is not None:
            self.abort_on_board()
        self._end("cancelled")

    def _end(self, error: str) -> None:
        self.prompt, self.waits = "", False
        self.result = self.result or error or "done"
        if not error:
            self.done = self.total
        self.needs_reboot = self.procedure.reboot_once_begun and self.began if error else self.procedure.needs_reboot
        self.close()
        if self.on_end is not None:
            self.on_end(self)

    def on_ordered(self, now: float) -> None:
        """The order was sent for the first time."""

    def may_repeat(self, vehicle: Vehicle) -> bool:
        """Whether a copy of the order does no harm though nothing was received after the first."""
        return True

    def accepted(self, now: float) -> None:
        """The vehicle acknowledged the order."""

    def watch(self, vehicle: Vehicle, now: float) -> None:
        """Do what is due while it goes on."""

    def close(self) -> None:
        """Undo what was set up for the calibration; called however it ends."""

    def on_text(self, vehicle: Vehicle, text: str, now: float) -> None:
        """Take a complete STATUSTEXT of the vehicle's autopilot."""
        self.order_received = self.order_received or self._ordered_s is not None
        self.note(text)

    def confirm(self, vehicle: Vehicle) -> str:
        """Report to the vehicle that the operator has followed the prompt; returns "" or why that is of no use."""
        return "nothing is to be confirmed: the vehicle sees it by itself"

    def note(self, text: str) -> None:
        """Keep a text for display."""
        if text and len(self.notes) < MAX_NOTES and (not self.notes or self.notes[-1] != text):
            self.notes.append(text)

    def give_up(self) -> None:
        """End because it took too long."""
        self.abort_on_board()
        self.finish(f"not done within {self.procedure.limit_s:.0f} s; if it refuses to arm, reboot it")

    def abort_on_board(self) -> None:
        """Make the vehicle stop, if it can."""
        if self.procedure.cancel is not None:
            self._submit_cancel(self.procedure.cancel)
        else:
            self.note(self.procedure.no_cancel)

    def _ask(self, now: float) -> None:
        self._ordered_s = now
        action = VehicleAction(
            self.vehicle,
            f"begin {self.name}",
            self.retry,
            send=lambda copy: self._send(action, copy),
            confirmed=lambda v: action.acked_s is not None and not action.in_progress,
            command=self.procedure.order.command,
            confirm_s=self.ack_s,
            on_done=self._answered,
            order=self.procedure.order,
        )
        self.context.commands.submit(action)
        self.on_ordered(now)

    def _send(self, action: VehicleAction, copy: int) -> None:
        """Send the order, a copy only while nothing shows that the first was received."""
        vehicle = self.context.fleet.vehicles.get(self.vehicle)
        # A second order during a calibration makes PX4 refuse everything in a storm of texts, and ArduPilot answer
        # "failed".
        if vehicle is None or (copy and (self.order_received or not self.may_repeat(vehicle))):
            return
        self.sent_s = self.context.clock.now()
        command = action.order or self.procedure.order
        fields = command.fields(copy)
        action.refusal = self.context.uplink.action(self.vehicle, action.as_order(), command.message, **fields)

    def _answered(self, action: VehicleAction, outcome: Outcome, why: str) -> None:
        self.began = self.began or outcome is Outcome.CONFIRMED
        if self.over or self.cancelling:
            return
        if outcome is Outcome.CONFIRMED:
            self.accepted(self.context.clock.now())
        elif outcome is Outcome.REFUSED:
            self.finish(f"refused: {why}")
        elif outcome is Outcome.SUPERSEDED:
            self.finish("a stop came first")
        elif not self.is_led_by_others():
            self.finish("no answer: whether it took place is not known")

    def is_led_by_others(self) -> bool:
        """Whether it goes on although its acknowledgement was lost."""
        return False

    def cancel(self) -> str:
        """Ask the vehicle to stop; returns "" or why it cannot. The job ends when the effect shows."""
        if self.state is JobState.QUEUED or self._ordered_s is None:
            self.context.jobs.cancel(self.vehicle, self.name)
            return ""
        if self.procedure.cancel is None:
            return self.procedure.no_cancel
        if not self.cancelling:
            self.cancelling, self.prompt, self.waits = True, "", False
            self._submit_cancel(self.procedure.cancel)
        return ""

    def shows_cancelled(self, action: VehicleAction, vehicle: Vehicle) -> bool:
        """Whether the vehicle has stopped the calibration."""
        return action.acked_s is not None

    def _submit_cancel(self, order: MavCommand) -> None:
        """Submit the order that cancels."""
        # PX4 cancels by the same command and answers twice, once yes and once no. Such an ACK proves nothing; its texts
        # do.
        by_ack = order.command != self.procedure.order.command
        action = VehicleAction(
            self.vehicle,
            f"cancel {self.name}",
            RetryClass.SET,
            send=lambda copy: self._send_cancel(action, order, copy),
            confirmed=lambda v: self.shows_cancelled(action, v),
            command=order.command if by_ack else None,
            confirm_s=CANCEL_S,
            on_done=self._cancel_answered,
        )
        self.context.commands.cancel(self.vehicle, f"begin {self.name}")
        self.context.commands.submit(action)

    def _send_cancel(self, action: VehicleAction, order: MavCommand, copy: int) -> None:
        if action.command is None:
            self.context.commands.question(self.vehicle, order.command)
        self.context.uplink.action(self.vehicle, action.as_order(), order.message, **order.fields(copy))

    def _cancel_answered(self, action: VehicleAction, outcome: Outcome, why: str) -> None:
        if self.over:
            return
        if outcome is Outcome.CONFIRMED:
            self.cancelled()
        else:
            self.finish(f"cancelling: {outcome.value}; it may still be running")

    def cancelled(self) -> None:
        """End because the vehicle has stopped it."""
        if not self.over:
            self.state, self.error = JobState.CANCELLED, "cancelled"
            self._end("cancelled")


class AckCalibration(CalibrationJob):
    """A calibration that is over when it is acknowledged; until then the vehicle sends nothing, or only texts."""

    def accepted(self, now: float) -> None:
        """End: the ACK comes when it is done."""
        self.finish()
