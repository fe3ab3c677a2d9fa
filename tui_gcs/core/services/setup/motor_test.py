"""A test that turns one motor for a moment on the ground, once the operator has confirmed that the propellers are off.

The order leaves once: a copy would turn the motor again. ArduPilot's heartbeat shows armed meanwhile. ArduPilot and PX4
both accept a test of a motor that they do not have (measured), so the result is what SERVO_OUTPUT_RAW showed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from tui_gcs.core.firmware.calibration_setup import motor_test, motor_test_end, motor_test_hint, motors
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import StopReason
from tui_gcs.core.mavlink.enum_names import type_name
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction

DEFAULT_THROTTLE, MAX_THROTTLE = 0.15, 0.30
DEFAULT_DURATION_S, MAX_DURATION_S = 1.0, 3.0
SHOWN_ARMED_S = 2.5
"""The heartbeat that shows the end comes at most this much later."""

SERVO_OUTPUT_RAW = 36
OUTPUTS = tuple(f"servo{number}_raw" for number in range(1, 17))
DRIVEN_US = 20
"""An output that moves by so much is driven: the smallest throttle that turns a motor is about 50 µs."""
OBSERVED_AFTER_S = 0.7
"""How long after the end outputs are observed: a test that began before the first observation shows then."""

UNSEEN = "accepted; the vehicle reports no outputs: check whether the motor turned"

Done = Callable[[Outcome, str], None]
"""Called once with how it ended: what was seen of it if it was carried out, else why it was not."""


@dataclass(frozen=True)
class _Test:
    motor: int
    until_s: float


@dataclass
class _OutputRange:
    """The range of one vehicle's outputs during a test."""

    since_s: float
    least: dict[str, int] = field(default_factory=dict)
    most: dict[str, int] = field(default_factory=dict)

    def add(self, values: dict[str, int]) -> None:
        """Take the present outputs in µs, 0 for an output that is not used."""
        for name in OUTPUTS:
            value = values.get(name, 0)
            self.least[name] = min(value, self.least.get(name, value))
            self.most[name] = max(value, self.most.get(name, value))

    def driven(self) -> str:
        """Describe which outputs moved; "" if none did."""
        moved = [name for name in self.least if self.most[name] - self.least[name] >= DRIVEN_US]
        return ", ".join(f"{OUTPUTS.index(n) + 1} ({self.least[n]} to {self.most[n]} µs)" for n in moved)


@dataclass(frozen=True)
class MotorResult:
    """What came of the test of one motor."""

    ok: bool
    text: str


class MotorTestService:
    """Starts, watches and stops the motor tests of all vehicles."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._tests: dict[int, _Test] = {}
        self._results: dict[int, dict[int, MotorResult]] = {}
        context.forget_with(self._forget, reboot=False)

    def results(self, vehicle_id: int) -> dict[int, MotorResult]:
        """The last result of each motor that was tested since this station began, by the motor's number."""
        return dict(self._results.get(vehicle_id, {}))

    def is_testing(self, vehicle_id: int) -> bool:
        """Whether a motor turns by our order, or the heartbeat may still show it: armed means nothing then."""
        test = self._tests.get(vehicle_id)
        return test is not None and self._context.clock.now() < test.until_s

    def start(
        self,
        vehicle_id: int,
        motor: int,
        *,
        props_removed: bool,
        throttle: float = DEFAULT_THROTTLE,
        seconds: float = DEFAULT_DURATION_S,
        on_done: Done | None = None,
    ) -> str:
        """Turn motor 1, 2, … with `throttle` (0…1, at most 0.3) for `seconds` (at most 3); returns "" or why not.

        `on_done` is called when its time is over.
        """
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return "unknown vehicle"
        why = self._why_not(vehicle, motor, throttle, seconds, props_removed=props_removed)
        order = motor_test(vehicle, motor, throttle, seconds)
        if why or order is None:
            return why or "this autopilot has no motor test"
        now = self._context.clock.now()
        outputs = _OutputRange(now)
        action = VehicleAction(
            vehicle_id,
            f"test of motor {motor}",
            RetryClass.START,
            send=lambda copy: self._send(action, order, copy),
            confirmed=lambda v: self._is_over(v, action, seconds, outputs),
            command=order.command,
            confirm_s=seconds + 2.0,
            on_done=lambda _, outcome, reason: self._answered(vehicle, motor, outcome, reason, outputs, on_done),
            look=partial(self._context.request_message, vehicle_id, SERVO_OUTPUT_RAW),
        )
        self._tests[vehicle_id] = _Test(motor, now + seconds + SHOWN_ARMED_S)
        text = f"motor {motor} turns with {100 * throttle:.0f} % for {seconds:g} s"
        self._context.events.report(EventClass.SENSOR, f"vehicle {vehicle_id}", text, NOTICE)
        self._context.commands.submit(action)
        return ""

    def stop(self, vehicle_id: int) -> str:
        """End the test early; returns "" or why not."""
        test, vehicle = self._tests.get(vehicle_id), self._context.fleet.vehicles.get(vehicle_id)
        if test is None or vehicle is None or not self.is_testing(vehicle_id):
            return "no motor is being tested"
        order = motor_test_end(vehicle, test.motor)
        self._context.commands.cancel(vehicle_id, f"test of motor {test.motor}")
        # A motor turns, perhaps with its propeller: the end of it is a stop, over every path.
        self._context.submit_order(
            vehicle_id,
            "stop the motor test",
            order,
            lambda _, outcome, why: self._stopped(vehicle_id, test, outcome),
            stop=StopReason("stop the motor test"),
        )
        return ""

    def _stopped(self, vehicle_id: int, test: _Test, outcome: Outcome) -> None:
        if outcome is Outcome.CONFIRMED and self._tests.get(vehicle_id) is test:
            # The heartbeat shows armed for a moment after the end.
            until_s = min(test.until_s, self._context.clock.now() + SHOWN_ARMED_S)
            self._tests[vehicle_id] = _Test(test.motor, until_s)

    def _forget(self, vehicle: Vehicle) -> None:
        self._results.pop(vehicle.id, None)

    def _why_not(self, vehicle: Vehicle, motor: int, throttle: float, seconds: float, *, props_removed: bool) -> str:
        if not props_removed:
            return "take the propellers off, and say so"
        if self.is_testing(vehicle.id):
            return "a motor of it is being tested"
        if vehicle.telemetry.armed:
            return "it is armed"
        if not 1 <= motor <= motors(vehicle):
            return f"motors of a {type_name(vehicle.type)} are 1 to {motors(vehicle)}"
        if not 0 < throttle <= MAX_THROTTLE:
            return f"throttle is more than 0 and at most {MAX_THROTTLE:.0%}"
        if not 0 < seconds <= MAX_DURATION_S:
            return f"at most {MAX_DURATION_S:g} s"
        return vehicle.why_not_commanded

    def _send(self, action: VehicleAction, order: MavCommand, copy: int) -> None:
        # A copy would turn the motor again.
        if copy == 0:
            action.refusal = self._context.uplink.action(
                action.vehicle, action.as_order(), order.message, **order.fields(copy)
            )

    def _is_over(self, vehicle: Vehicle, action: VehicleAction, seconds: float, outputs: _OutputRange) -> bool:
        """Whether its time has passed; until then its outputs are observed."""
        now = self._context.clock.now()
        if now - vehicle.silent_s(SERVO_OUTPUT_RAW, now) > outputs.since_s:
            shown = self._context.fleet.newest(vehicle, SERVO_OUTPUT_RAW)
            if shown is not None:
                outputs.add(shown.fields)
        return action.acked_s is not None and now >= action.acked_s + seconds + OBSERVED_AFTER_S

    def _answered(
        self, vehicle: Vehicle, motor: int, outcome: Outcome, why: str, outputs: _OutputRange, on_done: Done | None
    ) -> None:
        if outcome is Outcome.REFUSED:
            self._tests.pop(vehicle.id, None)
            hint = motor_test_hint(vehicle) if ":" not in why else ""
            why = f"{why}: {hint}" if hint else why
        # The order left once, and may have been heard.
        elif outcome is Outcome.EXPIRED and not why:
            driven = outputs.driven()
            why = f"no answer, but it drove output {driven}" if driven else "no answer: not known whether it turned"
        elif outcome is Outcome.CONFIRMED:
            driven = outputs.driven()
            why = f"it drove output {driven}" if driven else UNSEEN
            # An autopilot accepts a test of a motor that it does not have (measured).
            if outputs.least and not driven:
                outcome, why = Outcome.NOT_CONFIRMED, "accepted, but no output of it was seen to move"
        result = MotorResult(outcome is Outcome.CONFIRMED, why or outcome.value)
        self._results.setdefault(vehicle.id, {})[motor] = result
        if on_done is not None:
            on_done(outcome, why)
