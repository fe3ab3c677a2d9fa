"""The battery of a simulated ArduCopter: charge used, voltage, and the level that its failsafe has latched."""

import math

from sitl.common.outbox import VehicleClock
from sitl.common.parameters import ParameterTable

PACK_SAG = 0.2
"""An empty lithium pack has lost this share of its voltage."""
# A level that was reached stays, whatever the voltage is later (measured: latched until 42651 or a reboot).
GOOD, LOW, CRITICAL = 0, 1, 2
_THRESHOLDS = ((CRITICAL, "BATT_CRT_VOLT", "BATT_CRT_MAH"), (LOW, "BATT_LOW_VOLT", "BATT_LOW_MAH"))
LEVEL_NAMES = {LOW: "low", CRITICAL: "critical"}
_Limits = tuple[tuple[int, float, float], ...]
"""Level, and the voltage and charge below which it is reached."""


class CopterBattery:
    """One battery. The charge outlives a reboot; the latched level does not."""

    def __init__(self, params: ParameterTable, clock: VehicleClock) -> None:
        self._params, self._clock = params, clock
        self.consumed_mah = 0.0
        self._drains = True
        self.level = GOOD
        """GOOD, LOW or CRITICAL, latched until the battery is reset or the vehicle reboots."""
        self._low_us: int | None = None
        self._limits: _Limits = ()
        self._limits_of = -1
        """The count of changed parameters at which `_limits` were read."""

    def power_on(self) -> None:
        """Forget the latched level, as a reboot does."""
        self.level, self._low_us = GOOD, None

    def drain(self, current_a: float) -> None:
        """Use charge during the tick that ends now."""
        if self._drains:
            self.consumed_mah += current_a * self._clock.elapsed_us / 3.6e6

    def discharge(self, left: float) -> None:
        """Leave at most this share of the capacity; charge that was used before counts, too."""
        self.consumed_mah = max(self.consumed_mah, self._params["BATT_CAPACITY"] * (1.0 - left))

    def stop_draining(self) -> None:
        """Keep the charge from now on: only `discharge` takes of it."""
        self._drains = False

    def reset(self, left: float) -> None:
        """Replace the battery by one that holds this share of the capacity."""
        self.consumed_mah = self._params["BATT_CAPACITY"] * (1.0 - left)
        self.power_on()

    @property
    def voltage_v(self) -> float:
        """Voltage of the pack: constant unless SIM_BATT_CAP_AH is set; then it falls as a lithium pack's does."""
        full_v, capacity_mah = self._params["SIM_BATT_VOLTAGE"], self._params["SIM_BATT_CAP_AH"] * 1000.0
        if capacity_mah <= 0.0:
            return full_v
        return full_v * (1.0 - PACK_SAG * min(self.consumed_mah / capacity_mah, 1.0))

    @property
    def left_mah(self) -> float:
        """Charge that is left of BATT_CAPACITY."""
        return self._params["BATT_CAPACITY"] - self.consumed_mah

    @property
    def percent(self) -> int:
        """Charge that is left, in percent of BATT_CAPACITY."""
        return max(0, math.ceil(100.0 * (1.0 - self.consumed_mah / max(self._params["BATT_CAPACITY"], 1.0))))

    def refusals(self) -> list[str]:
        """Return why this battery refuses arming: its voltage or charge is below a limit now, however briefly."""
        volts, left, params = self.voltage_v, self.left_mah, self._params
        failing = {"below minimum arming voltage": volts < params["BATT_ARM_VOLT"]}
        for level, volt, mah in reversed(_THRESHOLDS):
            failing[f"{LEVEL_NAMES[level]} voltage failsafe"] = volts < params[volt]
            failing[f"{LEVEL_NAMES[level]} capacity failsafe"] = left < params[mah]
        # ArduPilot reports the first only.
        return [f"Battery 1 {text}" for text, fails in failing.items() if fails][:1]

    def fallen_to(self) -> int | None:
        """Latch and return a level that is worse than before; None otherwise.

        A low voltage has to last for BATT_LOW_TIMER, a low charge counts at once. To be asked only while the vehicle is
        armed: on the ground ArduCopter refuses arming instead, and latches nothing.
        """
        level, now_us = self._present_level(), self._clock.now_us
        # Latched: a voltage that recovers does not end the failsafe (docs/autopilots.md "Failsafes of ArduCopter").
        if level <= self.level:
            self._low_us = None if level == GOOD else self._low_us
            return None
        if self._low_us is None:
            self._low_us = now_us
        by_charge = self.left_mah < self._params["BATT_LOW_MAH" if level == LOW else "BATT_CRT_MAH"]
        if not by_charge and now_us - self._low_us < self._params["BATT_LOW_TIMER"] * 1e6:
            return None
        self.level, self._low_us = level, None
        return level

    def _present_level(self) -> int:
        volts, left = self.voltage_v, self.left_mah
        # Read again only after a change: each vehicle asks at every tick.
        if self._limits_of != self._params.changes:
            self._limits_of = self._params.changes
            self._limits = tuple((level, self._params[volt], self._params[mah]) for level, volt, mah in _THRESHOLDS)
        for level, min_volt, min_mah in self._limits:
            if volts < min_volt or left < min_mah:
                return level
        return GOOD
