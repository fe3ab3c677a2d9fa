"""The simulated battery of a PX4 vehicle."""

from sitl.common.platform import Part, Platform

_THRESHOLDS = (("emergency", "BAT_EMERGEN_THR"), ("critical", "BAT_CRIT_THR"), ("low", "BAT_LOW_THR"))


class Px4Battery(Part):
    """A battery that is drained by the time with the motors on, and full again after a disarming."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self.warning = ""
        """"low", "critical", "emergency", or nothing: as it was reported last."""
        self._armed_us = 0
        self._max_charge = 1.0
        self._drains = True

    def drain(self) -> None:
        """Use charge during the tick that ends now."""
        self._armed_us += self._clock.elapsed_us * self._drains

    def recharge(self) -> None:
        """Begin a new flight with a full battery."""
        self._armed_us = 0

    def discharge(self, left: float) -> None:
        """Leave no more than this share, whatever SIM_BAT_MIN_PCT is."""
        self._max_charge = min(self._max_charge, left)

    def stop_draining(self) -> None:
        """Keep the charge from now on: only `discharge` takes of it."""
        self._drains = False

    @property
    def charge(self) -> float:
        """Share that is left: it falls by half in SIM_BAT_DRAIN seconds, down to SIM_BAT_MIN_PCT."""
        # PX4's battery simulator falls by half in SIM_BAT_DRAIN, and is full again after a disarming.
        drained = 0.5 * self._armed_us / 1e6 / max(self._params["SIM_BAT_DRAIN"], 1.0)
        return min(max(1.0 - drained, min(self._params["SIM_BAT_MIN_PCT"] / 100.0, 1.0)), self._max_charge)

    def present_warning(self) -> str:
        """Return the warning that the charge calls for now."""
        charge = self.charge
        for warning, name in _THRESHOLDS:
            if charge <= self._params[name]:
                return warning
        return ""
