"""The motor test: one output turns for a while although the vehicle is disarmed."""

from sitl.common.outbox import VehicleClock


class MotorTest:
    """Which output a test drives, and until when."""

    def __init__(self, clock: VehicleClock) -> None:
        self._clock = clock
        self._output = 0
        """From 1. 0 stands for a motor that does not exist: nothing turns then, as measured."""
        self._pulse_us = 0
        self._until_us = 0

    def start(self, output: int, throttle: float, duration_us: int) -> None:
        """Drive an output with 0 to 1 of the throttle."""
        self._output, self._pulse_us = output, round(1000 + 1000 * throttle)
        self._until_us = self._clock.now_us + duration_us

    @property
    def running(self) -> bool:
        """Whether a test is under way."""
        return self._clock.now_us < self._until_us

    def outputs_us(self) -> dict[int, int]:
        """Return the pulse width that a test drives now, by output; empty without a test."""
        return {self._output: self._pulse_us} if self._output and self.running else {}
